// @ts-check
/**
 * The `scanstitch` package: the typed API of the engine, in Node and in the browser. Types and documentation are in
 * `index.d.ts`.
 */
import init, { initSync } from '../pkg/scanstitch.js';

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

/** @type {Promise<void> | undefined} */
let loading;

/** @type {typeof import('./index.js').load} */
export function load(engine) {
  loading ??= instantiate(engine).catch((error) => {
    loading = undefined; // a failed download may succeed at the next try
    throw error;
  });
  return loading;
}

/** @param {Parameters<typeof import('./index.js').load>[0]} engine */
async function instantiate(engine) {
  const path = new URL('../pkg/scanstitch_bg.wasm', import.meta.url);
  if (engine instanceof WebAssembly.Module || engine instanceof ArrayBuffer || ArrayBuffer.isView(engine)) {
    initSync({ module: engine });
  } else if (engine === undefined && path.protocol === 'file:') {
    // Node's fetch reads no files.
    const { readFile } = await import(/* @vite-ignore */ 'node:fs/promises');
    initSync({ module: await readFile(path) });
  } else {
    await init({ module_or_path: engine ?? path });
  }
}
