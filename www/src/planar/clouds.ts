/** The scans of a run as clouds to register, for the ICP lab. */
import type { GivenCloud, GivenClouds } from '../run/given-clouds.js';
import type { Dataset } from '../datasets/dataset.js';
import type { FrameResult, PlanarPose, ScanToMap, Settings } from '../engine/protocol.js';
import { baseName } from '../views/format.js';
import type { PointSet } from '../views/point-layer.js';
import type { Turns } from '../views/viewport.js';

interface Run {
  settings: Settings;
  dataset: Dataset;
  frames: readonly FrameResult[];
  /** The map's points by frame, in the map's frame. */
  points: PointSet;
}

/** Scan `frame` and the one before it; with them all others. Null: there are no two. */
export function clouds(
  { settings, dataset, frames, points }: Run,
  frame: number | null,
  sample: string,
): GivenClouds | null {
  const source = Math.max(frame ?? 1, 1);
  if (frames.length < 2 || source >= frames.length) return null;
  const before = source - 1;
  // Of a log, no file is a cloud.
  const files = new Map(dataset.scans.flatMap(({ name, bytes, isLog }) => (isLog ? [] : [[name, bytes]])));
  const scans = frames.map(({ name, T_world_sensor }, i): GivenCloud => {
    const bytes = files.get(name);
    if (bytes) return { name, read: async () => ({ kind: 'file', name, bytes: new Uint8Array(bytes) }) };
    return pointsOf(name, points, i, T_world_sensor);
  });
  return {
    title: dataset.title,
    sample,
    of: dataset,
    clouds: scans,
    source: frames[source]?.name ?? '',
    target: frames[before]?.name ?? '',
    options: optionsOf(settings),
    init_T_target_source: null,
  };
}

/** The same, but scan `frame` and the map that the run registered it to, as they were at that time. */
export function cloudsAsRun(given: GivenClouds, pair: ScanToMap): GivenClouds {
  const { source, clouds, options } = given;
  const target = `map before ${baseName(source)}`;
  const positions = (name: string, xyz: ScanToMap['source'], normals: ScanToMap['target_normals']): GivenCloud => ({
    name,
    read: async () => ({ kind: 'positions', name, xyz, normals }),
  });
  // The search has been done: what it found is the first guess.
  const { search_translation: _, search_rotation: __, ...others } = options ?? {};
  return {
    ...given,
    sample: '',
    clouds: [
      ...clouds.map((cloud) => (cloud.name === source ? positions(source, pair.source, null) : cloud)),
      positions(target, pair.target, pair.target_normals),
    ],
    target,
    options: others,
    init_T_target_source: pair.init_T_target_source,
  };
}

/**
 * By how many quarter turns the target's frame is to be turned to lie as on the map, which is turned by `turned`. `pair`: the
 * map that the scan was registered to, if that is the target; else it is the scan before.
 */
export function turnsOf(
  { source, target }: GivenClouds,
  pair: ScanToMap | null,
  frames: readonly FrameResult[],
  turned: Turns,
): Turns {
  const thetaOf = (wanted: string): number => frames.find(({ name }) => name === wanted)?.T_world_sensor.theta ?? 0;
  const [cos = 1, , , , sin = 0] = pair?.init_T_target_source ?? [];
  const thetaWorldTarget = pair ? thetaOf(source) - Math.atan2(sin, cos) : thetaOf(target);
  return ((((turned + Math.round(thetaWorldTarget / (Math.PI / 2))) % 4) + 4) % 4) as Turns;
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

/** Points of a frame, in the frame of its sensor. */
function pointsOf(name: string, { points, offsets }: PointSet, frame: number, sensor: PlanarPose): GivenCloud {
  return {
    name,
    read: async () => {
      const [from, to] = [offsets[frame] ?? 0, offsets[frame + 1] ?? 0];
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
