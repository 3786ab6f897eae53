/** From the session to what the stage draws. */
import { memoizeLast } from '../views/memoize-last.js';
import { arrowsOf, ellipseOf } from './degeneracy.js';
import type { PlaneScene, StageLook } from './plane-painter.js';
import { acted, centroid } from './poses.js';
import type { LabFacts, LabTrace, Pose } from './protocol.js';
import type { LabRun } from './runs.js';
import type { LabSession } from './session.js';
import { numPoses, poseAt } from './trace.js';

export interface StageOf {
  session: LabSession;
  facts: LabFacts;
  dark: boolean;
  look: StageLook;
  showsDirections: boolean;
}

/** `ghost`: another pose of the source, to be drawn beside it. */
export function stageScene(
  { session, facts, dark, look, showsDirections }: StageOf,
  colorOf: (run: LabRun) => string,
  ghost: { pose: Pose; color: string } | null,
): PlaneScene {
  const { iteration, isDragged } = session;
  const others = isDragged ? [] : session.runs.filter(({ id, trace }) => id !== session.active && trace);
  const held = showsDirections ? iteration : null;
  return {
    facts,
    dark,
    look,
    pose: session.pose,
    iteration,
    ghosts: [
      ...others.map((run) => ({
        pose: poseAt(run.trace, Math.min(session.at, numPoses(run.trace) - 1)),
        color: colorOf(run),
      })),
      ...(ghost ? [ghost] : []),
    ],
    path: isDragged ? [] : pathOf(session.trace, facts),
    arrows: held ? arrowsOf(held, dark) : [],
    ellipse: held ? ellipseOf(held, dark) : null,
  };
}

/** Path of the source's centroid, from the start to the end. */
const pathOf = memoizeLast((trace: LabTrace | null, { source_points }: LabFacts): number[] => {
  const middle = centroid(source_points);
  return Array.from({ length: numPoses(trace) }, (_, i) => {
    const [x, y] = acted(poseAt(trace, i), ...middle);
    return [x, y];
  }).flat();
});
