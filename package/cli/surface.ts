/** The surface of a run of depth images: its files again, at the poses that the run gave them. */
import type { SpatialReconstruction, SpatialResult, Surface } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { type Engine, isScanstitchError } from './command.js';
import { writeWhole } from './disk.js';
import { formatOf, type MeshOptions } from './mesh_options.js';
import type { FrameJob } from './preparers.js';
import { readFirst } from './inputs.js';
import { note, print, progressLine } from './terminal.js';

/** Writes the surface of the frames whose pose is good, in the main piece. */
export async function writeSurface(
  engine: Engine,
  reconstruction: SpatialReconstruction,
  jobs: FrameJob[],
  { path, voxelSize }: MeshOptions,
  complain: (problem: string) => void,
) {
  const format = formatOf(path) ?? 'ply';
  const config = reconstruction.decode_config();
  if (config === undefined) return;
  let surface: Surface;
  try {
    surface = new engine.Surface(config, voxelSize === undefined ? {} : { voxel_size: voxelSize });
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(`--mesh ${path}: ${error.message}`);
    return;
  }
  try {
    const start = performance.now();
    await addFrames(surface, reconstruction.result(), jobs, complain);
    if (surface.num_triangles === 0) {
      complain(`--mesh ${path}: no surface was seen well enough, so nothing was written.`);
      return;
    }
    if (surface.voxel_size > (voxelSize ?? 0.02)) {
      note(`The surface has voxels of ${surface.voxel_size} m: smaller ones do not fit into 400 MB.`);
    }
    await writeWhole(
      path,
      format === 'glb' ? await (await import('../mesh/glb.js')).toGlb(surface) : surface.file(format),
    );
    const seconds = ((performance.now() - start) / 1000).toFixed(1);
    print(
      `Surface of ${surface.num_frames} frames: ${surface.num_triangles} triangles in ${seconds} s, written to ${printable(path)}\n`,
    );
  } finally {
    surface.free();
  }
}

async function addFrames(
  surface: Surface,
  { frames }: SpatialResult,
  jobs: FrameJob[],
  complain: (problem: string) => void,
) {
  const placed = frames.filter(({ status, piece }) => status === 'good' && piece === 0);
  if (placed.length < frames.length) {
    note(`The surface is of the ${placed.length} of ${frames.length} frames whose pose is good.`);
  }
  const progress = progressLine(placed.length);
  for (const [index, { index: job, name, T_world_sensor: T }] of placed.entries()) {
    const { file, color } = jobs[job] ?? {};
    if (!file) continue;
    try {
      const colors = color ? await readFirst(color.path, color).catch(() => undefined) : undefined;
      surface.add(name, await readFirst(name, file), colors, Float64Array.of(T.x, T.y, T.z, T.qx, T.qy, T.qz, T.qw));
    } catch (error) {
      if (!isScanstitchError(error)) throw error;
      complain(error.message);
    }
    progress.show(index + 1);
  }
  progress.clear();
}
