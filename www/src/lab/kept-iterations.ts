/** A cache of the iterations that were shown. */
import type { LabIteration } from './protocol.js';

/** Pairs that are kept; the oldest iterations go first. */
const MAX_KEPT_PAIRS = 2_000_000;

export class KeptIterations {
  #kept = new Map<string, LabIteration>();

  get(run: number, at: number): LabIteration | undefined {
    return this.#kept.get(keyOf(run, at));
  }

  keep(run: number, at: number, iteration: LabIteration): void {
    this.#kept.set(keyOf(run, at), iteration);
    let count = 0;
    for (const kept of this.#kept.values()) count += numPairs(kept);
    for (const [oldest, kept] of this.#kept) {
      if (count <= MAX_KEPT_PAIRS || kept === iteration) return;
      this.#kept.delete(oldest);
      count -= numPairs(kept);
    }
  }

  /** Those of one run. */
  forget(run: number): void {
    for (const key of this.#kept.keys()) if (key.startsWith(keyOf(run, ''))) this.#kept.delete(key);
  }

  clear(): void {
    this.#kept.clear();
  }
}

const keyOf = (run: number, at: number | ''): string => `${run} ${at}`;

const numPairs = ({ source, rejected_source }: LabIteration): number => source.length + rejected_source.length;
