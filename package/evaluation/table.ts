/** Comparisons as rows: one list of columns for the page and the command line. */
import type { EvaluationOptions, EvaluationSummary } from '../../pkg/scanstitch.js';

interface Column {
  id: string;
  label: string;
  /** What it is, in a line. */
  hint: string;
  value: (summary: EvaluationSummary) => number | null;
}

const STATISTICS = {
  rmse: 'root of the mean squared error',
  mean: 'mean error',
  median: 'half of the errors are smaller',
  std: 'standard deviation of the errors',
  min: 'smallest error',
  max: 'largest error',
  sse: 'sum of squared errors',
} as const;

const POSITIONS: readonly Column[] = [
  {
    id: 'mean_l2',
    label: 'mean L2 (m)',
    hint: 'mean distance of the positions',
    value: ({ mean_l2 }) => mean_l2,
  },
  {
    id: 'aligned',
    label: 'aligned (m)',
    hint: 'mean distance with all positions aligned by a rotation and a translation',
    value: ({ aligned }) => aligned?.mean ?? null,
  },
];

const SCALE: Column = {
  id: 'scale',
  label: 'scale',
  hint: 'factor of the alignment, by which the estimate was multiplied',
  value: ({ alignment }) => alignment.scale,
};

const PAIRS: Column = {
  id: 'pairs',
  label: 'pairs',
  hint: 'pairs of poses that were compared',
  value: ({ num_errors }) => num_errors,
};

const DRIFT: readonly Column[] = [
  {
    id: 'drift',
    label: 'drift (%)',
    hint: "KITTI's translation drift over 100 to 800 m, or scaled to a short path",
    value: ({ drift }) => drift?.translation ?? null,
  },
  {
    id: 'drift_rotation',
    label: 'drift (deg/m)',
    hint: "KITTI's rotation drift",
    value: ({ drift }) => drift?.rotation ?? null,
  },
];

/** Columns of errors in a unit. */
export function columnsOf(
  unit: string,
  { metric, alignment }: Partial<EvaluationOptions>,
  withDrift: boolean,
): Column[] {
  const ids = Object.keys(STATISTICS) as (keyof typeof STATISTICS)[];
  const statistics = ids.map((id) => ({
    id,
    label: unit === '' || id === 'sse' ? id : `${id} (${unit})`,
    hint: STATISTICS[id],
    value: ({ statistics }: EvaluationSummary) => statistics[id],
  }));
  return [
    ...(metric === 'rpe' ? [PAIRS] : []),
    ...statistics,
    ...POSITIONS,
    ...(alignment === 'sim3' || alignment === 'scale' ? [SCALE] : []),
    ...(withDrift ? DRIFT : []),
  ];
}

/**
 * Six digits: more would be noise in a report.
 * @param none what stands for null
 */
export function formatValue(value: number | null, none = '–') {
  return value === null ? none : String(Number(value.toPrecision(6)));
}

/** @param textColumns that hold no numbers */
export function markdownOf(heads: readonly string[], rows: readonly string[][], textColumns: ReadonlySet<number>) {
  const line = (cells: readonly string[]) => `| ${cells.map((cell) => cell.replaceAll('|', '\\|')).join(' | ')} |\n`;
  const rule = heads.map((_, column) => (textColumns.has(column) ? '---' : '---:'));
  return [heads, rule, ...rows].map(line).join('');
}

export function csvOf(heads: readonly string[], rows: readonly string[][]) {
  const cell = (text: string) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  return [heads, ...rows].map((row) => `${row.map(cell).join(',')}\n`).join('');
}
