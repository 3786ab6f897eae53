/** The little of vector algebra that the views need; three.js is not loaded where this is enough. */

export type Vec3 = readonly [x: number, y: number, z: number];
/** Row-major 3 x 3. */
export type Mat3 = readonly [Vec3, Vec3, Vec3];

export interface Quaternion {
  qx: number;
  qy: number;
  qz: number;
  qw: number;
}

export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export const scaled = (a: Vec3, factor: number): Vec3 => [factor * a[0], factor * a[1], factor * a[2]];

/** a + factor b */
export const added = (a: Vec3, b: Vec3, factor = 1): Vec3 => [
  a[0] + factor * b[0],
  a[1] + factor * b[1],
  a[2] + factor * b[2],
];

export function normalized(a: Vec3): Vec3 {
  const length = Math.hypot(...a) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}

export const transformed = (m: Mat3, v: Vec3): Vec3 => [dot(m[0], v), dot(m[1], v), dot(m[2], v)];

/** A vector turned by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v). */
export function turned({ qx, qy, qz, qw }: Quaternion, v: Vec3): Vec3 {
  const q: Vec3 = [qx, qy, qz];
  const once = cross(q, v);
  return added(added(v, once, 2 * qw), cross(q, once), 2);
}
