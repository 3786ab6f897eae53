/** Logs of laser scans, many in one file: which files are such, and which tell the odometry to them. */
import { latin1 } from './heads.js';

/** Readings cover a turn at most; steps that were rounded may add up to a little more (rad). */
export const MOST_ANGLE = 1.1 * 2 * Math.PI;

/** Words that begin a line of a CARMEN log, or of what pose graph tools made of one. */
const CARMEN_WORDS = /^(FLASER|ROBOTLASER1|RAWLASER1|LASER_READING|ODOM|PARAM|VERTEX2|EDGE2|SYNC|RLASER)\s/;

/** A line of a scan in a table has so many numbers at least: a pose has 16 at the most. */
const MIN_SCAN_NUMBERS = 24;
/** So many lines of a table are looked into. */
const TABLE_LINES = 20;
/** So many words of a scan's line may be no numbers: names of frames, dates. */
const MAX_WORDS = 8;

/**
 * Whether a file that begins like this is a laser log: CARMEN's text, that of CMU's course, CSM's JSON, a table of messages
 * or of ranges. The engine's `is_laser_log` says the same.
 * @param head a few kilobytes
 */
export function isLaserLog(head: Uint8Array) {
  if (head.includes(0)) return false;
  const text = new TextDecoder().decode(head).trimStart();
  if (/^[[{]/.test(text)) return /"readings"/.test(text) || (/"nrays"/.test(text) && /"min_theta"/.test(text));
  const lines = text.split(/[\r\n]+/).filter((line) => line.trim() !== '' && !/^\s*#/.test(line));
  const first = lines.slice(0, 3);
  if (first.some((line) => CARMEN_WORDS.test(line.trimStart()))) return true;
  return (first.length > 0 && first.every(isCmuLine)) || isMessageTable(lines[0] ?? '') || isRangeTable(head, text);
}

/** Whether a file that begins like this is a table of ranges, whose columns somebody may want to name. */
export function isTable(head: Uint8Array) {
  const lines = latin1(head)
    .split(/[\r\n]+/)
    .filter((line) => line.trim() !== '' && !/^\s*#/.test(line));
  const [first = ''] = lines;
  const isOther = /^\s*[[{]/.test(first) || isCmuLine(first) || isMessageTable(first);
  return isLaserLog(head) && !isOther && !lines.slice(0, 3).some((line) => CARMEN_WORDS.test(line.trimStart()));
}

/** `O x y theta time`, or `L` and a scan. */
function isCmuLine(line: string) {
  const [kind, ...words] = line.trim().split(/\s+/);
  const end = words.findIndex((word) => !isNumber(word));
  const count = end < 0 ? words.length : end;
  return (kind === 'O' && count === 4) || (kind === 'L' && count > 7);
}

/** The first line names the fields of a LaserScan. */
function isMessageTable(line: string) {
  const names = line.split(',').map((name) =>
    name
      .trim()
      .toLowerCase()
      .replaceAll(/^[%"]+|[%"]+$/g, ''),
  );
  const has = (wanted: string) => names.some((name) => name.replace(/^field\.|^\/.*\//, '') === wanted);
  return has('angle_min') && has('angle_increment');
}

/** A scan a line, or a step and its range. */
function isRangeTable(head: Uint8Array, text: string) {
  const lines = text.split(/[\r\n]+/).map((line) => line.split(/[\s,;|[\](){}"']+/).filter((word) => word !== ''));
  const isLabel = (word: string) => /[^:]:$/.test(word);
  const isRow = (given: string[]) => {
    if (/^(#|%|\/\/)/.test(given[0] ?? '')) return false;
    // Beside labels, words stand for no column; many of them are no such line, but a program's text.
    const isText = given.filter((word) => !isLabel(word) && !isNumber(word)).length > MAX_WORDS;
    const words = given.some(isLabel) && !isText ? given.filter(isNumber) : given;
    const others = words.filter((word) => !isNumber(word)).length;
    // Mostly zeros beside words are the covariances of a pose.
    const ranges = words.filter((word) => Number(word) > 0).length;
    return words.length > 0 && (others === 0 || (others <= MAX_WORDS && 3 * ranges > words.length));
  };
  const rows = lines.filter(isRow).slice(0, TABLE_LINES);
  if (head.at(-1) !== 10 && rows.length > 1 && rows.length < TABLE_LINES) rows.pop();
  if (rows.length === 0 || areLabels(rows.slice(1))) return false;
  if (rows.every((row) => row.filter(isNumber).length >= MIN_SCAN_NUMBERS)) return true;
  const labels = rows[0]?.filter(isLabel) ?? [];
  const names = labels.length > 0 ? labels : (lines.slice(0, lines.findIndex(isRow)).at(-1) ?? []);
  if (rows.length >= 2 && isReading(names)) return true;
  const begin = Number(rows[0]?.[0]);
  const follows = (row: string[], index: number) =>
    index === 0 || Number(row[0]) === begin || Number(row[0]) === Number(rows[index - 1]?.[0]) + 1;
  const counts = rows.every((row, index) => row.length === 2 && follows(row, index));
  return rows.length >= TABLE_LINES && (begin === 0 || begin === 1) && counts;
}

/** Most different numbers of labels, the largest, and fewest lines that show them. */
const [MOST_LABELS, MAX_LABEL, MIN_LABEL_LINES] = [12, 255, 3];

/** Whether all numbers of lines behind the first are a few different small whole ones. */
function areLabels(rows: string[][]) {
  const numbers = rows.flatMap((row) => row.slice(1).map(Number).filter(Number.isFinite));
  const { size } = new Set(numbers);
  const isFew = size > 1 && size <= MOST_LABELS;
  const areSmall = numbers.every((number) => Number.isInteger(number) && Math.abs(number) <= MAX_LABEL);
  return rows.length >= MIN_LABEL_LINES && rows.every((row) => row.length > MIN_SCAN_NUMBERS) && isFew && areSmall;
}

/** Whether a file of numbers is of labels: by its name, or since it holds nothing else. */
export function isOfLabels(path: string, head: Uint8Array) {
  const isNamed = /(^|[^a-z])(labels?|partitions?|classes|segments?|annotations?)([^a-z]|$)/i.test(
    path.split('/').at(-1) ?? '',
  );
  const rows = latin1(head)
    .split(/[\r\n]+/)
    .slice(1, 1 + TABLE_LINES);
  return isNamed || areLabels(rows.map((line) => line.split(/[\s,;|]+/).filter((word) => word !== '')));
}

/** What an angle, the number of a beam and a range are called, as the engine knows it. */
const ANGLE =
  /(^|[^\p{L}\d])(angle|angule|theta|bearing|azimut|servo|winkel|ángulo|angulo|angolo|角度|方位|ang(?![\p{L}\d]))/iu;
const IN_ANGLES = /(^|[^\p{L}\d])(deg|rad|degrees|radians)([^\p{L}\d]|$)|°/iu;
const HEADING =
  /^(odometry|odom|odo|pose|robot|position|pos)?[_. ]?(theta|th|yaw|heading|phi|ang|orientation|rotation|rot|gier|richtung|cap|lacet|rumbo)([^\p{L}]|$)/iu;
const BEAM = /^(beam|ray|strahl|haz|faisceau|step)/i;
const RANGE = /^(range|dist|radius|abstand|entfernung|portée|alcance|距離|距离)/i;
/** Without x and y beside it, as in polar coordinates. */
const RADIUS = /^(r|rho)([_\s([]|$)/i;

/** Whether the names of the columns are those of an angle or a beam, and of a range, or of numbered scans. */
function isReading(names: string[]) {
  const has = (word: RegExp) => names.some((name) => word.test(name));
  const hasAngle = has(ANGLE) || names.some((name) => IN_ANGLES.test(name) && !HEADING.test(name));
  const isScans = names.length > 2 && new Set(names.slice(1).map((name) => name.replace(/\d+/, ''))).size === 1;
  const isRanges = has(RANGE) || isScans || (has(RADIUS) && !has(/^x$/i));
  return names.length < MIN_SCAN_NUMBERS && (hasAngle || has(BEAM)) && isRanges;
}

function isNumber(word: string) {
  return (
    word !== '' && (Number.isFinite(Number(word)) || /^([+-]?(nan|inf(inity)?)|none|null|n\/?a|-{1,3})$/i.test(word))
  );
}

/** Whether a file of numbers is called odometry. */
export function isOdometryName(path: string) {
  return /odom/i.test(path.split('/').at(-1) ?? '');
}
