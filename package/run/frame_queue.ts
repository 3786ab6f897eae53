/**
 * The frames of a run in their order, each with its state. Every question is answered from counts and two positions:
 * no call goes through all frames, so that a run costs as much for its last frame as for its first.
 */

/** A frame; the preparer knows what else is in it. */
export type Job = { index: number; name: string };
/** Of each stage. */
export type Milliseconds = Record<string, number>;
export type Prepared = { bytes: Uint8Array; milliseconds: Milliseconds };
/** failed: left out, and told */
type State = 'waiting' | 'preparing' | 'prepared' | 'registered' | 'failed';

/** One frame of a run. */
export class Frame<J extends Job> {
  job: J;
  /** Its place among all frames. */
  position: number;
  /** What a preparer made of it, until the registrar takes it. */
  prepared: Prepared | null = null;
  #state: State = 'waiting';

  constructor(job: J, position: number) {
    this.job = job;
    this.position = position;
  }

  get state() {
    return this.#state;
  }

  /** For the queue alone, which counts the states. */
  set state(state: State) {
    this.#state = state;
  }
}

/** All frames of a run. */
export class FrameQueue<J extends Job> {
  #frames: Frame<J>[] = [];
  /** Frames in each state. */
  #counts = { waiting: 0, preparing: 0, prepared: 0, registered: 0, failed: 0 };
  /** No frame before this position is waiting. */
  #firstWaiting = 0;
  /** Frames before this position were given to the registrar or left out. */
  #next = 0;

  /** @param job comes after those there are */
  add(job: J) {
    const last = this.#frames.at(-1)?.job;
    if (last && job.index <= last.index) {
      throw new RangeError(`Frame ${job.index} (${job.name}) cannot come after frame ${last.index}.`);
    }
    this.#frames.push(new Frame(job, this.#frames.length));
    this.#counts.waiting += 1;
  }

  get length() {
    return this.#frames.length;
  }

  get numRegistered() {
    return this.#counts.registered;
  }

  /** Frames that are being prepared, or are prepared and not yet registered: those that take memory. */
  get numInFlight() {
    return this.#counts.preparing + this.#counts.prepared;
  }

  /** The first frame that nobody has claimed. */
  waiting(): Frame<J> | null {
    if (this.#counts.waiting === 0) return null;
    while (this.#frames[this.#firstWaiting]?.state !== 'waiting') this.#firstWaiting += 1;
    return this.#frames[this.#firstWaiting] ?? null;
  }

  /** The frame whose turn it is to be registered; null after the last one. */
  next(): Frame<J> | null {
    while (this.#frames[this.#next]?.state === 'failed') this.#next += 1;
    return this.#frames[this.#next] ?? null;
  }

  /** Takes what was prepared of the next frame; its state stays until the registrar has answered. */
  take() {
    const frame = this.next();
    const prepared = frame?.prepared;
    if (!frame || !prepared) throw new Error('The next frame is not prepared.');
    frame.prepared = null;
    this.#next += 1;
    return { frame, prepared };
  }

  move(frame: Frame<J>, state: State) {
    this.#counts[frame.state] -= 1;
    this.#counts[state] += 1;
    frame.state = state;
    if (state === 'waiting') this.#firstWaiting = Math.min(this.#firstWaiting, frame.position);
  }

  /** Frames that are being prepared wait again, as after a stop. */
  release() {
    for (let position = this.#next; this.#counts.preparing > 0; position += 1) {
      const frame = this.#frames[position];
      if (frame?.state === 'preparing') this.move(frame, 'waiting');
    }
  }
}
