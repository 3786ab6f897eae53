/// <reference lib="esnext.disposable" />
/**
 * Laser scans, depth images and point clouds to a trajectory and a stitched map, in Node and in the browser.
 *
 * ```js
 * import { readFile } from 'node:fs/promises';
 * import { load, Reconstruction } from 'scanstitch';
 *
 * await load();
 * const reconstruction = new Reconstruction({ max_range: 30 });
 * for (const name of ['0.ply', '1.ply', '2.ply']) {
 *   reconstruction.add_scan(name, await readFile(name));
 * }
 * while (reconstruction.step().stage !== 'done');
 * for (const { name, T_world_sensor } of reconstruction.result().frames) {
 *   console.log(name, T_world_sensor.x, T_world_sensor.y, T_world_sensor.theta); // m, m, rad
 * }
 * reconstruction.free();
 * ```
 *
 * Trajectories are compared with a reference as evo does:
 *
 * ```js
 * import { readFile } from 'node:fs/promises';
 * import { evaluate, load, Trajectory } from 'scanstitch';
 *
 * await load();
 * const reference = Trajectory.read(await readFile('reference.tum'), 'reference.tum');
 * const mine = Trajectory.read(await readFile('mine.tum'), 'mine.tum');
 * const evaluation = evaluate(reference, mine, { alignment: 'se3' });
 * console.log(evaluation.summary().statistics.rmse, evaluation.errors()); // m
 * ```
 *
 * SI units and radians everywhere. `T_target_source` maps points of the source into the target; `T_world_sensor` is a
 * pose. What is thrown for bad input is a {@link ScanstitchError}.
 */
import type {
  BasinEnds,
  BasinLabels,
  GridOptions,
  LocalMinimum,
  PointCloud,
  RegistrationOptions,
} from '../pkg/scanstitch.js';

export type * from '../pkg/scanstitch.js';
export {
  bev_in_axes,
  bev_presets,
  bev_refine,
  bev_with_poses,
  BevImage,
  BirdsEyeView,
  check_bev_image,
  decode_depth,
  DepthConsistency,
  DepthPicture,
  DepthPixels,
  describe_settings,
  describe_spatial_settings,
  describe_strategy_settings,
  describe_table,
  Evaluation,
  evaluate,
  evaluation_defaults,
  FrameClouds,
  IcpLab,
  local_minima,
  map_quality,
  PointCloud,
  PoseGraph,
  prepare_cloud,
  prepare_frame,
  presets,
  read_bev_pairs,
  read_bev_points,
  read_bev_scene,
  is_laser_log,
  OccupancyGrid,
  Reconstruction,
  register,
  relation_errors,
  spatial_presets,
  SpatialMapPoints,
  SpatialReconstruction,
  strategy_presets,
  StrategyComparison,
  Trajectory,
  version,
} from '../pkg/scanstitch.js';

/**
 * Loads the engine. All other functions may be called once the promise is fulfilled; further calls have no effect.
 *
 * @param engine Where the engine comes from, when it is not beside this file: its address, its response, its bytes, or
 *   the compiled module, which workers can be sent.
 */
export function load(engine?: string | URL | Request | Response | BufferSource | WebAssembly.Module): Promise<void>;

/** Any subset of the fields of a grid; missing ones have their default values. */
export type LabGrid = Partial<Omit<GridOptions, 'T_center'>> & { T_center?: number[] };

/**
 * The cost of a registration over two of its unknowns (m^2): the mean robust loss of a source point, with the pairs searched at
 * every node. Without a grid: x and y, 1 m to either side of the registration's result, 101 x 101 nodes.
 */
export function cost_landscape(
  source: PointCloud,
  target: PointCloud,
  options?: Partial<RegistrationOptions> & { grid?: LabGrid },
): { grid: GridOptions; costs: Float64Array<ArrayBuffer>; minima: LocalMinimum[] };

/**
 * The results of registrations that start at the nodes of a grid over one to three unknowns, grouped by minimum. `reference` is a
 * pose in the basin of the minimum that is taken as right; by default the result of the registration.
 */
export function basin_of_attraction(
  source: PointCloud,
  target: PointCloud,
  options?: Partial<RegistrationOptions> & { grid?: LabGrid; reference?: number[] },
): { grid: GridOptions; reference: number[]; ends: BasinEnds } & BasinLabels;

/** A step of an own ICP beside the engine's step from the same pose. */
export interface OwnIcpStep {
  /** The own ICP's pose before the step: 4 x 4, row by row. */
  T_before: number[];
  /** The own ICP's pose after the step. */
  T_own: number[];
  /** The pose after the engine's step from `T_before`. */
  T_ours: number[];
  /** Rotation between the two poses after the step (rad). */
  rotation: number;
  /** Translation between the two poses after the step (m). */
  translation: number;
}

/** Why a step of an own ICP differs from the engine's. */
export interface OwnIcpFault {
  kind: 'input' | 'pairs' | 'weights' | 'solution' | 'unknown';
  name: string;
  text: string;
}

export interface OwnIcpComparison {
  steps: OwnIcpStep[];
  /** Index of the first step that differs, from 0; null where all agree. */
  parts_at: number | null;
  /** The known fault that reproduces the own steps from there; null where all agree. */
  fault: OwnIcpFault | null;
  /** Number of iterations of the engine's loop from the same start. */
  num_ours: number;
}

/**
 * Compares the steps of an own ICP with the engine's: from each of the own poses (T_target_source after each iteration, 16 numbers,
 * with or without the start before them) the engine does one step by `options`. Where the steps differ, the fault is searched in
 * the pairs, the weights and the solution. For an ICP without weights and limits give `robust_kernel: 'none'`,
 * `max_correspondence_distance: 1e6` and `max_normal_angle: Math.PI`.
 */
export function compare_own_icp(
  source: PointCloud,
  target: PointCloud,
  poses: ArrayLike<number>[],
  options?: Partial<RegistrationOptions>,
): OwnIcpComparison;

/**
 * Reads the poses of an own ICP, a 3 x 3 or 4 x 4 matrix per iteration, from CSV, JSON or npy (by the file extension). Throws an
 * Error with the reason: not rigid, transposed, a reflection, matrices of other lengths.
 */
export function read_own_poses(bytes: Uint8Array, name: string): number[][];

/** A small scene that demonstrates one effect. */
export interface LabScene {
  name: string;
  title: string;
  /** A hint at what to observe. */
  look_at: string;
  question: string;
  answer: string;
  /** x y z of each point (m); z is 0 in planar scenes. */
  source: Float32Array;
  target: Float32Array;
  /** True motion: 4 x 4, row by row. */
  T_reference: number[];
  /** Options to compare, the initially selected ones first. */
  methods: Partial<RegistrationOptions>[];
}

/** Names of the scenes of the gallery, in its order. */
export function lab_scenes(): string[];

/** Makes a scene of the gallery. Throws a RangeError if there is none of this name. */
export function lab_scene(name: string): LabScene;
