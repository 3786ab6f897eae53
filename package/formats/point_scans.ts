/**
 * Scans as points: returns x and y in the laser's frame in place of angles and ranges.
 *
 * | what | example |
 * |---|---|
 * | a scan a line, two numbers a return (`x y x y ...`), or three whose third stays | what CoppeliaSim's Hokuyo gives |
 * | an angle and a range, in turn, on a line | `0 1.25 1 1.26 ...` |
 * | the number of the scan, x and y, a return a line | `scan_id,x,y` |
 * | lists of points in JSON | `{"scans": [{"points": [[x, y], ...]}]}`, `[{"x": ..., "y": ...}, ...]` |
 */
import { DEGREE } from '../base/units.js';
import { evenShare, inRadians, MAX_RADIANS, mayBeMirrored, median, stepsOf } from './angles.js';
import type { Scan } from './scan.js';

/** Fewer returns are no scan. */
const MIN_RETURNS = 24;
/** Ranges are not negative, but coordinates are: at least this share of them. */
const MIN_NEGATIVE = 0.1;
/** Of coordinates, more negative ones than these differ. */
const MIN_DISTINCT = 4;
/** A step is even within this share of the median step. */
const EVEN = 0.2;
/** Smallest and largest field of view of a scan (degrees). */
const [MIN_VIEW, MAX_VIEW] = [45, 365];
const SCAN_NUMBERS =
  /^\s*(["']?)(scan|frame|scan_?(id|no|num|number|idx|index)|frame_?(id|no|num|number|idx|index))\1[,;\s]/i;

export function scanOfPoints(points: readonly (readonly [number, number])[]): Scan {
  const returns = points.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y) && Math.hypot(x, y) > 0);
  const polar = returns.map(([x, y]) => [Math.atan2(y, x), Math.hypot(x, y)]).sort(([a = 0], [b = 0]) => a - b);
  return { angles: polar.map(([angle = 0]) => angle), ranges: polar.map(([, range = 0]) => range) };
}

/** What the first lines hold. */
export function kindOfLines(head: string): 'triples' | 'pairs' | 'polar' | null {
  const lines = head.split(/\r?\n/).filter((line) => line.trim() !== '' && !line.startsWith('#'));
  const first = numbersOf(lines[0] ?? '');
  if (first === null || first.length < 2 * MIN_RETURNS || first.length > 100_000) return null;
  // Bearings above a table of ranges, with or without a corner, are no points.
  if ([0, 1].some((start) => isEven(first.slice(start)))) return null;
  const column = (stride: number, at: number) => first.filter((_, index) => index % stride === at);
  const isFlat = first.length % 3 === 0 && new Set(column(3, 2)).size === 1;
  // One negative value again and again means no return.
  const areNegative = (values: number[]) => {
    const negative = values.filter((value) => value < 0);
    return negative.length > MIN_NEGATIVE * values.length && new Set(negative).size > MIN_DISTINCT;
  };
  if (isFlat && (areNegative(column(3, 0)) || areNegative(column(3, 1)))) return 'triples';
  if (first.length % 2 !== 0) return null;
  if (isEven(column(2, 0)) && column(2, 1).every((range) => range >= 0)) return 'polar';
  return areNegative(column(2, 0)) && areNegative(column(2, 1)) ? 'pairs' : null;
}

/** A scan a line; those of another kind than the first are counted. */
export function readLines(text: string): { scans: Scan[]; numBroken: number } {
  const lines = text.split(/\r?\n/).filter((line) => line.trim() !== '' && !line.startsWith('#'));
  const kind = kindOfLines(`${lines[0]}\n`);
  const stride = kind === 'triples' ? 3 : 2;
  let numBroken = 0;
  const scans = lines.flatMap((line) => {
    const numbers = numbersOf(line);
    if (numbers === null || numbers.length % stride !== 0 || numbers.length < stride * 2) {
      numBroken += 1;
      return [];
    }
    const rows = Array.from({ length: numbers.length / stride }, (_, row) => {
      return [numbers[stride * row], numbers[stride * row + 1]] as [number, number];
    });
    return [kind === 'polar' ? scanOfPolar(rows) : scanOfPoints(rows)];
  });
  return { scans, numBroken };
}

function scanOfPolar(rows: readonly [number, number][]): Scan {
  const angles = inRadians(rows.map(([angle]) => angle));
  const ranges = rows.map(([, range]) => (range > 0 && Number.isFinite(range) ? range : null));
  return { angles, ranges, ...(mayBeMirrored(angles) && { mayBeMirrored: true }) };
}

/** The numbers of a line that holds nothing else. */
function numbersOf(line: string) {
  const words = line
    .trim()
    .split(/[\s,;]+/)
    .filter(Boolean);
  const numbers = words.map((word) => (/^[-+]?(inf|nan)/i.test(word) ? Number.NaN : Number(word)));
  return numbers.every((number, at) => Number.isFinite(number) || /^[-+]?(inf|nan)/i.test(words[at] ?? ''))
    ? numbers
    : null;
}

function isEven(angles: number[]) {
  const steps = stepsOf(angles);
  const view = Math.abs((angles.at(-1) ?? 0) - (angles[0] ?? 0));
  const isView = view > MIN_VIEW ? view <= MAX_VIEW : view > MIN_VIEW * DEGREE && view < MAX_RADIANS;
  return median(steps) !== 0 && isView && evenShare(steps, EVEN) === 1;
}

/**
 * Whether the names of a table's columns are those of a scan's number and a point's coordinates, and the first rows are
 * of one scan:
 * a path has another number in every row.
 */
export function isNumberedPoints(head: string) {
  if (columnsOf(head) === null) return false;
  const numbers = head
    .split(/\r?\n/)
    .slice(1, 1 + MIN_RETURNS)
    .map((line) => line.split(/[,;\s]+/).find(Boolean));
  return numbers.length === MIN_RETURNS && new Set(numbers).size === 1;
}

function columnsOf(head: string) {
  const line = head.slice(0, Math.max(0, head.indexOf('\n'))).replace(/^\s*#\s*/, '');
  if (!SCAN_NUMBERS.test(`${line} `)) return null;
  const names = line.split(/[,;\s]+/).map((name) => name.replaceAll(/["'\r]/g, '').toLowerCase());
  const [x, y] = [/^x(_?\(?m\)?)?$/, /^y(_?\(?m\)?)?$/].map((name) => names.findIndex((word) => name.test(word)));
  return x === undefined ||
    y === undefined ||
    x < 0 ||
    y < 0 ||
    names.some((name) => /^(z|theta|yaw|heading|phi|q[wxyz])\b/.test(name))
    ? null
    : { x, y };
}

/** A scan of each number, in the order of the file. */
export function readNumberedPoints(text: string): { scans: Scan[]; numBroken: number } {
  const columns = columnsOf(text);
  if (columns === null) return { scans: [], numBroken: 0 };
  const points: Map<string, [number, number][]> = new Map();
  let numBroken = 0;
  for (const line of text.split(/\r?\n/).slice(1)) {
    if (line.trim() === '') continue;
    const words = line.split(/[,;\s]+/).filter(Boolean);
    const [x, y] = [Number(words[columns.x]), Number(words[columns.y])];
    if (!Number.isFinite(x) || !Number.isFinite(y)) {
      numBroken += 1;
      continue;
    }
    const number = words[0] ?? '';
    const own = points.get(number);
    if (own) own.push([x, y]);
    else points.set(number, [[x, y]]);
  }
  return { scans: [...points.values()].filter(({ length }) => length >= MIN_RETURNS).map(scanOfPoints), numBroken };
}

/** What lists of points belong to that somebody drew on images. */
const ANNOTATIONS = /["'](shapes|segmentation|bbox|imagePath|annotations)["']/;
/** As many points as a scan has, one behind the other: lists, or objects with x and y. */
const POINT_LISTS = /["']points["']\s*:\s*\[(\s*\[[^[\]]{3,80}\]\s*,){23}/;
const POINT_OBJECTS = /\[(\s*\{[^{}]{0,80}["']x["']\s*:[^{}]{1,40}["']y["']\s*:[^{}]{1,80}\}\s*,){23}/;

/** Whether a document in JSON begins with scans as points. */
export function isPointJson(head: string) {
  return !ANNOTATIONS.test(head) && (POINT_LISTS.test(head) || POINT_OBJECTS.test(head));
}

/** The points of a list in JSON: pairs, triples whose third is zero, or objects with x and y; null where it is none. */
export function pointsOfList(list: readonly unknown[]): [number, number][] | null {
  if (list.length < MIN_RETURNS) return null;
  const points = list.map((item) => {
    if (typeof item !== 'object' || item === null) return null;
    const values = item as Record<string, unknown>;
    const [x, y, z = 0] = Array.isArray(item) ? item : [values['x'], values['y'], values['z'] ?? 0];
    const isPoint = typeof x === 'number' && typeof y === 'number' && z === 0 && Object.keys(item).length <= 5;
    return isPoint ? ([x, y] as [number, number]) : null;
  });
  return points.every((point) => point !== null) ? points : null;
}
