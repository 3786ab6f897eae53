// @ts-check
/**
 * Runs strategies side by side, frame by frame, with a clock: what places the frames for a `SpatialRun`. It is the same on the
 * command line and in a worker of the page.
 */
import { nextTurn } from './spatial_run.js';

/** @typedef {import('../pkg/scanstitch.js').StrategyFrame} StrategyFrame */
/** @typedef {Pick<import('../pkg/scanstitch.js').StrategyComparison, 'offer' | 'step'>} Comparison */

export class StrategyRace {
  /** What each frame took, of each strategy (ms). @type {number[][]} */
  milliseconds;
  #comparison;
  /** @type {boolean[]} */
  #runs;
  #tell;
  #numOffered = 0;
  #hasFrame = false;
  #isOver = () => false;

  /**
   * @param {Comparison} comparison
   * @param {number} count strategies
   * @param {object} [options]
   * @param {(strategy: number, frame: StrategyFrame, milliseconds: number) => void} [options.onFrame]
   * @param {() => boolean} [options.isOver] whether the frame at hand is to be left as it is
   */
  constructor(comparison, count, { onFrame = () => {}, isOver = () => false } = {}) {
    this.#comparison = comparison;
    this.#runs = Array.from({ length: count }, () => true);
    this.milliseconds = Array.from({ length: count }, () => []);
    this.#tell = onFrame;
    this.#isOver = isOver;
  }

  /** Leaves a strategy as it stands: the others go on without it. @param {number} strategy */
  retire(strategy) {
    this.#runs[strategy] = false;
  }

  /** @param {number} strategy */
  isRetired(strategy) {
    return !this.#runs[strategy];
  }

  /** Whether no strategy goes on. */
  get isEmpty() {
    return !this.#runs.includes(true);
  }

  /** @param {Uint8Array} bytes */
  add_prepared(bytes) {
    this.#comparison.offer(bytes);
    this.#numOffered += 1;
    this.#hasFrame = true;
  }

  /** Places the frame by every strategy that goes on. */
  async step() {
    const done = this.#numOffered;
    if (!this.#hasFrame) return { stage: 'done', done, total: done, frame: null };
    this.#hasFrame = false;
    for (const [strategy, times] of this.milliseconds.entries()) {
      if (!this.#runs[strategy] || this.#isOver()) continue;
      const start = performance.now();
      const frame = this.#comparison.step(strategy);
      const milliseconds = performance.now() - start;
      times.push(milliseconds);
      this.#tell(strategy, frame, milliseconds);
      await nextTurn();
    }
    return { stage: 'register', done, total: done, frame: done - 1 };
  }
}
