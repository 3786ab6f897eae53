/**
 * Clouds as text: x y z on a line, and whatever stands beside them (intensity, colours, times), under names or without. A number
 * alone counts the points that follow (PTS); PTX has a header of ten lines before each scan, whose points are in the scanner's
 * frame. VeloView and Livox Viewer write such tables, x y z among other columns.
 */
import { haveDecimalCommas, LENGTH_UNIT } from '../base/units.js';
import { pointsFile } from './ply.js';

const PTX_HEADER_LINES = 10;
const TAB = 9;
const LINE_FEED = 10;
const CARRIAGE_RETURN = 13;
/** Lines that separators are told from. */
const LOOKED_INTO = 50;
/** Fewer lines are no table of points. */
const MIN_ROWS = 20;
/** x y z, an intensity, three colours. */
const MAX_COLUMNS = 7;
/** Columns that a laser's program writes beside x y z. */
const LASER_COLUMNS = /^(intensity|intensities|reflectivity|quality|rssi|laser_id|ring|azimuth|tag)$/;

/** A unit behind the name of a column in lower case, and that of x. */
const UNIT_BEHIND = new RegExp(`[\\s_]*[([].*$|_${LENGTH_UNIT}$`);
const UNIT_OF_X = new RegExp(`(?:^|[\\s,;"#])x1?[\\s_]*[([]?(${LENGTH_UNIT})\\b`, 'i');

/** loss: what is missing of it */
type TextCloud = { ply: Uint8Array; count: number; notes: string[]; loss: string | null };

/**
 * The clouds of a text: one, or all scans of a PTX.
 * @param columns of x, y and z; of x and y for planar points, z = 0
 */
export function textClouds(bytes: Uint8Array, columns: readonly number[] = [0, 1, 2]): TextCloud[] {
  const lines = linesOf(bytes);
  const scans = ptxScans(lines);
  if (scans.length > 0) return scans.map(({ rows, count }) => cloudOf(rows, { columns: [0, 1, 2], size: count }));
  const head = lines.slice(0, 10 * LOOKED_INTO);
  return [cloudOf(lines, { columns, colors: colorColumns(head), unit: unitOf(head) })];
}

interface Table {
  /** Of x, y and z. */
  columns: readonly number[];
  /** Columns of red, green and blue. */
  colors?: readonly number[] | null;
  /** Of the coordinates. */
  unit?: string | null;
  /** Of a scan of a PTX. */
  size?: number | null;
}

function cloudOf(rows: readonly string[], { columns, colors = null, unit = null, size = null }: Table): TextCloud {
  const cells = cellsOf(rows);
  const points = new Float64Array(3 * rows.length);
  const shades = colors && new Uint16Array(3 * rows.length);
  let count = 0;
  let skipped = 0;
  for (const line of rows) {
    const words = cells(line);
    const values = columns.map((column) => numberOf(words[column]));
    if (!values.every(Number.isFinite)) {
      if (count > 0 && !isComment(line) && words.length > 1) skipped += 1;
      continue;
    }
    // PTX has a row of zeros where nothing came back.
    if (size !== null && values.every((value) => value === 0)) continue;
    points.set(values, 3 * count);
    if (shades) colors?.forEach((column, at) => (shades[3 * count + at] = numberOf(words[column]) || 0));
    count += 1;
  }
  const notes = skipped > 0 ? [`${skipped} of its lines are not points and are left out`] : [];
  const [there, announced] = size === null ? [count + skipped, announcedBy(rows)] : [rows.length, size];
  const loss = there < announced ? `cut off: ${there} of ${announced} points are there` : null;
  const ply = pointsFile(points.subarray(0, 3 * count), { colors: shades?.subarray(0, 3 * count) ?? null, unit });
  return { ply, count, notes, loss };
}

/** Points that the numbers alone on a line count, where a text begins with one. */
function announcedBy(rows: readonly string[]) {
  const isCount = (line: string) => /^\d+$/.test(line);
  if (!isCount(rows.find((line) => !isComment(line)) ?? '')) return 0;
  return rows.reduce((sum, line) => sum + (isCount(line) ? Number(line) : 0), 0);
}

function numberOf(word: string | undefined) {
  return word === undefined || word === '' ? Number.NaN : Number(word);
}

/** How the lines of a text are taken apart, decimal commas made points. */
function cellsOf(lines: readonly string[]): (line: string) => string[] {
  const known = lines.filter((line) => !isComment(line)).slice(0, LOOKED_INTO);
  const has = (text: string) => known.some((line) => line.includes(text));
  const hasDecimalCommas = haveDecimalCommas(known);
  const gap = has(';') ? ';' : has(',') && !hasDecimalCommas ? ',' : null;
  return (line) => {
    const text = hasDecimalCommas ? line.replaceAll(',', '.') : line;
    const cells = gap === null ? text.split(/\s+/) : text.split(gap).map((cell) => cell.trim());
    // "1, 2 3" and a PTS line behind a header of commas.
    return cells.length < 2 ? text.split(/[\s,;]+/) : cells;
  };
}

function isComment(line: string) {
  return line === '' || /^(#|\/\/|%|;)/.test(line);
}

function linesOf(bytes: Uint8Array) {
  const text = new TextDecoder('latin1').decode(bytes.subarray(hasMark(bytes) ? 3 : 0));
  return text.split(/\r\n|\n|\r/).map((line) => line.trim());
}

function hasMark([first, second, third]: Uint8Array) {
  return first === 0xef && second === 0xbb && third === 0xbf;
}

/** The points of each scan of a PTX; none where it is no PTX: columns and rows, then 3 + 1 + 4 lines of numbers. */
function ptxScans(lines: string[]) {
  const scans: { rows: string[]; count: number }[] = [];
  for (let at = 0; at < lines.length;) {
    const widths = lines.slice(at, at + PTX_HEADER_LINES).map((line) => (line === '' ? 0 : line.split(/\s+/).length));
    const count = Number(lines[at]) * Number(lines[at + 1]);
    if (widths.join() !== '1,1,3,3,3,3,4,4,4,4' || !Number.isSafeInteger(count)) break;
    const rows = lines.slice(at + PTX_HEADER_LINES, at + PTX_HEADER_LINES + count).filter((line) => line !== '');
    scans.push({ rows, count });
    at += PTX_HEADER_LINES + count;
  }
  return scans;
}

/** The names above the columns of a text, in a comment or not; empty without. */
function namesOf(lines: readonly string[]) {
  const first = lines.findIndex((line) => !isComment(line));
  const rows = lines.slice(first, first + LOOKED_INTO);
  const split = cellsOf(rows.slice(1));
  const isNames = (line: string) => /[a-z]/i.test(line) && !/^[+-]?[\d.]+[\s,;]/.test(line);
  const head = [rows[0] ?? '', ...lines.slice(0, Math.max(first, 0)).reverse()].find(isNames) ?? '';
  return split(head.replace(/^[#%/;\s]+/, '')).map((name) =>
    name
      .toLowerCase()
      .replaceAll(/["']/g, '')
      .replace(/^points(_m_xyz)?:([012])$/, (_, __, axis) => 'xyz'[Number(axis)] ?? '')
      .replace(UNIT_BEHIND, '')
      .trim()
      // Of the first return, as Ouster's program writes them.
      .replace(/^([xyz])1$/, '$1'),
  );
}

/** The columns of the colours: by the names above them, or the last three of whole numbers up to 255. */
function colorColumns(lines: readonly string[]) {
  const names = namesOf(lines);
  const named = [
    ['r', 'g', 'b'],
    ['red', 'green', 'blue'],
  ].map((colors) => colors.map((name) => names.indexOf(name)));
  const found = named.find((columns) => columns.every((column) => column >= 0));
  if (found) return found;
  const rows = lines.filter((line) => !isComment(line)).slice(1, LOOKED_INTO);
  const numbers = rows.map(cellsOf(rows)).map((words) => words.slice(-3).map(numberOf));
  const width = cellsOf(rows)(rows[0] ?? '').length;
  const isShade = (value: number) => Number.isInteger(value) && value >= 0 && value <= 255;
  const isColor = width >= 6 && numbers.flat().every(isShade) && numbers.flat().some((value) => value > 1);
  return isColor && !namedColumns(names) ? [width - 3, width - 2, width - 1] : null;
}

/** The unit that the name of a coordinate says: `x (mm)`, `X_cm`. */
function unitOf(lines: readonly string[]) {
  const found = lines.map((line) => UNIT_OF_X.exec(line)).find((match) => match !== null);
  return found?.[1]?.toLowerCase() ?? null;
}

/** The columns called x, y and z (or x and y, beside what lasers measure). */
function namedColumns(names: readonly string[]): number[] | null {
  const columns = ['x', 'y', 'z'].map((name) => names.indexOf(name));
  if (columns.every((column) => column >= 0)) return columns;
  const [x = -1, y = -1] = columns;
  const others = names.filter((_, at) => at !== x && at !== y);
  return x >= 0 && y >= 0 && others.every((name) => LASER_COLUMNS.test(name)) ? [x, y] : null;
}

/** The columns of x, y and z by the names above them, or behind one that counts the points; null without. */
export function pointColumns(head: Uint8Array) {
  const lines = linesOf(head);
  return namedColumns(namesOf(lines)) ?? (isCounted(lines) ? [1, 2, 3] : null);
}

/** Whether the first of four columns or more counts the points. */
function isCounted(lines: readonly string[]) {
  const rows = lines.filter((line) => !isComment(line)).slice(0, LOOKED_INTO);
  const numbers = rows.map(cellsOf(rows)).map((words) => words.map(numberOf));
  const first = numbers[0]?.[0] ?? Number.NaN;
  return rows.length >= MIN_ROWS && numbers.every((row, at) => row.length > 3 && row[0] === first + at);
}

/** The numbers of each line, where all of them are some. */
export function numberRows(bytes: Uint8Array) {
  const lines = linesOf(bytes).filter((line) => !isComment(line));
  const cells = cellsOf(lines);
  return lines.map((line) => cells(line).map(numberOf)).filter((row) => row.every(Number.isFinite));
}

/** Whether a laser's program wrote a table of points: what stands beside x y z. */
export function isLaserTable(head: Uint8Array) {
  const names = namesOf(linesOf(head));
  return namedColumns(names)?.length === 3 && names.some((name) => LASER_COLUMNS.test(name));
}

/**
 * The columns of x, y and z (or of x and y) where the beginning of a text is points and nothing else: lines of three or two
 * numbers, or of more under names. Null where it is not.
 */
export function looksLikePoints(head: Uint8Array): number[] | null {
  if (head.some((byte) => byte < 32 && byte !== TAB && byte !== LINE_FEED && byte !== CARRIAGE_RETURN)) return null;
  const all = linesOf(head);
  const spoken = all.filter((line) => !isComment(line)).slice(0, -1);
  // A number alone counts the points that follow.
  const lines = /^\d+$/.test(spoken[0] ?? '') ? spoken.slice(1) : spoken;
  const named = namedColumns(namesOf(all));
  const cells = cellsOf(lines.slice(1));
  const isNumber = (word: string | undefined) => Number.isFinite(numberOf(word));
  const rows = cells(lines[0] ?? '').every(isNumber) ? lines : lines.slice(1);
  if (rows.length < MIN_ROWS) return null;
  if (named) return rows.every((line) => named.every((column) => isNumber(cells(line)[column]))) ? named : null;
  if (rows.length < lines.length) return null;
  const count = cells(rows[0] ?? '').length;
  const isRow = (line: string) => cells(line).length === count && cells(line).every(isNumber);
  if (count < 2 || count > MAX_COLUMNS || !rows.every(isRow)) return null;
  // More than three numbers are points with intensities or colours, as KITTI's; a trajectory's times ascend.
  const first = rows.map((line) => numberOf(cells(line)[0]));
  const ascends = first.every((value, at) => at === 0 || value > (first[at - 1] ?? 0));
  return count > 3 && ascends ? null : [0, 1, 2].slice(0, count);
}
