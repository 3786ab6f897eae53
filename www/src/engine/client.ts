/**
 * The page's side of the worker. It keeps the bytes of every input, so a worker that crashes is replaced by a fresh
 * one that holds the same scans.
 */
import wasm_url from '../../../pkg/scanstitch_bg.wasm?url';
import type {
  Answers,
  EngineFacts,
  FromWorker,
  InputFile,
  Inputs,
  Problem,
  Progress,
  RunState,
  Settings,
  Snapshot,
  ToWorker,
} from './protocol.js';
import { compile, startWorker } from './start.js';
import worker_url from './worker.ts?worker&url';

export interface EngineListener {
  ready(facts: EngineFacts): void;
  reading(file: string, done: number, total: number): void;
  /** `accepted` empty: nothing could be read, and what was there before is still there. */
  loaded(inputs: Inputs, accepted: readonly string[], problems: readonly Problem[]): void;
  progress(progress: Progress): void;
  snapshot(state: RunState, snapshot: Snapshot): void;
  /** A setting the engine does not take. */
  rejected(problem: Problem): void;
  /** The worker died; a new one is starting with the same inputs. */
  crashed(message: string): void;
  /** The engine cannot be started at all. */
  unavailable(message: string): void;
}

interface Waiting {
  resolve(value: Answers[keyof Answers]): void;
  reject(error: Error): void;
}

/** A worker that has not obeyed a stop after this long is taken for stuck and replaced. */
const STOP_PATIENCE_MS = 4000;
/** An engine that crashes this often in a row, with no file to blame, is given up. */
const MAX_CRASHES = 3;

export class EngineClient {
  #listener: EngineListener;
  #module: Promise<WebAssembly.Module>;
  #worker: Worker | null = null;
  /** Orders given before the worker is ready. */
  #backlog: ToWorker[] = [];
  #is_ready = false;
  #run = 0;
  #settings: Partial<Settings> = {};
  /** What the worker holds, and what it is being asked to hold instead. */
  #inputs: Inputs | null = null;
  #candidate: Inputs | null = null;
  /** The file being read, to know the culprit of a crash. */
  #reading: string | null = null;
  #waiting = new Map<number, Waiting>();
  #next_question = 0;
  #num_crashes = 0;
  #stop_timer: ReturnType<typeof setTimeout> | undefined;

  constructor(listener: EngineListener) {
    this.#listener = listener;
    this.#module = compile(wasm_url);
    this.#start();
  }

  /** Reads `inputs` and computes. */
  load(inputs: Inputs, settings: Partial<Settings>): void {
    this.#candidate = inputs;
    this.#settings = settings;
    this.#send({ type: 'load', run: ++this.#run, inputs, settings, hold: false });
  }

  /** Computes again with other settings. */
  configure(settings: Partial<Settings>): void {
    this.#settings = settings;
    this.#send({ type: 'configure', run: ++this.#run, settings });
  }

  /** Stops computing; what has been computed arrives as a snapshot. */
  stop(): void {
    this.#send({ type: 'stop' });
    clearTimeout(this.#stop_timer);
    this.#stop_timer = setTimeout(() => this.#crash('It did not react to the stop.'), STOP_PATIENCE_MS);
  }

  /** Goes on where it was stopped, or computes for the first time what was only read. */
  resume(): void {
    this.#send({ type: 'resume', run: ++this.#run });
  }

  /** `frame` matters for `correspondences` alone. */
  ask<K extends keyof Answers>(kind: K, frame = 0): Promise<Answers[K]> {
    const id = this.#next_question++;
    return new Promise<Answers[keyof Answers]>((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#send({ type: 'ask', id, kind, frame });
    }) as Promise<Answers[K]>;
  }

  dispose(): void {
    clearTimeout(this.#stop_timer);
    this.#worker?.terminate();
    this.#worker = null;
    this.#refuseAll('The page was closed.');
  }

  #start(): void {
    const worker = startWorker(worker_url);
    this.#worker = worker;
    this.#is_ready = false;
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
      if (this.#worker === worker) this.#receive(data);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      if (this.#worker === worker) this.#crash(event.message || 'The worker could not be loaded.');
    };
    this.#module.then(
      (module) => worker.postMessage({ type: 'start', module } satisfies ToWorker),
      (error: unknown) => this.#listener.unavailable(error instanceof Error ? error.message : String(error)),
    );
  }

  #send(message: ToWorker): void {
    if (this.#is_ready) this.#worker?.postMessage(message);
    else this.#backlog.push(message);
  }

  #receive(message: FromWorker): void {
    if ('run' in message && message.run !== this.#run) return;
    switch (message.type) {
      case 'ready':
        this.#is_ready = true;
        this.#listener.ready(message.facts);
        for (const order of this.#backlog.splice(0)) this.#send(order);
        return;
      case 'reading':
        this.#reading = message.file;
        this.#listener.reading(message.file, message.done, message.total);
        return;
      case 'loaded':
        this.#loaded(message.accepted, message.refused, message.problems);
        return;
      case 'progress':
        this.#listener.progress(message.progress);
        return;
      case 'snapshot':
        if (message.state !== 'running') clearTimeout(this.#stop_timer);
        this.#listener.snapshot(message.state, message.snapshot);
        return;
      case 'rejected':
        this.#listener.rejected(message.problem);
        return;
      case 'answer':
        this.#waiting.get(message.id)?.resolve(message.value);
        this.#waiting.delete(message.id);
        return;
      case 'refused':
        this.#waiting.get(message.id)?.reject(new Error(message.message));
        this.#waiting.delete(message.id);
        return;
      case 'crashed':
        this.#crash(message.message);
    }
  }

  #loaded(accepted: string[], refused: string[], problems: Problem[]): void {
    clearTimeout(this.#stop_timer);
    this.#reading = null;
    const candidate = this.#candidate;
    this.#candidate = null;
    if (!candidate) return; // read again after a crash: nothing is new
    this.#num_crashes = 0;
    const names = new Set(accepted);
    const kept: Inputs = {
      scans: candidate.scans.filter(({ name }) => names.has(name)),
      reference: unlessNamed(candidate.reference, refused),
      odometry: unlessNamed(candidate.odometry, refused),
    };
    if (accepted.length > 0) this.#inputs = kept;
    this.#listener.loaded(kept, accepted, problems);
  }

  /**
   * Replaces the worker and reads the inputs again. A file it died on is left out; when it died otherwise, nothing is
   * computed until the user asks for it.
   */
  #crash(message: string): void {
    clearTimeout(this.#stop_timer);
    const was_ready = this.#is_ready;
    const culprit = this.#reading;
    this.#worker?.terminate();
    this.#worker = null;
    this.#is_ready = false;
    this.#backlog = [];
    this.#reading = null;
    this.#refuseAll('The computation crashed.');
    const is_blamed = this.#candidate !== null && culprit !== null;
    if (!was_ready || (!is_blamed && ++this.#num_crashes > MAX_CRASHES)) {
      this.#listener.unavailable(message);
      return;
    }
    this.#start();
    if (this.#candidate && culprit !== null) {
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
      if (!this.#inputs) return;
      this.#send({ type: 'load', run: ++this.#run, inputs: this.#inputs, settings: this.#settings, hold: true });
    }
  }

  #refuseAll(reason: string): void {
    for (const { reject } of this.#waiting.values()) reject(new Error(reason));
    this.#waiting.clear();
  }
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
