import type { Pose } from './map-painter.js';
import type { PointSet } from './point-layer.js';

const NUM_BINS = 180;
/** A scanner that leaves this much of the circle unseen looks somewhere; one that sees more looks everywhere. */
const SMALLEST_GAP = Math.PI / 3;
/** A direction counts as seen when this share of the frames has a return there: a few odd frames decide nothing. */
const SEEN_BY = 0.2;
/** Number of frames from which the direction is determined. */
const MAX_FRAMES = 50;

/**
 * Which way the scanner looks, as an angle in its own frame: the middle of the sector in which it has returns. Files of
 * points do not say it, and half the world mounts scanners with x forward, the other half with y. Zero, the x axis, for
 * one that sees all around.
 */
export function lookDirection({ points, offsets }: PointSet, poses: readonly Pose[]): number {
  const numSeen = new Uint16Array(NUM_BINS);
  const stride = Math.max(1, Math.ceil(poses.length / MAX_FRAMES));
  let num_frames = 0;
  for (let frame = 0; frame < poses.length; frame += stride) {
    const seen = seenBins(points, offsets[frame] ?? 0, offsets[frame + 1] ?? 0, poses[frame] as Pose);
    if (seen.size > 0) num_frames++;
    for (const bin of seen) numSeen[bin] = (numSeen[bin] ?? 0) + 1;
  }
  const isSeen = Uint8Array.from(numSeen, (count) => (count > 0 && count >= SEEN_BY * num_frames ? 1 : 0));
  const { start, length } = longestGap(isSeen);
  if (length === NUM_BINS || (length / NUM_BINS) * 2 * Math.PI < SMALLEST_GAP) return 0;
  const middle = start + length / 2 + NUM_BINS / 2;
  return ((((middle % NUM_BINS) / NUM_BINS) * 2 * Math.PI + Math.PI) % (2 * Math.PI)) - Math.PI;
}

/** The bins of the bearings, in the scanner's own frame, in which one frame has returns. */
function seenBins(points: Float32Array, first: number, last: number, pose: Pose): Set<number> {
  const seen = new Set<number>();
  for (let i = 2 * first; i < 2 * last; i += 2) {
    const bearing = Math.atan2((points[i + 1] as number) - pose.y, (points[i] as number) - pose.x) - pose.theta;
    const turn = bearing / (2 * Math.PI);
    seen.add(Math.floor((turn - Math.floor(turn)) * NUM_BINS) % NUM_BINS);
  }
  return seen;
}

/** The longest run of zeros around the circle. */
function longestGap(isSeen: Uint8Array): { start: number; length: number } {
  let best = { start: 0, length: 0 };
  let length = 0;
  for (let i = 0; i < 2 * isSeen.length; i++) {
    length = isSeen[i % isSeen.length] === 0 ? Math.min(length + 1, isSeen.length) : 0;
    if (length > best.length) best = { start: i - length + 1, length };
  }
  return best;
}
