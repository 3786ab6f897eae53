/** Clouds of so many points that an iteration would take seconds: they are thinned before they are registered. */
import type { Message } from '../components/messages.js';
import { formatCount, formatLength } from '../views/format.js';
import type { LabFacts } from './protocol.js';

/** Clouds with more points are thinned: an iteration of them takes a second or more on one core. */
export const MOST_POINTS = 300_000;
/** So many are left at most: an iteration takes a tenth of a second. */
const KEPT_POINTS = 100_000;
/** The finest voxels that are tried are this share of the target's reach. */
const FINEST_SHARE = 1e-3;

/** So many points of a source in space are registered from each of hundreds of starts: the picture is that of all. */
const SURVEYED_POINTS = 5000;

/**
 * Every so-many-th source point that surveys use. It is odd, so that of images, whose widths are even, no columns are left out.
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

/** Side of voxels (m) that leave few enough points; `prepare` makes the clouds ready with voxels of a side. */
export async function voxelFor(whole: LabFacts, prepare: (size: number) => Promise<LabFacts>): Promise<number> {
  const reach = whole.target_points.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  for (let side = FINEST_SHARE * reach; ; side *= 2) {
    const voxel_size = Number(side.toPrecision(1));
    if (side >= reach || numLargest(await prepare(voxel_size)) <= KEPT_POINTS) return voxel_size;
  }
}

export function tooLarge(whole: LabFacts, voxel_size: number): Message {
  const text = `A cloud of ${formatCount(numLargest(whole))} points: both are thinned to one point in ${formatLength(voxel_size)}`;
  return { kind: 'note', file: '', place: '', text, remedy: 'The voxel size is under Methods; 0 uses all points' };
}
