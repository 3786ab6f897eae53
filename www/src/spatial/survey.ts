/** What is measured of a map before it is shown: how it lies before the eye, how high it is, which way its walls run. */
import type { MapPoints } from '../engine/spatial-protocol.js';
import { type Heights, layOf, NUM_SAMPLES, sample, straightAzimuth } from './leveling.js';
import { type Pose, positionOf } from './poses.js';
import { fitted, type Orbit, type Size } from '../views/orbit.js';
import { type Mat3, transformed, type Vec3 } from '../views/vectors.js';

export interface Survey {
  R_view_map: Mat3;
  /** Some of the map's points in the picture's world: enough to fit a view to. */
  sampled: readonly Vec3[];
  heights: Heights;
  /** The azimuth at which the walls run across and along the screen. */
  straight: number;
}

export const NO_SURVEY: Survey = {
  R_view_map: [
    [1, 0, 0],
    [0, -1, 0],
    [0, 0, -1],
  ],
  sampled: [],
  heights: { floor: 0, top: 0, section: 0 },
  straight: 0,
};

/** Factor by which fewer points are used while the map grows, since it is surveyed repeatedly. */
const ROUGHNESS = 5;

export function leveled(
  before: Survey,
  points: MapPoints,
  poses: readonly Pose[],
  { hasCamera, isRough }: { hasCamera: boolean; isRough: boolean },
): Survey {
  // Without points the picture stays as it lies.
  if (points.positions.length === 0) return { ...before, sampled: [], heights: NO_SURVEY.heights };
  const count = isRough ? NUM_SAMPLES / ROUGHNESS : NUM_SAMPLES;
  const { R_view_map, heights } = layOf(points, poses.map(positionOf), hasCamera, count);
  return { R_view_map, sampled: sample(points, R_view_map, count), heights, straight: before.straight };
}

/** With the walls' direction, from what a section at the height `cut` leaves open. */
export function straightened(
  survey: Survey,
  poses: readonly Pose[],
  { cut, isWide }: { cut: number; isWide: boolean },
): Survey {
  if (survey.sampled.length === 0) return survey;
  return { ...survey, straight: straightAzimuth(openSamples(survey, poses, cut), isWide) };
}

/** What the section leaves, and all cameras: as heavy as a part of the map, lest they count as strays. */
function openSamples({ sampled, R_view_map }: Survey, poses: readonly Pose[], cut: number): Vec3[] {
  const open = sampled.filter(([, y]) => y <= cut);
  const cameras = positions(poses, R_view_map);
  const weight = Math.ceil((open.length * 0.02) / Math.max(cameras.length, 1));
  return [...open, ...Array.from({ length: weight }, () => cameras).flat()];
}

/** Of the cameras, in the picture's world. */
export function positions(poses: readonly Pose[], R_view_map: Mat3): Vec3[] {
  return poses.map((pose) => transformed(R_view_map, positionOf(pose)));
}

/** The orbit that shows all that a section at the height `cut` leaves, from where this one looks. */
export function fittedTo(survey: Survey, poses: readonly Pose[], cut: number, orbit: Orbit, size: Size): Orbit {
  // The buttons need room at the right, and the picture is to stay in the middle.
  const margin = size.width < 520 ? { across: 30, along: 16 } : { across: 56, along: 30 };
  return fitted(orbit, openSamples(survey, poses, cut), size, margin);
}
