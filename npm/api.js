// @ts-check
/**
 * The API of the engine but for `load`, which differs between Node and the browser. Types and documentation are in
 * `index.d.ts`.
 */
import { IcpLab, local_minima } from '../pkg/scanstitch.js';
import { compareOwnIcp } from './lab/own_icp.js';

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

export { read_own_poses } from './lab/own_poses.js';
export { lab_scene, lab_scenes } from './lab/scenes.js';

/** @type {typeof import('./index.js').cost_landscape} */
export function cost_landscape(source, target, options = {}) {
  const { grid, ...others } = options;
  const lab = new IcpLab(source, target, others);
  try {
    const T_center = grid?.T_center ?? lab.trace().poses.at(-1) ?? [...lab.initial()];
    const axes = lab.is_planar ? [1, 2] : [3, 4];
    const whole = gridOf({ axes, half_widths: [1, 1], size: [101, 101], ...grid, T_center });
    const costs = lab.cost_landscape(whole);
    return { grid: whole, costs, minima: local_minima(costs, whole.size[0] ?? 1) };
  } finally {
    lab.free();
  }
}

/** @type {typeof import('./index.js').basin_of_attraction} */
export function basin_of_attraction(source, target, options = {}) {
  const { grid, reference, ...others } = options;
  const lab = new IcpLab(source, target, others);
  try {
    const home = reference ?? lab.trace().poses.at(-1) ?? [...lab.initial()];
    const axes = lab.is_planar ? [1, 2] : [3, 4];
    const whole = gridOf({ T_center: home, axes, half_widths: [1, 1], size: [31, 31], ...grid });
    const ends = lab.basin_of_attraction(whole);
    return { grid: whole, reference: home, ends, ...lab.label_ends(ends, Float64Array.from(home)) };
  } finally {
    lab.free();
  }
}

/** A type cast: the sixteen numbers of a pose may be an array of any type. @param {object} grid */
function gridOf(grid) {
  return /** @type {import('./index.js').GridOptions} */ (grid);
}

/** @type {typeof import('./index.js').compare_own_icp} */
export function compare_own_icp(source, target, poses, options = {}) {
  return compareOwnIcp({ IcpLab }, source, target, options, poses);
}
