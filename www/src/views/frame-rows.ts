/** The table's rows, from the engine's results and the clock. */
import type { Status } from './map-painter.js';

interface Frame {
  name: string;
  T_world_sensor: { x: number; y: number; theta: number };
  status: Status;
  num_inliers: number;
  fitness: number;
  inlier_rmse: number;
  iterations: number;
}

export interface FrameRow extends Omit<Frame, 'T_world_sensor'> {
  frame: number;
  x: number;
  y: number;
  theta: number;
  /** Distance to the reference, m; null without one. */
  error: number | null;
  ms: number;
  /** The first frame is where the map begins: it is matched with nothing. */
  isOrigin: boolean;
}

export function frameRows(
  frames: readonly Frame[],
  ms: readonly number[],
  errors: readonly (number | null | undefined)[],
): FrameRow[] {
  return frames.map(({ name, T_world_sensor, status, num_inliers, fitness, inlier_rmse, iterations }, frame) => ({
    frame,
    name,
    ...T_world_sensor,
    num_inliers,
    fitness,
    inlier_rmse,
    iterations,
    error: errors[frame] ?? null,
    ms: ms[frame] ?? 0,
    status,
    isOrigin: frame === 0 && iterations === 0,
  }));
}
