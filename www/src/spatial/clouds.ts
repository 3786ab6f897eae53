/** The frames of a run as clouds to register, for the ICP lab. */
import type { CloudData, GivenCloud, GivenClouds } from '../run/given-clouds.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { MapPoints, SpatialResult } from '../engine/spatial-protocol.js';
import { added, turned, type Vec3 } from '../views/vectors.js';
import type { SpatialDataset } from './take-in.js';

/** A depth image of a room keeps about ten thousand of its points in voxels of this side (m): they are stepped at once. */
const DEPTH_VOXEL = 0.05;

/** What a run registers each frame to its map by; the others register it to the frame before. */
const METHODS_WITH_MAP: readonly string[] = ['surfel_map', 'cloud_map'];

/**
 * Frame `frame` of the result and what the run registered it to: the map of the frames before as it was then, or the frame
 * before; with all others. Null: there are no two. `mapBefore`: how the map has moved since, as the engine tells it.
 */
export async function clouds(
  dataset: SpatialDataset,
  result: SpatialResult,
  points: MapPoints,
  frame: number | null,
  mapBefore: (frame: number) => Promise<Float64Array>,
): Promise<GivenClouds | null> {
  const source = Math.max(frame ?? 1, 1);
  const jobs = new Map(dataset.jobs.map((job) => [job.index, job]));
  const known = result.frames.flatMap(({ index, name }, at) => {
    const job = jobs.get(index);
    return job ? [{ name, job, at }] : [];
  });
  const [from, to] = [known[source], known[source - 1]];
  if (!from || !to) return null;
  // Of one frame the frame itself says more: it has all its points.
  const motions = source > 1 ? await mapBefore(from.at) : null;
  const map = motions && mapCloud(`map of ${source} frames`, points, motions, result.camera !== null);
  const hasMap = map && METHODS_WITH_MAP.includes(result.settings.method ?? '');
  return {
    title: dataset.title,
    sample: '',
    of: dataset,
    clouds: [
      ...known.map(({ name, job }): GivenCloud => ({ name, read: () => readCloud(name, job, result) })),
      ...(map ? [map] : []),
    ],
    source: from.name,
    target: hasMap ? map.name : to.name,
    options: optionsOf(result),
    init_T_target_source: null,
  };
}

/** Numbers of a motion: x y z qx qy qz qw. */
const MOTION = 7;

/** Points of the map that the first frames gave to it, by the motion of those of each frame. */
function mapCloud(
  name: string,
  { positions, frames }: MapPoints,
  motions: Float64Array,
  isOfCamera: boolean,
): GivenCloud {
  const read = async (): Promise<CloudData> => {
    const xyz = new Float32Array(positions.length);
    let length = 0;
    for (let i = 0; i < frames.length; i++) {
      const motion = motions.subarray(MOTION * (frames[i] ?? 0));
      if (motion.length === 0) continue;
      const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = motion;
      const point: Vec3 = [positions[3 * i] ?? 0, positions[3 * i + 1] ?? 0, positions[3 * i + 2] ?? 0];
      xyz.set(added(turned({ qx, qy, qz, qw }, point), [x, y, z]), length);
      length += 3;
    }
    return { kind: 'positions', name, xyz: xyz.slice(0, length), isOfCamera };
  };
  return { name, read };
}

/** Those of the run's settings that say how two frames are registered. Points of a depth image have no normals in a file. */
function optionsOf({ settings, camera }: SpatialResult): Readonly<Record<string, string | number>> {
  const { voxel_size, max_correspondence_distance, map_voxel_size } = settings;
  return {
    metric: 'point_to_plane',
    voxel_size: voxel_size || map_voxel_size || (camera ? DEPTH_VOXEL : 0),
    ...reachOf(max_correspondence_distance),
  };
}

const reachOf = (reach: number | undefined): Record<string, number> =>
  reach ? { max_correspondence_distance: reach } : {};

async function readCloud(name: string, { file, isCloud }: SpatialJob, result: SpatialResult): Promise<CloudData> {
  const bytes = (await file.read()).slice();
  const { camera, depth_scale } = result;
  if (isCloud || !camera) return { kind: 'file', name: file.path, bytes };
  const { fx, fy, cx, cy } = camera;
  return { kind: 'depth', name, bytes, camera: { fx, fy, cx, cy }, depth_scale: depth_scale ?? 1000 };
}
