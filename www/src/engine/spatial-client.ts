/**
 * The page's side of a run in space: one registrar, a few preparing workers, and the order of what they do, which the
 * command line shares (npm/spatial_run.js). A worker that dies is replaced.
 */
import { giveBack, owned } from '../../../npm/buffers.js';
import { SpatialRun, WorkerDied } from '../../../npm/spatial_run.js';
import wasm_url from '../../../pkg/scanstitch_bg.wasm?url';
import preparer_url from './preparer-worker.ts?worker&url';
import type { Problem } from './protocol.js';
import registrar_url from './registrar-worker.ts?worker&url';
import { EngineProblem, Remote } from './remote.js';
import type {
  ColorFile,
  DepthColors,
  PreparerApi,
  RegistrarApi,
  SizedMap,
  SpatialAnswers,
  SpatialFacts,
  SpatialSettings,
  SpatialSnapshot,
} from './spatial-protocol.js';
import { compile, keepWorker, startWorker } from './start.js';

/** A file that can be read whenever it is needed, and is not held in memory meanwhile. */
export interface Readable {
  path: string;
  read(): Promise<Uint8Array>;
}

/** One frame of the recording. */
export interface SpatialJob {
  index: number;
  name: string;
  time: number | null;
  /** Depth image or cloud. */
  file: Readable;
  color: Readable | null;
  is_cloud: boolean;
}

export interface SpatialInputs {
  jobs: readonly SpatialJob[];
  /** Frames of the recording, used or not. */
  num_recorded: number;
  intrinsics: Readable | null;
  /** The true path as one file. */
  reference: Readable | null;
}

export type SpatialState = 'running' | 'stopped' | 'done';

export interface SpatialListener {
  ready(facts: SpatialFacts): void;
  /** A frame was registered: `done` of `total` are over, good or bad. */
  registered(index: number, ms: number, done: number, total: number): void;
  /** All frames have had their turn: those that were left out are tried again, then all poses are solved for together. */
  finishing(stage: 'retry' | 'loops'): void;
  snapshot(state: SpatialState, snapshot: SpatialSnapshot): void;
  /** Input that cannot be used, or a setting that is not taken. */
  problem(problem: Problem): void;
  /** A preparing worker died on this frame and was replaced. */
  replaced(name: string): void;
  /** The registrar died; `restarts`: all is computed again by itself. */
  crashed(message: string, restarts: boolean): void;
  /** The engine cannot be started at all. */
  unavailable(message: string): void;
}

/** The map is sent after so long at first, then ever later, as there is ever less that is new in it: ... */
const SNAPSHOT_INTERVALS_MS = { least: 300, most: 1500 };
/** ... after this share of the time that the run has taken so far, ... */
const SNAPSHOT_GROWTH = 1;
/** ... and so that sending takes at most this share of the time. */
const SNAPSHOT_SHARE = 0.06;
/** Preparing workers, as many as there are cores, within these bounds. */
const MAX_PREPARERS = 4;
/** A worker that has had a frame for so long is taken for dead: one that is ended from outside says nothing. */
const PATIENCE_MS = 20_000;
/** A registrar that dies this often in a row is not started again by itself. */
const MAX_RESTARTS = 1;

export class SpatialClient {
  #listener: SpatialListener;
  #module = compile(wasm_url);
  #registrar: Remote<RegistrarApi> | null = null;
  #preparers: ThreadPreparer[] = [];
  #inputs: SpatialInputs | null = null;
  #settings: Partial<SpatialSettings> = {};
  #run: SpatialRun<SpatialJob> | null = null;
  /** Orders are numbered; one that has been overtaken ends. */
  #order = 0;
  #stopping = new AbortController();
  #working: Promise<void> = Promise.resolve();
  #num_done = 0;
  #num_restarts = 0;
  #computing_since = 0;
  #next_snapshot = 0;
  #is_sending = false;
  #is_disposed = false;

  constructor(listener: SpatialListener) {
    this.#listener = listener;
    this.#startRegistrar().then(
      (facts) => this.#is_disposed || listener.ready(facts),
      (error: unknown) => this.#is_disposed || listener.unavailable(messageOf(error)),
    );
  }

  /** Computes these frames from the first one on. */
  load(inputs: SpatialInputs, settings: Partial<SpatialSettings>): void {
    this.#inputs = inputs;
    this.#settings = settings;
    this.#num_restarts = 0;
    this.#begin((order) => this.#loadAll(order));
  }

  /** Computes the frames of `inputs` that come after those there are, on top of them. */
  extend(inputs: SpatialInputs): void {
    const known = this.#inputs?.jobs.length ?? 0;
    this.#inputs = inputs;
    this.#begin(async (order) => {
      if (!this.#run || this.#run.total < known) return this.#loadAll(order);
      this.#run.add(inputs.jobs.slice(this.#run.total));
      await this.#setReference();
      await this.#compute(order);
    });
  }

  /** Takes another reference, or none. */
  setReference(reference: Readable | null): void {
    if (!this.#inputs) return;
    this.#inputs = { ...this.#inputs, reference };
    this.#begin(async (order) => {
      if (!this.#run) return this.#loadAll(order);
      await this.#setReference();
      await this.#compute(order);
    });
  }

  /** Stops; what is done stays, and arrives as a snapshot. */
  stop(): void {
    this.#stopping.abort();
  }

  /** Goes on after a stop or a crash. */
  resume(): void {
    this.#num_restarts = 0;
    this.#begin((order) => (this.#run ? this.#compute(order) : this.#loadAll(order)));
  }

  ask<K extends keyof SpatialAnswers>(kind: K): Promise<SpatialAnswers[K]> {
    if (!this.#registrar) return Promise.reject(new Error('The engine is not running.'));
    return this.#registrar.call('ask', kind) as Promise<SpatialAnswers[K]>;
  }

  /** What the map would come to in voxels of this size, m. */
  mapSize(voxel_size: number): Promise<SizedMap> {
    return this.#registrar?.call('mapSize', voxel_size) ?? Promise.reject(new Error('The engine is not running.'));
  }

  /** A depth image in these colours, from near to far. A thread that prepares frames makes it in between. */
  depthPicture(file: Readable, colors: Uint32Array): Promise<DepthColors> {
    const preparer = this.#preparers.at(-1) ?? new ThreadPreparer(this.#module);
    if (this.#preparers.length === 0) this.#preparers.push(preparer);
    return preparer.depthPicture(file, colors);
  }

  dispose(): void {
    this.#is_disposed = true;
    this.#order++;
    this.#stopping.abort();
    this.#registrar?.end();
    for (const preparer of this.#preparers) preparer.end();
  }

  /** As `dispose`, when all is done; the next client goes on with its threads. */
  async retire(): Promise<void> {
    await this.#registrar?.call('forget').catch(() => this.dispose());
    if (this.#is_disposed) return;
    keep(registrar_url, this.#registrar);
    for (const preparer of this.#preparers) preparer.retire();
    this.dispose();
  }

  /** Ends what is being done, then does this, unless something else has been ordered meanwhile. */
  #begin(work: (order: number) => Promise<void>): void {
    const order = ++this.#order;
    this.#stopping.abort();
    const stopping = new AbortController();
    this.#stopping = stopping;
    this.#working = this.#working.then(async () => {
      if (order !== this.#order) return;
      try {
        await work(order);
      } catch (error) {
        this.#onFailure(order, error);
      }
    });
  }

  async #loadAll(order: number): Promise<void> {
    const { jobs, intrinsics } = this.#inputs ?? { jobs: [], intrinsics: null };
    if (!this.#registrar?.is_alive) await this.#startRegistrar();
    const registrar = this.#registrar as Remote<RegistrarApi>;
    this.#run = null;
    await registrar.call('create', this.#settings);
    if (intrinsics) {
      await this.#tolerate(intrinsics.path, async () =>
        registrar.call('setIntrinsics', intrinsics.path, await intrinsics.read()),
      );
    }
    await this.#setReference();
    if (order !== this.#order) return;
    this.#num_done = 0;
    this.#run = this.#makeRun(registrar);
    this.#run.add(jobs);
    await this.#compute(order);
  }

  async #compute(order: number): Promise<void> {
    const run = this.#run;
    if (!run || order !== this.#order) return;
    this.#computing_since = performance.now();
    this.#next_snapshot = this.#computing_since + SNAPSHOT_INTERVALS_MS.least;
    const { state } = await run.run(this.#stopping.signal);
    if (order !== this.#order) return;
    await this.#send(state, order);
  }

  #makeRun(registrar: Remote<RegistrarApi>): SpatialRun<SpatialJob> {
    const cores = navigator.hardwareConcurrency || 2;
    const wanted = Math.min(Math.max(cores, 1), MAX_PREPARERS);
    while (this.#preparers.length < wanted) this.#preparers.push(new ThreadPreparer(this.#module));
    const run: SpatialRun<SpatialJob> = new SpatialRun<SpatialJob>({
      preparers: this.#preparers,
      registrar: {
        begin: async ({ name, file }) => registrar.call('begin', name, await file.read()),
        // With the next frame at hand it need not wait until this thread has told it.
        ahead: 2,
        place: async (bytes) => {
          const { spent, ...progress } = await registrar.give('place', [bytes.buffer as ArrayBuffer], bytes);
          if (spare_prepared.length < MOST_SPARE) spare_prepared.push(spent);
          return { ...progress, frame: progress.frame ?? null };
        },
        finish: async () => {
          const progress = await registrar.call('finish');
          return { ...progress, frame: progress.frame ?? null };
        },
      },
      onEvent: (event) => {
        if (run !== this.#run && this.#run) return;
        if (event.type === 'registered') {
          this.#num_restarts = 0;
          const { ms } = event.progress as typeof event.progress & { ms: number };
          this.#listener.registered(event.index, ms, ++this.#num_done, run.total);
          if (performance.now() >= this.#next_snapshot && !this.#is_sending) this.#send('running', this.#order);
        } else if (event.type === 'problem') {
          this.#num_done++;
          this.#listener.problem(problemOf(event.error, event.name));
        } else if (event.type === 'step') {
          const { stage } = event.progress;
          if (stage === 'retry' || stage === 'loops') this.#listener.finishing(stage);
        } else if (event.type === 'replaced') {
          this.#listener.replaced(event.name);
        }
      },
    });
    return run;
  }

  async #setReference(): Promise<void> {
    const { reference = null, num_recorded = 0 } = this.#inputs ?? {};
    const registrar = this.#registrar as Remote<RegistrarApi>;
    await registrar.call('clearReference');
    if (!reference) return;
    await this.#tolerate(reference.path, async () =>
      registrar.call('setReference', reference.path, await reference.read(), num_recorded),
    );
  }

  /** What is wrong with a file beside the frames is told, and the frames go on without it. */
  async #tolerate(name: string, action: () => Promise<unknown>): Promise<void> {
    try {
      await action();
    } catch (error) {
      if (error instanceof WorkerDied) throw error;
      this.#listener.problem(problemOf(error, name));
    }
  }

  async #send(state: SpatialState, order: number): Promise<void> {
    const registrar = this.#registrar;
    if (!registrar) return;
    this.#is_sending = true;
    const start = performance.now();
    try {
      const snapshot = await registrar.call('snapshot');
      if (order === this.#order) this.#listener.snapshot(state, snapshot);
    } catch {
      return; // the registrar died, which is told elsewhere
    } finally {
      this.#is_sending = false;
      const now = performance.now();
      const { least, most } = SNAPSHOT_INTERVALS_MS;
      const interval = Math.min(Math.max(SNAPSHOT_GROWTH * (now - this.#computing_since), least), most);
      this.#next_snapshot = now + Math.max(interval, (now - start) / SNAPSHOT_SHARE);
    }
  }

  async #startRegistrar(): Promise<SpatialFacts> {
    const module = await this.#module;
    if (this.#is_disposed) throw new WorkerDied('it was ended');
    const registrar = new Remote<RegistrarApi>(startWorker(registrar_url), (message) => {
      if (this.#registrar === registrar) this.#onRegistrarDeath(message);
    });
    this.#registrar = registrar;
    return registrar.call('start', module);
  }

  #onRegistrarDeath(message: string): void {
    if (this.#is_disposed || !this.#inputs) return;
    this.#run = null;
    const restarts = this.#num_restarts < MAX_RESTARTS;
    this.#num_restarts++;
    this.#listener.crashed(message, restarts);
    if (restarts) this.#begin((order) => this.#loadAll(order));
    else this.#order++;
  }

  #onFailure(order: number, error: unknown): void {
    // A registrar that died has told so itself.
    if (order !== this.#order || error instanceof WorkerDied) return;
    this.#listener.problem(problemOf(error, ''));
    this.#send('stopped', order);
  }
}

/** Buffers of frames that have been registered, for those to come. */
const spare_prepared: Uint8Array[] = [];
/** As many as may be on their way at a time. */
const MOST_SPARE = 8;

/** One thread that prepares frames; where it dies, another takes its place. */
export class ThreadPreparer {
  #module: Promise<WebAssembly.Module>;
  #remote: Promise<Remote<PreparerApi>> | null = null;
  #has_ended = false;

  constructor(module: Promise<WebAssembly.Module>) {
    this.#module = module;
  }

  async prepare(
    job: SpatialJob,
    preparation: string,
    signal: AbortSignal,
  ): Promise<{ bytes: Uint8Array; milliseconds: Record<string, number> }> {
    const { index, name, time, file, color, is_cloud } = job;
    // The thread gets them for its own; should it die, they are read again.
    const read = async (from: Readable): Promise<Uint8Array> => owned(await from.read());
    const readColors = async (from: Readable): Promise<ColorFile> => {
      const { path } = from;
      return read(from).then(
        (bytes) => ({ path, bytes, problem: null }),
        (error: unknown) => ({ path, bytes: null, problem: textOf(error, path) }),
      );
    };
    const [bytes, colors] = await Promise.all([read(file), color && readColors(color)]);
    // No thread is started for a run that has ended meanwhile.
    signal.throwIfAborted();
    const spare = spare_prepared.pop() ?? null;
    const buffers = [bytes, colors?.bytes, spare].flatMap((given) => (given ? [given.buffer] : []));
    const start = performance.now();
    const { prepared, spent, spent_color } = await this.#patiently((remote) =>
      is_cloud
        ? remote.give('prepareCloud', buffers, preparation, name, index, time, bytes, spare)
        : remote.give('prepareFrame', buffers, preparation, name, index, time, bytes, colors, spare),
    );
    for (const read of [spent, spent_color]) if (read) giveBack(read);
    return { bytes: prepared, milliseconds: { prepare: performance.now() - start } };
  }

  async depthPicture(file: Readable, colors: Uint32Array): Promise<DepthColors> {
    const bytes = owned(await file.read());
    return this.#patiently((remote) => remote.give('depthPicture', [bytes.buffer], file.path, bytes, colors));
  }

  /** The next call starts a new thread: one that died is forgotten at once. */
  replace(): void {}

  end(): void {
    this.#leave((remote) => remote.end());
  }

  /** As `end`, but the thread is kept for the next client. */
  retire(): void {
    this.#leave((remote) => keep(preparer_url, remote));
  }

  #leave(action: (remote: Remote<PreparerApi>) => void): void {
    this.#remote?.then(action, () => undefined);
    this.#remote = null;
    this.#has_ended = true;
  }

  async #patiently<R>(call: (remote: Remote<PreparerApi>) => Promise<R>): Promise<R> {
    // A file may have been read meanwhile.
    if (this.#has_ended) throw new WorkerDied('it was ended');
    const started = (this.#remote ??= this.#start());
    let timer: ReturnType<typeof setTimeout> | undefined;
    try {
      const remote = await started;
      timer = setTimeout(() => remote.kill('it did not answer'), PATIENCE_MS);
      return await call(remote);
    } catch (error) {
      if (error instanceof WorkerDied && this.#remote === started) this.#remote = null;
      throw error;
    } finally {
      clearTimeout(timer);
    }
  }

  async #start(): Promise<Remote<PreparerApi>> {
    const module = await this.#module;
    const remote = new Remote<PreparerApi>(startWorker(preparer_url));
    await remote.call('start', module);
    return remote;
  }
}

function keep(worker_url: string, remote: Remote<PreparerApi> | Remote<RegistrarApi> | null): void {
  const worker = remote?.release();
  if (worker) keepWorker(worker_url, worker);
}

export function problemOf(error: unknown, file: string): Problem {
  if (error instanceof EngineProblem) return { ...error.problem, file: error.problem.file || file };
  const { place = null, problem = messageOf(error), remedy = '' } = error as Partial<Problem>;
  return { file: (error as Partial<Problem>).file || file, place, problem, remedy };
}

/** What went wrong with a file, which is named. */
function textOf(error: unknown, file: string): string {
  return (error as Partial<Problem>).file ? messageOf(error) : `${file}: ${messageOf(error)}`;
}

function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
