/** What the view and its worker say to each other. Plain data: views know neither the worker nor the engine. */
import type { EvaluationOptions, EvaluationSummary } from '../../../pkg/scanstitch.js';

export type { EvaluationOptions, EvaluationSummary };

/** A trajectory in a file. */
export interface TrajectoryFile {
  /** No other file's, though it may have the same name. */
  id: number;
  name: string;
  bytes: Uint8Array;
}

export interface Question {
  id: number;
  reference: TrajectoryFile;
  estimates: readonly TrajectoryFile[];
  options: Partial<EvaluationOptions>;
}

/** An estimate compared with the reference; poses that belong together have the same index in all arrays. */
export interface Comparison {
  id: number;
  name: string;
  summary: EvaluationSummary;
  errors: Float64Array;
  /** The pose of each error. */
  error_poses: Uint32Array;
  /** Times of the reference's poses (s); null without times. */
  stamps: Float64Array | null;
  /** Path travelled (m). */
  distances: Float64Array;
  /** x y z of each pose (m). */
  reference_positions: Float64Array;
  estimate_positions: Float64Array;
  /** Roll, pitch, yaw of each pose (rad); null without orientations. */
  reference_angles: Float64Array | null;
  estimate_angles: Float64Array | null;
}

/** An estimate that cannot be compared, and why. */
export interface Refusal {
  id: number;
  name: string;
  problem: string;
}

export interface Answer {
  id: number;
  comparisons: Comparison[];
  refusals: Refusal[];
  /** What is wrong with the reference itself; nothing was compared then. */
  reference_problem: string | null;
  /** Reading and computing in the worker (ms). */
  elapsed_ms: number;
}

export type ToWorker = { type: 'start'; module: WebAssembly.Module } | { type: 'ask'; question: Question };
export type FromWorker = { type: 'ready' } | { type: 'answer'; answer: Answer } | { type: 'crashed'; message: string };
