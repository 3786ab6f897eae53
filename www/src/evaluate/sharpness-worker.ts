/** The thread that computes the sharpness of maps, with no ground truth. It takes seconds: comparisons go on meanwhile. */
import { FrameClouds, init, map_quality, PointCloud, Trajectory } from '../engine/package.js';
import type { FrameQuality, MapResult, MapQuality, MapQuery, Part, TrajectoryFile, QueryApi } from './protocol.js';
import { attempt, serve } from '../engine/serve.js';
import { readTrajectory } from './read-trajectory.js';

serve<QueryApi<never, MapQuery, MapResult>>({
  async start(module) {
    await init({ module_or_path: module });
  },
  tell: () => undefined,
  ask({ maps, frames, trajectories }) {
    const start = performance.now();
    const result: MapResult = { maps: [], placed: [], refusals: [], elapsed_ms: 0 };
    const take = <T>(name: string, judge: () => T): { name: string; quality: T }[] => {
      const found = attempt(judge);
      if ('value' in found) return [{ name, quality: found.value }];
      result.refusals.push({ name, problem: found.problem });
      return [];
    };
    result.maps = maps.flatMap((map) => take(map.name, () => judgeMap(map)));
    if (frames.length > 0) {
      const clouds = new FrameClouds();
      try {
        const kept = attempt(() => addAll(clouds, frames));
        if ('problem' in kept) result.refusals.push({ name: 'The frames', problem: kept.problem });
        else result.placed = trajectories.flatMap((file) => take(file.name, () => judgeFrames(clouds, file)));
      } finally {
        clouds.free();
      }
    }
    result.elapsed_ms = performance.now() - start;
    return result;
  },
});

function judgeMap({ name, bytes }: Part): MapQuality {
  return withCloud(name, bytes, (cloud) => map_quality(cloud));
}

function addAll(clouds: FrameClouds, frames: readonly Part[]): void {
  for (const { name, bytes } of frames) withCloud(name, bytes, (cloud) => clouds.add(cloud, name));
}

function withCloud<T>(name: string, bytes: Uint8Array, use: (cloud: PointCloud) => T): T {
  const cloud = PointCloud.read(bytes, name);
  try {
    return use(cloud);
  } finally {
    cloud.free();
  }
}

function judgeFrames(clouds: FrameClouds, file: TrajectoryFile): FrameQuality {
  const trajectory = readTrajectory(Trajectory, file);
  try {
    return clouds.quality(trajectory);
  } finally {
    trajectory.free();
  }
}
