/**
 * The thread of planar scans, with whichever file of the engine its worker has. It works in slices of a few milliseconds and reads its messages between them, so a stop is
 * obeyed and a question answered while a long input is computed.
 */
import { gridFiles } from '../../../package/report/grid_files.js';
import type * as full from './package.js';
import type {
  Answers,
  EngineFacts,
  Grid,
  Growth,
  InputFile,
  Inputs,
  ReadOutcome,
  PlanarApi,
  PlanarEvent,
  Preset,
  Progress,
  RunState,
  ScanToMap,
  SettingDescription,
  Settings,
  Timing,
} from './protocol.js';
import { otherMessages } from './other-messages.js';
import { addScans, attempt } from './reading.js';
import { emit, nothingLoaded, reportCrash, serve, type Served } from './serve.js';

/** The full engine, or the part of it that reads scans alone and no logs. */
export type PlanarEngine = Pick<typeof full, 'describe_settings' | 'presets' | 'version'> & {
  init: (given: { module_or_path: WebAssembly.Module }) => Promise<unknown>;
  Reconstruction: new () => Reconstruction;
};
/** What only the full engine knows of. */
type Tables = Pick<Served<PlanarApi>, 'describeTable'>;
type FullOnly = Pick<
  full.Reconstruction,
  | 'add_log'
  | 'clear_odometry'
  | 'graph_g2o'
  | 'graph_loops'
  | 'preview_edit'
  | 'scans_at'
  | 'set_edits'
  | 'set_odometry'
  | 'changes'
  | 'plan'
  | 'preview_plan'
  | 'unused_edits'
>;
/** That of the full engine tells more of a grid that was read from a file. */
type PlanarGrid = Omit<full.OccupancyGrid, 'remark' | 'yaw' | 'edit'>;
type Reconstruction = Omit<
  full.Reconstruction,
  keyof FullOnly | 'draw' | 'localization' | 'map_file' | 'occupancy_grid'
> &
  Partial<FullOnly> & { occupancy_grid: (...given: Parameters<full.Reconstruction['occupancy_grid']>) => PlanarGrid };

/** The page is answered at least this often, unless one step takes longer. */
const SLICE_MS = 15;
/** Progress is reported at most this often. */
const PROGRESS_INTERVAL_MS = 50;
/** What is done in this time is shown when it is done: each picture costs a slow page as much as ten scans. */
const FIRST_SNAPSHOT_MS = 300;
/** What is new of the map is sent at most this often while it grows... */
const SNAPSHOT_INTERVAL_MS = 120;
/** ...less often the more frames there are, for the page goes through all of them each time... */
const SNAPSHOT_INTERVAL_MS_PER_FRAME = 0.1;
/** ...and sending it takes at most this share of the time. */
const SNAPSHOT_SHARE = 0.15;

let engine: PlanarEngine;
let reconstruction: Reconstruction | null = null;
let timing: Timing = { load: 0, frames: [], joint: 0, total: 0 };
/** The order being worked on. A loop that finds another number here than its own has been overtaken and ends. */
let currentRun = 0;
let isRunning = false;
let isReading = false;
/** Frames that the page knows of this order's result. */
let numTold = 0;

const api: Omit<Served<PlanarApi>, keyof Tables> = {
  async start(module) {
    await engine.init({ module_or_path: module });
    return engineFacts();
  },
  load,
  configure,
  stop,
  resume,
  mend(run, steps) {
    resume(run); // also where the steps are of no use: the map is told as it is
    return reconstruction?.set_edits?.(steps) ?? [];
  },
  previewEdit(steps) {
    const consequence = reconstruction?.preview_edit?.(steps);
    if (!consequence) throw nothingLoaded();
    return consequence;
  },
  previewPlan: (steps) => reconstruction?.preview_plan?.(steps) ?? null,
  ask: <K extends keyof Answers>(kind: K, frame: number) => answer(kind, frame) as Answers[K],
  scansAt: (x, y, side) => reconstruction?.scans_at?.(x, y, side) ?? [],
};

function engineFacts(): EngineFacts {
  return {
    version: engine.version(),
    descriptions: engine.describe_settings() as SettingDescription[],
    presets: engine.presets() as Preset[],
  };
}

/**
 * Reads the files into a new reconstruction. One with at least one scan replaces the present one; otherwise the
 * present one stays, and so does what the page shows. With `hold` nothing is computed yet.
 */
async function load(
  run: number,
  inputs: Inputs,
  settings: Partial<Settings>,
  hold: boolean,
): Promise<ReadOutcome | null> {
  currentRun = run;
  isRunning = false;
  isReading = true;
  const loaded: ReadOutcome = { accepted: [], refused: [], problems: [], notes: [] };
  const next = new engine.Reconstruction();
  attempt(loaded.problems, '', () => next.set_settings(settings));
  const loadMs = await readScans(run, next, inputs.scans, loaded);
  if (loadMs === null) {
    next.free();
    return null;
  }
  readBeside(run, next, inputs, loaded);
  isReading = false;
  if (loaded.accepted.length === 0) {
    next.free();
  } else {
    reconstruction?.free();
    reconstruction = next;
    numTold = 0;
    timing = { load: loadMs, frames: [], joint: 0, total: loadMs };
    if (!hold) computeLater(run);
  }
  return loaded;
}

/** The time that it took (ms); null where another order has overtaken this one. After a stop none is accepted. */
async function readScans(
  run: number,
  next: Reconstruction,
  scans: readonly InputFile[],
  loaded: ReadOutcome,
): Promise<number | null> {
  const { accepted, problems, notes } = loaded;
  const total = scans.length;
  let loadMs = 0;
  let sliceStart = performance.now();
  for (const [index, file] of scans.entries()) {
    const { name } = file;
    post({ type: 'reading', run, file: name, done: index, total });
    const start = performance.now();
    if (attempt(problems, name, () => addScans(next, file, { problems, notes }))) accepted.push(name);
    loadMs += performance.now() - start;
    if (performance.now() - sliceStart <= SLICE_MS) continue;
    await otherMessages();
    if (currentRun !== run) return null;
    if (!isReading) {
      const howFar = total > 1 ? ` after ${index + 1} of ${total} files` : '';
      notes.push({ file: '', text: `Reading was stopped${howFar}: none of it is used` });
      [loaded.isStopped, accepted.length] = [true, 0];
      break;
    }
    sliceStart = performance.now();
  }
  return loadMs;
}

/** The reference and the odometry, unless reading was stopped. */
function readBeside(
  run: number,
  next: Reconstruction,
  { scans, reference, odometry }: Inputs,
  loaded: ReadOutcome,
): void {
  const give = (file: InputFile | null, take: (name: string, bytes: Uint8Array) => void): void => {
    if (!file || !isReading) return;
    post({ type: 'reading', run, file: file.name, done: scans.length, total: scans.length });
    const isTaken = attempt(loaded.problems, file.name, () => take(file.name, new Uint8Array(file.bytes)));
    if (!isTaken) loaded.refused.push(file.name);
  };
  give(reference, (name, bytes) => next.set_reference(name, bytes));
  give(odometry, (name, bytes) => next.set_odometry?.(name, bytes));
}

function configure(run: number, settings: Partial<Settings>): void {
  if (!reconstruction) return;
  currentRun = run;
  isRunning = false;
  reconstruction.set_settings(settings);
  numTold = 0;
  timing = { load: timing.load, frames: [], joint: 0, total: timing.load };
  computeLater(run);
}

function resume(run: number): void {
  currentRun = run;
  numTold = 0;
  computeLater(run);
}

/** Computes once the order has been answered. */
function computeLater(run: number): void {
  isRunning = true; // a stop may arrive before the first slice
  otherMessages()
    .then(() => compute(run))
    .catch(reportCrash);
}

/** Steps until all is done, or stopped, or overtaken; sends what is new now and then and all of it at the end. */
async function compute(run: number): Promise<void> {
  if (!reconstruction || currentRun !== run || !isRunning) return;
  let nextProgress = performance.now();
  let nextSnapshot = performance.now() + FIRST_SNAPSHOT_MS;
  while (isRunning && currentRun === run) {
    const progress = computeSlice(reconstruction);
    if (performance.now() >= nextProgress) {
      post({ type: 'progress', run, progress });
      nextProgress = performance.now() + PROGRESS_INTERVAL_MS;
    }
    if (progress.stage === 'done') {
      isRunning = false;
      sendGrowth(run, 'done', true);
      return;
    }
    const before = performance.now();
    // The search for loops leaves the map as it is; then all poses move together.
    const isMoving = progress.stage === 'joint';
    if (before >= nextSnapshot && (isMoving || numTold < timing.frames.length)) {
      sendGrowth(run, 'running', isMoving);
      const cost = performance.now() - before;
      const least = Math.max(SNAPSHOT_INTERVAL_MS, SNAPSHOT_INTERVAL_MS_PER_FRAME * numTold);
      nextSnapshot = performance.now() + Math.max(least, cost / SNAPSHOT_SHARE);
    }
    await otherMessages();
  }
}

function computeSlice(present: Reconstruction): Progress {
  const sliceStart = performance.now();
  for (;;) {
    const start = performance.now();
    const progress = present.step();
    const now = performance.now();
    const ms = now - start;
    timing.total += ms;
    if (progress.frame === null || progress.frame === undefined) timing.joint += ms;
    else timing.frames[progress.frame] = (timing.frames[progress.frame] ?? 0) + ms;
    if (progress.stage === 'done' || now - sliceStart > SLICE_MS) return progress;
  }
}

function stop(): void {
  isReading = false;
  if (!isRunning) return;
  isRunning = false;
  sendGrowth(currentRun, 'stopped', true);
}

/** `isMoved`: frames that the page knows are no longer where they were. */
function sendGrowth(run: number, state: RunState, isMoved: boolean): void {
  if (!reconstruction) return;
  const isWhole = numTold === 0 || state !== 'running';
  const first = isWhole ? 0 : numTold;
  const firstMapped = isMoved ? 0 : first;
  const { frames, result } = isWhole
    ? wholeResult(reconstruction)
    : { frames: reconstruction.frames_from(first), result: null };
  numTold = first + frames.length;
  const growth: Growth = {
    result,
    first,
    frames,
    poses: isMoved && !isWhole ? reconstruction.poses() : null,
    firstMapped,
    map_points: reconstruction.map_points(firstMapped),
    mapCounts: reconstruction.map_sizes(firstMapped),
    timing: { ...timing, frames: timing.frames.slice(first) },
  };
  const buffers = [growth.map_points.buffer, growth.mapCounts.buffer] as Transferable[];
  post({ type: 'growth', run, state, growth }, buffers);
}

function wholeResult(present: Reconstruction): Pick<Growth, 'frames' | 'result'> {
  const { frames, ...result } = present.summary();
  return { frames, result };
}

function answer(kind: keyof Answers, frame: number): Answers[keyof Answers] {
  if (!reconstruction) throw nothingLoaded();
  if (kind === 'correspondences' || kind === 'history') return reconstruction[kind](frame);
  if (kind === 'scan_to_map') return scanToMap(reconstruction, frame);
  if (kind === 'occupancy_grid') return occupancyGrid(reconstruction);
  if (kind === 'plan') return reconstruction.plan?.() ?? null;
  if (kind === 'gridFiles') return gridFiles(reconstruction);
  const told = reconstruction[kind]?.();
  if (told === undefined) throw nothingLoaded();
  return told;
}

function scanToMap(present: Reconstruction, frame: number): ScanToMap | null {
  const pair = present.scan_to_map(frame);
  if (!pair) return null;
  const plain: ScanToMap = {
    source: pair.source(),
    target: pair.target(),
    target_normals: pair.target_normals() ?? null,
    init_T_target_source: Array.from(pair.init_T_target_source()),
  };
  pair.free();
  return plain;
}

function occupancyGrid(present: Reconstruction): Grid {
  const grid = present.occupancy_grid();
  const { width, height, resolution, origin } = grid;
  const grey_values = grid.grey_values();
  grid.free();
  return { width, height, resolution, origin, grey_values };
}

function post(event: PlanarEvent, transfer: Transferable[] = []): void {
  emit(event, transfer);
}

/** In a worker: reconstructs with this engine. */
export function servePlanar(withEngine: PlanarEngine, tables: Tables = { describeTable: () => null }): void {
  engine = withEngine;
  serve<PlanarApi>({ ...api, ...tables });
}
