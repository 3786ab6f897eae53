/**
 * The page's side of the worker of planar scans. It keeps the bytes of every input, so that a worker that takes the place
 * of one that crashed holds the same scans. The first scans go to the small file of the engine, which is there sooner; what
 * follows, and what is large, to the full one, which is faster. Both find the same.
 */
import { type EngineFile, first, fullWorker } from './engine-files.js';
import { GrowingSnapshot } from './growing-snapshot.js';
import type {
  Answers,
  Consequence,
  Edit,
  EngineFacts,
  InputFile,
  Inputs,
  PlacedPlan,
  ReadOutcome,
  PlanarApi,
  PlanarEvent,
  Problem,
  Progress,
  RefusedEdit,
  ScanAt,
  RunState,
  Settings,
  Snapshot,
  TableFacts,
} from './protocol.js';
import { EngineProblem, WorkerDied } from './remote.js';
import { compileFullWhenIdle, isCompiled } from './start.js';
import { type WorkerFaults, type WorkerHooks, WorkerHost, type WorkerScript } from './worker-host.js';
import { messageOf } from './message-of.js';

export interface PlanarListener extends WorkerFaults {
  ready(facts: EngineFacts): void;
  reading(file: string, done: number, total: number): void;
  /** `accepted` empty: nothing could be read, and what was there before is still there. */
  loaded(inputs: Inputs, told: ReadOutcome): void;
  progress(progress: Progress): void;
  snapshot(state: RunState, snapshot: Snapshot): void;
  /** A setting the engine does not take, or a step: all stays as it is. */
  rejected(problem: Problem, isStep?: boolean): void;
  /** The map is being mended, but for these steps. */
  refused(steps: readonly RefusedEdit[]): void;
  /** The worker died; a new one is starting with the same inputs. */
  crashed(message: string): void;
}

/** Time after a stop command at which a worker that has not responded is replaced (ms). */
const STOP_PATIENCE_MS = 4000;

/** More than this is computed sooner by the full engine, though it has to be fetched: about 100 scans as text. */
const MAX_FIRST_BYTES = 1e6;
/** The pieces of longer recordings are searched for in each other, which the full engine alone can. */
const MAX_FIRST_SCANS = 99;

/** What is told of files that are not wanted any more. */
const STOPPED_READING = { notes: [{ file: '', text: 'Reading was stopped: none of it is used' }], isStopped: true };

type Host = WorkerHost<PlanarApi, PlanarEvent>;

export class PlanarClient {
  #listener: PlanarListener;
  #host: Host;
  /** The host of the small engine while the full one reads: it holds what is shown, which stays if nothing can be read. */
  #firstHost: Host | null = null;
  /** The host that looks into tables; null before the first one. */
  #tableHost: Host | null = null;
  #isFull = first.file === 'full';
  #run = 0;
  #growing = new GrowingSnapshot();
  #settings: Partial<Settings> = {};
  #steps: readonly Edit[] = [];
  /** Whether the map is that of the steps. */
  #isMended = true;
  /** What the worker holds, and what it is being asked to hold instead. */
  #inputs: Inputs | null = null;
  #candidate: Inputs | null = null;
  /** The file being read, to know the culprit of a crash. */
  #reading: string | null = null;
  /** Whether the worker has not reacted to a stop yet. */
  #isStopping = false;
  #stopTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(listener: PlanarListener) {
    this.#listener = listener;
    this.#host = this.#createHost(first.workerUrl, first.file);
    this.#start();
  }

  /** Reads `inputs` and computes; `steps`: by which other scans are mended. */
  load(inputs: Inputs, settings: Partial<Settings>, steps: readonly Edit[] = []): void {
    if (!sameScans(inputs, this.#inputs)) this.#steps = steps;
    this.#candidate = inputs;
    this.#settings = settings;
    this.#preferFullEngine(inputs, steps.length > 0);
    this.#load(inputs, false);
  }

  /** Computes again with other settings. */
  configure(settings: Partial<Settings>): void {
    this.#settings = settings;
    this.#isMended = false;
    if (this.#inputs && this.#preferFullEngine(this.#inputs)) this.#load(this.#inputs, false);
    else this.#order(this.#host.call('configure', ++this.#run, settings));
  }

  /** The steps by which the map is mended. */
  get steps(): readonly Edit[] {
    return this.#steps;
  }

  /** Makes the full engine compute, the only one that mends; whether it is to compute first. */
  prepareToMend(): boolean {
    const isNew = this.#inputs !== null && this.#preferFullEngine(this.#inputs, true);
    if (isNew && this.#inputs) this.#load(this.#inputs, false);
    return isNew;
  }

  /** Takes these steps, and none that were taken before. They are taken again after other settings. */
  mend(steps: readonly Edit[]): void {
    const before = this.#steps;
    this.#steps = steps;
    this.#isMended = true;
    const mended = this.#host.call('mend', ++this.#run, steps).then(
      (refused) => this.#listener.refused(refused),
      (error: unknown) => {
        // The engine has kept them.
        this.#steps = before;
        if (!(error instanceof EngineProblem)) throw error;
        this.#listener.rejected(error.problem, true);
      },
    );
    this.#order(mended);
  }

  /** What a step would change after those that were taken. */
  previewEdit(step: Edit): Promise<Consequence> {
    return this.#host.call('previewEdit', [...this.#steps, step]);
  }

  /** Where a step would lay a building plan behind the map as it is. */
  previewPlan(step: Edit): Promise<PlacedPlan | null> {
    return this.#host.call('previewPlan', [step]);
  }

  /** The scans with beams that met a cell of this side (m); the full engine alone tells them. */
  scansAt(x: number, y: number, side: number): Promise<ScanAt[]> {
    return this.#host.call('scansAt', x, y, side);
  }

  /** Stops computing; what has been computed arrives as a snapshot. */
  stop(): void {
    if (this.#firstHost && this.#candidate) {
      // The full engine is on its way, or reads.
      this.#run++;
      this.#listener.slow(false);
      this.#keepFirst(STOPPED_READING);
      return;
    }
    const host = this.#host;
    clearTimeout(this.#stopTimer);
    this.#isStopping = true;
    let isAnswered = false;
    // What it answers is the reaction, also where there was nothing to stop.
    const answered = host.call('stop').then(() => {
      isAnswered = true;
      this.#isStopping = false;
      clearTimeout(this.#stopTimer);
    });
    this.#order(answered);
    // A worker that is still starting cannot react.
    host.start().then(
      () => {
        if (isAnswered) return;
        clearTimeout(this.#stopTimer);
        this.#stopTimer = setTimeout(() => host.kill('It did not react to the stop.'), STOP_PATIENCE_MS);
      },
      () => undefined, // reported as `unavailable`
    );
  }

  /** Goes on where it was stopped, or computes for the first time what was only read. */
  resume(): void {
    this.#order(this.#host.call('resume', ++this.#run));
  }

  /** `frame` matters for `correspondences`, `history` and `scan_to_map` alone. */
  ask<K extends keyof Answers>(kind: K, frame = 0): Promise<Answers[K]> {
    return (this.#firstHost ?? this.#host).call('ask', kind, frame) as Promise<Answers[K]>;
  }

  /** Reads a table by the full engine, the only one that can, in a separate worker, so that a run continues. */
  describeTable(file: InputFile, format: string | null, scan: number): Promise<TableFacts | null> {
    const forget = (): void => {
      this.#tableHost = null;
    };
    const hooks: WorkerHooks<PlanarEvent> = { event: () => undefined, crashed: forget, unavailable: forget };
    this.#tableHost ??= new WorkerHost<PlanarApi, PlanarEvent>(fullWorker, hooks, 'full');
    return this.#tableHost.call('describeTable', file, format, scan);
  }

  dispose(): void {
    clearTimeout(this.#stopTimer);
    this.#firstHost?.dispose();
    this.#tableHost?.dispose();
    this.#host.dispose();
  }

  #createHost(script: WorkerScript, file: EngineFile): Host {
    const hooks: WorkerHooks<PlanarEvent> = {
      event: (event) => this.#onEvent(event),
      crashed: (message) => this.#onCrash(message),
      slow: (isSlow) => this.#listener.slow(isSlow),
      unavailable: (message) => this.#onUnavailable(message),
    };
    return new WorkerHost<PlanarApi, PlanarEvent>(script, hooks, file);
  }

  /** Takes the full engine from here on, where it is there or is worth waiting for; whether it was taken now. */
  #preferFullEngine(inputs: Inputs, isNeeded = false): boolean {
    if (this.#isFull || (!isNeeded && !isCompiled('full') && isForFirst(inputs))) return false;
    this.#order(this.#host.call('stop'));
    this.#firstHost = this.#host;
    this.#host = this.#createHost(fullWorker, 'full');
    this.#isFull = true;
    return true;
  }

  /** The full engine has read what it was given, or could not. */
  #settleEngine(isTaken: boolean): void {
    const firstHost = this.#firstHost;
    this.#firstHost = null;
    if (!firstHost) return;
    if (isTaken) {
      firstHost.dispose();
      return;
    }
    this.#host.dispose();
    this.#host = firstHost;
    this.#isFull = false;
  }

  #start(): void {
    this.#host.start().then(
      (facts) => this.#listener.ready(facts),
      () => undefined, // reported as `unavailable`
    );
  }

  #load(inputs: Inputs, hold: boolean): void {
    this.#isMended = false;
    const run = ++this.#run;
    this.#order(
      this.#host.call('load', run, inputs, this.#settings, hold).then((loaded) => {
        if (loaded && run === this.#run) this.#onLoaded(loaded);
      }),
    );
  }

  /** Handles a command that fails; the crash of a worker is reported elsewhere. */
  #order(done: Promise<void>): void {
    const [run, host] = [this.#run, this.#host];
    done.catch((error: unknown) => {
      if (error instanceof WorkerDied || run !== this.#run) return;
      if (error instanceof EngineProblem) this.#listener.rejected(error.problem);
      else host.kill(messageOf(error));
    });
  }

  #onEvent(event: PlanarEvent): void {
    if (event.run !== this.#run) return;
    if (event.type === 'reading') {
      this.#reading = event.file;
      this.#listener.reading(event.file, event.done, event.total);
    } else if (event.type === 'progress') {
      this.#listener.progress(event.progress);
    } else {
      if (event.state !== 'running') clearTimeout(this.#stopTimer);
      if (event.state === 'done') {
        this.#host.succeeded();
        compileFullWhenIdle();
      }
      const isToMend = event.state === 'done' && !this.#isMended && this.#steps.length > 0;
      if (isToMend) this.mend(this.#steps);
      else if (event.state === 'done' && this.#steps.length > 0) this.#tellUnused();
      this.#listener.snapshot(isToMend ? 'running' : event.state, this.#growing.take(event.growth));
    }
  }

  #tellUnused(): void {
    const run = this.#run;
    this.ask('unused_edits').then(
      (unused) => run === this.#run && this.#listener.refused(unused),
      () => undefined, // reported as a crash
    );
  }

  #onLoaded(loaded: ReadOutcome): void {
    const { accepted, refused } = loaded;
    this.#settleEngine(accepted.length > 0);
    clearTimeout(this.#stopTimer);
    this.#reading = null;
    const candidate = this.#candidate;
    this.#candidate = null;
    if (!candidate) return; // read again after a crash: nothing is new
    const names = new Set(accepted);
    const kept: Inputs = {
      scans: candidate.scans.filter(({ name }) => names.has(name)),
      reference: unlessNamed(candidate.reference, refused),
      odometry: unlessNamed(candidate.odometry, refused),
    };
    if (accepted.length > 0) this.#inputs = kept;
    this.#listener.loaded(kept, loaded);
  }

  /** What is shown stays where only the full engine cannot be had. */
  #onUnavailable(message: string): void {
    clearTimeout(this.#stopTimer);
    if (this.#firstHost && this.#candidate) {
      const remedy = 'Try again when the network is there';
      this.#keepFirst({ problems: [{ file: '', place: null, problem: message, remedy }] });
    } else this.#listener.unavailable(message);
  }

  /** What the small engine holds stays; nothing of what the full one was to read is used. */
  #keepFirst(told: Partial<ReadOutcome>): void {
    this.#onLoaded({ accepted: [], refused: [], problems: [], notes: [], ...told });
  }

  /**
   * Reads the inputs again in a new worker. A file it died on is left out; when it died otherwise, nothing is computed until
   * the user asks for it.
   */
  #onCrash(message: string): void {
    clearTimeout(this.#stopTimer);
    const culprit = this.#reading;
    this.#reading = null;
    this.#start();
    if (this.#candidate && this.#isStopping) {
      this.#host.succeeded(); // a large file that was being read, and no crash
      this.#isStopping = false;
      this.#keepFirst(STOPPED_READING);
      if (this.#inputs) this.load(this.#inputs, this.#settings, this.#steps);
    } else if (this.#candidate && culprit !== null) {
      this.#host.succeeded(); // the file is to blame, not the engine
      this.#listener.rejected({
        file: culprit,
        place: null,
        problem: `The engine crashed while reading this file (${message})`,
        remedy: 'It was left out; export it again',
      });
      this.load(withoutFile(this.#candidate, culprit), this.#settings);
    } else if (this.#candidate) {
      this.load(this.#candidate, this.#settings);
    } else {
      this.#listener.crashed(message);
      if (this.#inputs) this.#load(this.#inputs, true);
    }
  }
}

function sameScans({ scans }: Inputs, other: Inputs | null): boolean {
  return scans.length === other?.scans.length && scans.every((scan, index) => scan === other.scans[index]);
}

/** A few scans and no logs. */
function isForFirst({ scans, odometry }: Inputs): boolean {
  const num_bytes = scans.reduce((sum, { bytes }) => sum + bytes.byteLength, 0);
  const isSmall = num_bytes <= MAX_FIRST_BYTES && scans.length <= MAX_FIRST_SCANS;
  return !odometry && isSmall && !scans.some(({ isLog, table }) => isLog || table !== undefined);
}

function withoutFile({ scans, reference, odometry }: Inputs, name: string): Inputs {
  return {
    scans: scans.filter((scan) => scan.name !== name),
    reference: unlessNamed(reference, [name]),
    odometry: unlessNamed(odometry, [name]),
  };
}

function unlessNamed(file: InputFile | null, names: readonly string[]): InputFile | null {
  return file && names.includes(file.name) ? null : file;
}
