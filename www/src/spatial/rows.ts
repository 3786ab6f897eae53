/** The table of a run in space: one row a frame. */
import { csvFormatRows } from 'd3-dsv';
import type { SpatialFrameResult, SpatialPose, SpatialResult } from '../engine/spatial-protocol.js';
import { DEGREES, formatFixed } from '../views/format.js';
import { formatAngle, formatCoordinate } from '../views/pose-format.js';
import { type Column, column, errorColumn, ofRegistration, type TableRow, UNKNOWN } from '../views/frame-columns.js';

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
  const { matched, rmse } = ofRegistration<SpatialRow>(({ result }) => result);
  const degrees = ({ rotationError }: SpatialRow): string =>
    rotationError === null ? UNKNOWN : formatFixed(rotationError * DEGREES, 2);
  const axis = (name: 'x' | 'y' | 'z', way: string): Column<SpatialRow> =>
    column(name, 'm', hasCamera ? `to the ${way}, as the first frame sees it` : 'as the first cloud has it', (row) =>
      formatCoordinate(row.result.T_world_sensor[name]),
    );
  return [
    // First: they are what a run is judged by, and the last columns may have to be scrolled to.
    ...(referenceName === ''
      ? []
      : [
          errorColumn<SpatialRow>(referenceName),
          column<SpatialRow>('rotation', '°', `angle to ${referenceName}`, degrees),
        ]),
    ...[axis('x', 'right'), axis('y', 'floor'), axis('z', 'front')],
    ...(hasCamera
      ? [
          column<SpatialRow>('heading', '°', 'to the right of the first frame', ({ result }) =>
            formatAngle(heading(result.T_world_sensor), 1).replace('°', ''),
          ),
        ]
      : []),
    matched,
    rmse,
    column('time', 'ms', 'registering this frame', ({ ms }) => formatFixed(ms, 1)),
  ];
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
