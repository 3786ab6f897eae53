/** Rigid motions as 4 x 4 matrices, row by row: the little of their algebra that the lab's view needs. */
import { difference, IDENTITY, inverted, moved, multiplied, poseOf } from '../../../package/base/matrices.js';
import type { Pose } from './protocol.js';

export { difference, IDENTITY, inverted, multiplied };

const at = (T: Pose, row: number, column: number): number => T[4 * row + column] ?? 0;

/** The rotation part as a vector along its axis, rad. */
export function rotationVector(T: Pose): [number, number, number] {
  const axis = [at(T, 2, 1) - at(T, 1, 2), at(T, 0, 2) - at(T, 2, 0), at(T, 1, 0) - at(T, 0, 1)];
  const sine = Math.hypot(...axis) / 2;
  const cosine = (at(T, 0, 0) + at(T, 1, 1) + at(T, 2, 2) - 1) / 2;
  const angle = Math.atan2(sine, cosine);
  const factor = sine > 1e-12 ? angle / (2 * sine) : 0.5;
  return [(axis[0] ?? 0) * factor, (axis[1] ?? 0) * factor, (axis[2] ?? 0) * factor];
}

/** A rotation by a vector along its axis (rad; Rodrigues), then a translation. */
export function fromVectors([rx, ry, rz]: readonly [number, number, number], t: readonly number[]): number[] {
  const angle = Math.hypot(rx, ry, rz);
  const [a, b] = angle < 1e-9 ? [1, 0.5] : [Math.sin(angle) / angle, (1 - Math.cos(angle)) / (angle * angle)];
  const sq = angle * angle;
  const R = [
    ...[1 + b * (rx * rx - sq), b * rx * ry - a * rz, b * rx * rz + a * ry],
    ...[b * rx * ry + a * rz, 1 + b * (ry * ry - sq), b * ry * rz - a * rx],
    ...[b * rx * rz - a * ry, b * ry * rz + a * rx, 1 + b * (rz * rz - sq)],
  ];
  return poseOf(R, [...t]);
}

/** In the plane. */
export function planarPose(x: number, y: number, theta: number): number[] {
  return fromVectors([0, 0, theta], [x, y, 0]);
}

/** x, y (m) and heading (rad) of a pose in the plane. */
export function planarParts(T: Pose): { x: number; y: number; theta: number } {
  return { x: at(T, 0, 3), y: at(T, 1, 3), theta: Math.atan2(at(T, 1, 0), at(T, 0, 0)) };
}

/** `share` of the way from one pose to another; the source's origin goes straight. */
export function between(from: Pose, to: Pose, share: number): number[] {
  const [rx, ry, rz] = rotationVector(multiplied(to, inverted(from)));
  const turn = fromVectors([rx * share, ry * share, rz * share], [0, 0, 0]);
  const T = multiplied(turn, from);
  for (const row of [0, 1, 2]) T[4 * row + 3] = at(from, row, 3) + share * (at(to, row, 3) - at(from, row, 3));
  return T;
}

/** Turned by a vector along an axis (rad) about a point, and then moved. */
export function movedBy(
  T: Pose,
  turn: readonly [number, number, number],
  about: readonly number[],
  shift: readonly number[],
): number[] {
  const R = fromVectors(turn, [0, 0, 0]);
  const [x, y, z] = [about[0] ?? 0, about[1] ?? 0, about[2] ?? 0];
  acted(R, x, y, z).forEach((turned, row) => {
    R[4 * row + 3] = (about[row] ?? 0) - turned + (shift[row] ?? 0);
  });
  return multiplied(R, T);
}

export const acted = (T: Pose, x: number, y: number, z: number): [number, number, number] =>
  moved(T, [x, y, z]) as [number, number, number];

/** Mean of points, x y z x y z ... */
export function centroid(points: ArrayLike<number>): [number, number, number] {
  const sums: [number, number, number] = [0, 0, 0];
  const count = Math.max(Math.floor(points.length / 3), 1);
  for (let i = 0; i + 2 < points.length; i += 3) {
    sums[0] += points[i] ?? 0;
    sums[1] += points[i + 1] ?? 0;
    sums[2] += points[i + 2] ?? 0;
  }
  return [sums[0] / count, sums[1] / count, sums[2] / count];
}
