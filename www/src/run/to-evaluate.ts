/** A run, as the evaluation takes it over. */
import type { FrameResult, PlanarPoint, PlanarPose } from '../engine/protocol.js';
import type { SpatialPose } from '../engine/spatial-protocol.js';
import type { GivenFiles } from './run-kind.js';

interface Comparison {
  name: string;
  rotation_errors: readonly (number | null)[];
}

/** A frame that was placed: its pose, and that of the run's reference. */
export interface ComparedFrame {
  index: number;
  time: number | null;
  pose: SpatialPose;
  /** Null: there is none. */
  reference: SpatialPose | null;
}

/** What is to be known of a run's comparison with its reference. */
export function comparedWith(comparison: Comparison | null): { name: string; has_orientations: boolean } | null {
  if (!comparison) return null;
  return { name: comparison.name, has_orientations: comparison.rotation_errors.some((error) => error !== null) };
}

/**
 * The frames that were placed and, where the run has a reference, its poses. Those are taken from the comparison, not from
 * the file: there they are in the estimate's world, whatever the file's axes and quaternions were, and each stands at its
 * frame. Times are the numbers of the frames where these have none. `compared`: the reference's name, and whether it has
 * orientations.
 */
export function trajectoriesToEvaluate(
  frames: readonly ComparedFrame[],
  compared: { name: string; has_orientations: boolean } | null,
  readMap: GivenFiles['readMap'],
): GivenFiles {
  // Times that are repeated or go back do not tell frames apart.
  const isTimed = frames.every(
    ({ time }, at) => time !== null && time > (frames[at - 1]?.time ?? Number.NEGATIVE_INFINITY),
  );
  const both = compared ? frames.filter(({ reference }) => reference !== null) : frames;
  const stamp = ({ index, time }: ComparedFrame): number => (isTimed && time !== null ? time : index);
  const line = (frame: ComparedFrame, pose: SpatialPose): string => {
    const { x, y, z, qx, qy, qz, qw } = pose;
    return `${[stamp(frame), x, y, z, qx, qy, qz, qw].join(' ')}\n`;
  };
  const reference = both.flatMap((frame) => (frame.reference ? [[frame, frame.reference] as const] : []));
  const text = reference.map(([frame, pose]) =>
    compared?.has_orientations ? line(frame, pose) : `${pose.x} ${pose.y} ${pose.z}\n`,
  );
  return {
    reference: compared && {
      name: compared.name,
      bytes: new TextEncoder().encode(text.join('')).buffer as ArrayBuffer,
    },
    estimate: { name: 'this run', text: both.map((frame) => line(frame, frame.pose)).join('') },
    alignment: compared?.has_orientations ? 'origin' : 'se3',
    readMap,
  };
}

/** Poses in the plane and their partners in the reference, as poses in space. */
export function placedInPlane(
  frames: readonly FrameResult[],
  references: readonly (PlanarPoint | null)[] = [],
): ComparedFrame[] {
  return frames.flatMap(({ index, time, status, T_world_sensor }, at) => {
    if (status === 'lost') return [];
    const reference = references[at] ?? null;
    const { x = 0, y = 0, heading = null } = reference ?? {};
    return [
      { index, time, pose: inSpace(T_world_sensor), reference: reference && inSpace({ x, y, theta: heading ?? 0 }) },
    ];
  });
}

/** A pose of the plane as one of space. */
function inSpace({ x, y, theta }: PlanarPose): SpatialPose {
  return { x, y, z: 0, qx: 0, qy: 0, qz: Math.sin(theta / 2), qw: Math.cos(theta / 2) };
}
