/** Results in plain words. */
import { DEGREES, formatCount, formatFixed, formatLength, formatPercent, plural } from './format.js';

interface Matched {
  num_correspondences: number;
  num_inliers: number;
  fitness: number;
  inlier_rmse: number;
  iterations: number;
  converged: boolean;
}

/** What the alignment of one scan found. */
export function frameSummary(frame: Matched, index: number): string {
  if (frame.iterations === 0) {
    return index === 0 ? 'This scan is the origin of the map.' : 'This scan was not registered.';
  }
  const found = `${formatCount(frame.num_inliers)} points (${formatPercent(frame.fitness)}) were matched, with an rmse of ${formatLength(frame.inlier_rmse)}`;
  const settled = frame.converged
    ? `the pose converged after ${plural(frame.iterations, 'iteration')}`
    : `the pose did not converge within ${plural(frame.iterations, 'iteration')}`;
  return `${found}; ${settled}.`;
}

interface Cleaning {
  num_read: number;
  non_finite: number;
  too_near: number;
  at_range_limit: number;
  duplicates: number;
  num_kept: number;
}

/** "175 of 180 used; left out: 4 at the range limit, 1 duplicate". */
export function cleaningWords(cleaning: Cleaning): string {
  const parts = cleaningParts(cleaning);
  const used = `${formatCount(cleaning.num_kept)} of ${formatCount(cleaning.num_read)} used`;
  return parts.length === 0 ? used : `${used}; left out: ${parts.join(', ')}`;
}

export function cleaningParts(cleaning: Cleaning): string[] {
  const parts: [number, string][] = [
    [cleaning.non_finite, 'not a number'],
    [cleaning.too_near, 'too near'],
    [cleaning.at_range_limit, 'at the range limit'],
    [cleaning.duplicates, cleaning.duplicates === 1 ? 'duplicate' : 'duplicates'],
  ];
  return parts.filter(([count]) => count > 0).map(([count, what]) => `${formatCount(count)} ${what}`);
}

/** All scans' cleaning in one. */
export function sumCleaning(reports: readonly Cleaning[]): Cleaning {
  const sum: Cleaning = { num_read: 0, non_finite: 0, too_near: 0, at_range_limit: 0, duplicates: 0, num_kept: 0 };
  for (const report of reports) {
    for (const name of Object.keys(sum) as (keyof Cleaning)[]) sum[name] += report[name];
  }
  return sum;
}

/** Which motion the scene leaves open. */
export function directionWords(direction: { x: number; y: number; theta: number }): string {
  if (Math.abs(direction.theta) > Math.hypot(direction.x, direction.y)) {
    return 'The view does not constrain the heading (degenerate geometry).';
  }
  const angle = (((Math.atan2(direction.y, direction.x) * DEGREES) % 180) + 180) % 180;
  return `The view does not constrain the position along one direction, ${formatFixed(angle, 0)}° in the map (degenerate geometry): walls that run that way look the same from anywhere along them.`;
}
