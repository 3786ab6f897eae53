/** Rigid motions as 4 x 4 matrices, row by row: the little of their algebra that the lab's view needs. */
import type { Pose } from './protocol.js';

export const IDENTITY: Pose = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const at = (T: Pose, row: number, column: number): number => T[4 * row + column] ?? 0;

export function multiplied(A: Pose, B: Pose): number[] {
  return Array.from({ length: 16 }, (_, i) => {
    const [row, column] = [i >> 2, i & 3];
    let sum = 0;
    for (let k = 0; k < 4; k++) sum += at(A, row, k) * at(B, k, column);
    return sum;
  });
}

export function inverted(T: Pose): number[] {
  const R = (row: number, column: number): number => at(T, column, row);
  const t = [0, 1, 2].map((row) => -[0, 1, 2].reduce((sum, k) => sum + R(row, k) * at(T, k, 3), 0));
  return [0, 1, 2].flatMap((row) => [R(row, 0), R(row, 1), R(row, 2), t[row] ?? 0]).concat([0, 0, 0, 1]);
}

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
  return [
    1 + b * (rx * rx - sq),
    b * rx * ry - a * rz,
    b * rx * rz + a * ry,
    t[0] ?? 0,
    b * rx * ry + a * rz,
    1 + b * (ry * ry - sq),
    b * ry * rz - a * rx,
    t[1] ?? 0,
    b * rx * rz - a * ry,
    b * ry * rz + a * rx,
    1 + b * (rz * rz - sq),
    t[2] ?? 0,
    0,
    0,
    0,
    1,
  ];
}

/** In the plane. */
export function planarPose(x: number, y: number, theta: number): number[] {
  return fromVectors([0, 0, theta], [x, y, 0]);
}

/** x, y (m) and heading (rad) of a pose in the plane. */
export function planarParts(T: Pose): { x: number; y: number; theta: number } {
  return { x: at(T, 0, 3), y: at(T, 1, 3), theta: Math.atan2(at(T, 1, 0), at(T, 0, 0)) };
}

/** What leads from one pose to another, as a motion in the target's frame: how far it turns (rad) and moves the source's origin (m). */
export function difference(from: Pose, to: Pose): { rotation: number; translation: number } {
  const delta = multiplied(to, inverted(from));
  const moved = [0, 1, 2].map((row) => at(to, row, 3) - at(from, row, 3));
  return { rotation: Math.hypot(...rotationVector(delta)), translation: Math.hypot(...moved) };
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
  for (const row of [0, 1, 2]) {
    const turned = at(R, row, 0) * x + at(R, row, 1) * y + at(R, row, 2) * z;
    R[4 * row + 3] = (about[row] ?? 0) - turned + (shift[row] ?? 0);
  }
  return multiplied(R, T);
}

export function acted(T: Pose, x: number, y: number, z: number): [number, number, number] {
  return [
    at(T, 0, 0) * x + at(T, 0, 1) * y + at(T, 0, 2) * z + at(T, 0, 3),
    at(T, 1, 0) * x + at(T, 1, 1) * y + at(T, 1, 2) * z + at(T, 1, 3),
    at(T, 2, 0) * x + at(T, 2, 1) * y + at(T, 2, 2) * z + at(T, 2, 3),
  ];
}

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
