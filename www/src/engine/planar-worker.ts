/**
 * The thread of planar scans. It works in slices of a few milliseconds and reads its messages between them, so a stop is
 * obeyed and a question answered while a long input is computed.
 */
import { init, describe_settings, is_laser_log, presets, Reconstruction, version } from './package.js';
import type {
  Answers,
  EngineFacts,
  Grid,
  InputFile,
  Inputs,
  Loaded,
  PlanarApi,
  PlanarEvent,
  Preset,
  Problem,
  Progress,
  RunState,
  SettingDescription,
  Settings,
  Snapshot,
  Timing,
} from './protocol.js';
import { emit, isInputError, nothingLoaded, reportCrash, serve, type Served } from './serve.js';

/** The page is answered at least this often, unless one step takes longer. */
const SLICE_MS = 15;
/** A laser log is recognised by its first bytes. */
const LOG_HEAD_BYTES = 8192;
/** Progress is reported at most this often. */
const PROGRESS_INTERVAL_MS = 50;
/** The map is sent at most this often while it grows... */
const SNAPSHOT_INTERVAL_MS = 120;
/** ...and sending it takes at most this share of the time. */
const SNAPSHOT_SHARE = 0.15;

let reconstruction: Reconstruction | null = null;
let timing: Timing = { load: 0, frames: [], joint: 0, total: 0 };
/** The order being worked on. A loop that finds another number here than its own has been overtaken and ends. */
let current_run = 0;
let is_running = false;
let is_reading = false;

const api: Served<PlanarApi> = {
  async start(module) {
    await init({ module_or_path: module });
    return engineFacts();
  },
  load,
  configure,
  stop,
  resume(run) {
    current_run = run;
    computeLater(run);
  },
  ask: <K extends keyof Answers>(kind: K, frame: number) => answer(kind, frame) as Answers[K],
};

function engineFacts(): EngineFacts {
  return {
    version: version(),
    descriptions: describe_settings() as SettingDescription[],
    presets: presets() as Preset[],
  };
}

/**
 * Reads the files into a new reconstruction. One with at least one scan replaces the present one; otherwise the
 * present one stays, and so does what the page shows. With `hold` nothing is computed yet.
 */
async function load(run: number, inputs: Inputs, settings: Partial<Settings>, hold: boolean): Promise<Loaded | null> {
  current_run = run;
  is_running = false;
  is_reading = true;
  const problems: Problem[] = [];
  const next = new Reconstruction();
  attempt(problems, '', () => next.set_settings(settings));
  const accepted: string[] = [];
  let load_ms = 0;
  let slice_start = performance.now();
  for (const [index, { name, bytes }] of inputs.scans.entries()) {
    post({ type: 'reading', run, file: name, done: index, total: inputs.scans.length });
    const start = performance.now();
    if (attempt(problems, name, () => addScans(next, { name, bytes }, problems))) accepted.push(name);
    load_ms += performance.now() - start;
    if (performance.now() - slice_start > SLICE_MS) {
      await otherMessages();
      if (current_run !== run) {
        next.free();
        return null;
      }
      if (!is_reading) {
        const problem = `Reading was stopped after ${index + 1} of ${inputs.scans.length} scans`;
        problems.push({ file: '', place: null, problem, remedy: '' });
        accepted.length = 0;
        break;
      }
      slice_start = performance.now();
    }
  }
  const refused: string[] = [];
  const give = (file: InputFile | null, take: (name: string, bytes: Uint8Array) => void): void => {
    if (!file || !is_reading) return;
    post({ type: 'reading', run, file: file.name, done: inputs.scans.length, total: inputs.scans.length });
    const is_taken = attempt(problems, file.name, () => take(file.name, new Uint8Array(file.bytes)));
    if (!is_taken) refused.push(file.name);
  };
  give(inputs.reference, (name, bytes) => next.set_reference(name, bytes));
  give(inputs.odometry, (name, bytes) => next.set_odometry(name, bytes));
  is_reading = false;
  if (accepted.length === 0) {
    next.free();
  } else {
    reconstruction?.free();
    reconstruction = next;
    timing = { load: load_ms, frames: [], joint: 0, total: load_ms };
    if (!hold) computeLater(run);
  }
  return { accepted, refused, problems };
}

/** A file is one scan, or a log of many. */
function addScans(engine: Reconstruction, { name, bytes }: InputFile, problems: Problem[]): void {
  const content = new Uint8Array(bytes);
  if (!is_laser_log(content.subarray(0, LOG_HEAD_BYTES))) {
    engine.add_scan(name, content);
    return;
  }
  for (const problem of engine.add_log(name, content).notes) {
    problems.push({ file: name, place: null, problem: problem.replace(/\.$/, ''), remedy: '' });
  }
}

function configure(run: number, settings: Partial<Settings>): void {
  if (!reconstruction) return;
  current_run = run;
  is_running = false;
  reconstruction.set_settings(settings);
  timing = { load: timing.load, frames: timing.frames.map(() => 0), joint: 0, total: timing.load };
  computeLater(run);
}

/** Computes once the order has been answered. */
function computeLater(run: number): void {
  otherMessages()
    .then(() => compute(run))
    .catch(reportCrash);
}

/** Steps until all is done, or stopped, or overtaken; sends the growing map now and then and the whole one at the end. */
async function compute(run: number): Promise<void> {
  if (!reconstruction || current_run !== run) return;
  is_running = true;
  let next_progress = performance.now();
  let next_snapshot = performance.now() + SNAPSHOT_INTERVAL_MS;
  while (is_running && current_run === run) {
    const progress = computeSlice(reconstruction);
    if (performance.now() >= next_progress) {
      post({ type: 'progress', run, progress });
      next_progress = performance.now() + PROGRESS_INTERVAL_MS;
    }
    if (progress.stage === 'done') {
      is_running = false;
      sendSnapshot(run, 'done');
      return;
    }
    const before = performance.now();
    if (before >= next_snapshot) {
      sendSnapshot(run, 'running');
      const cost = performance.now() - before;
      next_snapshot = performance.now() + Math.max(SNAPSHOT_INTERVAL_MS, cost / SNAPSHOT_SHARE);
    }
    await otherMessages();
  }
}

function computeSlice(engine: Reconstruction): Progress {
  const slice_start = performance.now();
  for (;;) {
    const start = performance.now();
    const progress = engine.step();
    const now = performance.now();
    const ms = now - start;
    timing.total += ms;
    if (progress.frame === null || progress.frame === undefined) timing.joint += ms;
    else timing.frames[progress.frame] = (timing.frames[progress.frame] ?? 0) + ms;
    if (progress.stage === 'done' || now - slice_start > SLICE_MS) return progress;
  }
}

function stop(): void {
  is_reading = false;
  if (!is_running) return;
  is_running = false;
  sendSnapshot(current_run, 'stopped');
}

function sendSnapshot(run: number, state: RunState): void {
  if (!reconstruction) return;
  const snapshot: Snapshot = {
    result: reconstruction.result(),
    map_points: reconstruction.map_points(),
    map_frames: reconstruction.map_frames(),
    timing: structuredClone(timing),
  };
  post({ type: 'snapshot', run, state, snapshot }, [snapshot.map_points.buffer, snapshot.map_frames.buffer]);
}

function answer(kind: keyof Answers, frame: number): Answers[keyof Answers] {
  if (!reconstruction) throw nothingLoaded();
  if (kind === 'correspondences') return reconstruction.correspondences(frame);
  if (kind === 'occupancy_grid') return occupancyGrid(reconstruction);
  return reconstruction[kind]();
}

function occupancyGrid(engine: Reconstruction): Grid {
  const grid = engine.occupancy_grid();
  const { width, height, resolution, origin } = grid;
  const grey_values = grid.grey_values();
  const plain: Grid = { width, height, resolution, origin, grey_values, pgm: grid.pgm(), yaml: grid.yaml('map.pgm') };
  grid.free();
  return plain;
}

/** Runs `action`; what is wrong with the input becomes a problem of `file`, what is wrong with the engine goes on up. */
function attempt(problems: Problem[], file: string, action: () => void): boolean {
  try {
    action();
    return true;
  } catch (error) {
    if (!isInputError(error)) throw error;
    problems.push(toProblem(error, file));
    return false;
  }
}

function toProblem(error: unknown, file: string): Problem {
  const { file: named, place, problem, remedy, message } = error as Problem & Error;
  return { file: named || file, place: place ?? null, problem: problem || message, remedy: remedy ?? '' };
}

function post(event: PlanarEvent, transfer: Transferable[] = []): void {
  emit(event, transfer);
}

const channel = new MessageChannel();
const waiting: (() => void)[] = [];
channel.port1.onmessage = () => waiting.shift()?.();

/** Lets the messages that wait be handled first: a task of our own behind them, without the delay of a timer. */
function otherMessages(): Promise<void> {
  return new Promise((resolve) => {
    waiting.push(resolve);
    channel.port2.postMessage(null);
  });
}

serve<PlanarApi>(api);
