/** Poses in the plane, one after the other. */
import type { PlanarPose } from '../engine/protocol.js';

export function composed(a: PlanarPose, b: PlanarPose): PlanarPose {
  const { x, y } = placed(a, b.x, b.y);
  return { x, y, theta: a.theta + b.theta };
}

export function inverse({ x, y, theta }: PlanarPose): PlanarPose {
  const [cos, sin] = [Math.cos(theta), Math.sin(theta)];
  return { x: -x * cos - y * sin, y: x * sin - y * cos, theta: -theta };
}

/** Where a pose takes a point. */
export function placed(pose: PlanarPose, x: number, y: number): { x: number; y: number } {
  const [cos, sin] = [Math.cos(pose.theta), Math.sin(pose.theta)];
  return { x: pose.x + x * cos - y * sin, y: pose.y + x * sin + y * cos };
}
