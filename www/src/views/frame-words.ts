/** What became of one scan or frame, in plain words. */
import { type Cleaning, cleaningParts } from './cleaning.js';
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

/** "175 of 180 used; left out: 4 at the range limit, 1 duplicate". */
export function cleaningWords(cleaning: Cleaning): string {
  const parts = cleaningParts(cleaning);
  const used = `${formatCount(cleaning.num_kept)} of ${formatCount(cleaning.num_read)} used`;
  return parts.length === 0 ? used : `${used}; left out: ${parts.join(', ')}`;
}

/** Which motion the scene leaves open. */
export function directionWords(direction: { x: number; y: number; theta: number }): string {
  if (Math.abs(direction.theta) > Math.hypot(direction.x, direction.y)) {
    return 'The view does not constrain the heading (degenerate geometry).';
  }
  const angle = (((Math.atan2(direction.y, direction.x) * DEGREES) % 180) + 180) % 180;
  return `The view does not constrain the position along one direction, ${formatFixed(angle, 0)}° in the map (degenerate geometry): walls that run that way look the same from anywhere along them.`;
}
