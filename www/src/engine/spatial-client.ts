/**
 * The page's side of a run in space: one registrar, a few preparing workers, and the order of what they do, which the
 * command line shares (package/run/spatial_run.ts).
 */
import { SpatialRun } from '../../../package/run/spatial_run.js';
import type { Problem } from './protocol.js';
import registrarUrl from './registrar-worker.ts?worker&url';
import {
  addPreparers,
  AHEAD,
  dropSpare,
  keepSpare,
  NUM_CORES,
  problemOf,
  type Readable,
  type SpatialJob,
  ThreadPreparer,
  tolerate,
} from './preparer.js';
import { WorkerDied } from './remote.js';
import type {
  DepthColors,
  RegistrarApi,
  FloorGrid,
  FloorGridFiles,
  SizedMap,
  SpatialAnswers,
  SpatialFacts,
  SpatialSettings,
  SpatialSnapshot,
  TopView,
} from './spatial-protocol.js';
import { type WorkerFaults, WorkerHost } from './worker-host.js';

export interface SpatialInputs {
  jobs: readonly SpatialJob[];
  /** Frames of the recording, used or not. */
  num_recorded: number;
  intrinsics: Readable | null;
  /** The reference trajectory as one file. */
  reference: Readable | null;
  /** Whether more frames are to come: the map then grows, and is not solved as a whole. */
  isGrowing?: boolean;
}

export type SpatialState = 'running' | 'stopped' | 'done';

export interface SpatialListener extends Partial<WorkerFaults> {
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
  /** The registrar died; `restarts`: whether the run restarts automatically. */
  crashed(message: string, restarts: boolean): void;
  unavailable: WorkerFaults['unavailable'];
}

/** The map is sent again after the time that the run has taken so far, within these limits (ms), ... */
const SNAPSHOT_INTERVALS_MS = { least: 300, most: 1500 };
/** ... and so that sending takes at most this share of the time. */
const SNAPSHOT_SHARE = 0.06;
/** Number of consecutive crashes after which the run restarts only on request. */
const MAX_RESTARTS = 1;

export class SpatialClient {
  #listener: SpatialListener;
  #registrar: WorkerHost<RegistrarApi>;
  #preparers: ThreadPreparer[] = [];
  #inputs: SpatialInputs | null = null;
  #settings: Partial<SpatialSettings> = {};
  #run: SpatialRun<SpatialJob> | null = null;
  /** Orders are numbered; one that has been overtaken ends. */
  #order = 0;
  #stopping = new AbortController();
  #working: Promise<void> = Promise.resolve();
  #numDone = 0;
  #computingSince = 0;
  #nextSnapshot = 0;
  #isSending = false;
  #sending: ReturnType<typeof setTimeout> | undefined;
  #isDisposed = false;

  constructor(listener: SpatialListener) {
    this.#listener = listener;
    this.#registrar = new WorkerHost<RegistrarApi>(registrarUrl, {
      crashed: (message, numCrashes) => this.#onRegistrarDeath(message, numCrashes),
      slow: (isSlow) => listener.slow?.(isSlow),
      unavailable: (message) => {
        this.#abandon();
        listener.unavailable(message);
      },
    });
    this.#registrar.start().then(
      (facts) => this.#isDisposed || listener.ready(facts),
      () => undefined, // reported as `unavailable`
    );
  }

  /** Computes these frames from the first one on. */
  load(inputs: SpatialInputs, settings: Partial<SpatialSettings>): void {
    this.#inputs = inputs;
    this.#settings = settings;
    this.#begin((order) => this.#loadAll(order));
  }

  /** Computes the frames of `inputs` that come after those there are, on top of them. */
  extend(inputs: SpatialInputs): void {
    const known = this.#inputs?.jobs.length ?? 0;
    this.#inputs = inputs;
    if (inputs.isGrowing && this.#run?.isWorking) {
      this.#run.add(inputs.jobs.slice(this.#run.total));
      return;
    }
    this.#begin(async (order) => {
      if (!this.#run || this.#run.total < known) return this.#loadAll(order);
      this.#run.add(inputs.jobs.slice(this.#run.total));
      await this.#setReference();
      await this.#compute(order);
    });
  }

  /** Takes another reference, or none. A run that was stopped, or crashed, stays so. */
  setReference(reference: Readable | null): void {
    if (!this.#inputs) return;
    this.#inputs = { ...this.#inputs, reference };
    const isStopped = this.#stopping.signal.aborted;
    this.#begin(async (order) => {
      if (!this.#run) return isStopped ? undefined : this.#loadAll(order);
      await this.#setReference();
      await this.#compute(order);
    });
    if (isStopped) this.#stopping.abort();
  }

  /** Stops; what is done stays, and arrives as a snapshot. */
  stop(): void {
    this.#stopping.abort();
  }

  /** Goes on after a stop or a crash. */
  resume(): void {
    this.#begin((order) => (this.#run ? this.#compute(order) : this.#loadAll(order)));
  }

  ask<K extends keyof SpatialAnswers>(kind: K, frame = 0): Promise<SpatialAnswers[K]> {
    return this.#registrar.call('ask', kind, frame) as Promise<SpatialAnswers[K]>;
  }

  /** The map flattened to a grid. */
  floorGrid(wanted: FloorGrid): Promise<FloorGridFiles> {
    return this.#registrar.call('floorGrid', wanted);
  }

  /** What the map would come to in voxels of this size, m. */
  mapSize(voxel_size: number): Promise<SizedMap> {
    return this.#registrar.call('mapSize', voxel_size);
  }

  /** A depth image in these colours, from near to far. A thread that prepares frames makes it in between. */
  depthPicture(file: Readable, colors: Uint32Array): Promise<DepthColors> {
    return this.#idlePreparer().depthPicture(file, colors);
  }

  /** A depth image from above. */
  topView(file: Readable, fx: number): Promise<TopView> {
    return this.#idlePreparer().topView(file, fx);
  }

  #idlePreparer(): ThreadPreparer {
    const preparer = this.#preparers.at(-1) ?? new ThreadPreparer();
    if (this.#preparers.length === 0) this.#preparers.push(preparer);
    return preparer;
  }

  dispose(): void {
    this.#isDisposed = true;
    clearTimeout(this.#sending);
    this.#abandon();
    this.#registrar.dispose();
    for (const preparer of this.#preparers) preparer.end();
  }

  /** As `dispose`, at the end of a run; the next client reuses its threads. */
  async retire(): Promise<void> {
    await this.#registrar.call('forget').catch(() => this.dispose());
    if (this.#isDisposed) return;
    this.#registrar.retire();
    for (const preparer of this.#preparers) preparer.retire();
    this.dispose();
  }

  /** Ends what is being done. */
  #abandon(): void {
    this.#order++;
    this.#run = null;
    this.#stopping.abort();
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
    const registrar = this.#registrar;
    this.#run = null;
    await registrar.call('create', this.#settings);
    if (intrinsics) {
      await tolerate(this.#listener, intrinsics.path, async () =>
        registrar.call('setIntrinsics', intrinsics.path, await intrinsics.read()),
      );
    }
    await this.#setReference();
    if (order !== this.#order) return;
    this.#numDone = 0;
    this.#run = this.#makeRun();
    this.#run.isOpen = this.#inputs?.isGrowing ?? false;
    this.#run.add(jobs);
    await this.#compute(order);
  }

  async #compute(order: number): Promise<void> {
    const run = this.#run;
    if (!run || order !== this.#order) return;
    this.#computingSince = performance.now();
    this.#nextSnapshot = this.#computingSince + SNAPSHOT_INTERVALS_MS.least;
    const { state } = await run.run(this.#stopping.signal).finally(dropSpare);
    if (order !== this.#order) return;
    await this.#send(state, order);
  }

  #makeRun(): SpatialRun<SpatialJob> {
    const registrar = this.#registrar;
    addPreparers(this.#preparers, NUM_CORES);
    const run: SpatialRun<SpatialJob> = new SpatialRun<SpatialJob>({
      preparers: this.#preparers,
      ...AHEAD,
      registrar: {
        begin: async ({ name, file }) => registrar.call('begin', name, await file.read()),
        // With the next frame already queued the worker need not wait for this thread.
        ahead: 2,
        place: async (bytes) => {
          const { spent, ...progress } = await registrar.give('place', [bytes.buffer as ArrayBuffer], bytes);
          keepSpare(spent);
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
          const { ms } = event.progress as typeof event.progress & { ms: number };
          this.#listener.registered(event.index, ms, ++this.#numDone, run.total);
          if (performance.now() >= this.#nextSnapshot && !this.#isSending) void this.#send('running', this.#order);
          else if (run.isOpen) this.#sendLater();
        } else if (event.type === 'problem') {
          this.#numDone++;
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
    const registrar = this.#registrar;
    await registrar.call('clearReference');
    if (!reference) return;
    await tolerate(this.#listener, reference.path, async () =>
      registrar.call('setReference', reference.path, await reference.read(), num_recorded),
    );
  }

  /** Of a map that grows, the last frame so far is shown as well. */
  #sendLater(): void {
    this.#sending ??= setTimeout(
      () => {
        this.#sending = undefined;
        if (this.#isSending) this.#sendLater();
        else void this.#send('running', this.#order);
      },
      Math.max(0, this.#nextSnapshot - performance.now()),
    );
  }

  async #send(state: SpatialState, order: number): Promise<void> {
    this.#isSending = true;
    const start = performance.now();
    try {
      const snapshot = await this.#registrar.call('snapshot');
      if (order !== this.#order) return;
      if (state === 'done') this.#registrar.succeeded();
      this.#listener.snapshot(state, snapshot);
    } catch {
      return; // the registrar died, which is reported elsewhere
    } finally {
      this.#isSending = false;
      const now = performance.now();
      const { least, most } = SNAPSHOT_INTERVALS_MS;
      const interval = Math.min(Math.max(now - this.#computingSince, least), most);
      this.#nextSnapshot = now + Math.max(interval, (now - start) / SNAPSHOT_SHARE);
    }
  }

  #onRegistrarDeath(message: string, numCrashes: number): void {
    if (!this.#inputs) return;
    this.#abandon();
    const restarts = numCrashes <= MAX_RESTARTS;
    this.#listener.crashed(message, restarts);
    if (restarts) this.#begin((order) => this.#loadAll(order));
  }

  #onFailure(order: number, error: unknown): void {
    // The crash of a registrar is reported by itself.
    if (order !== this.#order || error instanceof WorkerDied) return;
    this.#listener.problem(problemOf(error, ''));
    void this.#send('stopped', order);
  }
}
