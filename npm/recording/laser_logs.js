// @ts-check
/** Logs of laser scans, many in one file: which files are such, and which tell the odometry to them. */
import { latin1 } from './heads.js';

/** Words that begin a line of a CARMEN log, or of what pose graph tools made of one. */
const CARMEN_WORDS = /^(FLASER|ROBOTLASER1|RAWLASER1|ODOM|PARAM|VERTEX2|EDGE2|SYNC|RLASER)\s/;

/** A line of a scan in a table has so many numbers at least: a pose has 16 at the most. */
const MIN_SCAN_NUMBERS = 24;
/** So many lines of a table are looked into. */
const TABLE_LINES = 20;

/**
 * Whether a file that begins like this is a laser log: CARMEN's text, that of CMU's course, CSM's JSON, a table of messages
 * or of ranges. The engine's `is_laser_log` says the same.
 * @param {Uint8Array} head a few kilobytes
 */
export function isLaserLog(head) {
  if (head.includes(0)) return false;
  const text = latin1(head)
    .replace(/^\xef\xbb\xbf/, '')
    .trimStart();
  if (/^[[{]/.test(text)) return /"readings"/.test(text) || (/"nrays"/.test(text) && /"min_theta"/.test(text));
  const lines = text.split(/[\r\n]+/).filter((line) => line.trim() !== '' && !/^\s*#/.test(line));
  const first = lines.slice(0, 3);
  if (first.some((line) => CARMEN_WORDS.test(line.trimStart()))) return true;
  return (first.length > 0 && first.every(isCmuLine)) || isMessageTable(lines[0] ?? '') || isRangeTable(head, text);
}

/** `O x y theta time`, or `L` and a scan. @param {string} line */
function isCmuLine(line) {
  const [kind, ...words] = line.trim().split(/\s+/);
  const end = words.findIndex((word) => !isNumber(word));
  const count = end < 0 ? words.length : end;
  return (kind === 'O' && count === 4) || (kind === 'L' && count > 7);
}

/** The first line names the fields of a LaserScan. @param {string} line */
function isMessageTable(line) {
  const names = line.split(',').map((name) =>
    name
      .trim()
      .toLowerCase()
      .replaceAll(/^[%"]+|[%"]+$/g, ''),
  );
  const has = (/** @type {string} */ wanted) => names.some((name) => name.replace(/^field\./, '') === wanted);
  return has('angle_min') && has('angle_increment');
}

/** A scan a line, or a step and its range. @param {Uint8Array} head @param {string} text */
function isRangeTable(head, text) {
  const rows = text
    .split(/[\r\n]+/)
    .map((line) => line.split(/[\s,;]+/).filter((word) => word !== ''))
    .filter((words) => words.length > 0 && words.every(isNumber))
    .slice(0, TABLE_LINES);
  if (head.at(-1) !== 10 && rows.length > 1 && rows.length < TABLE_LINES) rows.pop();
  if (rows.length === 0) return false;
  if (rows.every((row) => row.length >= MIN_SCAN_NUMBERS)) return true;
  const begin = Number(rows[0]?.[0]);
  const counts = rows.every((row, index) => row.length === 2 && Number(row[0]) === begin + index);
  return rows.length >= TABLE_LINES && (begin === 0 || begin === 1) && counts;
}

/** @param {string} word */
function isNumber(word) {
  return word !== '' && (Number.isFinite(Number(word)) || /^[+-]?(nan|inf(inity)?)$/i.test(word));
}

/**
 * Whether a file of numbers is called odometry.
 * @param {string} path
 */
export function isOdometryName(path) {
  return /odom/i.test(path.split('/').at(-1) ?? '');
}
