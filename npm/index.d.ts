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
