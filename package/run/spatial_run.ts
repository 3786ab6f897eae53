/**
 * Runs a reconstruction on several threads: frames are read and prepared ahead by as many preparers as there are
 * workers, while one registrar places them in their order. It knows neither Web Workers nor those of Node, neither
 * files nor the engine: those are behind two small interfaces.
 */
import { WorkerDied } from '../base/worker_died.js';
import { type Frame, FrameQueue, type Job, type Milliseconds, type Prepared } from './frame_queue.js';

export { WorkerDied };

/** As the engine reports it; `decodeConfig`: what frames to come are prepared with, where that may have changed. */
export type Progress = {
  stage: string;
  done: number;
  total: number;
  frame: number | null;
  decodeConfig?: string | undefined;
};

/** Prepares frames, one after the other, in a separate thread. */
export interface Preparer<J extends Job> {
  /**
   * Frames that it is given at a time, 1 where it does not say: with another one at hand it need not wait until this
   * thread has time for it.
   */
  ahead?: number;
  /** Rejects with a WorkerDied where the thread is gone, with any other error where it is the frame's fault. */
  prepare: (job: J, decodeConfig: string, signal: AbortSignal) => Promise<Prepared>;
  /** A new thread in the place of the one that died. */
  replace: () => void | Promise<void>;
}

/** Places frames, in order. */
export interface Registrar<J extends Job> {
  /** Looks at the first frame; what it returns is for all preparers. */
  begin: (job: J) => string | Promise<string>;
  place: (bytes: Uint8Array) => Progress | Promise<Progress>;
  /** Does a piece of what is left to do after the last frame, until it is `done`. */
  finish: () => Progress | Promise<Progress>;
  /** As a preparer's. */
  ahead?: number;
}

/** A frame that was left out, and why. */
type Problem = { index: number; name: string; error: Error };

export type RunEvent =
  | { type: 'prepared'; index: number; name: string; milliseconds: Milliseconds }
  | { type: 'registered'; index: number; name: string; milliseconds: Milliseconds; progress: Progress }
  | { type: 'problem'; index: number; name: string; error: Error }
  | { type: 'replaced'; index: number; name: string }
  | { type: 'step'; milliseconds: Milliseconds; progress: Progress };

type Outcome = { state: 'done' | 'stopped'; numRegistered: number; problems: Problem[] };

/** So many frames more than there are workers are prepared or being prepared at a time: what bounds the memory. */
const FRAMES_AHEAD = 4;
/** A frame on which this many workers died is left out. */
const MAX_DEATHS = 2;

/**
 * One reconstruction. Frames are added, and `run` works until all are placed; after a stop, or when more frames were
 * added, `run` goes on.
 */
export class SpatialRun<J extends Job> {
  /** Whether more frames are expected: `run` then waits for them, and leaves what is to be done after the last one. */
  isOpen = false;
  #registrar: Registrar<J>;
  #preparers: Preparer<J>[];
  #tell: (event: RunEvent) => void;
  #maxInFlight;
  #frames: FrameQueue<J> = new FrameQueue();
  #decodeConfig: string | null = null;
  /** What the registrar is still at; a stop does not wait for it, the next run does. */
  #registering: Promise<void> = Promise.resolve();
  #session: Session | null = null;
  #problems: Problem[] = [];

  /** @param parts.maxInFlight frames prepared or being prepared at a time */
  constructor({
    registrar,
    preparers,
    onEvent = () => {},
    maxInFlight = numAhead(preparers) + FRAMES_AHEAD,
  }: {
    registrar: Registrar<J>;
    preparers: Preparer<J>[];
    onEvent?: (event: RunEvent) => void;
    maxInFlight?: number;
  }) {
    this.#registrar = registrar;
    this.#preparers = preparers;
    this.#tell = onEvent;
    this.#maxInFlight = Math.max(1, maxInFlight);
  }

  /** More frames, which come after those there are. */
  add(jobs: readonly J[]) {
    for (const job of jobs) this.#frames.add(job);
    this.#session?.changed();
  }

  /** Whether `run` is at work, and takes in what is added. */
  get isWorking() {
    return this.#session !== null;
  }

  /** Frames that were added. */
  get total() {
    return this.#frames.length;
  }

  /**
   * Works until every frame is placed or left out. When the signal aborts, it answers at once and keeps what is done.
   * @returns rejects only where nothing can go on: the registrar failed, or no worker can be started
   */
  async run(signal?: AbortSignal): Promise<Outcome> {
    if (this.#session) throw new Error('It is running already.');
    const session = new Session(signal);
    this.#session = session;
    try {
      await Promise.race([this.#work(session), session.stopped]);
    } finally {
      session.end();
      this.#frames.release();
      this.#session = null;
    }
    const { numRegistered } = this.#frames;
    return { state: signal?.aborted ? 'stopped' : 'done', numRegistered, problems: [...this.#problems] };
  }

  async #work(session: Session) {
    await this.#registering;
    if (session.isOver) return;
    await this.#begin(session);
    if (this.#decodeConfig === null || session.isOver) return;
    const orders = this.#preparers.flatMap((preparer) => Array.from({ length: preparer.ahead ?? 1 }, () => preparer));
    const preparing = Promise.all(orders.map((preparer) => this.#prepareAll(preparer, session)));
    const hasEnded = preparing.then(() => session.endPreparing());
    const registering = this.#registerAll(session).then(() => session.finish());
    await Promise.all([registering, hasEnded]);
  }

  /** The first readable frame decides how all are prepared. */
  async #begin(session: Session) {
    while (this.#decodeConfig === null && !session.isOver) {
      const frame = this.#frames.waiting();
      if (!frame) return;
      try {
        const decodeConfig = await this.#registrar.begin(frame.job);
        this.#decodeConfig ??= decodeConfig;
      } catch (error) {
        if (!session.isOver) this.#leaveOut(frame, error);
      }
      await nextTurn();
    }
  }

  /** Claims frame after frame, as far ahead as may be. */
  async #prepareAll(preparer: Preparer<J>, session: Session) {
    while (!session.isOver && !session.isFinished) {
      const frame = this.#frames.waiting();
      if (!frame || this.#frames.numInFlight >= this.#maxInFlight) {
        await session.change();
        continue;
      }
      this.#frames.move(frame, 'preparing');
      const isAlive = await this.#prepare(frame, preparer, session);
      session.changed();
      if (!isAlive) return;
    }
  }

  /** Whether the preparer can go on. */
  async #prepare(frame: Frame<J>, preparer: Preparer<J>, session: Session) {
    const { index, name } = frame.job;
    for (let deaths = 0; ;) {
      try {
        const prepared = await preparer.prepare(frame.job, this.#decodeConfig ?? '', session.signal);
        if (session.isOver) return true;
        frame.prepared = prepared;
        this.#frames.move(frame, 'prepared');
        this.#tell({ type: 'prepared', index, name, milliseconds: prepared.milliseconds });
        return true;
      } catch (error) {
        const hasDied = error instanceof WorkerDied;
        const isBlamed = hasDied && !error.wasWaiting;
        deaths += Number(isBlamed);
        if (session.isOver && !hasDied) return true;
        if (!session.isOver && (!hasDied || deaths === MAX_DEATHS)) this.#leaveOut(frame, error);
        if (hasDied && !(await isReplaced(preparer))) {
          // Another worker may still do it.
          if (!session.isOver && frame.state === 'preparing') this.#frames.move(frame, 'waiting');
          return false;
        }
        if (session.isOver || frame.state === 'failed') return true;
        if (isBlamed) this.#tell({ type: 'replaced', index, name });
      }
    }
  }

  #leaveOut(frame: Frame<J>, thrown: unknown) {
    const error = thrown instanceof Error ? thrown : new Error(String(thrown));
    const { index, name } = frame.job;
    this.#frames.move(frame, 'failed');
    this.#problems.push({ index, name, error });
    this.#tell({ type: 'problem', index, name, error });
  }

  async #registerAll(session: Session) {
    const ahead = this.#registrar.ahead ?? 1;
    let [hasMore, numOrdered] = [true, 0];
    const failures: unknown[] = [];
    const order = (frame: Frame<J> | null) => {
      numOrdered += 1;
      const isOver = (frame ? this.#registerNext() : this.#finish()).then(
        (stage) => (hasMore = stage !== 'done'),
        (error) => failures.push(error),
      );
      this.#registering = Promise.all([this.#registering, isOver]).then(() => {
        numOrdered -= 1;
        session.changed();
      });
    };
    const isDone = () => !this.isOpen && !hasMore && numOrdered === 0 && this.#frames.next() === null;
    while (!session.isOver && failures.length === 0 && !isDone()) {
      const frame = this.#frames.next();
      if (frame && frame.state !== 'prepared' && numOrdered === 0 && session.hasEndedPreparing) {
        throw new Error('No worker can be started.');
      }
      if (frame ? frame.state === 'prepared' && numOrdered < ahead : !this.isOpen && hasMore && numOrdered === 0) {
        order(frame);
        await nextTurn();
      } else {
        await session.change();
      }
    }
    if (failures.length > 0) throw failures[0];
  }

  /** What is left to do after the last frame, or a piece of it. */
  async #finish() {
    const start = performance.now();
    const progress = await this.#registrar.finish();
    this.#tell({ type: 'step', milliseconds: { register: performance.now() - start }, progress });
    return progress.stage;
  }

  /** The frame whose turn it is. */
  async #registerNext() {
    const start = performance.now();
    const { frame, prepared } = this.#frames.take();
    const { index, name } = frame.job;
    try {
      const progress = await this.#registrar.place(prepared.bytes);
      this.#decodeConfig = progress.decodeConfig ?? this.#decodeConfig;
      this.#frames.move(frame, 'registered');
      const register = performance.now() - start;
      this.#tell({ type: 'registered', index, name, milliseconds: { ...prepared.milliseconds, register }, progress });
      return progress.stage;
    } catch (error) {
      this.#leaveOut(frame, error);
      // Bad input is reported; an engine that broke cannot go on.
      if ((error as Error).name !== 'ScanstitchError') throw error;
      return '';
    }
  }
}

/** One call of `run`: whether it is over, and word of every change to those who wait for one. */
class Session {
  isOver = false;
  /** Every frame is placed or left out. */
  isFinished = false;
  /** No preparer is left that could prepare another frame. */
  hasEndedPreparing = false;
  /** Fulfilled when the signal aborts. */
  stopped: Promise<void>;
  #controller = new AbortController();
  #waiting: (() => void)[] = [];
  #unlisten: () => void = () => {};

  constructor(signal?: AbortSignal) {
    this.stopped = new Promise((resolve) => {
      const stop = () => {
        this.end();
        resolve();
      };
      if (signal?.aborted) stop();
      signal?.addEventListener('abort', stop, { once: true });
      this.#unlisten = () => signal?.removeEventListener('abort', stop);
    });
  }

  get signal() {
    return this.#controller.signal;
  }

  end() {
    if (this.isOver) return;
    this.isOver = true;
    this.#unlisten();
    this.#controller.abort();
    this.changed();
  }

  finish() {
    this.isFinished = true;
    this.changed();
  }

  endPreparing() {
    this.hasEndedPreparing = true;
    this.changed();
  }

  change(): Promise<void> {
    return this.isOver || this.isFinished ? Promise.resolve() : new Promise((resolve) => this.#waiting.push(resolve));
  }

  changed() {
    for (const resolve of this.#waiting.splice(0)) resolve();
  }
}

function numAhead<J extends Job>(preparers: readonly Preparer<J>[]) {
  return preparers.reduce((sum, { ahead = 1 }) => sum + ahead, 0);
}

async function isReplaced<J extends Job>(preparer: Preparer<J>) {
  try {
    await preparer.replace();
    return true;
  } catch {
    return false;
  }
}

/** Lets messages and a stop come in between two frames; timers would be slow in a tab in the background. */
export function nextTurn() {
  return new Promise((resolve) => {
    if (typeof setImmediate === 'function') {
      setImmediate(resolve);
      return;
    }
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve(undefined);
    };
    port2.postMessage(null);
  });
}
