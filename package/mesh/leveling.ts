/**
 * How a map in space lies: which way is up, and how high the floor, the ceiling and the cameras are. The world of the estimate is the
 * first camera: x right, y down, z forward, and that camera may have looked down a little. The world of a picture has y up and the floor
 * level.
 */
import { added, cross, dot, type Mat3, normalized, transformed, type Vec3 } from '../base/vectors.js';

/** The points of a map: x y z ... (m), and their normals, unit vectors of which a unit is `NORMAL_UNIT`; zero where unknown. */
export interface LevelPoints {
  positions: Float32Array;
  normals: Int16Array;
}

/** Cones around the presumed vertical, from wide to narrow, in which normals vote on the true one (cosines). */
const CONES = [0.82, 0.94, 0.985];
/** At least this share of the sampled normals must stand upright for a vote to count. */
const MIN_SHARE = 0.08;
/** Length of a normal. */
export const NORMAL_UNIT = 32_767;

/** Up in the world of the first camera, or of the first cloud of a laser that stands upright. */
const CAMERA_UP: Vec3 = [0, -1, 0];
const LASER_UP: Vec3 = [0, 0, 1];

/**
 * Rotation from the map's world to the picture's: rows are right, up and backward. `hasCamera`: the sensor looks along
 * z and has y down; otherwise a laser with z up is thought possible too. `maxCount` points have a vote: 4000 are certain to a
 * tenth of a degree.
 */
export function leveling(points: LevelPoints, hasCamera: boolean, maxCount: number): Mat3 {
  const candidates = hasCamera ? [CAMERA_UP] : [LASER_UP, CAMERA_UP];
  const voted = candidates.map((presumed) => ({ presumed, ...voteOnUp(points, presumed, maxCount) }));
  const best = voted.reduce((a, b) => (b.share > a.share ? b : a));
  const up = best.share >= MIN_SHARE ? best.up : best.presumed;
  const ahead: Vec3 = best.presumed === LASER_UP ? [1, 0, 0] : [0, 0, 1];
  const forward = normalized(added(ahead, up, -dot(ahead, up)));
  return [cross(forward, up), up, [-forward[0], -forward[1], -forward[2]]];
}

/** Floors, tables and ceilings are level: the mean of the normals that stand nearly upright. */
function voteOnUp({ normals }: LevelPoints, presumed: Vec3, maxCount: number): { up: Vec3; share: number } {
  const count = normals.length / 3;
  const stride = Math.max(1, Math.ceil(count / maxCount));
  let up = presumed;
  let share = 0;
  for (const cone of CONES) {
    const [upX, upY, upZ] = up;
    let [sumX, sumY, sumZ] = [0, 0, 0];
    let votes = 0;
    // This is done whenever the map has grown: no vector is made for a point.
    for (let at = 0; at < 3 * count; at += 3 * stride) {
      const [x, y, z] = [normals[at] ?? 0, normals[at + 1] ?? 0, normals[at + 2] ?? 0];
      const cosine = x * upX + y * upY + z * upZ;
      if (Math.abs(cosine) < NORMAL_UNIT * cone) continue;
      const sign = Math.sign(cosine);
      sumX += sign * x;
      sumY += sign * y;
      sumZ += sign * z;
      votes++;
    }
    if (votes === 0) return { up: presumed, share: 0 };
    up = normalized([sumX, sumY, sumZ]);
    share = votes / Math.ceil(count / stride);
  }
  return { up, share };
}

/** A sample of the points in the picture's world, sufficient to fit a view. */
export function sample(points: LevelPoints, R_view_map: Mat3, maxCount: number): Vec3[] {
  const count = points.positions.length / 3;
  const stride = Math.max(1, Math.ceil(count / maxCount));
  const sampled: Vec3[] = [];
  for (let i = 0; i < count; i += stride) {
    const at = 3 * i;
    const p: Vec3 = [points.positions[at] ?? 0, points.positions[at + 1] ?? 0, points.positions[at + 2] ?? 0];
    sampled.push(transformed(R_view_map, p));
  }
  return sampled;
}

/** Heights above the first camera, m. */
export interface Heights {
  floor: number;
  top: number;
  /** Where the section cuts at first: above the cameras and below the ceiling, so that the rooms lie open. */
  section: number;
}

const BIN = 0.05; // m
/** The cut lies so far above the highest camera, or so far below the ceiling where that is lower. */
const ABOVE_CAMERA = 0.3;
const BELOW_CEILING = 0.2;

/**
 * A ceiling is level: it holds at least this share of the points above the cameras. Measured: 32 to 41 % in a room and in three apartments;
 * at most 10 % where none was seen, in three rooms, a hall, a corridor and outdoors.
 */
const MIN_CEILING_SHARE = 0.2;

/** From points and cameras in the picture's world. */
export function heightsOf(sampled: readonly Vec3[], cameras: readonly Vec3[]): Heights {
  const heights = coordinates(sampled, 1).sort();
  const at = (share: number): number => heights[Math.floor(share * (heights.length - 1))] ?? 0;
  const [bottom, top] = [at(0.002), at(0.998)];
  const highest = cameras.reduce((high, [, y]) => Math.max(high, y), Number.NEGATIVE_INFINITY);
  const camera = Number.isFinite(highest) ? highest : 0;
  const above = heights.filter((height) => height > camera + BELOW_CEILING);
  // Of a camera close under the ceiling, no point lies above it.
  const ceiling = fullestBin(above) ?? { height: top, share: 1 };
  const floor = fullestBin(heights.filter((height) => height < camera - 0.3))?.height ?? bottom;
  // Without a ceiling, or where all lies far below or above the cameras, there is nothing to cut open.
  if (ceiling.share < MIN_CEILING_SHARE) return { floor, top, section: top };
  const section = Math.min(camera + ABOVE_CAMERA, ceiling.height - BELOW_CEILING);
  return { floor, top, section: section > floor + 0.5 ? section : top };
}

/** The height that most points have, and their share. */
function fullestBin(heights: Float64Array): { height: number; share: number } | null {
  const counts = new Map<number, number>();
  for (const height of heights) counts.set(Math.round(height / BIN), (counts.get(Math.round(height / BIN)) ?? 0) + 1);
  const [fullest] = [...counts].sort((a, b) => b[1] - a[1]);
  return fullest ? { height: fullest[0] * BIN, share: fullest[1] / heights.length } : null;
}

/** One coordinate of each point. */
export function coordinates(points: readonly Vec3[], axis: 0 | 1 | 2): Float64Array {
  const found = new Float64Array(points.length);
  for (const [i, point] of points.entries()) found[i] = point[axis];
  return found;
}

/** Points that tell how a map lies: three times as many normals, four times as many heights. */
export const NUM_SAMPLES = 1500;

/** The rotation into the world of a picture, and the heights there. `sensors`: their places in the map; `hasCamera` as for `leveling`. */
export function layOf(
  points: LevelPoints,
  sensors: readonly Vec3[],
  hasCamera: boolean,
  count: number = NUM_SAMPLES,
): { R_view_map: Mat3; heights: Heights } {
  const R_view_map = leveling(points, hasCamera, 3 * count);
  const places = sensors.map((place) => transformed(R_view_map, place));
  // A floor that is hardly seen counts.
  return { R_view_map, heights: heightsOf(sample(points, R_view_map, 4 * count), places) };
}
