/**
 * How the map is laid before the eye. The world of the estimate is the first camera: x right, y down, z forward, and
 * that camera may have looked down a little. The picture's world has y up and the floor level.
 */
import type { MapPoints } from '../engine/spatial-protocol.js';
import { added, cross, dot, type Mat3, normalized, transformed, type Vec3 } from '../views/vectors.js';

export const NO_POINTS: MapPoints = {
  positions: new Float32Array(),
  colors: new Uint8Array(),
  normals: new Int16Array(),
  frames: new Uint32Array(),
};

/** Cones around the presumed vertical, from wide to narrow, in which normals vote on the true one (cosines). */
const CONES = [0.82, 0.94, 0.985];
/** At least this share of the sampled normals must stand upright for a vote to count. */
const MIN_SHARE = 0.08;
/** Length of a normal of `MapPoints`. */
export const NORMAL_UNIT = 32_767;

/** Up in the world of the first camera, or of the first cloud of a laser that stands upright. */
const CAMERA_UP: Vec3 = [0, -1, 0];
const LASER_UP: Vec3 = [0, 0, 1];

/**
 * Rotation from the map's world to the picture's: rows are right, up and backward. `hasCamera`: the sensor looks along
 * z and has y down; otherwise a laser with z up is thought possible too. `maxCount` points have a vote: 4000 are certain to a
 * tenth of a degree.
 */
export function leveling(points: MapPoints, hasCamera: boolean, maxCount: number): Mat3 {
  const candidates = hasCamera ? [CAMERA_UP] : [LASER_UP, CAMERA_UP];
  const voted = candidates.map((presumed) => ({ presumed, ...voteOnUp(points, presumed, maxCount) }));
  const best = voted.reduce((a, b) => (b.share > a.share ? b : a));
  const up = best.share >= MIN_SHARE ? best.up : best.presumed;
  const ahead: Vec3 = best.presumed === LASER_UP ? [1, 0, 0] : [0, 0, 1];
  const forward = normalized(added(ahead, up, -dot(ahead, up)));
  return [cross(forward, up), up, [-forward[0], -forward[1], -forward[2]]];
}

/** Floors, tables and ceilings are level: the mean of the normals that stand nearly upright. */
function voteOnUp({ normals }: MapPoints, presumed: Vec3, maxCount: number): { up: Vec3; share: number } {
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
export function sample(points: MapPoints, R_view_map: Mat3, maxCount: number): Vec3[] {
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

/** The turn about the vertical (rad) at which the plan fills the smallest rectangle, its long side across the screen. */
export function straightAzimuth(sampled: readonly Vec3[], isWide: boolean): number {
  const STEPS = 60;
  const [xs, zs] = [coordinates(sampled, 0), coordinates(sampled, 2)];
  const along = new Float64Array(sampled.length);
  const spreadAlong = (a: number, b: number): number => {
    for (let i = 0; i < along.length; i++) along[i] = a * (xs[i] ?? 0) + b * (zs[i] ?? 0);
    return spread(along);
  };
  let best = { area: Number.POSITIVE_INFINITY, azimuth: 0, isWide: true };
  for (let step = 0; step < STEPS; step++) {
    const azimuth = ((step / STEPS) * Math.PI) / 2;
    const [cos, sin] = [Math.cos(azimuth), Math.sin(azimuth)];
    const width = spreadAlong(cos, -sin);
    const depth = spreadAlong(sin, cos);
    if (width * depth < best.area * 0.995) best = { area: width * depth, azimuth, isWide: width >= depth };
  }
  return best.isWide === isWide ? best.azimuth : best.azimuth - Math.PI / 2;
}

/** Extent of all but the outermost hundredth on either side. */
export function spread(values: ArrayLike<number>): number {
  if (values.length === 0) return 0;
  // The outermost ones in order, the innermost of them last: few values come in between, and the others need no order.
  const count = Math.floor(values.length / 100) + 1;
  const highest = new Float64Array(count).fill(Number.NEGATIVE_INFINITY);
  const lowest = new Float64Array(count).fill(Number.NEGATIVE_INFINITY);
  for (let i = 0; i < values.length; i++) {
    const value = values[i] ?? 0;
    takeIn(highest, value);
    takeIn(lowest, -value);
  }
  return (highest[count - 1] ?? 0) + (lowest[count - 1] ?? 0);
}

/** Puts a value among the highest, which are in falling order. */
function takeIn(highest: Float64Array, value: number): void {
  let place = highest.length - 1;
  if (value <= (highest[place] ?? 0)) return;
  for (; place > 0 && value > (highest[place - 1] ?? 0); place--) highest[place] = highest[place - 1] ?? 0;
  highest[place] = value;
}

/** One coordinate of each point. */
function coordinates(points: readonly Vec3[], axis: 0 | 1 | 2): Float64Array {
  const found = new Float64Array(points.length);
  for (const [i, point] of points.entries()) found[i] = point[axis];
  return found;
}
