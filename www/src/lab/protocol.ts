/** What the view of the ICP lab and its workers say to each other. The names of the data are the engine's own. */
import type { OwnIcpComparison } from '../../../package/lab/own_icp.js';
import type { CloudData } from '../run/given-clouds.js';
import type {
  BasinEnds,
  BasinLabels,
  GridOptions,
  IcpIteration,
  IterationRecord,
  LocalMinimum,
  RegistrationOptions,
  SearchedBlock,
} from '../engine/package.js';

export type * from '../engine/package.js';
export type Options = Partial<RegistrationOptions>;
export type LabIteration = IcpIteration;

/** T_target_source: 4 x 4, row by row. */
export type Pose = ArrayLike<number>;

/** The two clouds as the loop uses them, after cleaning and thinning; x y z x y z ..., m, each in its own frame. */
export interface LabFacts {
  is_planar: boolean;
  source_points: Float32Array;
  target_points: Float32Array;
  /** NaN where a point has none; empty where none has. */
  target_normals: Float32Array;
}

/** A run of the loop from a start. */
export interface LabTrace {
  converged: boolean;
  end_reason: string;
  /** Pose before the first iteration, then the pose after each one: 16 numbers each. */
  poses: Float64Array;
  records: readonly IterationRecord[];
  /** Mean robust loss at each of the poses (m^2). */
  costs: readonly number[];
  /** Of the whole run in the worker, ms. */
  milliseconds: number;
}

/** In place of the partner of a rejected source point that has none. */
export const NO_PARTNER = 0xffffffff;

/** A grid of poses: around which one, over which unknowns, how far and how finely. */
export interface Grid {
  T_center: Pose;
  axes: readonly number[];
  /** rad, m */
  half_widths: readonly number[];
  size: readonly number[];
  /** Stride of the source points that are used; 1 is all. */
  stride: number;
}

/** Rows of a grid, from the first to before the second, counted through all layers. */
export interface GridPart extends Grid {
  rows: readonly [number, number];
}

export type EngineGrid = GridOptions;

/** What every worker of the lab does. A `method` is a number that the page gives to a set of options. */
export interface LabApi {
  start(module: WebAssembly.Module): string;
  open(source: CloudData, target: CloudData): void;
  prepare(method: number, options: Options): LabFacts;
  forget(method: number): void;
  trace(method: number, init: Pose | null): LabTrace;
  /** Of the last trace of the method, from exactly the pose that the loop had. */
  traced_iteration(method: number, index: number): LabIteration;
  /** `stride`: that of the source points that are used. */
  iteration(method: number, T: Pose, stride: number): LabIteration;
  landscape(method: number, part: GridPart): Float64Array;
  /** Planar clouds: blocks of the correlative search within half widths (m, rad), in the order in which it looks at them. */
  search_path(method: number, T_center: Pose, translation: number, rotation: number): SearchedBlock[];
  minima(costs: Float64Array, width: number): LocalMinimum[];
  basin(method: number, part: GridPart): BasinEnds;
  /** Somebody's own poses, the start first, beside the engine's steps. */
  own(method: number, poses: readonly (readonly number[])[]): OwnIcpComparison;
  /** Tells the ends of a basin apart. */
  label(method: number, ends: BasinEnds, reference: Pose): BasinLabels;
}
