/** Clouds with so many points that an iteration would take seconds: the notes on downsampled clouds, and the stride of surveys. */
import { MOST_POINTS, voxelFor } from '../../../package/lab/thinning.js';
import type { Message } from '../components/messages.js';
import { formatCount, formatLength } from '../views/format.js';
import type { LabFacts } from './protocol.js';

/** Largest number of source points that are paired while the source is dragged: this takes one or two pictures (33 ms). */
const MAX_FOLLOWED_POINTS = 8000;
/** Number of source points in space that are registered from each of hundreds of starts: all points give nearly the same. */
const SURVEYED_POINTS = 5000;

/**
 * Stride of the source points that surveys use. It is odd, so that no columns of images, whose widths are even, are left out.
 * In the plane all are used.
 */
export function surveyStride({ is_planar, source_points }: LabFacts): number {
  const stride = is_planar ? 1 : Math.ceil(source_points.length / 3 / SURVEYED_POINTS);
  return stride + (1 - (stride % 2));
}

/** ", 1 of 15 source points"; nothing where all are used. */
export const strideWords = (stride: number): string => (stride > 1 ? `, 1 of ${stride} source points` : '');

/** Points of the larger cloud. */
const numLargest = ({ source_points, target_points }: LabFacts): number =>
  Math.max(source_points.length, target_points.length) / 3;

export function tooLarge(whole: LabFacts, voxel_size: number): Message {
  const text = `A cloud of ${formatCount(numLargest(whole))} points: both are thinned to one point in ${formatLength(voxel_size)}`;
  return { kind: 'note', file: '', place: '', text, remedy: 'The voxel size is under Methods; 0 uses all points' };
}

/** Whether an iteration of such clouds would take seconds. */
export const isTooLarge = (facts: LabFacts): boolean => !facts.is_planar && numLargest(facts) > MOST_POINTS;

/** The voxel size (m) that leaves a number of points that can be used. */
export const voxelToThin = (facts: LabFacts, prepare: (voxel_size: number) => Promise<LabFacts>): Promise<number> =>
  voxelFor(facts.target_points, async (size) => numLargest(await prepare(size)));

/** Stride of the source points that are paired while the source is dragged. */
export function followedStride(facts: LabFacts | null): number {
  const num_points = (facts?.source_points.length ?? 0) / 3;
  return Math.max(1, Math.ceil(num_points / MAX_FOLLOWED_POINTS));
}
