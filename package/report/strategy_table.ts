/** Results of strategies as rows: for CSV, Markdown and tables on a screen. One list of columns serves them all. */
import type { MapQuality, StrategyErrors, StrategyResult, StrategyTiming, Trend } from '../../pkg/scanstitch.js';
import { formatCount } from '../base/format_count.js';
import { csv, markdown } from '../base/tables.js';

/** What tables and figures read of a strategy: of frames in space, or of planar scans, which have no `map_bytes`. */
export interface Compared extends Pick<StrategyResult, 'num_lost' | 'map_points' | 'notes'> {
  settings: object;
  frames: readonly {
    name: string;
    index: number;
    T_world_sensor: { x: number; y: number; z: number };
    map_points: number;
  }[];
  timing: StrategyTiming | null;
  comparison:
    | (Pick<StrategyErrors, 'num_matched' | 'ape_mean' | 'ape_rmse' | 'ape_max' | 'errors'> &
        Partial<Omit<StrategyErrors, 'reference'>> & {
          reference: readonly ({ x: number; y: number; z: number } | null)[];
        })
    | null;
  map_bytes?: number;
  growth?: Trend | null;
  sharpness?: MapQuality | null;
  /** Of planar scans: scans that are doubtful, and the mean distance between overlapping ones along the normals (m). */
  num_doubtful?: number;
  mean_residual?: number | null;
}

export type Row = { name: string; label: string; result: Compared };

export interface Column {
  /** In CSV; SI units, but for milliseconds, which are named so. */
  name: string;
  /** On a screen. */
  label: string;
  /** Of `shown`. */
  unit: string;
  /** In plain words. */
  about: string;
  /** In full precision. */
  value: (result: Compared) => number | null;
  /** For people. */
  shown: (value: number, result: Compared) => string;
}

/** How a value is shown: in this unit, of which it has so many times its own, with so many digits. */
type Shown = readonly [unit: string, times: number, digits: number];
const MS: Shown = ['ms', 1, 1];
const METRES: Shown = ['m', 1, 3];
const MM: Shown = ['mm', 1e3, 1];
const DEGREES: Shown = ['deg', 180 / Math.PI, 3];

function fixed(name: string, label: string, [unit, times, digits]: Shown, about: string, value: Column['value']) {
  return { name, label, unit, about, value, shown: (one: number) => (one * times).toFixed(digits) };
}

type ErrorName = `${'ape' | 'rpe'}_${'mean' | 'rmse' | 'max'}` | 'rpe_rotation_mean';
function ofTruth(name: ErrorName, label: string, shown: Shown, about: string) {
  return fixed(name, label, shown, about, ({ comparison }) => comparison?.[name] ?? null);
}

function ofMap(name: keyof MapQuality, label: string, shown: Shown, about: string) {
  return fixed(name, label, shown, about, ({ sharpness }) => sharpness?.[name] ?? null);
}

const COLUMNS: readonly Column[] = [
  {
    name: 'frames',
    label: 'Frames',
    unit: '',
    about: 'Frames that the strategy has processed',
    value: ({ frames }) => frames.length,
    shown: String,
  },
  {
    name: 'lost',
    label: 'Lost',
    unit: '',
    about: 'Frames that could not be registered; their pose is the prediction',
    value: ({ num_lost }) => num_lost,
    shown: String,
  },
  {
    name: 'map_points',
    label: 'Map points',
    unit: '',
    about: 'Points of the map after the last frame',
    value: ({ map_points }) => map_points,
    shown: formatCount,
  },
  {
    name: 'map_bytes',
    label: 'Map size',
    unit: 'MB',
    about: '24 bytes a point: three coordinates in double precision; normals and the search index are not counted',
    value: ({ map_bytes }) => map_bytes ?? null,
    shown: (value) => (value / 1e6).toFixed(value < 1e7 ? 2 : 1),
  },
  fixed(
    'ms_median',
    'Median time',
    MS,
    'Median time per frame, from the second frame on',
    ({ timing }) => timing?.median ?? null,
  ),
  fixed('ms_last', 'Last frame', MS, 'Time that the last frame took', ({ timing }) => timing?.last ?? null),
  {
    name: 'ms_slope',
    label: 'Time growth',
    unit: 'ms/frame',
    about: 'Slope of the time per frame over the frames: least squares, with the standard error',
    value: ({ timing }) => timing?.trend?.slope ?? null,
    shown: (value, { timing }) => `${value.toFixed(2)} ±${(timing?.trend?.standard_error ?? 0).toFixed(2)}`,
  },
  {
    name: 'map_growth',
    label: 'Map growth',
    unit: 'points/frame',
    about: 'Mean number of points that a frame adds to the map, over the second half of the frames',
    value: ({ growth }) => growth?.slope ?? null,
    shown: (value) => value.toFixed(0),
  },
  ofTruth('ape_mean', 'APE mean', METRES, 'Mean distance to the ground truth, first poses aligned'),
  ofTruth('ape_rmse', 'APE rmse', METRES, 'Root mean square distance to the ground truth'),
  ofTruth('ape_max', 'APE max', METRES, 'Largest distance to the ground truth'),
  ofTruth('rpe_mean', 'RPE mean', MM, 'Mean translation error from each frame to the next'),
  ofTruth('rpe_rmse', 'RPE rmse', MM, 'Root mean square of the error from each frame to the next'),
  ofTruth('rpe_max', 'RPE max', MM, 'Largest error from a frame to the next'),
  ofTruth('rpe_rotation_mean', 'RPE rotation', DEGREES, 'Mean rotation error from each frame to the next'),
  ofMap(
    'mean_map_entropy',
    'Entropy',
    ['nats', 1, 3],
    'Mean map entropy of the same points of all frames at the estimated poses: lower is sharper',
  ),
  ofMap(
    'mean_plane_variance',
    'Plane variance',
    ['mm²', 1e6, 0],
    'Mean plane variance of the same points: lower is sharper',
  ),
];

const named = (...names: string[]): readonly Column[] => COLUMNS.filter(({ name }) => names.includes(name));
const PLANAR_COLUMNS: readonly Column[] = [
  ...named('frames', 'lost'),
  {
    name: 'doubtful',
    label: 'Doubtful',
    unit: '',
    about: 'Scans whose pose is doubtful',
    value: ({ num_doubtful }) => num_doubtful ?? null,
    shown: String,
  },
  ...named('map_points', 'ms_median'),
  fixed(
    'ms_total',
    'Total time',
    MS,
    'Time of all scans, with the joint solution',
    ({ timing }) => timing?.total ?? null,
  ),
  fixed(
    'mean_residual',
    'Sharpness',
    MM,
    'Mean distance between the points of overlapping scans, along the normals: lower is sharper',
    ({ mean_residual }) => mean_residual ?? null,
  ),
  ...named('ape_mean', 'ape_rmse', 'ape_max'),
];

/** Columns of errors, which need a reference. */
const OF_TRUTH = /^(ape|rpe)_/;

function allColumns(rows: readonly Row[]): readonly Column[] {
  return rows[0] && !('map_bytes' in rows[0].result) ? PLANAR_COLUMNS : COLUMNS;
}

/** All columns; those of errors only where a result is compared with a reference. */
export function columnsOf(rows: readonly Row[]): readonly Column[] {
  const hasTruth = rows.some(({ result }) => result.comparison !== null);
  return allColumns(rows).filter(({ name }) => hasTruth || !OF_TRUTH.test(name));
}

export function cell(column: Column, result: Compared) {
  const value = column.value(result);
  return value === null ? '–' : column.shown(value, result);
}

/** In full precision and SI units, a line a strategy, its settings at the end. */
export function csvOf(rows: readonly Row[]) {
  const settings = Object.keys(rows[0]?.result.settings ?? {});
  const columns = allColumns(rows);
  const heads = [
    'strategy',
    ...columns.flatMap(({ name }) => (name === 'ms_slope' ? [name, 'ms_slope_error'] : name)),
    ...settings,
  ];
  const lines = rows.map(({ name, result }) => [
    name,
    ...columns.flatMap((column) => {
      const value = column.value(result);
      return column.name === 'ms_slope' ? [value, result.timing?.trend?.standard_error ?? null] : value;
    }),
    ...Object.values(result.settings),
  ]);
  return csv([heads, ...lines]);
}

/** One line a frame and strategy. */
export function framesCsvOf(
  rows: readonly { name: string; result: StrategyResult }[],
  milliseconds: readonly (readonly number[])[],
) {
  const heads = ['strategy', 'index', 'name', 'status', 'ms', 'map_points', 'map_bytes', 'num_added', 'num_source'];
  const more = ['threshold', 'fitness', 'inlier_rmse', 'iterations', 'error', 'x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'];
  const lines = rows.flatMap(({ name, result }, strategy) =>
    result.frames.map((frame, place) => {
      const { x, y, z, qx, qy, qz, qw } = frame.T_world_sensor;
      return [
        ...[name, frame.index, frame.name, frame.status, milliseconds[strategy]?.[place] ?? null],
        ...[frame.map_points, frame.map_bytes, frame.num_added, frame.num_source, frame.threshold, frame.fitness],
        ...[frame.inlier_rmse, frame.iterations, result.comparison?.errors[place] ?? null, x, y, z, qx, qy, qz, qw],
      ];
    }),
  );
  return csv([[...heads, ...more], ...lines]);
}

/** A line for each strategy, its label first, and the heads of the columns after that. */
export function shownTable(rows: readonly Row[]) {
  const columns = columnsOf(rows);
  return {
    heads: columns.map(({ label, unit }) => (unit ? `${label} (${unit})` : label)),
    lines: rows.map(({ label, result }) => [label, ...columns.map((column) => cell(column, result))]),
  };
}

/** As it is shown, for a report. */
export function markdownOf(rows: readonly Row[]) {
  const { heads, lines } = shownTable(rows);
  return markdown(['Strategy', ...heads], lines, new Set([0]));
}
