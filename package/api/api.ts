/** The API of the engine but for `load`, which differs between Node and the browser. */
import {
  type BasinEnds,
  type BasinLabels,
  type GridOptions,
  IcpLab,
  local_minima,
  type LocalMinimum,
  type PointCloud,
  type RegistrationOptions,
} from '../../pkg/scanstitch.js';
import { compareOwnIcp, type OwnIcpComparison } from '../lab/own_icp.js';

export type * from '../../pkg/scanstitch.js';
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
  Localization,
  map_image_name,
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
  Surface,
  Trajectory,
  version,
} from '../../pkg/scanstitch.js';

export type { OwnIcpComparison, OwnIcpFault, OwnIcpStep } from '../lab/own_icp.js';
export { read_own_poses } from '../lab/own_poses.js';
export type { LabScene } from '../lab/scenes.js';
export { lab_scene, lab_scenes } from '../lab/scenes.js';

/** Any subset of the fields of a grid; missing ones have their default values. */
export type LabGrid = Partial<Omit<GridOptions, 'T_center'>> & { T_center?: number[] };

/**
 * The cost of a registration over two of its unknowns (m^2): the mean robust loss of a source point, with the pairs searched at
 * every node. Without a grid: x and y, 1 m to either side of the registration's result, 101 x 101 nodes.
 */
export function cost_landscape(
  source: PointCloud,
  target: PointCloud,
  options: Partial<RegistrationOptions> & { grid?: LabGrid } = {},
): { grid: GridOptions; costs: Float64Array<ArrayBuffer>; minima: LocalMinimum[] } {
  const { grid, ...others } = options;
  return inLab(source, target, others, (lab) => {
    const T_center = grid?.T_center ?? resultOf(lab);
    const whole = gridOf(lab, { size: [101, 101], ...grid, T_center });
    const costs = lab.cost_landscape(whole);
    return { grid: whole, costs, minima: local_minima(costs, whole.size[0] ?? 1) };
  });
}

/**
 * The results of registrations that start at the nodes of a grid over one to three unknowns, grouped by minimum. `reference` is a
 * pose in the basin of the minimum that is taken as right; by default the result of the registration.
 */
export function basin_of_attraction(
  source: PointCloud,
  target: PointCloud,
  options: Partial<RegistrationOptions> & { grid?: LabGrid; reference?: number[] } = {},
): { grid: GridOptions; reference: number[]; ends: BasinEnds } & BasinLabels {
  const { grid, reference, ...others } = options;
  return inLab(source, target, others, (lab) => {
    const home = reference ?? resultOf(lab);
    const whole = gridOf(lab, { T_center: home, size: [31, 31], ...grid });
    const ends = lab.basin_of_attraction(whole);
    return { grid: whole, reference: home, ends, ...lab.label_ends(ends, Float64Array.from(home)) };
  });
}

function inLab<T>(
  source: PointCloud,
  target: PointCloud,
  options: Partial<RegistrationOptions>,
  look: (lab: IcpLab) => T,
): T {
  const lab = new IcpLab(source, target, options);
  try {
    return look(lab);
  } finally {
    lab.free();
  }
}

/** The pose that the registration ends at, and otherwise the one that it begins with. */
const resultOf = (lab: IcpLab) => lab.trace().poses.at(-1) ?? [...lab.initial()];

/** The whole of a grid: the sixteen numbers of its pose may be an array of any type. Without axes, x and y, 1 m to either side. */
function gridOf(lab: IcpLab, grid: LabGrid): GridOptions {
  return { axes: lab.is_planar ? [1, 2] : [3, 4], half_widths: [1, 1], ...grid } as GridOptions;
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
  options: Partial<RegistrationOptions> = {},
): OwnIcpComparison {
  return compareOwnIcp({ IcpLab }, source, target, options, poses);
}
