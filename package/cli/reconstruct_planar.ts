/** Planar scans to a trajectory, a map and a report. */
import { basename } from 'node:path';
import { zipSync } from 'fflate';
import type { CleaningReport, Reconstruction, ReconstructionResult, RefusedEdit } from '../../pkg/scanstitch.js';
import type { Note } from '../base/errors.js';
import { printable } from '../base/printable.js';
import type { Content } from '../files/content.js';
import type { Mended } from '../files/recording.js';
import type { OpenedRecording } from '../recording_reader.js';
import { gridFiles } from '../report/grid_files.js';
import { changeWords } from '../report/change_words.js';
import { mapMcap } from '../report/map_mcap.js';
import { planFiles } from '../report/plan_files.js';
import { workbenchFiles } from '../report/workbench.js';
import { nextTurn } from '../run/spatial_run.js';
import { CommandError, isScanstitchError, table, untilInterrupt } from './command.js';
import { writeResults } from './disk.js';
import { readInput, readSource } from './inputs.js';
import { accepted, errorFigures, mapFile, millimetres, type Options, reportFile, type Task } from './results.js';
import { planarCatalogue, readSettings } from './settings.js';
import { trajectoryBytes } from '../recording/pose_file.js';
import { note, print, progressLine, tellDoubtful, tellNotes } from './terminal.js';

/** Archives of the same files have the same bytes. */
const FIRST_DAY = '1980-01-02';
/** Of more scans than this, only those that are not good have a line. */
const MOST_ROWS = 200;

export async function reconstructPlanar(task: Task) {
  const { engine, recording, options, complain } = task;
  const assigned = readSettings(planarCatalogue(engine), options.preset, options.set);
  const steps = options.steps ?? (recording.mended && { ...recording.mended, name: recording.root || 'The workbench' });
  const settings = { ...steps?.settings, ...assigned };
  const table = options.table ?? recording.mended?.table;
  const reconstruction = new engine.Reconstruction(settings);
  const odometry = await addInputs(task, reconstruction, table);

  const { milliseconds, total, isStopped } = await untilInterrupt(async (signal) => {
    const run = await runToTheEnd(reconstruction, signal);
    if (!steps || run.isStopped) return run;
    mend(reconstruction, steps, complain);
    const again = await runToTheEnd(reconstruction, signal);
    tellUntaken(reconstruction.unused_edits(), steps.name, complain);
    return { ...run, total: run.total + again.total, isStopped: again.isStopped };
  });
  const result = reconstruction.result();
  if (isStopped) tellStop(result, complain);
  for (const { name, status, reason } of result.frames) {
    if (status === 'lost') complain(`${name}: This scan could not be placed: ${reason}.`);
  }
  if (result.frames.every(({ status }) => status === 'lost')) {
    throw new CommandError('No scan could be placed, so nothing was written.');
  }
  const map = mapFile(reconstruction, options);
  const changes = reconstruction.changes();
  await writeResults(options.out, {
    'trajectory.tum': reconstruction.trajectory_tum(),
    [map.name]: map.bytes,
    ...gridFiles(reconstruction),
    'report.json': reconstruction.report_json(),
    ...planFiles(reconstruction.plan(), steps?.pictures),
    ...(changes.length > 0 && { 'changes.json': `${JSON.stringify(changes, null, 2)}\n` }),
    ...reportFile(result, reconstruction.map_points(), task),
    ...(await alsoWanted(task, reconstruction, {
      ...{ num_scans: result.frames.length, settings, steps: steps?.steps ?? [] },
      ...(steps?.pictures && { pictures: steps.pictures }),
      ...(table !== undefined && { table }),
    })),
  });
  for (const { name, cleaning } of result.frames.filter(({ cleaning }) => cleaning.non_finite > 0)) {
    const some = `${cleaning.non_finite} of its ${cleaning.num_read} points`;
    note(`${name}: ${some} have coordinates that are not finite and were dropped.`);
  }
  if (result.frames.length <= MOST_ROWS) tellDoubtful(result.frames, complain);
  if (odometry !== null && result.odometry_refusal === null && result.settings.odometry !== 'none') {
    note(`${odometry} gives the first guess of every scan.`);
  }
  result.notes.forEach((text) => (text === result.odometry_refusal ? complain(text) : note(text)));
  changes.forEach((of) => note(`${changeWords(of)}${of.changes.length > 0 ? ' See changes.json.' : ''}`));
  print(`${frameTable(result, milliseconds)}\n${headline(result, total)}Written to ${printable(options.out)}\n`);
}

/** The scans, under short names where those are distinct. */
function scansOf({ files, scans }: OpenedRecording) {
  const found = scans.flatMap((path) => files.get(path) ?? []);
  const names = found.map(({ path }) => basename(path));
  const distinct = new Set(names).size === names.length;
  return found.map((source) => ({ source, name: distinct ? basename(source.path) : (source.disk ?? source.path) }));
}

/** `table`: what the columns of tables are. Throws a CommandError where no file can be used. */
export async function addScans(
  reconstruction: Reconstruction,
  recording: OpenedRecording,
  table: string | undefined,
  complain: (problem: string) => void,
): Promise<void> {
  let added = 0;
  const found: Note[] = [];
  for (const { source, name } of scansOf(recording)) {
    const bytes = await readSource(source, name, complain);
    if (!bytes) continue;
    const add = recording.logs.includes(source.path)
      ? () => {
          const { losses, notes } = reconstruction.add_log(name, bytes, table);
          losses.forEach((text) => complain(`${name}: ${text}`));
          found.push(...notes.map((text) => ({ file: name, reason: text.replace(/\.$/, '') })));
        }
      : () => reconstruction.add_scan(name, bytes);
    if (accepted(add, complain)) added += 1;
    tellNotes(source.losses ?? [], complain);
  }
  tellNotes(found, complain);
  if (added === 0) throw new CommandError('No scan could be used, so nothing was computed.');
}

/** The scans, and what lies beside them; the name of the odometry, where there is one that is taken. */
export async function addInputs(
  { recording, options, complain }: Task,
  reconstruction: Reconstruction,
  table?: string,
) {
  await addScans(reconstruction, recording, table, complain);
  const { odometry, reference } = options;
  const setOdometry = reconstruction.set_odometry.bind(reconstruction);
  const setReference = reconstruction.set_reference.bind(reconstruction);
  const taken = await addPoses(recording, recording.odometry, odometry, setOdometry, complain);
  await addPoses(recording, recording.reference[0], reference, setReference, complain);
  return taken;
}

/** Poses that were named, or that were found beside the scans; their name, where `take` takes them. */
export async function addPoses(
  { files }: OpenedRecording,
  found: string | null | undefined,
  named: string | undefined,
  take: (name: string, bytes: Uint8Array) => void,
  complain: (problem: string) => void,
) {
  const bytes = await readGiven(files.get(found ?? ''), named, complain);
  const name = basename(named ?? found ?? '');
  return bytes && accepted(() => take(name, trajectoryBytes(name, bytes)), complain) ? name : null;
}

/** A file that was named, or otherwise the one that was found. */
async function readGiven(source: Content | undefined, named: string | undefined, complain: (problem: string) => void) {
  if (named !== undefined) return readInput({ name: basename(named), path: named }, complain);
  return source ? readSource(source, basename(source.path), complain) : null;
}

/** The files that are written where they are asked for. */
async function alsoWanted(task: Task, reconstruction: Reconstruction, mended: Mended) {
  const { g2o, mcap, workbench } = task.options;
  return {
    ...(g2o && { 'graph.g2o': reconstruction.graph_g2o() ?? '' }),
    ...(mcap && { 'map.mcap': mcapOf(reconstruction) }),
    ...(workbench && { 'workbench.zip': await workbenchOf(task, mended) }),
  };
}

/** What was opened, with how it was made into a map. */
async function workbenchOf({ recording, options, complain }: Task, mended: Mended) {
  const { files, scans, logs, reference, odometry, read } = recording;
  const file = async (path: string, bytes: Promise<Uint8Array | null>) => ({
    path,
    bytes: (await bytes) ?? new Uint8Array(),
  });
  const beside = async (named: string | undefined, found: string | null | undefined) => {
    const path = named === undefined ? found : basename(named);
    return path ? file(path, readGiven(files.get(path), named, complain)) : null;
  };
  const made = workbenchFiles({
    ...mended,
    scans: await Promise.all(
      scans.map(async (path) => ({ ...(await file(path, read(path))), isLog: logs.includes(path) })),
    ),
    reference: await beside(options.reference, reference[0]),
    odometry: await beside(options.odometry, odometry),
  });
  return zipSync(made, { mtime: FIRST_DAY });
}

function mcapOf(reconstruction: Reconstruction) {
  const grid = reconstruction.occupancy_grid();
  const { width, height, resolution, origin } = grid;
  const cells = { width, height, resolution, origin, grey_values: grid.grey_values() };
  grid.free();
  const [points, sizes] = [reconstruction.map_points(), reconstruction.map_sizes(0)];
  return mapMcap({ trajectory: reconstruction.trajectory_tum(), points, sizes, grid: cells });
}

/** Takes the steps; the run is to be brought to its end again then. */
function mend(
  reconstruction: Reconstruction,
  { name, num_scans, steps }: NonNullable<Options['steps']>,
  complain: (problem: string) => void,
) {
  const { length } = reconstruction.summary().frames;
  if (length !== num_scans) {
    throw new CommandError(`${name}: The steps are for a recording of ${num_scans} scans, and this one has ${length}.`);
  }
  try {
    tellUntaken(reconstruction.set_edits(steps), name, complain);
  } catch (error) {
    if (isScanstitchError(error)) throw new CommandError(`${name}: ${error.message}`);
    throw error;
  }
}

export function tellUntaken(steps: readonly RefusedEdit[], name: string, complain: (problem: string) => void) {
  for (const { index, reason } of steps) complain(`${name}: Step ${index + 1} was not taken: ${reason}.`);
}

function tellStop({ frames }: ReconstructionResult, complain: (problem: string) => void) {
  if (frames.length === 0) throw new CommandError('Stopped before the first scan was placed, so nothing was computed.');
  complain(`Stopped after ${frames.length} scans; these are written, as far as they had been placed.`);
}

/**
 * Runs it until it is done or the signal aborts, with the time that each frame's registration took, and all together
 * (ms).
 */
export async function runToTheEnd(reconstruction: Reconstruction, signal: AbortSignal) {
  const milliseconds: Map<number, number> = new Map();
  const started = performance.now();
  let [progress, isDone] = [null as ReturnType<typeof progressLine> | null, false];
  for (; !isDone && !signal.aborted; await nextTurn()) {
    const start = performance.now();
    const { stage, frame, total } = reconstruction.step();
    if (frame !== null) milliseconds.set(frame, (milliseconds.get(frame) ?? 0) + performance.now() - start);
    progress ??= progressLine(total, 'scans');
    progress.show(milliseconds.size);
    isDone = stage === 'done';
  }
  progress?.clear();
  return { milliseconds, total: performance.now() - started, isStopped: !isDone };
}

function frameTable({ frames }: ReconstructionResult, milliseconds: Map<number, number>) {
  const heads = ['scan', 'x (m)', 'y (m)', 'heading (deg)', 'inliers', 'rmse (mm)', 'iterations', 'ms', 'status'];
  const numbered = frames.map((frame, index) => ({ frame, index }));
  const shown = frames.length > MOST_ROWS ? numbered.filter(({ frame }) => frame.status !== 'good') : numbered;
  if (shown.length === 0) return '';
  const rows = shown.map(({ frame, index }) => [
    frame.name,
    frame.T_world_sensor.x.toFixed(3),
    frame.T_world_sensor.y.toFixed(3),
    ((frame.T_world_sensor.theta * 180) / Math.PI).toFixed(2),
    String(frame.num_inliers),
    millimetres(frame.inlier_rmse),
    String(frame.iterations),
    (milliseconds.get(index) ?? 0).toFixed(1),
    frame.status,
  ]);
  return table(heads, rows, new Set([0, 8]));
}

/** @param total (ms) */
function headline({ frames, sharpness, comparison, unconnected }: ReconstructionResult, total: number) {
  const lines = [`${frames.length} ${frames.length === 1 ? 'scan' : 'scans'} in ${total.toFixed(0)} ms`];
  const count = (wanted: string) => frames.filter(({ status }) => status === wanted).length;
  if (frames.length > MOST_ROWS) {
    lines.push(`${count('good')} good, ${count('doubtful')} doubtful, ${count('lost')} lost`);
  }
  if (unconnected !== null) {
    const pieces = new Set(frames.flatMap(({ status, piece }) => (status === 'lost' ? [] : [piece])));
    lines.push(`Map in ${pieces.size} pieces that are not connected`);
  }
  lines.push(cleaningLine(frames));
  if (sharpness) {
    lines.push(`Sharpness ${millimetres(sharpness.mean_residual)} mm, mean over ${sharpness.num_pairs} pairs`);
  }
  if (comparison) {
    const { name, num_matched, aligned } = comparison;
    const inMillimetres = (metres: number) => `${millimetres(metres)} mm`;
    const matched = `over ${num_matched} of ${frames.length} scans`;
    lines.push(`Distance to ${printable(name)}: ${errorFigures(comparison, inMillimetres)} ${matched}`);
    if (aligned) lines.push(`  with all poses aligned: ${errorFigures(aligned, inMillimetres)}`);
  }
  return lines.map((line) => `${line}\n`).join('');
}

/** What cleaning dropped from all scans. */
function cleaningLine(frames: ReconstructionResult['frames']) {
  const sum = (field: keyof CleaningReport) => frames.reduce((total, { cleaning }) => total + cleaning[field], 0);
  const reasons = (
    [
      ['not finite', 'non_finite'],
      ['too near', 'too_near'],
      ['at the range limit', 'at_range_limit'],
      ['duplicate', 'duplicates'],
    ] as const
  ).flatMap(([words, field]) => (sum(field) > 0 ? [`${sum(field)} ${words}`] : []));
  const dropped = reasons.length > 0 ? `; dropped: ${reasons.join(', ')}` : '';
  return `${sum('num_kept')} of ${sum('num_read')} points used${dropped}`;
}
