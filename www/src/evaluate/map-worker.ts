/** The thread that judges maps without any truth. Its figures take seconds: comparisons go on meanwhile. */
import { FrameClouds, map_quality, PointCloud, Trajectory } from '../../../pkg/scanstitch.js';
import type { FrameQuality, MapAnswer, MapQuality, MapQuestion, Part, TrajectoryFile } from './protocol.js';
import { attempt, serve } from './serve.js';

serve<never, MapQuestion, MapAnswer>(
  () => undefined,
  ({ maps, frames, trajectories }) => {
    const start = performance.now();
    const answer: MapAnswer = { maps: [], placed: [], refusals: [], elapsed_ms: 0 };
    const take = <T>(name: string, judge: () => T): { name: string; quality: T }[] => {
      const found = attempt(judge);
      if ('value' in found) return [{ name, quality: found.value }];
      answer.refusals.push({ name, problem: found.problem });
      return [];
    };
    answer.maps = maps.flatMap((map) => take(map.name, () => judgeMap(map)));
    if (frames.length > 0) {
      const clouds = new FrameClouds();
      try {
        const kept = attempt(() => addAll(clouds, frames));
        if ('problem' in kept) answer.refusals.push({ name: 'The frames', problem: kept.problem });
        else answer.placed = trajectories.flatMap((file) => take(file.name, () => judgeFrames(clouds, file)));
      } finally {
        clouds.free();
      }
    }
    answer.elapsed_ms = performance.now() - start;
    return { answer, transfer: [] };
  },
);

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

function judgeFrames(clouds: FrameClouds, { name, parts }: TrajectoryFile): FrameQuality {
  const [only] = parts;
  const trajectory =
    parts.length === 1 && only
      ? Trajectory.read(only.bytes, name)
      : Trajectory.read_frames(
          parts.map((part) => part.name),
          parts.map(({ bytes }) => bytes),
        );
  try {
    return clouds.quality(trajectory);
  } finally {
    trajectory.free();
  }
}
