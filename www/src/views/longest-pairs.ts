/** The pairs of a registration that contribute most to its residual: what to look at where a scan fits worse than others. */

/** Which pairs of the selected scan are drawn. */
export type ShownPairs = 'none' | 'longest' | 'all';

/** One in so many. */
const SHARE = 10;

export interface LongestPairs {
  /** x y x y quadruples of the longest tenth, from the longest on. */
  drawn: Float32Array;
  count: number;
  total: number;
  /** m. */
  longest: number;
  median: number;
  /** Share of the sum of squared lengths that the drawn ones have. */
  share: number;
}

/** `pairs`: x y x y quadruples, source and target. */
export function longestPairs(pairs: Float32Array): LongestPairs {
  const at = (pair: number, k: number): number => pairs[4 * pair + k] ?? 0;
  const lengths = Float64Array.from({ length: pairs.length / 4 }, (_, i) =>
    Math.hypot(at(i, 2) - at(i, 0), at(i, 3) - at(i, 1)),
  );
  const order = Array.from(lengths.keys()).sort((a, b) => (lengths[b] ?? 0) - (lengths[a] ?? 0));
  const chosen = order.slice(0, Math.ceil(order.length / SHARE));
  const squares = (some: readonly number[]): number => some.reduce((sum, i) => sum + (lengths[i] ?? 0) ** 2, 0);
  return {
    drawn: Float32Array.from(chosen.flatMap((i) => [0, 1, 2, 3].map((k) => at(i, k)))),
    count: chosen.length,
    total: order.length,
    longest: lengths[order[0] ?? 0] ?? 0,
    median: lengths[order[order.length >> 1] ?? 0] ?? 0,
    share: squares(chosen) / (squares(order) || 1),
  };
}
