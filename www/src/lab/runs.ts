/** The methods that the lab compares: one run each, and what can be said of it. */
import type { GivenClouds } from '../run/given-clouds.js';
import type { Colors } from '../views/axes.js';
import { baseName, formatLength } from '../views/format.js';
import type { LabFacts, LabTrace, Options } from './protocol.js';
import type { OwnIcpComparison } from '../../../package/lab/own_icp.js';

/** Entries of poses that differ by less are equal: a file of nine digits. */
const SAME_POSE = 1e-8;

/** One method, and what came of it. */
export interface LabRun {
  id: number;
  options: Options;
  facts: LabFacts | null;
  trace: LabTrace | null;
  /** Why there is no trace. */
  problem: string;
  /** Poses of somebody else's program: the name of its file; empty for the engine's own runs. */
  own: string;
  /** Of such poses with the engine's steps. */
  comparison: OwnIcpComparison | null;
}

/** `own`: the name of the file of somebody else's poses. */
export function newRun(id: number, options: Options, own = ''): LabRun {
  return { id, options, facts: null, trace: null, problem: '', own, comparison: null };
}

/** Poses of somebody else's program from this start on, whether or not they hold it. */
export function withStart(
  poses: readonly (readonly number[])[],
  start: readonly number[],
): readonly (readonly number[])[] {
  const hasStart = poses[0]?.every((value, i) => Math.abs(value - (start[i] ?? 0)) < SAME_POSE);
  return hasStart ? poses : [start, ...poses];
}

export function traceOfPoses(poses: readonly (readonly number[])[]): LabTrace {
  const all = Float64Array.from(poses.flat());
  return { converged: true, end_reason: '', poses: all, records: [], costs: [], milliseconds: 0 };
}

/** Why a start gives no registration, and the remedy. `reach`: the largest distance of a pair, m. */
export function startProblem(
  { records, end_reason }: LabTrace,
  reach: number,
): [problem: string, remedy: string] | null {
  const [first] = records;
  if (first?.num_correspondences === 0) {
    return [
      `The clouds do not overlap from this start: no point of the source has a partner within ${formatLength(reach)}`,
      'Drag the source onto the target, or raise the largest pair distance under Methods',
    ];
  }
  if (end_reason !== 'no_step') return null;
  return first?.num_inliers === 0
    ? [
        'Every pair is rejected from this start: by distance, by the normals, or as the target has none',
        'Drag the source nearer to the target, or raise the largest distance or normal angle under Methods',
      ]
    : [
        'The pairs do not determine a step: there are too few, or the target has no normals to measure along',
        'Choose point to point under Methods, or clouds of more points',
      ];
}

export function runColor({ runs }: { runs: readonly LabRun[] }, run: LabRun, { estimates }: Colors): string {
  return estimates[runs.indexOf(run) % estimates.length] ?? 'currentColor';
}

/** "2.ply to 1.ply" */
export const pairName = ({ source, target }: GivenClouds): string => `${baseName(source)} to ${baseName(target)}`;
