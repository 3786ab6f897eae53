/** The ranked table: its columns, its order, and its text for a report. */
import { csv as csvOf, markdown as markdownOf } from '../../../package/base/tables.js';
import {
  columnsOf as figureColumns,
  figureColumn,
  type FigureColumn,
  formatValue,
} from '../../../package/evaluation/table.js';
import type { Comparison, EvaluationOptions, Refusal } from './protocol.js';

export { formatValue };

export type Column = FigureColumn<Comparison>;

const OF_RELATIONS: readonly Column[] = [
  figureColumn(
    'relations',
    'relations (m)',
    'mean translation error of the known relations (Kuemmerle et al. 2009)',
    ({ relations }) => relations?.translation.mean ?? null,
  ),
  figureColumn(
    'relations_rotation',
    'relations (deg)',
    'mean rotation error of the known relations',
    ({ relations }) => relations && (relations.rotation.mean * 180) / Math.PI,
  ),
  figureColumn(
    'num_relations',
    'relations',
    'known relations whose two poses the estimate has',
    ({ relations }) => relations?.num_compared ?? null,
  ),
  figureColumn(
    'wrong_relations',
    'wrong (%)',
    'share of these relations that are off by more than 0.5 m or 5 degrees',
    ({ relations }) => relations && 100 * relations.share_wrong,
  ),
];

/** Columns of errors in a unit. */
export function columnsOf(unit: string, options: Partial<EvaluationOptions>, hasRelations: boolean): Column[] {
  const figures = figureColumns(unit, options, true).map(({ value, ...column }) => ({
    ...column,
    value: ({ summary }: Comparison) => value(summary),
  }));
  return [...figures, ...(hasRelations ? OF_RELATIONS : [])];
}

export interface Ranking {
  /** From the best. */
  ranked: readonly Comparison[];
  refusals: readonly Refusal[];
  columns: readonly Column[];
  referenceName: string;
}

export function markdown(ranking: Ranking): string {
  const names = heads(ranking);
  return markdownOf(names, cells(ranking), new Set([1, names.indexOf('reference'), names.indexOf('reason')]));
}

export function csv(ranking: Ranking): string {
  return csvOf([heads(ranking), ...cells(ranking)]);
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
  return ['rank', 'estimate', 'poses', ...labels, 'reference', ...(hasFaults(ranking) ? ['reason'] : [])];
}

function cells(ranking: Ranking): string[][] {
  const { ranked, refusals, columns, referenceName } = ranking;
  const last = hasFaults(ranking) ? [''] : [];
  const compared = ranked.map((comparison, index) => [
    String(index + 1),
    comparison.name,
    `${comparison.summary.num_matched}/${comparison.summary.num_estimate}`,
    ...columns.map((column) => formatValue(column.value(comparison))),
    referenceName,
    ...last,
  ]);
  const refused = refusals.map((refusal) => [
    '–',
    refusal.name,
    '–',
    ...columns.map(() => '–'),
    referenceName,
    bareProblem(refusal).replaceAll('\n', ' '),
  ]);
  return [...compared, ...refused];
}
