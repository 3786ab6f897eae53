// @ts-check
/**
 * The frames of a run in their order, each with its state. Every question is answered from counts and two positions:
 * no call goes through all frames, so that a run costs as much for its last frame as for its first.
 */

/** @typedef {'waiting' | 'preparing' | 'prepared' | 'registered' | 'failed'} State failed: left out, and told */
/** @typedef {import('./spatial_run.js').Job} Job */
/** @typedef {import('./spatial_run.js').Prepared} Prepared */

/**
 * One frame of a run.
 * @template {Job} J
 */
export class Frame {
  /** @type {J} */
  job;
  /** Its place among all frames. @type {number} */
  position;
  /** What a preparer made of it, until the registrar takes it. @type {Prepared | null} */
  prepared = null;
  /** @type {State} */
  #state = 'waiting';

  /** @param {J} job @param {number} position */
  constructor(job, position) {
    this.job = job;
    this.position = position;
  }

  get state() {
    return this.#state;
  }

  /** For the queue alone, which counts the states. @param {State} state */
  set state(state) {
    this.#state = state;
  }
}

/**
 * All frames of a run.
 * @template {Job} J
 */
export class FrameQueue {
  /** @type {Frame<J>[]} */
  #frames = [];
  /** Frames in each state. */
  #counts = { waiting: 0, preparing: 0, prepared: 0, registered: 0, failed: 0 };
  /** No frame before this position is waiting. */
  #firstWaiting = 0;
  /** Frames before this position were given to the registrar or left out. */
  #next = 0;

  /** @param {J} job comes after those there are */
  add(job) {
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

  /** The first frame that nobody has claimed. @returns {Frame<J> | null} */
  waiting() {
    if (this.#counts.waiting === 0) return null;
    while (this.#frames[this.#firstWaiting]?.state !== 'waiting') this.#firstWaiting += 1;
    return this.#frames[this.#firstWaiting] ?? null;
  }

  /** The frame whose turn it is to be registered; null after the last one. @returns {Frame<J> | null} */
  next() {
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

  /** @param {Frame<J>} frame @param {State} state */
  move(frame, state) {
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
