/** The poses of a trace, the start first. */
import type { LabTrace, Pose } from './protocol.js';

export const numPoses = (trace: { readonly poses: ArrayLike<number> } | null): number =>
  trace ? trace.poses.length / 16 : 0;

/** After so many steps; empty where the trace has no such pose. */
export const poseAt = (trace: LabTrace | null, at: number): Pose => trace?.poses.slice(16 * at, 16 * at + 16) ?? [];

export const lastPose = (trace: LabTrace): Pose => poseAt(trace, numPoses(trace) - 1);
