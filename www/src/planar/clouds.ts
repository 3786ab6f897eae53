/** The scans of a run as clouds to register, for the ICP lab. */
import type { GivenCloud, GivenClouds } from '../components/given-clouds.js';
import type { Dataset } from '../datasets/dataset.js';
import type { FrameResult, PlanarPose, Settings } from '../engine/protocol.js';
import type { PointSet } from '../views/point-layer.js';

interface Run {
  settings: Settings;
  dataset: Dataset;
  frames: readonly FrameResult[];
  /** The map's points by frame, in the map's frame. */
  points: PointSet;
}

/** Scan `frame` and the one before it; with them all others, and the map of the scans before. Null: there are no two. */
export function clouds(
  { settings, dataset, frames, points }: Run,
  frame: number | null,
  sample: string,
): GivenClouds | null {
  const source = Math.max(frame ?? 1, 1);
  if (frames.length < 2 || source >= frames.length) return null;
  const before = source - 1;
  const files = new Map(dataset.scans.map((scan) => [scan.name, scan.bytes]));
  const scans = frames.map(({ name, T_world_sensor }, i): GivenCloud => {
    const bytes = dataset.is_log ? undefined : files.get(name);
    if (bytes) return { name, read: async () => ({ kind: 'file', name, bytes: new Uint8Array(bytes) }) };
    return pointsOf(name, points, i, i + 1, T_world_sensor);
  });
  const pose = frames[before]?.T_world_sensor;
  const map = pose && before > 0 ? [pointsOf(`map of ${source} scans`, points, 0, source, pose)] : [];
  return {
    title: dataset.title,
    sample,
    of: dataset,
    clouds: [...scans, ...map],
    source: frames[source]?.name ?? '',
    target: frames[before]?.name ?? '',
    options: optionsOf(settings),
    init_T_target_source: null,
  };
}

/** Those of the run's settings that say how two scans are registered; the search before it where the run has one. */
function optionsOf(settings: Settings): Readonly<Record<string, string | number>> {
  const { metric, max_correspondence_distance, max_normal_angle, trim_fraction, robust_kernel } = settings;
  const { robust_kernel_width, max_iterations, rotation_eps, translation_eps } = settings;
  const { search_translation, search_rotation } = settings;
  return {
    ...(settings.initial_guess === 'correlative' ? { search_translation, search_rotation } : {}),
    ...{ metric, max_correspondence_distance, max_normal_angle, trim_fraction, robust_kernel },
    ...{ robust_kernel_width, max_iterations, rotation_eps, translation_eps },
  };
}

/** Points of some frames, in the frame of a sensor. */
function pointsOf(
  name: string,
  { points, offsets }: PointSet,
  first: number,
  last: number,
  sensor: PlanarPose,
): GivenCloud {
  return {
    name,
    read: async () => {
      const [from, to] = [offsets[first] ?? 0, offsets[last] ?? 0];
      const [cos, sin] = [Math.cos(sensor.theta), Math.sin(sensor.theta)];
      const xyz = new Float32Array(3 * (to - from));
      for (let i = from, k = 0; i < to; i++, k += 3) {
        const [dx, dy] = [(points[2 * i] ?? 0) - sensor.x, (points[2 * i + 1] ?? 0) - sensor.y];
        xyz[k] = cos * dx + sin * dy;
        xyz[k + 1] = cos * dy - sin * dx;
      }
      return { kind: 'positions', name, xyz };
    },
  };
}
