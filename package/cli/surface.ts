/** The surface of a run: its depth images again, or its clouds as they were kept, at the poses that the run gave them. */
import { basename, dirname, join } from 'node:path';
import type { SpatialReconstruction, Surface } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';
import { decimate } from '../mesh/decimate.js';
import { meshFile } from '../mesh/files.js';
import {
  addFrames,
  HOLE_VOXELS,
  MEMORY_MB,
  numbersAndPoses,
  type PlacedFrame,
  placedFrames,
  VOXEL_SIZE,
} from '../mesh/frames.js';
import { type Engine, isScanstitchError } from './command.js';
import { writeResults, writeWhole } from './disk.js';
import { splatFiles } from '../mesh/splats.js';
import { formatOf, type MeshOptions } from './mesh_options.js';
import type { FrameJob } from './preparers.js';
import { readFirst } from './inputs.js';
import { note, print, progressLine } from './terminal.js';

/** Writes the surface of the frames whose pose is good, in the main piece. */
export async function writeSurface(
  engine: Engine,
  reconstruction: SpatialReconstruction,
  jobs: FrameJob[],
  { path, voxelSize, maxTriangles, fillHoles }: MeshOptions,
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
    const result = reconstruction.result();
    const placed = placedFrames(result);
    if (placed.length < result.frames.length) {
      note(`The surface is of the ${placed.length} of ${result.frames.length} frames whose pose is good.`);
    }
    const order = surface.follow(...numbersAndPoses(placed), true);
    if (surface.is_of_clouds) putClouds(surface, reconstruction, order);
    else await addImages(surface, inOrder(placed, order), jobs, complain);
    if (surface.num_triangles === 0) {
      complain(`--mesh ${path}: no surface was seen well enough, so nothing was written.`);
      return;
    }
    // The engine has it in single precision.
    if (surface.voxel_size > Math.fround(voxelSize ?? VOXEL_SIZE)) {
      const why = surface.is_of_clouds
        ? 'the points lie too far apart for smaller ones'
        : `smaller ones do not fit into ${MEMORY_MB} MB`;
      note(`The surface has voxels of ${Number(surface.voxel_size.toPrecision(3))} m: ${why}.`);
    }
    if (surface.is_of_clouds && fillHoles !== undefined)
      complain('--fill-holes: not used, for holes of clouds stay open.');
    const wanted = fillHoles === 'auto' ? HOLE_VOXELS * surface.voxel_size : (fillHoles ?? 0);
    const holeSize = surface.is_of_clouds ? 0 : wanted;
    surface.set_max_hole_size(holeSize);
    const moved = maxTriangles === undefined ? 0 : await decimate(surface, maxTriangles);
    if (moved > 0) note(`Fewer triangles: the surface moves by up to ${(1000 * moved).toFixed(1)} mm.`);
    await writeWhole(path, await meshFile(surface, format));
    const seconds = ((performance.now() - start) / 1000).toFixed(1);
    const filled =
      holeSize > 0 ? `, ${surface.num_filled} of them over holes of up to ${toMillimetres(holeSize)} m` : '';
    print(
      `Surface of ${surface.num_frames} frames: ${surface.num_triangles} triangles in ${seconds} s${filled}, written to ${printable(path)}\n`,
    );
  } finally {
    surface.free();
  }
}

/** Writes the folder that trainers of splats open. */
export async function writeSplats(
  reconstruction: SpatialReconstruction,
  jobs: FrameJob[],
  folder: string,
  complain: (problem: string) => void,
) {
  const result = reconstruction.result();
  if (!result.camera) {
    complain(`--splats ${folder}: not used, for clouds have no pictures.`);
    return;
  }
  const points = { positions: reconstruction.map_positions(), colors: reconstruction.map_colors() };
  const count = await splatFiles(
    result.camera,
    placedFrames(result),
    points,
    async ({ index }) => {
      const color = jobs[index]?.color;
      return color ? readFirst(color.path, color) : null;
    },
    (path, bytes) => writeResults(join(folder, dirname(path)), { [basename(path)]: bytes }),
  );
  if (count === 0) {
    complain(`--splats ${folder}: no frame with a good pose has colours as PNG or JPEG, so nothing was written.`);
    return;
  }
  print(`${count} images with their poses for nerfstudio and COLMAP, written to ${printable(folder)}\n`);
}

const toMillimetres = (metres: number) => Number(metres.toFixed(3));

/** The frames in the order of these numbers: keyframes first, as the engine tells the noise by what the first images differ. */
function inOrder(placed: readonly PlacedFrame[], order: Uint32Array): PlacedFrame[] {
  const byIndex = new Map(placed.map((frame) => [frame.index, frame]));
  return Array.from(order).flatMap((index) => byIndex.get(index) ?? []);
}

function putClouds(surface: Surface, reconstruction: SpatialReconstruction, order: Uint32Array) {
  for (const frame of order) {
    const points = reconstruction.kept_points(frame);
    if (points) surface.put(frame, points);
  }
}

async function addImages(
  surface: Surface,
  placed: readonly PlacedFrame[],
  jobs: FrameJob[],
  complain: (problem: string) => void,
) {
  const progress = progressLine(placed.length);
  await addFrames(placed, {
    filesOf: ({ index, name }) => {
      const { file, color } = jobs[index] ?? {};
      if (!file) return null;
      return {
        depth: { read: () => readFirst(name, file) },
        color: color ? { read: () => readFirst(color.path, color) } : null,
      };
    },
    add: ({ name, pose }, depth, colors) => surface.add(name, depth, colors, pose),
    refused: (_, error) => {
      if (!isScanstitchError(error)) throw error;
      complain(error.message);
    },
    done: (count) => progress.show(count),
  });
  progress.clear();
}
