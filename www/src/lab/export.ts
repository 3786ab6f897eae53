/** What leaves the lab: pictures, a film of the run, and the trace as data. */
import { pngFile, svgFile } from '../drawing/figure-files.js';
import type { Painter, ScanstitchFigure } from '../drawing/figure-view.js';
import type { MenuItem } from '../components/menu.js';
import { animatedPng } from '../export/apng.js';
import type { Download } from '../export/download.js';
import type { Size } from '../views/figures.js';
import type { Viewport } from '../views/viewport.js';
import { paintGround, paintStep, type PlaneScene, stageTheme } from './plane-painter.js';
import { pngOf } from '../views/canvas.js';
import { penOn } from '../views/pen.js';
import { between } from './poses.js';
import type { LabIteration, Pose } from './protocol.js';
import { type LabRun, pairName } from './runs.js';
import { type LabSession } from './session.js';
import { numPoses, poseAt } from './trace.js';

const EXPORTS: readonly MenuItem[] = [
  { id: 'link', label: 'Copy link', detail: 'clouds of samples by name, methods, start and iteration' },
  { id: 'png', label: 'Picture, PNG', detail: 'the clouds and pairs as you see them' },
  { id: 'svg', label: 'Picture, SVG', detail: 'the same as lines and dots' },
  { id: 'film', label: 'Film, animated PNG', detail: 'the whole run, for slides' },
  { id: 'figure_png', label: 'Figure, PNG', detail: 'the figure of this panel' },
  { id: 'figure_svg', label: 'Figure, SVG', detail: 'the same as lines' },
  { id: 'trace', label: 'Trace, JSON', detail: 'poses, costs, and every iteration with its pairs and equations' },
];

/** Those that there are: clouds in space have no lines and dots, and some panels have no figure. */
export const exportItems = (is_planar: boolean, hasFigure: boolean): readonly MenuItem[] =>
  EXPORTS.filter(({ id }) => (is_planar || id !== 'svg') && (hasFigure || !id.startsWith('figure')));

/** A picture of the source at a pose, as a PNG. */
export type Shoot = (pose: Pose, iteration: LabIteration | null) => Promise<Blob>;

/** Makes one of the files. `stage`: the clouds as they are seen, in the plane or in space; `figure`: what the panel shows. */
export async function exportFile(
  id: string,
  session: LabSession,
  run: LabRun,
  stage: { scene: PlaneScene; view: Viewport; size: Size } | Shoot,
  figure: ScanstitchFigure | null,
  dark: boolean,
): Promise<Download> {
  if (id === 'trace') return traceFile(session, run);
  const kind = id.endsWith('svg') ? 'svg' : 'png';
  if (id.startsWith('figure')) {
    if (!figure) throw new Error('this panel has no figure');
    return pictureFile('icp_figure', kind, figure.painter, figure.size, dark);
  }
  if (id === 'film') return film(session, run, typeof stage === 'function' ? stage : planarShots(stage));
  if (typeof stage === 'function') return { name: 'icp.png', blob: await stage(session.pose, session.iteration) };
  return pictureFile('icp', kind, scenePainter(stage.scene, stage.view), stage.size, dark);
}

/** The clouds and pairs as a painter of figures. */
function scenePainter(scene: PlaneScene, view: Viewport): Painter {
  return (pen, size) => {
    paintGround(pen, size, view, scene);
    paintStep(pen, size, view, scene);
  };
}

async function pictureFile(
  name: string,
  kind: 'png' | 'svg',
  painter: Painter,
  size: Size,
  dark: boolean,
): Promise<Download> {
  const { background } = stageTheme(dark);
  const blob = kind === 'svg' ? svgFile(painter, size, background) : await pngFile(painter, size, background);
  return { name: `${name}.${kind}`, blob };
}

/** Pictures between two iterations, and how long each is shown; longer where the source rests. */
const MOVES = 6;
const MOVING_MS = 50;
const RESTING_MS = 350;
const END_MS = 2000;
/** Of the film: as wide as a slide wants it at most. */
const MAX_WIDTH = 960;

function planarShots({ scene, view, size }: { scene: PlaneScene; view: Viewport; size: Size }): Shoot {
  const canvas = document.createElement('canvas');
  const ratio = Math.min(MAX_WIDTH / size.width, 1.5);
  return (pose, iteration) => {
    scenePainter({ ...scene, pose, iteration }, view)(penOn(canvas, size, ratio), size);
    return pngOf(canvas);
  };
}

/** Every iteration: the pairs, then the motion of the source. */
async function film(session: LabSession, run: LabRun, shot: Shoot): Promise<Download> {
  const count = numPoses(run.trace);
  const frames: { png: Uint8Array; milliseconds: number }[] = [];
  const shoot = async (pose: Pose, iteration: LabIteration | null, milliseconds: number): Promise<void> => {
    frames.push({ png: new Uint8Array(await (await shot(pose, iteration)).arrayBuffer()), milliseconds });
  };
  for (let at = 0; at < count; at++) {
    const iteration = await session.iterationAt(run, at);
    const from = poseAt(run.trace, at);
    await shoot(from, iteration, at + 1 === count ? END_MS : RESTING_MS);
    for (let k = 1; k < MOVES && at + 1 < count; k++) {
      await shoot(between(from, poseAt(run.trace, at + 1), k / MOVES), iteration, MOVING_MS);
    }
  }
  return { name: 'icp.png', blob: animatedPng(frames) };
}

/** The whole run as data; the names are the engine's. */
async function traceFile(session: LabSession, run: LabRun): Promise<Download> {
  const { trace } = run;
  const iterations: unknown[] = [];
  for (let at = 0; at < numPoses(trace); at++) {
    const iteration = await session.iterationAt(run, at);
    iterations.push(
      Object.fromEntries(
        Object.entries(iteration ?? {}).map(([name, value]) => [
          name,
          ArrayBuffer.isView(value) ? Array.from(value as Float64Array) : value,
        ]),
      ),
    );
  }
  const given = session.given;
  const content = {
    source: given?.source,
    target: given?.target,
    options: run.options,
    converged: trace?.converged,
    end_reason: trace?.end_reason,
    T_target_source: Array.from({ length: numPoses(trace) }, (_, at) => Array.from(poseAt(run.trace, at))),
    records: trace?.records,
    costs: trace?.costs,
    iterations,
  };
  const name = given ? pairName(given).replaceAll(/[^\w.-]+/g, '_') : 'trace';
  return { name: `icp_${name}.json`, blob: new Blob([JSON.stringify(content)], { type: 'application/json' }) };
}
