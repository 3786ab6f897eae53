/** The frames of a run as clouds to register, for the ICP lab. */
import type { CloudData, GivenCloud, GivenClouds } from '../components/given-clouds.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { SpatialResult } from '../engine/spatial-protocol.js';
import type { SpatialDataset } from './session.js';

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
    options: null,
    init_T_target_source: null,
  };
}

async function readCloud(name: string, { file, is_cloud }: SpatialJob, result: SpatialResult): Promise<CloudData> {
  const bytes = (await file.read()).slice();
  const { camera, depth_scale } = result;
  if (is_cloud || !camera) return { kind: 'file', name: file.path, bytes };
  const { fx, fy, cx, cy } = camera;
  return { kind: 'depth', name, bytes, camera: { fx, fy, cx, cy }, depth_scale: depth_scale ?? 1000 };
}
