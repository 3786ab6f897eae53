// @ts-check
/**
 * Clouds as text: x y z on a line, and whatever stands behind them (intensity, colours, normals). A number alone at the
 * beginning counts the points (PTS); PTX has a header of ten lines before each scan, whose points are in the scanner's frame.
 */
import { bytesOf, plyFile } from './ply.js';

const PTX_HEADER_LINES = 10;
const TAB = 9;
const LINE_FEED = 10;
const CARRIAGE_RETURN = 13;

/**
 * @param {Uint8Array} bytes
 * @param {number} dimensions 3; 2 for planar points, z = 0
 * @returns {{ ply: Uint8Array, count: number, notes: string[] }}
 */
export function textCloud(bytes, dimensions = 3) {
  const lines = linesOf(bytes);
  const ptx = ptxScan(lines);
  const rows = ptx ?? lines;
  const points = new Float32Array(3 * rows.length);
  let count = 0;
  let skipped = 0;
  for (const line of rows) {
    const values = line.split(/[\s,;]+/, dimensions).map(Number);
    const isPoint = values.length === dimensions && values.every(Number.isFinite) && line !== '';
    if (!isPoint) {
      if (count > 0 && !isComment(line)) skipped += 1;
      continue;
    }
    // PTX has a row of zeros where nothing came back.
    if (ptx && values.every((value) => value === 0)) continue;
    points.set(values, 3 * count);
    count += 1;
  }
  const notes = skipped > 0 ? [`${skipped} lines of it are no points and are left out`] : [];
  if (ptx && ptx.length + PTX_HEADER_LINES < lines.length) notes.push('the first scan of the file is used');
  const used = points.subarray(0, 3 * count);
  return { ply: plyFile(bytesOf(used), count, ['x', 'y', 'z']), count, notes };
}

/** @param {string} line */
function isComment(line) {
  return line === '' || /^(#|\/\/|%|;)/.test(line);
}

/** @param {Uint8Array} bytes */
function linesOf(bytes) {
  const text = new TextDecoder('latin1').decode(bytes.subarray(hasMark(bytes) ? 3 : 0));
  return text.split(/\r\n|\n|\r/).map((line) => line.trim());
}

/** @param {Uint8Array} bytes */
function hasMark([first, second, third]) {
  return first === 0xef && second === 0xbb && third === 0xbf;
}

/** The points of the first scan of a PTX file; null where it is none: columns and rows, then 3 + 1 + 4 lines of numbers. @param {string[]} lines */
function ptxScan(lines) {
  const widths = lines.slice(0, PTX_HEADER_LINES).map((line) => (line === '' ? 0 : line.split(/\s+/).length));
  if (widths.join() !== '1,1,3,3,3,3,4,4,4,4') return null;
  const count = Number(lines[0]) * Number(lines[1]);
  return Number.isSafeInteger(count) ? lines.slice(PTX_HEADER_LINES, PTX_HEADER_LINES + count) : null;
}

/**
 * Whether the beginning of a text is points and nothing else: lines of `dimensions` numbers, or of more under a header that
 * names x, y and z.
 * @param {Uint8Array} head
 * @param {number} dimensions
 */
export function looksLikePoints(head, dimensions) {
  if (head.some((byte) => byte < 32 && byte !== TAB && byte !== LINE_FEED && byte !== CARRIAGE_RETURN)) return false;
  const lines = linesOf(head)
    .filter((line) => !isComment(line))
    .slice(0, -1);
  const [first = ''] = lines;
  const names = first.toLowerCase().split(/[\s,;]+/);
  const isNamed = ['x', 'y', 'z'].slice(0, dimensions).every((name, column) => names[column] === name);
  const rows = isNamed ? lines.slice(1) : lines;
  const isRow = (/** @type {string} */ line) => {
    const values = line.split(/\s*[\s,;]\s*/).map(Number);
    return (isNamed ? values.length >= dimensions : values.length === dimensions) && values.every(Number.isFinite);
  };
  const isFlat = names.includes('z') ? dimensions === 3 : true;
  return rows.length >= 20 && isFlat && rows.every(isRow);
}
