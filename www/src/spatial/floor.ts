/** The squares on the floor under a map in space: how far they reach, and how large they are. */
import type { Vec3 } from '../views/vectors.js';

/** Larger maps (m) have squares of ten metres, others of one. */
const LARGE = 120;

/** In the floor's own axes, m. */
export interface FloorLines {
  x0: number;
  x1: number;
  z0: number;
  z1: number;
  /** Side of a square. */
  step: number;
}

/** `points`: what they lie under, in the picture's world; `azimuth`: how they are turned there. */
export function floorLines(points: readonly Vec3[], azimuth: number): FloorLines {
  const [cos, sin] = [Math.cos(azimuth), Math.sin(azimuth)];
  const along = points.map(([x, , z]) => x * cos - z * sin);
  const across = points.map(([x, , z]) => x * sin + z * cos);
  const low = (values: readonly number[]): number => Math.floor(values.reduce((a, b) => Math.min(a, b), 0)) - 1;
  const high = (values: readonly number[]): number => Math.ceil(values.reduce((a, b) => Math.max(a, b), 0)) + 1;
  const [x0, x1, z0, z1] = [low(along), high(along), low(across), high(across)];
  return { x0, x1, z0, z1, step: Math.max(x1 - x0, z1 - z0) > LARGE ? 10 : 1 };
}
