/** The frames of a run as clouds to register, for the ICP lab. */
import type { CloudData, GivenCloud, GivenClouds } from '../components/given-clouds.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { SpatialResult } from '../engine/spatial-protocol.js';
import type { SpatialDataset } from './session.js';

/** A depth image of a room keeps about ten thousand of its points in voxels of this side (m): they are stepped at once. */
const DEPTH_VOXEL = 0.05;

/** Frame `frame` of the result and the one before it, with all others. Null: there are no two. */
export function clouds(dataset: SpatialDataset, result: SpatialResult, frame: number | null): GivenClouds | null {
  const source = Math.max(frame ?? 1, 1);
  const jobs = new Map(dataset.jobs.map((job) => [job.index, job]));
  const known = result.frames.flatMap(({ index, name }) => {
    const job = jobs.get(index);
    return job ? [{ name, job }] : [];
  });
  const [from, to] = [known[source], known[source - 1]];
  if (!from || !to) return null;
  return {
    title: dataset.title,
    sample: '',
    of: dataset,
    clouds: known.map(({ name, job }): GivenCloud => ({ name, read: () => readCloud(name, job, result) })),
    source: from.name,
    target: to.name,
    options: optionsOf(result),
    init_T_target_source: null,
  };
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
