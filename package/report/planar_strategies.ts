/** A run of planar scans as one of several strategies: what it costs and gains. */
import type { ReconstructionResult } from '../../pkg/scanstitch.js';
import { median } from '../formats/angles.js';
import { csv } from '../base/tables.js';
import type { Compared } from './strategy_table.js';

/**
 * @param mapSizes number of points that each scan has on the map
 * @param milliseconds of each scan, from its registration
 * @param total of all steps, those of no single scan included (ms)
 */
export function comparedPlanar(
  { frames, settings, sharpness, comparison, notes }: ReconstructionResult,
  mapSizes: ArrayLike<number>,
  milliseconds: readonly number[],
  total: number,
): Compared {
  let map_points = 0;
  const count = (wanted: string): number => frames.filter(({ status }) => status === wanted).length;
  const placed = frames.map(({ name, index, T_world_sensor: { x, y } }, at) => {
    map_points += mapSizes[at] ?? 0;
    return { name, index, T_world_sensor: { x, y, z: 0 }, map_points };
  });
  return {
    settings,
    frames: placed,
    num_lost: count('lost'),
    num_doubtful: count('doubtful'),
    map_points,
    timing:
      frames.length > 1
        ? { median: median(milliseconds.slice(1)), last: milliseconds.at(-1) ?? 0, total, trend: null }
        : null,
    comparison: comparison && {
      ...{ ape_mean: comparison.mean, ape_rmse: comparison.rmse, ape_max: comparison.max },
      ...{ num_matched: comparison.num_matched, errors: comparison.errors },
      reference: comparison.reference.map((pose) => pose && { x: pose.x, y: pose.y, z: 0 }),
    },
    mean_residual: sharpness?.mean_residual ?? null,
    notes,
  };
}

/** One line a scan and strategy. */
export function planarFramesCsvOf(
  rows: readonly { name: string; result: ReconstructionResult; milliseconds: readonly number[] }[],
) {
  const heads = [
    'strategy',
    'index',
    'name',
    'status',
    'ms',
    'num_inliers',
    'inlier_rmse',
    'iterations',
    'error',
    'x',
    'y',
  ];
  const lines = rows.flatMap(({ name, result, milliseconds }) =>
    result.frames.map(({ T_world_sensor: { x, y, theta }, ...frame }, at) => [
      ...[name, frame.index, frame.name, frame.status, milliseconds[at] ?? null, frame.num_inliers, frame.inlier_rmse],
      ...[frame.iterations, result.comparison?.errors[at] ?? null, x, y, theta],
    ]),
  );
  return csv([[...heads, 'theta'], ...lines]);
}
