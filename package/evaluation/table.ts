/** Comparisons as rows: one list of columns for the page and the command line. */
import type { EvaluationOptions, EvaluationSummary } from '../../pkg/scanstitch.js';

/** A figure of what is compared. */
export interface FigureColumn<Compared> {
  id: string;
  label: string;
  /** What it is, in a line. */
  hint: string;
  value: (compared: Compared) => number | null;
}
type Column = FigureColumn<EvaluationSummary>;

export function figureColumn<Compared>(
  id: string,
  label: string,
  hint: string,
  value: (compared: Compared) => number | null,
): FigureColumn<Compared> {
  return { id, label, hint, value };
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
  figureColumn('mean_l2', 'mean L2 (m)', 'mean distance of the positions', ({ mean_l2 }) => mean_l2),
  figureColumn(
    'aligned',
    'aligned (m)',
    'mean distance with all positions aligned by a rotation and a translation',
    ({ aligned }) => aligned?.mean ?? null,
  ),
];

const SCALE: Column = figureColumn(
  'scale',
  'scale',
  'factor of the alignment, by which the estimate was multiplied',
  ({ alignment }) => alignment.scale,
);

const PAIRS: Column = figureColumn(
  'pairs',
  'pairs',
  'pairs of poses that were compared',
  ({ num_errors }) => num_errors,
);

const DRIFT: readonly Column[] = [
  figureColumn(
    'drift',
    'drift (%)',
    "KITTI's translation drift over 100 to 800 m, or scaled to a short path",
    ({ drift }) => drift?.translation ?? null,
  ),
  figureColumn('drift_rotation', 'drift (deg/m)', "KITTI's rotation drift", ({ drift }) => drift?.rotation ?? null),
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
