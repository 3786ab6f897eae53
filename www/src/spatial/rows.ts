/** The table of a run in space: one row a frame. */
import { csvFormatRows } from 'd3-dsv';
import { html } from 'lit';
import type { SpatialFrameResult, SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import { DEGREES, formatAngle, formatCoordinate, formatCount, formatFixed, formatPercent } from '../views/format.js';
import { type Column, millimetres, type TableRow, UNKNOWN } from '../views/frame-columns.js';

export interface SpatialRow extends TableRow {
  result: SpatialFrameResult;
  error: number | null;
  rotationError: number | null;
  ms: number;
  /** The first frame is where the map begins: it is matched with nothing. */
  isOrigin: boolean;
}

export function spatialRows(result: SpatialResult | null, ms: readonly number[]): SpatialRow[] {
  return (result?.frames ?? []).map((frame, index) => ({
    frame: index,
    name: frame.name,
    status: frame.status,
    result: frame,
    error: result?.comparison?.errors[index] ?? null,
    rotationError: result?.comparison?.rotation_errors[index] ?? null,
    ms: ms[index] ?? 0,
    isOrigin: index === 0 && frame.history.length === 0,
  }));
}

/** Turn about the vertical of the first frame, rad, positive to the right: where the sensor's z axis points. */
export function heading({ qx, qy, qz, qw }: SpatialPose): number {
  return Math.atan2(2 * (qx * qz + qw * qy), 1 - 2 * (qx * qx + qy * qy));
}

/** `referenceName` empty: no columns for the distance to it. */
export function spatialColumns(referenceName: string, hasCamera: boolean): Column<SpatialRow>[] {
  const columns: Column<SpatialRow>[] = [];
  // First: they are what a run is judged by, and the last columns may have to be scrolled to.
  if (referenceName !== '') {
    columns.push(
      {
        label: 'error',
        unit: 'mm',
        title: `distance to ${referenceName}`,
        cell: ({ error }) => millimetres(error),
      },
      {
        label: 'rotation',
        unit: '°',
        title: `angle to ${referenceName}`,
        cell: ({ rotationError }) => (rotationError === null ? UNKNOWN : formatFixed(rotationError * DEGREES, 2)),
      },
    );
  }
  for (const [i, axis] of (['x', 'y', 'z'] as const).entries()) {
    columns.push({
      label: axis,
      unit: 'm',
      title: hasCamera
        ? `to the ${['right', 'floor', 'front'][i]}, as the first frame sees it`
        : 'as the first cloud has it',
      cell: ({ result }) => formatCoordinate(result.T_world_sensor[axis]),
    });
  }
  if (hasCamera) {
    columns.push({
      label: 'heading',
      unit: '°',
      title: 'to the right of the first frame',
      cell: ({ result }) => formatAngle(heading(result.T_world_sensor), 1).replace('°', ''),
    });
  }
  columns.push(
    {
      label: 'inliers',
      unit: '',
      title: 'matched points, and their share of all points',
      cell: ({ isOrigin, result }) =>
        isOrigin ? UNKNOWN : html`${formatCount(result.num_inliers)} <small>${formatPercent(result.fitness)}</small>`,
    },
    {
      label: 'rmse',
      unit: 'mm',
      title: 'root mean square distance of matched points after registration',
      cell: ({ isOrigin, result }) => (isOrigin ? UNKNOWN : formatFixed(result.inlier_rmse * 1000, 1)),
    },
  );
  columns.push({ label: 'time', unit: 'ms', title: 'registering this frame', cell: ({ ms }) => formatFixed(ms, 1) });
  return columns;
}

const ERROR_COLUMNS = [
  ...['frame', 'name', 'status', 'x_m', 'y_m', 'z_m', 'error_m', 'rotation_error_rad'],
  ...['num_inliers', 'fitness', 'inlier_rmse_m', 'ms'],
];

/** One line for each frame, for a spreadsheet: SI units, radians. */
export function errorCsv(result: SpatialResult, ms: readonly number[]): string {
  const rows = spatialRows(result, ms).map((row) => {
    const { x, y, z } = row.result.T_world_sensor;
    const { num_inliers, fitness, inlier_rmse } = row.result;
    const errors = [row.error ?? '', row.rotationError ?? ''];
    return [row.frame, row.name, row.status, x, y, z, ...errors, num_inliers, fitness, inlier_rmse, row.ms].map(String);
  });
  return `${csvFormatRows([ERROR_COLUMNS, ...rows])}\n`;
}
