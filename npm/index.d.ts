/// <reference lib="esnext.disposable" />
/**
 * Laser scans to a trajectory and a stitched map, in Node and in the browser.
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
 * Makes the engine ready. Everything else may be called once the promise is fulfilled; calling it again is free.
 *
 * @param engine Where the engine comes from, when it is not beside this file: its address, its response, its bytes, or
 *   the compiled module, which workers can be sent.
 */
export function load(engine?: string | URL | Request | Response | BufferSource | WebAssembly.Module): Promise<void>;

/** Some of the fields of a grid; the others have their defaults. */
export type LabGrid = Partial<Omit<GridOptions, 'T_center'>> & { T_center?: number[] };

/**
 * The cost of a registration over two of its unknowns (m^2): the mean robust loss of a source point, with the pairs searched at
 * every node. Without a grid: x and y, 1 m to either side of where the registration ends, 101 x 101 nodes.
 */
export function cost_landscape(
  source: PointCloud,
  target: PointCloud,
  options?: Partial<RegistrationOptions> & { grid?: LabGrid },
): { grid: GridOptions; costs: Float64Array<ArrayBuffer>; minima: LocalMinimum[] };

/**
 * Where registrations end that start at the nodes of a grid over one to three unknowns, and which ends are the same minimum.
 * `reference` is a pose of the minimum that is called right; without, where the registration ends.
 */
export function basin_of_attraction(
  source: PointCloud,
  target: PointCloud,
  options?: Partial<RegistrationOptions> & { grid?: LabGrid; reference?: number[] },
): { grid: GridOptions; reference: number[]; ends: BasinEnds } & BasinLabels;

/** A step of somebody's own ICP beside the engine's from the same pose. */
export interface OwnIcpStep {
  /** Their pose before it: 4 x 4, row by row. */
  T_before: number[];
  /** Their pose after it. */
  T_own: number[];
  /** Where the engine's step from `T_before` leads. */
  T_ours: number[];
  /** How far the two are apart (rad). */
  rotation: number;
  /** How far the two are apart (m). */
  translation: number;
}

/** Why their step differs from the engine's. */
export interface OwnIcpFault {
  kind: 'input' | 'pairs' | 'weights' | 'solution' | 'unknown';
  name: string;
  text: string;
}

export interface OwnIcpComparison {
  steps: OwnIcpStep[];
  /** The first step that differs, from 0; null where all are followed. */
  parts_at: number | null;
  /** The one of the known faults that gives exactly their steps from there; null where all are followed. */
  fault: OwnIcpFault | null;
  /** Iterations that the engine's own loop takes from the same start. */
  num_ours: number;
}

/**
 * Follows somebody's own ICP: from each of their poses (T_target_source after each iteration, 16 numbers, the start before them
 * or not) the engine does one step by `options`, and theirs is compared with it. Where they part, the fault is looked for in the
 * pairs, the weights and the solution. For an ICP without weights and limits give `robust_kernel: 'none'`,
 * `max_correspondence_distance: 1e6` and `max_normal_angle: Math.PI`.
 */
export function compare_own_icp(
  source: PointCloud,
  target: PointCloud,
  poses: ArrayLike<number>[],
  options?: Partial<RegistrationOptions>,
): OwnIcpComparison;

/**
 * Reads the poses of an own ICP, a 3 x 3 or 4 x 4 matrix an iteration, from CSV, JSON or npy (by the name's ending). Throws an
 * Error that says what is wrong: not rigid, transposed, a reflection, matrices of other lengths.
 */
export function read_own_poses(bytes: Uint8Array, name: string): number[][];

/** A small scene with one thing to see. */
export interface LabScene {
  name: string;
  title: string;
  /** What to look at. */
  look_at: string;
  question: string;
  answer: string;
  /** x y z of each point (m); z is 0 in planar scenes. */
  source: Float32Array;
  target: Float32Array;
  /** True motion: 4 x 4, row by row. */
  T_reference: number[];
  /** Options to set side by side, the first to begin with. */
  methods: Partial<RegistrationOptions>[];
}

/** Names of the scenes of the gallery, in its order. */
export function lab_scenes(): string[];

/** Makes a scene of the gallery. Throws a RangeError where there is none of this name. */
export function lab_scene(name: string): LabScene;
