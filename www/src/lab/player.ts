/** Plays the iterations of a run: the source moves from pose to pose, and rests at each while its new pairs are seen. */

/** A whole run takes about this long, but no iteration is shorter or longer than these. */
const FILM_MS = 9000;
const SHORTEST_MS = 70;
const LONGEST_MS = 1000;
/** Share of an iteration's time in which the source moves; then it rests and its pairs are drawn. */
const MOVING_SHARE = 0.55;

export class Player {
  /** Number of iterations done; fractions are positions during the animation of a step. */
  at = 0;
  /** Iterations of the run. */
  count = 0;
  isPlaying = false;
  /** Factor on the playing speed. */
  speed = 1;
  #goal: number | null = null;
  #started = 0;
  #from = 0;
  #frame = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;
  readonly #onMove: () => void;
  readonly #onArrived: () => void;

  /** `onMove`: `at` has changed; `onArrived`: the source rests at a whole iteration. */
  constructor(onMove: () => void, onArrived: () => void) {
    this.#onMove = onMove;
    this.#onArrived = onArrived;
  }

  /** On the way to an iteration. */
  get isMoving(): boolean {
    return this.#goal !== null;
  }

  get iterationMs(): number {
    return Math.min(Math.max(FILM_MS / Math.max(this.count, 1), SHORTEST_MS), LONGEST_MS) / this.speed;
  }

  reset(count: number): void {
    this.stop();
    this.count = count;
    this.at = 0;
  }

  play(): void {
    if (this.count === 0) return;
    if (this.at >= this.count) this.at = 0;
    this.isPlaying = true;
    this.#go(Math.min(Math.floor(this.at) + 1, this.count));
  }

  pause(): void {
    clearTimeout(this.#timer);
    this.isPlaying = false;
    this.#onMove();
  }

  /** One iteration on or back. */
  step(direction: 1 | -1): void {
    this.stop();
    const next = direction > 0 ? Math.floor(this.at) + 1 : Math.ceil(this.at) - 1;
    if (direction > 0 && next <= this.count) this.#go(next);
    else this.seek(next);
  }

  seek(at: number): void {
    this.stop();
    this.at = Math.min(Math.max(at, 0), this.count);
    this.#arrive();
  }

  /** Rests where it is. */
  stop(): void {
    clearTimeout(this.#timer);
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    if (this.#goal !== null) this.at = this.#goal;
    this.#goal = null;
    this.isPlaying = false;
  }

  #go(goal: number): void {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) {
      this.at = goal;
      this.#arrive();
      return;
    }
    this.#goal = goal;
    this.#from = this.at;
    this.#started = performance.now();
    this.#frame = requestAnimationFrame(this.#advance);
  }

  #advance = (): void => {
    if (this.#goal === null) return;
    const share = Math.min((performance.now() - this.#started) / (this.iterationMs * MOVING_SHARE), 1);
    const ease = share * share * (3 - 2 * share);
    this.at = this.#from + (this.#goal - this.#from) * ease;
    if (share < 1) {
      this.#frame = requestAnimationFrame(this.#advance);
      this.#onMove();
      return;
    }
    this.at = this.#goal;
    this.#goal = null;
    this.#arrive();
  };

  #arrive(): void {
    if (this.at >= this.count) this.isPlaying = false;
    this.#onArrived();
    if (!this.isPlaying) return;
    this.#timer = setTimeout(() => this.#go(Math.min(this.at + 1, this.count)), this.iterationMs * (1 - MOVING_SHARE));
  }
}
