/** The voxel size for clouds with so many points that an iteration takes a second, for the lab and the command line. */

/** Clouds with more points are thinned: an iteration of them takes a second or more on one core. */
export const MOST_POINTS = 300_000;
/** So many are left at most: an iteration takes a tenth of a second. */
const KEPT_POINTS = 100_000;
/** The finest voxels that are tried are this share of the target's reach. */
const FINEST_SHARE = 1e-3;

/**
 * Side of voxels (m) that leave few enough points.
 * @param target x y z x y z ... (m)
 * @param count points of the larger cloud with voxels of a side
 */
export async function voxelFor(
  target: Float32Array,
  count: (voxel_size: number) => number | Promise<number>,
): Promise<number> {
  const reach = target.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  for (let side = FINEST_SHARE * reach; ; side *= 2) {
    const voxel_size = Number(side.toPrecision(1));
    if (side >= reach || (await count(voxel_size)) <= KEPT_POINTS) return voxel_size;
  }
}
