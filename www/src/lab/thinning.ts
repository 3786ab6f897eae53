/** Clouds with so many points that an iteration would take seconds: the notes on downsampled clouds, and the stride of surveys. */
import type { Message } from '../components/messages.js';
import { formatCount, formatLength } from '../views/format.js';
import type { LabFacts } from './protocol.js';

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
export const numLargest = ({ source_points, target_points }: LabFacts): number =>
  Math.max(source_points.length, target_points.length) / 3;

export function tooLarge(whole: LabFacts, voxel_size: number): Message {
  const text = `A cloud of ${formatCount(numLargest(whole))} points: both are thinned to one point in ${formatLength(voxel_size)}`;
  return { kind: 'note', file: '', place: '', text, remedy: 'The voxel size is under Methods; 0 uses all points' };
}
