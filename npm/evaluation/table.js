// @ts-check
/** Comparisons as rows: one list of columns for the page and the command line. */

/** @typedef {import('../../pkg/scanstitch.js').EvaluationOptions} EvaluationOptions */
/** @typedef {import('../../pkg/scanstitch.js').EvaluationSummary} EvaluationSummary */

/**
 * @typedef {object} Column
 * @property {string} id
 * @property {string} label
 * @property {string} hint what it is, in a line
 * @property {(summary: EvaluationSummary) => number | null} value
 */

const STATISTICS = /** @type {const} */ ({
  rmse: 'root of the mean squared error',
  mean: 'mean error',
  median: 'half of the errors are smaller',
  std: 'standard deviation of the errors',
  min: 'smallest error',
  max: 'largest error',
  sse: 'sum of squared errors',
});

/** @type {readonly Column[]} */
const POSITIONS = [
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

/** @type {Column} */
const SCALE = {
  id: 'scale',
  label: 'scale',
  hint: 'factor of the alignment, by which the estimate was multiplied',
  value: ({ alignment }) => alignment.scale,
};

/** @type {Column} */
const PAIRS = {
  id: 'pairs',
  label: 'pairs',
  hint: 'pairs of poses that were compared',
  value: ({ num_errors }) => num_errors,
};

/** @type {readonly Column[]} */
const DRIFT = [
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

/**
 * Columns of errors in a unit.
 * @param {string} unit
 * @param {Partial<EvaluationOptions>} options
 * @param {boolean} withDrift
 * @returns {Column[]}
 */
export function columnsOf(unit, { metric, alignment }, withDrift) {
  const ids = /** @type {(keyof typeof STATISTICS)[]} */ (Object.keys(STATISTICS));
  const statistics = ids.map((id) => ({
    id,
    label: unit === '' || id === 'sse' ? id : `${id} (${unit})`,
    hint: STATISTICS[id],
    value: (/** @type {EvaluationSummary} */ { statistics }) => statistics[id],
  }));
  return [
    ...(metric === 'rpe' ? [PAIRS] : []),
    ...statistics,
    ...POSITIONS,
    ...(alignment === 'sim3' || alignment === 'scale' ? [SCALE] : []),
    ...(withDrift ? DRIFT : []),
  ];
}

/** Six digits: more would be noise in a report. @param {number | null} value @param {string} [none] what stands for null */
export function formatValue(value, none = '–') {
  return value === null ? none : String(Number(value.toPrecision(6)));
}

/**
 * @param {readonly string[]} heads
 * @param {readonly string[][]} rows
 * @param {ReadonlySet<number>} textColumns that hold no numbers
 */
export function markdownOf(heads, rows, textColumns) {
  const line = (/** @type {readonly string[]} */ cells) =>
    `| ${cells.map((cell) => cell.replaceAll('|', '\\|')).join(' | ')} |\n`;
  const rule = heads.map((_, column) => (textColumns.has(column) ? '---' : '---:'));
  return [heads, rule, ...rows].map(line).join('');
}

/** @param {readonly string[]} heads @param {readonly string[][]} rows */
export function csvOf(heads, rows) {
  const cell = (/** @type {string} */ text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  return [heads, ...rows].map((row) => `${row.map(cell).join(',')}\n`).join('');
}
