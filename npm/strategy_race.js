// @ts-check
/**
 * Runs strategies side by side, frame by frame, with a clock: what places the frames for a `SpatialRun`. It is the same on the
 * command line and in a worker of the page.
 */
import { nextTurn } from './spatial_run.js';

/** @typedef {import('../pkg/scanstitch.js').StrategyFrame} StrategyFrame */
/** @typedef {{ frame: StrategyFrame, milliseconds: number }} Placed */

/**
 * Strategies, in this thread or in another one.
 * @typedef {object} Comparison
 * @property {(bytes: Uint8Array) => void | Promise<void>} offer
 * @property {(strategy: number) => Placed | Promise<Placed>} place
 */

/**
 * The engine's comparison with a clock.
 * @param {Pick<import('../pkg/scanstitch.js').StrategyComparison, 'offer' | 'step'>} comparison
 * @returns {{ offer: (bytes: Uint8Array) => void, place: (strategy: number) => Placed }}
 */
export function timed(comparison) {
  return {
    offer: (bytes) => comparison.offer(bytes),
    place: (strategy) => {
      const start = performance.now();
      const frame = comparison.step(strategy);
      return { frame, milliseconds: performance.now() - start };
    },
  };
}

export class StrategyRace {
  /** What each frame took, of each strategy (ms). @type {number[][]} */
  milliseconds;
  #comparison;
  /** @type {boolean[]} */
  #runs;
  #tell;
  #numOffered = 0;
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

  /** Places a frame by every strategy that goes on. @param {Uint8Array} bytes */
  async place(bytes) {
    await this.#comparison.offer(bytes);
    this.#numOffered += 1;
    for (const [strategy, times] of this.milliseconds.entries()) {
      if (!this.#runs[strategy] || this.#isOver()) continue;
      const { frame, milliseconds } = await this.#comparison.place(strategy);
      times.push(milliseconds);
      this.#tell(strategy, frame, milliseconds);
      await nextTurn();
    }
    const done = this.#numOffered;
    return { stage: 'register', done, total: done, frame: done - 1 };
  }

  /** Nothing is left to do after the last frame. */
  finish() {
    const done = this.#numOffered;
    return { stage: 'done', done, total: done, frame: null };
  }
}
