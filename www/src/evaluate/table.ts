/** The ranked table: its columns, its order, and its text for a report. */
import { csvFormatRows } from 'd3-dsv';
import type { Comparison, Refusal } from './protocol.js';

export interface Column {
  id: string;
  label: string;
  /** What it is, in a line. */
  hint: string;
  value(comparison: Comparison): number | null;
}

const HINTS = {
  rmse: 'root of the mean squared error',
  mean: 'mean error',
  median: 'half of the errors are smaller',
  std: 'standard deviation of the errors',
  min: 'smallest error',
  max: 'largest error',
  sse: 'sum of squared errors',
} as const;

const ALWAYS: readonly Column[] = [
  {
    id: 'mean_l2',
    label: 'mean L2 (m)',
    hint: 'mean distance of the positions',
    value: ({ summary }) => summary.mean_l2,
  },
  {
    id: 'aligned',
    label: 'aligned (m)',
    hint: 'mean distance with all positions aligned by a rotation and a translation',
    value: ({ summary }) => summary.aligned?.mean ?? null,
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

const OF_RELATIONS: readonly Column[] = [
  {
    id: 'relations',
    label: 'relations (m)',
    hint: 'mean translation error of the known relations (Kuemmerle et al. 2009)',
    value: ({ relations }) => relations?.translation.mean ?? null,
  },
  {
    id: 'relations_rotation',
    label: 'relations (deg)',
    hint: 'mean rotation error of the known relations',
    value: ({ relations }) => relations && (relations.rotation.mean * 180) / Math.PI,
  },
  {
    id: 'num_relations',
    label: 'relations',
    hint: 'known relations whose two poses the estimate has',
    value: ({ relations }) => relations?.num_compared ?? null,
  },
  {
    id: 'wrong_relations',
    label: 'wrong (%)',
    hint: 'share of these relations that are off by more than 0.5 m or 5 degrees',
    value: ({ relations }) => relations && 100 * relations.share_wrong,
  },
];

/** Columns of errors in a unit. */
export function columnsOf(unit: string, has_relations: boolean): Column[] {
  const inUnit = (label: string) => (unit === '' ? label : `${label} (${unit})`);
  const names = Object.keys(HINTS) as (keyof typeof HINTS)[];
  const figures = names.map((id) => ({
    id,
    label: id === 'sse' ? id : inUnit(id),
    hint: HINTS[id],
    value: ({ summary }: Comparison) => summary.statistics[id],
  }));
  return [...figures, ...ALWAYS, ...(has_relations ? OF_RELATIONS : [])];
}

/** Six digits: more would be noise in a report. */
export function formatValue(value: number | null): string {
  return value === null ? '–' : String(Number(value.toPrecision(6)));
}

export interface Ranking {
  /** From the best. */
  ranked: readonly Comparison[];
  refusals: readonly Refusal[];
  columns: readonly Column[];
}

export function markdown(ranking: Ranking): string {
  const line = (cells: readonly string[]) => `| ${cells.map((cell) => cell.replaceAll('|', '\\|')).join(' | ')} |\n`;
  const rule = ['---:', '---', '---:', ...ranking.columns.map(() => '---:'), ...(hasFaults(ranking) ? ['---'] : [])];
  return [heads(ranking), rule, ...cells(ranking)].map(line).join('');
}

export function csv(ranking: Ranking): string {
  return `${csvFormatRows([heads(ranking), ...cells(ranking)])}\n`;
}

/** Without the file's name at its start, where the row has it already. */
export function bareProblem({ name, problem }: Refusal): string {
  if (!problem.startsWith(name)) return problem;
  const rest = problem.slice(name.length).replace(/^[,:]\s*/, '');
  return rest.charAt(0).toUpperCase() + rest.slice(1);
}

function hasFaults({ refusals }: Ranking): boolean {
  return refusals.length > 0;
}

function heads(ranking: Ranking): string[] {
  const labels = ranking.columns.map(({ label }) => label);
  return ['rank', 'estimate', 'poses', ...labels, ...(hasFaults(ranking) ? ['reason'] : [])];
}

function cells(ranking: Ranking): string[][] {
  const { ranked, refusals, columns } = ranking;
  const last = hasFaults(ranking) ? [''] : [];
  const compared = ranked.map((comparison, index) => [
    String(index + 1),
    comparison.name,
    `${comparison.summary.num_matched}/${comparison.summary.num_estimate}`,
    ...columns.map((column) => formatValue(column.value(comparison))),
    ...last,
  ]);
  const refused = refusals.map((refusal) => [
    '–',
    refusal.name,
    '–',
    ...columns.map(() => '–'),
    bareProblem(refusal).replaceAll('\n', ' '),
  ]);
  return [...compared, ...refused];
}
