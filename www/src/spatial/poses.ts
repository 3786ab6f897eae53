/** Poses of the sensor, and what is drawn of them: pieces of lines in the map's world. */
import type { SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import { added, turned, type Vec3 } from '../views/vectors.js';

export type Pose = SpatialPose;
export type Camera = NonNullable<SpatialResult['camera']>;

export const positionOf = ({ x, y, z }: Pose): Vec3 => [x, y, z];

export function pathSegments(positions: readonly (Vec3 | null)[]): [Vec3, Vec3][] {
  const segments: [Vec3, Vec3][] = [];
  let last: Vec3 | null = null;
  for (const position of positions) {
    if (position && last) segments.push([last, position]);
    last = position ?? last;
  }
  return segments;
}

/** The four corners of what a camera sees, `depth` m before it, in the world. */
export function corners(pose: Pose, camera: Camera, depth: number): Vec3[] {
  const { width, height, fx, fy, cx, cy } = camera;
  const pixels: [number, number][] = [
    [0, 0],
    [width, 0],
    [width, height],
    [0, height],
  ];
  return pixels.map(([u, v]) =>
    added(positionOf(pose), turned(pose, [((u - cx) / fx) * depth, ((v - cy) / fy) * depth, depth])),
  );
}

/** A pyramid from the eye to what it sees. */
export function frustumSegments(pose: Pose, camera: Camera, depth: number): [Vec3, Vec3][] {
  const eye = positionOf(pose);
  const rim = corners(pose, camera, depth);
  return rim.flatMap((corner, i): [Vec3, Vec3][] => [
    [eye, corner],
    [corner, rim[(i + 1) % 4] as Vec3],
  ]);
}
