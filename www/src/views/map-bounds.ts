/** Which part of the world a map's view is fitted to. */
import type { PointSet } from './point-layer.js';
import type { Bounds } from './viewport.js';

interface Place {
  x: number;
  y: number;
}

/** Largest number of points that are examined. */
const MAX_SAMPLES = 20_000;
/** Returns within this quantile of the ranges, or this many times their median, are to be in view. */
const NEAR_QUANTILE = 0.9;
const NEAR_MEDIANS = 2;
/** Of the near returns, this share on each side of each axis may be strays. */
const STRAYS = 0.005;

/**
 * The box of the path, of the reference, and of the returns of `frames` (all where none are given) that are not much further
 * from their scanner than most: a glimpse down a corridor must not shrink the rooms that were visited. Null when there is
 * nothing.
 */
export function mapBounds(
  { points, offsets }: PointSet,
  poses: readonly Place[],
  reference: readonly Place[] = [],
  frames: readonly number[] = Array.from({ length: offsets.length - 1 }, (_, frame) => frame),
): Bounds | null {
  const num_points = points.length / 2;
  const stride = Math.max(1, Math.ceil(num_points / MAX_SAMPLES));
  const xs = new Float32Array(Math.ceil(num_points / stride));
  const [ys, ranges] = [new Float32Array(xs.length), new Float32Array(xs.length)];
  let count = 0;
  for (const frame of frames) {
    const end = offsets[frame + 1] ?? 0;
    const pose = poses[frame];
    for (let i = Math.ceil((offsets[frame] ?? 0) / stride) * stride; i < end; i += stride) {
      const [x = 0, y = 0] = [points[2 * i], points[2 * i + 1]];
      xs[count] = x;
      ys[count] = y;
      ranges[count++] = pose ? Math.hypot(x - pose.x, y - pose.y) : 0;
    }
  }
  const sorted = ranges.slice(0, count).sort();
  const limit = Math.max(at(sorted, NEAR_QUANTILE), NEAR_MEDIANS * at(sorted, 0.5));
  const isNear = (_: number, i: number): boolean => i < count && (ranges[i] ?? 0) <= limit;
  const shown = [...frames.flatMap((frame) => poses[frame] ?? []), ...reference];
  const alongX = span(
    xs.filter(isNear).sort(),
    shown.map(({ x }) => x),
  );
  const alongY = span(
    ys.filter(isNear).sort(),
    shown.map(({ y }) => y),
  );
  return alongX && alongY && { minX: alongX[0], maxX: alongX[1], minY: alongY[0], maxY: alongY[1] };
}

/** From the least to the largest of all but the strays. */
function span(sorted: Float32Array, others: readonly number[]): [number, number] | null {
  const ends = sorted.length > 0 ? [at(sorted, STRAYS), at(sorted, 1 - STRAYS)] : [];
  const all = [...ends, ...others];
  return all.length === 0 ? null : [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
}

function at(sorted: Float32Array, quantile: number): number {
  return sorted[Math.round(quantile * (sorted.length - 1))] ?? 0;
}
