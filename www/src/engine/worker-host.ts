/**
 * One worker after the other, each with the engine started in it, and what is done when one dies; the same for all views.
 * A worker that dies is reported, and the calls that waited for it fail; another one starts with the next call. An engine that
 * cannot be fetched, or the third worker that dies with no work finished in between, ends it: nothing is started any more.
 */
import type { EngineFile } from './engine-files.js';
import { type Arguments, Remote, type Result, WorkerDied } from './remote.js';
import { compileEngine, keepWorker, startWorker } from './start.js';
import { messageOf } from './message-of.js';

/** So many crashes with no finished work in between end it. */
export const MAX_CRASHES = 3;

/** Start-up time of the engine above which a message is shown (ms). */
export const START_PATIENCE_MS = 15_000;

/** Every worker's first call, with the compiled engine; what it returns is what the engine reports of itself. */
export interface Startable {
  start(module: WebAssembly.Module): unknown;
}

export interface WorkerHooks<Event> {
  event?(event: Event): void;
  /** The worker died; the next call starts another. `numCrashes`: with no finished work in between. */
  crashed(message: string, numCrashes: number): void;
  /** The engine has not started after `START_PATIENCE_MS`; false when it has, or is given up. */
  slow?(isSlow: boolean): void;
  /** In a sentence: the engine cannot be started, or it crashed `MAX_CRASHES` times. Every further call fails. */
  unavailable(message: string): void;
}

/** What a client hands on of its worker's faults. */
export type WorkerFaults = Required<Pick<WorkerHooks<never>, 'slow' | 'unavailable'>>;

/** Address of a worker's script, or what fetches it. */
export type WorkerScript = string | (() => Promise<string>);

interface Running<Api extends Startable, Event> {
  remote: Remote<Api, Event>;
  facts: Result<Api['start']>;
}

export class WorkerHost<Api extends Startable, Event = never> {
  #script: WorkerScript;
  /** The script's address, once it is known. */
  #workerUrl = '';
  #hooks: WorkerHooks<Event>;
  #file: EngineFile;
  #running: Promise<Running<Api, Event>> | null = null;
  /** Also while it is still starting. */
  #remote: Remote<Api, Event> | null = null;
  #numCrashes = 0;
  /** Why no worker is started any more. */
  #end: string | null = null;

  constructor(script: WorkerScript, hooks: WorkerHooks<Event>, file: EngineFile = 'full') {
    this.#script = script;
    this.#hooks = hooks;
    this.#file = file;
  }

  get hasEnded(): boolean {
    return this.#end !== null;
  }

  /** Starts a worker where none runs; what the engine reports of itself. */
  async start(): Promise<Result<Api['start']>> {
    return (await this.#run()).facts;
  }

  async call<K extends keyof Api & string>(method: K, ...args: Arguments<Api[K]>): Promise<Result<Api[K]>> {
    return (await this.#run()).remote.call(method, ...args);
  }

  /** As `call`, with buffers that are given away. */
  async give<K extends keyof Api & string>(
    method: K,
    transfer: Transferable[],
    ...args: Arguments<Api[K]>
  ): Promise<Result<Api[K]>> {
    return (await this.#run()).remote.give(method, transfer, ...args);
  }

  /** Work was finished: the crashes before it no longer count. */
  succeeded(): void {
    this.#numCrashes = 0;
  }

  /** Ends a worker that is stuck, as one that died. */
  kill(message: string): void {
    this.#remote?.kill(message);
  }

  /** Ends it for good, on purpose: no callback is called. */
  dispose(message = 'the page was closed'): void {
    this.#end ??= message;
    this.#running = null;
    this.#remote?.end(message);
    this.#remote = null;
  }

  /** As `dispose`, but the worker is kept for whoever starts the next one of this script. */
  retire(): void {
    const worker = this.#remote?.release();
    if (worker) keepWorker(this.#workerUrl, worker);
    this.dispose();
  }

  #run(): Promise<Running<Api, Event>> {
    if (this.#end !== null) return Promise.reject(new WorkerDied(this.#end));
    this.#running ??= this.#begin();
    return this.#running;
  }

  /** Starts a worker. Nothing is lost with one that dies meanwhile. */
  async #begin(): Promise<Running<Api, Event>> {
    const timer = setTimeout(() => this.#end ?? this.#hooks.slow?.(true), START_PATIENCE_MS);
    try {
      return await this.#startAny();
    } finally {
      clearTimeout(timer);
      if (this.#end === null) this.#hooks.slow?.(false);
    }
  }

  /** A worker that dies while it starts is followed by the next one, as often as crashes are borne. */
  async #startAny(): Promise<Running<Api, Event>> {
    for (;;) {
      try {
        return await this.#startOne();
      } catch (error) {
        const isCrash = error instanceof WorkerDied && this.#end === null;
        if (isCrash && ++this.#numCrashes < MAX_CRASHES) continue;
        this.#giveUp(`The engine could not be started: ${messageOf(error)}`);
        throw error;
      }
    }
  }

  /** The worker's script is fetched while the engine is. */
  async #startOne(): Promise<Running<Api, Event>> {
    let isStarted = false;
    this.#workerUrl = typeof this.#script === 'string' ? this.#script : await this.#script();
    if (this.#end !== null) throw new WorkerDied(this.#end);
    const remote = new Remote<Api, Event>(startWorker(this.#workerUrl), {
      event: (event) => this.#hooks.event?.(event),
      died: (message) => {
        if (this.#remote === remote && isStarted) this.#onCrash(message);
      },
    });
    this.#remote = remote;
    const module = await compileEngine(this.#file);
    const facts = await remote.call('start', ...([module] as unknown as Arguments<Api['start']>));
    isStarted = true;
    return { remote, facts: facts as Result<Api['start']> };
  }

  #onCrash(message: string): void {
    this.#running = null;
    this.#remote = null;
    this.#numCrashes++;
    if (this.#numCrashes >= MAX_CRASHES)
      this.#giveUp(`The engine crashed ${MAX_CRASHES} times and is not started again: ${message}`);
    else this.#hooks.crashed(message, this.#numCrashes);
  }

  #giveUp(message: string): void {
    if (this.#end !== null) return;
    this.dispose(message);
    this.#hooks.unavailable(message);
  }
}
