/** The floor on which a map in space is flattened to a grid: the same for the page and the command line. */
import type { Vec3 } from '../base/vectors.js';
import { layOf, type LevelPoints } from './leveling.js';

/** Heights over the floor (m): over thresholds and carpets, and below lamps and lintels. */
export const GRID_BAND = [0.2, 1.8] as const;

/** As the engine's `flattened_grid` takes it: away from the floor, and its height along that (m). */
export function floorOf(
  points: LevelPoints,
  sensors: readonly Vec3[],
  hasCamera: boolean,
): { up: Vec3; floor: number } {
  const { R_view_map, heights } = layOf(points, sensors, hasCamera);
  return { up: R_view_map[1], floor: heights.floor };
}
