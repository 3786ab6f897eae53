/** What `reconstruct --mesh` asks for. */
import { extname } from 'node:path';
import { TRIANGLES } from '../mesh/decimate.js';
import { MESH_FORMATS } from '../mesh/files.js';
import { CommandError } from './command.js';

export type MeshOptions = {
  path: string;
  voxelSize: number | undefined;
  maxTriangles: number | undefined;
  /** Holes are filled up to this extent (m), or as the voxels suggest. */
  fillHoles: number | 'auto' | undefined;
};

/** What `--mesh`, `--mesh-voxel`, `--mesh-triangles` and `--fill-holes` ask for. */
export function readMeshOptions(
  path: string | undefined,
  voxel: string | undefined,
  triangles: string | undefined,
  holes: string | undefined,
): MeshOptions | undefined {
  if (path === undefined) {
    if (voxel !== undefined) throw new CommandError('--mesh-voxel is the size of the voxels of --mesh FILE.');
    if (triangles !== undefined)
      throw new CommandError('--mesh-triangles is how many triangles --mesh FILE has at most.');
    if (holes !== undefined) throw new CommandError('--fill-holes is how large holes of --mesh FILE are filled.');
    return undefined;
  }
  if (!formatOf(path)) throw new CommandError(`--mesh ${path}: the name ends in one of .${MESH_FORMATS.join(', .')}.`);
  const voxelSize = voxel === undefined ? undefined : Number(voxel);
  if (voxelSize !== undefined && !(voxelSize >= 0.001 && voxelSize <= 1)) {
    throw new CommandError(`--mesh-voxel ${voxel}: give a number of metres from 0.001 to 1.`);
  }
  const fillHoles = holes === undefined || holes === 'auto' ? holes : Number(holes);
  if (typeof fillHoles === 'number' && !(fillHoles > 0 && fillHoles <= 10)) {
    throw new CommandError(`--fill-holes ${holes}: give a number of metres up to 10, or auto.`);
  }
  const maxTriangles = triangles === undefined ? undefined : Number(triangles);
  const { least, most } = TRIANGLES;
  if (
    maxTriangles !== undefined &&
    !(Number.isInteger(maxTriangles) && maxTriangles >= least && maxTriangles <= most)
  ) {
    throw new CommandError(`--mesh-triangles ${triangles}: give a whole number from ${least} to ${most}.`);
  }
  return { path, voxelSize, maxTriangles, fillHoles };
}

/** The format that the name of a file asks for. */
export function formatOf(path: string) {
  return MESH_FORMATS.find((format) => extname(path).toLowerCase() === `.${format}`);
}
