/** The columns of the table of a planar run: what each is called and how its values are written. */
import { html, type TemplateResult } from 'lit';
import { formatCount, formatFixed, formatPercent } from './format.js';
import { formatAngle, formatCoordinate } from './pose-format.js';
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

export function column<R extends TableRow>(
  label: string,
  unit: string,
  title: string,
  cell: Column<R>['cell'],
): Column<R> {
  return { label, unit, title, cell };
}

export const UNKNOWN = '–';

/** A length in millimetres; of large ones a tenth of one is of no use. */
export function millimetres(metres: number | null): string {
  return metres === null ? UNKNOWN : formatFixed(metres * 1000, metres < 0.1 ? 1 : 0);
}

export const errorColumn = <R extends TableRow & { error: number | null }>(referenceName: string): Column<R> =>
  column('error', 'mm', `distance to ${referenceName}`, ({ error }) => millimetres(error));

/** What a registration has found; `of` has it of a row. */
export function ofRegistration<R extends TableRow & { isOrigin: boolean }>(
  of: (row: R) => { num_inliers: number; fitness: number; inlier_rmse: number },
): Record<'matched' | 'rmse', Column<R>> {
  const known = (words: (found: ReturnType<typeof of>) => ReturnType<Column<R>['cell']>) => (row: R) =>
    row.isOrigin ? UNKNOWN : words(of(row));
  return {
    matched: column(
      'inliers',
      '',
      'matched points, and their share of all points',
      known(({ num_inliers, fitness }) => html`${formatCount(num_inliers)} <small>${formatPercent(fitness)}</small>`),
    ),
    rmse: column(
      'rmse',
      'mm',
      'root mean square distance of matched points after registration',
      known(({ inlier_rmse }) => formatFixed(inlier_rmse * 1000, 1)),
    ),
  };
}

/** `referenceName` empty: no column for the distance to it. */
export function frameColumns(referenceName: string): Column<FrameRow>[] {
  const origin = 'metres, in the frame of the first scan';
  const { matched, rmse } = ofRegistration<FrameRow>((row) => row);
  return [
    // First: it is what a run is judged by, and the last columns may have to be scrolled to.
    ...(referenceName === '' ? [] : [errorColumn<FrameRow>(referenceName)]),
    column('x', 'm', origin, ({ x }) => formatCoordinate(x)),
    column('y', 'm', origin, ({ y }) => formatCoordinate(y)),
    column('heading', '°', '', ({ theta }) => formatAngle(theta).replace('°', '')),
    matched,
    rmse,
    column('iterations', '', 'ICP iterations until the pose converged', (row) =>
      row.isOrigin ? UNKNOWN : row.iterations,
    ),
    column('time', 'ms', 'computing time of this scan', ({ ms }) => formatFixed(ms, 1)),
  ];
}
