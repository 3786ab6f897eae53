/** What the view and its workers say to each other. Plain data: views know neither the workers nor the engine. */
import type {
  EvaluationOptions,
  EvaluationSummary,
  FrameQuality,
  MapQuality,
  RelationErrors,
} from '../engine/package.js';

export type * from '../engine/package.js';

/** A file as it was opened. */
export interface Part {
  name: string;
  bytes: Uint8Array;
}

/** A trajectory: one file, or a file with one pose for each frame. */
export interface TrajectoryFile {
  /** No other trajectory's, though it may have the same name. */
  id: number;
  name: string;
  parts: readonly Part[];
}

/** Times of the poses, one a line. */
export interface TimesFile extends Part {
  /** No other file's, though it may have the same name. */
  id: number;
}

export interface Query {
  reference: number;
  estimates: readonly number[];
  options: Partial<EvaluationOptions>;
  /** For trajectories without times. */
  times: TimesFile | null;
  /** Relations between poses that are known to be right. */
  relations: Part | null;
  /** Leaves out relations between one pose and the next. */
  loops_only: boolean;
}

/** An estimate compared with the reference; poses that belong together have the same index in all arrays. */
export interface Comparison {
  id: number;
  name: string;
  summary: EvaluationSummary;
  /** Null without a list of relations, or where none can be compared. */
  relations: RelationErrors | null;
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
  referenceAngles: Float64Array | null;
  estimateAngles: Float64Array | null;
}

/** An estimate that cannot be compared, and why. */
export interface Refusal {
  id: number;
  name: string;
  problem: string;
}

export interface Result {
  comparisons: Comparison[];
  refusals: Refusal[];
  /** Why no estimate could be aligned at the first pose, as was chosen: all are aligned by SE(3) then. Null where they could. */
  realigned: string | null;
  /** What is wrong with the reference itself; nothing was compared then. */
  referenceProblem: string | null;
  /** What reading the reference showed. */
  referenceNotes: readonly string[];
  /** What is wrong with the list of relations. */
  relationProblems: string[];
  /** Reading and computing in the worker (ms). */
  elapsed_ms: number;
}

/** Maps to be judged; and clouds that are the frames of a recording, with the trajectories that may place them. */
export interface MapQuery {
  maps: readonly Part[];
  frames: readonly Part[];
  trajectories: readonly TrajectoryFile[];
}

export interface MapResult {
  maps: { name: string; quality: MapQuality }[];
  /** By the trajectory that places the frames. */
  placed: { name: string; quality: FrameQuality }[];
  refusals: { name: string; problem: string }[];
  elapsed_ms: number;
}

/** A worker that takes commands and answers queries, one at a time. */
export interface QueryApi<Command, Query, Result> {
  start(module: WebAssembly.Module): void;
  tell(command: Command): void;
  ask(query: Query): Result;
}

/** For the worker of comparisons: trajectories to read, when a query needs them, and to forget. */
export interface Command {
  add: readonly TrajectoryFile[];
  remove: readonly number[];
}
