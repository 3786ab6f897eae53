/** The frames of a run as clouds to register, for the ICP lab. */
import type { CloudData, GivenCloud, GivenClouds } from '../components/given-clouds.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { MapPoints, SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import { turned, type Vec3 } from '../views/vectors.js';
import type { SpatialDataset } from './session.js';

/** A depth image of a room keeps about ten thousand of its points in voxels of this side (m): they are stepped at once. */
const DEPTH_VOXEL = 0.05;

/** What a run registers each frame to its map by; the others register it to the frame before. */
const METHODS_WITH_MAP: readonly string[] = ['surfel_map', 'cloud_map'];

/**
 * Frame `frame` of the result and what the run registered it to: the map of the frames before, or the frame before; with all
 * others. Null: there are no two.
 */
export function clouds(
  dataset: SpatialDataset,
  result: SpatialResult,
  points: MapPoints,
  frame: number | null,
): GivenClouds | null {
  const source = Math.max(frame ?? 1, 1);
  const jobs = new Map(dataset.jobs.map((job) => [job.index, job]));
  const known = result.frames.flatMap(({ index, name, T_world_sensor }, at) => {
    const job = jobs.get(index);
    return job ? [{ name, job, T_world_sensor, at }] : [];
  });
  const [from, to] = [known[source], known[source - 1]];
  if (!from || !to) return null;
  // Of one frame the frame itself says more: it has all its points.
  const pose = source > 1 ? to.T_world_sensor : null;
  const map = pose && mapCloud(`map of ${source} frames`, points, from.at, pose, result.camera !== null);
  const has_map = map && METHODS_WITH_MAP.includes(result.settings.method ?? '');
  return {
    title: dataset.title,
    sample: '',
    of: dataset,
    clouds: [
      ...known.map(({ name, job }): GivenCloud => ({ name, read: () => readCloud(name, job, result) })),
      ...(map ? [map] : []),
    ],
    source: from.name,
    target: has_map ? map.name : to.name,
    options: optionsOf(result),
    init_T_target_source: null,
  };
}

/** Points of the map that frames before `until` saw first, in the frame of the sensor at `pose`. */
function mapCloud(
  name: string,
  { positions, frames }: MapPoints,
  until: number,
  pose: SpatialPose,
  is_of_camera: boolean,
): GivenCloud {
  const read = async (): Promise<CloudData> => {
    const { x, y, z, qx, qy, qz, qw } = pose;
    const back = { qx: -qx, qy: -qy, qz: -qz, qw };
    const xyz = new Float32Array(positions.length);
    let length = 0;
    for (let i = 0; i < frames.length; i++) {
      if ((frames[i] ?? 0) >= until) continue;
      const from_sensor: Vec3 = [
        (positions[3 * i] ?? 0) - x,
        (positions[3 * i + 1] ?? 0) - y,
        (positions[3 * i + 2] ?? 0) - z,
      ];
      xyz.set(turned(back, from_sensor), length);
      length += 3;
    }
    return { kind: 'positions', name, xyz: xyz.slice(0, length), is_of_camera };
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

async function readCloud(name: string, { file, is_cloud }: SpatialJob, result: SpatialResult): Promise<CloudData> {
  const bytes = (await file.read()).slice();
  const { camera, depth_scale } = result;
  if (is_cloud || !camera) return { kind: 'file', name: file.path, bytes };
  const { fx, fy, cx, cy } = camera;
  return { kind: 'depth', name, bytes, camera: { fx, fy, cx, cy }, depth_scale: depth_scale ?? 1000 };
}
