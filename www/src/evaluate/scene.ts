/** What all figures of an evaluation share: the comparisons, the one that is selected, colours, and the common axis. */
import { type Colors, type Range, rangeOf } from '../views/axes.js';
import { nearestIndex } from '../views/figures.js';
import type { Comparison } from './protocol.js';

/** What is plotted to the right. */
export type Abscissa = 'seconds' | 'distance' | 'number';

export const ABSCISSA_NAMES: Record<Abscissa, string> = {
  seconds: 'time (s)',
  distance: 'distance travelled (m)',
  number: 'pose',
};

export interface Scene {
  comparisons: readonly Comparison[];
  selected: Comparison | null;
  colors: Colors;
  colorOf(comparison: Comparison): string;
  abscissa: Abscissa;
  /** Value of each pose on the common axis. */
  xOf(comparison: Comparison): ArrayLike<number>;
  xRange: Range;
}

/** Time only where every estimate has it. */
export function possibleAbscissa(wanted: Abscissa, comparisons: readonly Comparison[]): Abscissa {
  return wanted === 'seconds' && comparisons.some(({ stamps }) => stamps === null) ? 'number' : wanted;
}

/** The values of all comparisons on the common axis; times count from the first of all. */
export function makeAbscissas(
  abscissa: Abscissa,
  comparisons: readonly Comparison[],
): { values: ReadonlyMap<number, ArrayLike<number>>; range: Range } {
  const first = rangeOf(comparisons.map(({ stamps }) => stamps ?? [])).low;
  const values = new Map<number, ArrayLike<number>>(
    comparisons.map(({ id, stamps, distances }) => {
      if (abscissa === 'seconds' && stamps) return [id, stamps.map((stamp) => stamp - first)];
      return [id, abscissa === 'distance' ? distances : Float64Array.from(distances, (_, i) => i)];
    }),
  );
  // Times that go back are drawn as they are, so the ends are not always the first and the last.
  return { values, range: rangeOf([...values.values()]) };
}

/** The pose nearest to an instant on the common axis, and its error; null where there are no poses. */
export function poseAtInstant(
  scene: Scene,
  comparison: Comparison,
  instant: number,
): { pose: number; x: number; error: number | null } | null {
  const xs = scene.xOf(comparison);
  if (xs.length === 0) return null;
  const pose = nearestIndex(xs, instant);
  const index = nearestIndex(comparison.error_poses, pose);
  return { pose, x: xs[pose] as number, error: comparison.errors[index] ?? null };
}
