/** The ranked table: its columns, its order, and its text for a report. */
import type { Comparison } from './protocol.js';

export interface Column {
  id: string;
  label: string;
  /** What it is, in a line. */
  hint: string;
  value(comparison: Comparison): number | null;
}

/** Columns of errors in a unit. */
export function columnsOf(unit: string): Column[] {
  const inUnit = (label: string) => (unit === '' ? label : `${label} (${unit})`);
  const hints = {
    rmse: 'root of the mean squared error',
    mean: 'mean error',
    median: 'half of the errors are smaller',
    std: 'standard deviation of the errors',
    min: 'smallest error',
    max: 'largest error',
    sse: 'sum of squared errors',
  } as const;
  const names = Object.keys(hints) as (keyof typeof hints)[];
  return [
    ...names.map((id) => ({
      id,
      label: id === 'sse' ? id : inUnit(id),
      hint: hints[id],
      value: ({ summary }: Comparison) => summary.statistics[id],
    })),
    {
      id: 'mean_l2',
      label: 'mean L2 (m)',
      hint: 'mean distance of the positions',
      value: ({ summary }) => summary.mean_l2,
    },
    {
      id: 'drift',
      label: 'drift (%)',
      hint: "KITTI's translation drift over 100 to 800 m, or scaled to a short path",
      value: ({ summary }) => summary.drift?.translation ?? null,
    },
    {
      id: 'drift_rotation',
      label: 'drift (deg/m)',
      hint: "KITTI's rotation drift",
      value: ({ summary }) => summary.drift?.rotation ?? null,
    },
  ];
}

/** By a column, smallest first or last; what has no value comes at the end. */
export function sorted(comparisons: readonly Comparison[], column: Column, is_falling: boolean): Comparison[] {
  const sign = is_falling ? -1 : 1;
  return [...comparisons].sort((a, b) => {
    const [x, y] = [column.value(a), column.value(b)];
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return sign * (x - y);
  });
}

/** Six digits: more would be noise in a report. */
export function figure(value: number | null): string {
  return value === null ? '–' : String(Number(value.toPrecision(6)));
}

export function markdown(comparisons: readonly Comparison[], columns: readonly Column[]): string {
  const line = (cells: readonly string[]) => `| ${cells.map((cell) => cell.replaceAll('|', '\\|')).join(' | ')} |\n`;
  const rule = columns.map(() => '---:');
  return [
    ['rank', 'estimate', 'poses', ...columns.map(({ label }) => label)],
    ['---:', '---', '---:', ...rule],
    ...cells(comparisons, columns),
  ]
    .map(line)
    .join('');
}

export function csv(comparisons: readonly Comparison[], columns: readonly Column[]): string {
  const quote = (cell: string) => (/[",\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell);
  const heads = ['rank', 'estimate', 'poses', ...columns.map(({ label }) => label)];
  return [heads, ...cells(comparisons, columns)].map((row) => `${row.map(quote).join(',')}\n`).join('');
}

function cells(comparisons: readonly Comparison[], columns: readonly Column[]): string[][] {
  return comparisons.map((comparison, index) => [
    String(index + 1),
    comparison.name,
    String(comparison.summary.num_matched),
    ...columns.map((column) => figure(column.value(comparison))),
  ]);
}
