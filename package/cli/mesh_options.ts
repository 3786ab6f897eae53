/** What `reconstruct --mesh` asks for. */
import { extname } from 'node:path';
import { TRIANGLES } from '../mesh/decimate.js';
import { MESH_FORMATS } from '../mesh/files.js';
import { CommandError } from './command.js';

export type MeshOptions = { path: string; voxelSize: number | undefined; maxTriangles: number | undefined };

/** What `--mesh`, `--mesh-voxel` and `--mesh-triangles` ask for. */
export function readMeshOptions(
  path: string | undefined,
  voxel: string | undefined,
  triangles: string | undefined,
): MeshOptions | undefined {
  if (path === undefined) {
    if (voxel !== undefined) throw new CommandError('--mesh-voxel is the size of the voxels of --mesh FILE.');
    if (triangles !== undefined)
      throw new CommandError('--mesh-triangles is how many triangles --mesh FILE has at most.');
    return undefined;
  }
  if (!formatOf(path)) throw new CommandError(`--mesh ${path}: the name ends in one of .${MESH_FORMATS.join(', .')}.`);
  const voxelSize = voxel === undefined ? undefined : Number(voxel);
  if (voxelSize !== undefined && !(voxelSize >= 0.001 && voxelSize <= 1)) {
    throw new CommandError(`--mesh-voxel ${voxel}: give a number of metres from 0.001 to 1.`);
  }
  const maxTriangles = triangles === undefined ? undefined : Number(triangles);
  const { least, most } = TRIANGLES;
  if (
    maxTriangles !== undefined &&
    !(Number.isInteger(maxTriangles) && maxTriangles >= least && maxTriangles <= most)
  ) {
    throw new CommandError(`--mesh-triangles ${triangles}: give a whole number from ${least} to ${most}.`);
  }
  return { path, voxelSize, maxTriangles };
}

/** The format that the name of a file asks for. */
export function formatOf(path: string) {
  return MESH_FORMATS.find((format) => extname(path).toLowerCase() === `.${format}`);
}
