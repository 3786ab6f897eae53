/**
 * Runs strategies side by side, frame by frame, with a clock: what places the frames for a `SpatialRun`. It is the same on the
 * command line and in a worker of the page.
 */
import type { StrategyComparison, StrategyFrame } from '../../pkg/scanstitch.js';
import { nextTurn } from './spatial_run.js';

type Placed = { frame: StrategyFrame; milliseconds: number };

/** Strategies, in this thread or in another one. */
interface Comparison {
  offer: (bytes: Uint8Array) => void | Promise<void>;
  place: (strategy: number) => Placed | Promise<Placed>;
}

/** The engine's comparison with a clock. */
export function timed(comparison: Pick<StrategyComparison, 'offer' | 'step'>): {
  offer: (bytes: Uint8Array) => void;
  place: (strategy: number) => Placed;
} {
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
  /** What each frame took, of each strategy (ms). */
  milliseconds: number[][];
  #comparison;
  #runs: boolean[];
  #tell;
  #numOffered = 0;
  #isOver = () => false;

  /**
   * @param count strategies
   * @param options.isOver whether the frame at hand is to be left as it is
   */
  constructor(
    comparison: Comparison,
    count: number,
    {
      onFrame = () => {},
      isOver = () => false,
    }: {
      onFrame?: (strategy: number, frame: StrategyFrame, milliseconds: number) => void;
      isOver?: () => boolean;
    } = {},
  ) {
    this.#comparison = comparison;
    this.#runs = Array.from({ length: count }, () => true);
    this.milliseconds = Array.from({ length: count }, () => []);
    this.#tell = onFrame;
    this.#isOver = isOver;
  }

  /** Leaves a strategy as it stands: the others go on without it. */
  retire(strategy: number) {
    this.#runs[strategy] = false;
  }

  /** Places a frame by every strategy that goes on. */
  async place(bytes: Uint8Array) {
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
