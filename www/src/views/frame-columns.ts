/** The columns of the table of a planar run: what each is called and how its values are written. */
import { html, type TemplateResult } from 'lit';
import { formatAngle, formatCoordinate, formatCount, formatFixed, formatPercent } from './format.js';
import type { FrameRow } from './frame-rows.js';
import type { Status } from './map-painter.js';

/** The fields of a row that every table shows. */
export interface TableRow {
  frame: number;
  name: string;
  status: Status;
}

export interface Column<R extends TableRow> {
  label: string;
  unit: string;
  /** What it means; empty where the label says it. */
  title: string;
  cell(row: R): string | number | TemplateResult;
}

export const UNKNOWN = '–';

/** A length in millimetres; of large ones a tenth of one is of no use. */
export function millimetres(metres: number | null): string {
  return metres === null ? UNKNOWN : formatFixed(metres * 1000, metres < 0.1 ? 1 : 0);
}

/** `referenceName` empty: no column for the distance to it. */
export function frameColumns(referenceName: string): Column<FrameRow>[] {
  const origin = 'metres, in the frame of the first scan';
  const columns: Column<FrameRow>[] = [];
  // First: it is what a run is judged by, and the last columns may have to be scrolled to.
  if (referenceName !== '') {
    columns.push({
      label: 'error',
      unit: 'mm',
      title: `distance to ${referenceName}`,
      cell: ({ error }) => millimetres(error),
    });
  }
  columns.push(
    { label: 'x', unit: 'm', title: origin, cell: ({ x }) => formatCoordinate(x) },
    { label: 'y', unit: 'm', title: origin, cell: ({ y }) => formatCoordinate(y) },
    { label: 'heading', unit: '°', title: '', cell: ({ theta }) => formatAngle(theta).replace('°', '') },
    {
      label: 'inliers',
      unit: '',
      title: 'matched points, and their share of all points',
      cell: (row) =>
        row.isOrigin ? UNKNOWN : html`${formatCount(row.num_inliers)} <small>${formatPercent(row.fitness)}</small>`,
    },
    {
      label: 'rmse',
      unit: 'mm',
      title: 'root mean square distance of matched points after registration',
      cell: (row) => (row.isOrigin ? UNKNOWN : formatFixed(row.inlier_rmse * 1000, 1)),
    },
    {
      label: 'iterations',
      unit: '',
      title: 'ICP iterations until the pose converged',
      cell: (row) => (row.isOrigin ? UNKNOWN : row.iterations),
    },
    {
      label: 'time',
      unit: 'ms',
      title: 'computing time of this scan',
      cell: ({ ms }) => formatFixed(ms, 1),
    },
  );
  return columns;
}
