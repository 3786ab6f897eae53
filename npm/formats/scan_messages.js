// @ts-check
/**
 * Laser scans as programs print or log them, as the text that the engine reads: JSON objects with `readings` (CSM) where a scan
 * tells its angles, a table of ranges where it does not.
 *
 * | what | told from |
 * |---|---|
 * | `ros2 topic echo`, `rostopic echo`, `gz topic -e`: `name: value` lines, a message after the other | `angle_min:` and `angle_increment:` or `angle_step:` |
 * | JSON: a message, a list of them, one a line, within others (rosbridge) | `"ranges": [` or objects with an angle and a distance |
 * | SICK's telegrams (CoLa A) | `LMDscandata` |
 * | UrgBenri's log (`.ubh`) | `[startStep]` |
 * | a LaserScan as Python prints it | `LaserScan(header=` |
 * | lists of 24 numbers and more, as JSON or Python writes them | their brackets |
 * | Player, DP-SLAM, `ultra_simple` of RPLIDARs (scan_lines.js) | their lines |
 * | the Python package rplidar: a list of (quality, angle, distance) a line | its brackets |
 * | an angle and a distance at a time (angle_distance.js) | colons, braces, letters |
 */
import { fileError } from '../errors.js';
import { angleDistanceReader } from './angle_distance.js';
import { lookUp } from '../look_up.js';
import { checkedScans, given } from './scan_checks.js';
import { bytesOfHex, isLdrobot, readLdrobot } from './ldrobot.js';
import {
  isNumberedPoints,
  isPointJson,
  kindOfLines,
  pointsOfList,
  readLines,
  readNumberedPoints,
  scanOfPoints,
} from './point_scans.js';
import * as lines from './scan_lines.js';
import { isScip, readScip } from './scip.js';
import { readSickBinary, readSickText } from './sick.js';

/** @typedef {import('./scan_checks.js').Tell} Tell */

/**
 * A scan: ranges (m; null where nothing came back), angles in rad.
 * @typedef {{ ranges: (number | null)[], start?: number, step?: number, end?: number, angles?: number[], time?: number,
 *   nearest?: number, farthest?: number, odometry?: number[], mayBeMirrored?: boolean }} Scan end: the angle of the last reading, where it is told; odometry: x, y
 *   (m) and heading (rad) by the wheels; mayBeMirrored: whether nothing tells which way the laser turns
 */

const DEGREE = Math.PI / 180;
/** Nesting of JSON that is looked into. */
const MAX_DEPTH = 8;
/** A scan's message has these from its beginning on. */
const OF_A_MESSAGE = ['seq', 'sec', 'secs', 'frame_id', 'angle_min'];
/** Readings of a scan, at least, where nothing names them. */
const MIN_BEAMS = 24;
/** Lists of so many numbers, as JSON or as Python prints them. */
const LISTS = /\[(\s*(-?[\d.]+([eE][-+]?\d+)?|nan|inf|NaN|Infinity|null)\s*,){23}/;
/** Arrays alone, as Python prints them: `array('f', [1.25, ...])`. */
const ARRAYS = /^\s*(---\s*)*array\('[fd]', \[/;
/** Hokuyo's readings below this are codes of errors (mm). */
const FIRST_RANGE_OF_URG = 20;

/** @typedef {(text: string, name: string, tell: Tell) => string} Reader tell: of what is wrong with it */

/** @type {readonly { is: (head: string) => boolean, read: Reader }[]} */
const KINDS = [
  { is: (head) => /\bLMDscandata /.test(head), read: fromSick },
  { is: (head) => /^\[startStep\]/m.test(head) && /^\[(scan|endStep)\]/m.test(head), read: fromUrgBenri },
  { is: isScip, read: fromScip },
  { is: isRepr, read: fromRepr },
  { is: isJson, read: fromJson },
  { is: isTuples, read: fromTuples },
  { is: (head) => ARRAYS.test(head), read: fromArrays },
  { is: isEcho, read: fromEcho },
  { is: lines.isPlayer, read: (text, name, tell) => written(lines.fromPlayer(text), name, tell) },
  { is: lines.isDpSlam, read: (text, name, tell) => written(lines.fromDpSlam(text), name, tell) },
  { is: lines.isRplidar, read: (text, name, tell) => written(lines.fromRplidar(text), name, tell) },
  { is: lines.isListener, read: (text, name, tell) => written(lines.fromListener(text), name, tell) },
  { is: lines.isAria, read: (text, name, tell) => written(lines.fromAria(text), name, tell) },
];

/** Those that lie in tables as well: what has another reader by its columns is none of them. @type {typeof KINDS} */
const TABLE_KINDS = [
  { is: lines.isNeato, read: (text, name, tell) => written(lines.fromNeato(text), name, tell) },
  { is: isNumberedPoints, read: (text, name, tell) => whole(readNumberedPoints(text), 'lines', name, tell) },
  {
    is: (head) => isLdrobot(bytesOfHex(head) ?? new Uint8Array()),
    read: (text, name, tell) => fromLdrobot(bytesOfHex(text) ?? new Uint8Array(), name, tell),
  },
  { is: (head) => kindOfLines(head) !== null, read: (text, name, tell) => whole(readLines(text), 'lines', name, tell) },
];

/**
 * What reads a table that begins like this and whose columns are no ranges; null where it is none of these.
 * @param {string} head
 * @returns {Reader | null}
 */
export function tableScanReader(head) {
  return TABLE_KINDS.find(({ is }) => is(head))?.read ?? null;
}

/**
 * What reads a text that begins like this; null where it is none of these.
 * @param {string} head
 * @param {boolean} [isPath] whether it is called a path or a camera: lists without names are none of scans then
 * @returns {Reader | null}
 */
export function scanReader(head, isPath = false) {
  const reader = KINDS.find(({ is }) => is(head))?.read ?? tableScanReader(head) ?? angleDistanceReader(head);
  return reader ?? (!isPath && /^\s*[[{]/.test(head) && LISTS.test(head) ? fromJson : null);
}

/** @param {string} head */
function isEcho(head) {
  return /^\s*angle_min:/m.test(head) && /^\s*angle_(increment|step):/m.test(head);
}

/** @param {string} head */
function isJson(head) {
  if (!/^\s*[[{]/.test(head) || /"readings"|"nrays"/.test(head)) return false;
  const has = (/** @type {string} */ names) => new RegExp(`["'](${names})["']\\s*:\\s*-?[\\d.[]`, 'i').test(head);
  return (
    isPointJson(head) ||
    has('ranges') ||
    has('angle_min') ||
    (has('angle|theta|bearing') && has('range|dist|distance|r'))
  );
}

/** The field of a message alone: `ros2 topic echo --field ranges`. @param {string} text @param {string} name @param {Tell} tell */
function fromArrays(text, name, tell) {
  const lists = [...text.matchAll(/array\('[fd]', \[([^\]]*)\]\)/g)];
  const scans = lists.map(([, list = '']) =>
    scanOf(
      () => undefined,
      list.split(',').map((word) => word.trim()),
    ),
  );
  return written(scans, name, tell);
}

/** @param {string} head */
function isTuples(head) {
  return /^\s*\[?\s*\(\s*\d+(\.\d+)?\s*,\s*\d+(\.\d+)?\s*,\s*\d+(\.\d+)?\s*\)\s*,\s*\(/.test(head);
}

/** Messages as ROS and Gazebo print them: only the fields that are needed are looked at. @param {string} text @param {string} name @param {Tell} tell */
function fromEcho(text, name, tell) {
  /** @type {Scan[]} */
  const scans = [];
  /** @type {Map<string, string[]>} */
  let fields = new Map();
  let numBroken = 0;
  const finish = () => {
    if (!fields.has('ranges')) numBroken += OF_A_MESSAGE.some((key) => fields.has(key)) ? 1 : 0;
    else scans.push(scanOf((key) => fields.get(key)?.[0], fields.get('ranges') ?? []));
    fields = new Map();
  };
  let list = '';
  for (const line of text.split(/\r?\n/)) {
    const [, key = '', value = ''] = /^\s*(\w+):\s*(.*)$/.exec(line) ?? [];
    const item = /^\s*-\s*(\S.*)$/.exec(line)?.[1];
    if (item !== undefined) fields.get(list)?.push(item);
    // Gazebo's messages have nothing between them but the next header.
    else if (/^(---|header\b)/.test(line)) finish();
    else if (key !== '') {
      list = key;
      const values = value
        .replaceAll(/[[\]'"]/g, ' ')
        .split(/[\s,]+/)
        .filter(Boolean);
      // Gazebo has a line for each range.
      fields.set(key, key === 'ranges' ? [...(fields.get(key) ?? []), ...values] : values);
    } else if (/^[\s\d.,\]einfa+-]+$/i.test(line) && fields.has(list)) {
      // A list goes on in the next line.
      fields.get(list)?.push(
        ...line
          .replaceAll(/[\]]/g, ' ')
          .split(/[\s,]+/)
          .filter(Boolean),
      );
    }
  }
  finish();
  if (scans.length > 0 && /^\s*(- )?'?\.\.\.'?\s*$/m.test(text)) {
    throw fileError(
      name,
      'The ranges are shortened (...): so does ros2 topic echo with long lists',
      'Record them whole: ros2 topic echo --full-length /scan > FILE, or a bag: ros2 bag record /scan',
    );
  }
  if (numBroken > 0) tell(`${numBroken} of its messages have no ranges, as where it is cut off`, true);
  return written(scans, name, tell);
}

/** @param {string} head */
function isRepr(head) {
  return /LaserScan\(header=.*angle_min=/.test(head);
}

/** Messages as Python prints them: `LaserScan(header=..., angle_min=-1.57, ..., ranges=[...], ...)`. @param {string} text @param {string} name @param {Tell} tell */
function fromRepr(text, name, tell) {
  const scans = text
    .split(/LaserScan\((?=header=)/)
    .slice(1)
    .flatMap((message) => {
      const start = /\branges=(?:array\('f', )?\[/.exec(message);
      const end = start ? message.indexOf(']', start.index) : -1;
      const list = start && end > 0 ? message.slice(start.index + start[0].length, end) : null;
      const field = (/** @type {string} */ key) => new RegExp(`\\b${key}=(-?[\\d.e+-]+|-?inf|nan)`).exec(message)?.[1];
      return list === null
        ? []
        : [
            scanOf(
              field,
              list.split(',').map((word) => word.trim()),
            ),
          ];
    });
  return written(scans, name, tell);
}

/** @param {(key: string) => unknown} field @param {readonly unknown[]} ranges @returns {Scan} */
function scanOf(field, ranges) {
  const number = (/** @type {string[]} */ ...keys) => {
    const value = keys.map(field).find((value) => value !== undefined && value !== null);
    const known = numberOf(value);
    return Number.isFinite(known) ? known : undefined;
  };
  const seconds = number('secs', 'sec');
  const nanoseconds = number('nsecs', 'nanosec', 'nsec') ?? 0;
  const start = number('angle_min', 'angleMin', 'min_angle');
  const end = number('angle_max', 'angleMax', 'max_angle');
  const even = start === undefined || end === undefined ? undefined : (end - start) / Math.max(ranges.length - 1, 1);
  const step = number('angle_increment', 'angle_step', 'angleIncrement') || even;
  return {
    ranges: ranges.map((range) => {
      const value = numberOf(range);
      return Number.isFinite(value) ? value : null;
    }),
    ...given('start', start),
    ...given('step', step),
    ...given('end', end),
    ...given('time', seconds === undefined ? number('timestamp', 'time', 'stamp', 't') : seconds + 1e-9 * nanoseconds),
    ...given('nearest', number('range_min', 'rangeMin')),
    ...given('farthest', number('range_max', 'rangeMax')),
  };
}

/** @param {unknown} value */
function numberOf(value) {
  if (typeof value === 'number') return value;
  return typeof value === 'string' && value.trim() !== '' ? Number(value) : Number.NaN;
}

/** @param {string} text @param {string} name @param {Tell} tell */
function fromJson(text, name, tell) {
  /** @type {Scan[]} */
  const scans = [];
  // Python's words for what is no number are none of JSON's.
  const documents = documentsOf(inJson(text), name, tell);
  for (const document of documents) collect(document, {}, 0, scans);
  if (scans.length === 0) for (const document of documents) collectLists(document, {}, 0, scans);
  return written(scans, name, tell);
}

/** Python's quotes and words, and what is no number, as JSON has them. @param {string} text */
function inJson(text) {
  const numbers = text.replaceAll(/([[,]\s*)-?(?:nan|inf|NaN|Infinity)(?=\s*[,\]])/g, '$1null');
  if (numbers.includes('"')) return numbers;
  const words = { True: 'true', False: 'false', None: 'null' };
  return numbers.replaceAll("'", '"').replaceAll(/\b(True|False|None)\b/g, (word) => lookUp(words, word) ?? word);
}

/** One document, or one a line. @param {string} text @param {string} name @param {Tell} tell @returns {unknown[]} */
function documentsOf(text, name, tell) {
  try {
    return [JSON.parse(text)];
  } catch {
    const lines = text.split(/\r?\n/).filter((line) => line.trim() !== '');
    const known = lines.flatMap((line) => {
      try {
        return [JSON.parse(line.replace(/,\s*$/, ''))];
      } catch {
        return [];
      }
    });
    // A recorder that was stopped leaves half a line behind.
    if (known.length > 0 && known.length < lines.length) tell('one of its lines is not JSON, and is left out', true);
    if (known.length > 0 && known.length >= lines.length - 1) return known;
    throw fileError(name, 'This is neither one JSON document nor one a line', 'Correct the JSON: one scan a line');
  }
}

/**
 * The scans within a document; fields of what holds them (a time, for one) belong to them.
 * @param {unknown} value @param {Readonly<Record<string, unknown>>} around @param {number} depth @param {Scan[]} scans
 */
function collect(value, around, depth, scans) {
  if (typeof value !== 'object' || value === null || depth > MAX_DEPTH) return;
  if (Array.isArray(value)) {
    const points = pointsOfList(value);
    const readings = points ? scanOfPoints(points) : readingsOf(value);
    if (readings) scans.push({ ...scanOf((key) => around[key], []), ...readings });
    else value.forEach((item) => collect(item, around, depth + 1, scans));
    return;
  }
  const own = /** @type {Record<string, unknown>} */ (value);
  const known = { ...around, ...flat(own) };
  const ranges = Object.entries(own).find(([key]) => /^ranges$/i.test(key))?.[1];
  if (Array.isArray(ranges) && ranges.every((range) => typeof range !== 'object' || range === null)) {
    const angles = own['angles'];
    const listed =
      Array.isArray(angles) && angles.length === ranges.length ? { angles: radians(angles.map(Number)) } : {};
    scans.push({ ...scanOf((key) => known[key], ranges), ...listed });
    return;
  }
  Object.values(own).forEach((item) => collect(item, known, depth + 1, scans));
}

/**
 * The lists of numbers within a document, where nothing in it is called ranges.
 * @param {unknown} value @param {Readonly<Record<string, unknown>>} around @param {number} depth @param {Scan[]} scans
 */
function collectLists(value, around, depth, scans) {
  if (typeof value !== 'object' || value === null || depth > MAX_DEPTH) return;
  const isNumber = (/** @type {unknown} */ item) => typeof item === 'number' || item === null;
  if (Array.isArray(value) && value.length >= MIN_BEAMS && value.every(isNumber)) {
    scans.push(scanOf((key) => around[key], value));
    return;
  }
  const known = Array.isArray(value) ? around : { ...around, ...flat(/** @type {Record<string, unknown>} */ (value)) };
  for (const item of Object.values(value)) collectLists(item, known, depth + 1, scans);
}

/** Numbers and texts of an object, and those of its header and stamp. @param {Record<string, unknown>} object @returns {Record<string, unknown>} */
function flat(object) {
  const nested = ['header', 'stamp'].map((key) => object[key]);
  const below = nested.flatMap((item) =>
    typeof item === 'object' && item !== null && !Array.isArray(item)
      ? [flat(/** @type {Record<string, unknown>} */ (item))]
      : [],
  );
  const plain = Object.entries(object).filter(([, value]) => typeof value !== 'object');
  return Object.assign(Object.fromEntries(plain), ...below);
}

/** A list of objects with an angle and a distance each. @param {readonly unknown[]} list @returns {Pick<Scan, 'ranges' | 'angles' | 'mayBeMirrored'> | null} */
function readingsOf(list) {
  const [first] = list;
  if (list.length < 2 || typeof first !== 'object' || first === null || Array.isArray(first)) return null;
  const keys = Object.keys(first);
  const angle = keys.find((key) => /^(angle|theta|bearing|azimuth)(_?(deg|rad|degrees|radians))?$/i.test(key));
  const distance = keys.find((key) => /^(range|dist|distance|r)(_?(m|cm|mm))?$/i.test(key));
  if (angle === undefined || distance === undefined) return null;
  const values = (/** @type {string} */ key) =>
    list.map((item) => numberOf(/** @type {Record<string, unknown>} */ (item ?? {})[key]));
  const angles = radians(values(angle));
  // From 0 to beyond half a turn, as both lasers count that turn clockwise and others.
  const isOpen = angles.every((value) => !(value < 0)) && angles.some((value) => value > Math.PI);
  return { angles, ranges: metres(values(distance)), ...(isOpen && { mayBeMirrored: true }) };
}

/** Angles beyond a turn of radians are degrees. @param {readonly number[]} angles */
function radians(angles) {
  const largest = angles.reduce((most, angle) => Math.max(most, Math.abs(angle) || 0), 0);
  return angles.map((angle) => (largest > 7 ? DEGREE * angle : angle));
}

/** Distances whose median is beyond 60 are millimetres: no laser for the plane sees that far. @param {readonly number[]} distances */
function metres(distances) {
  const sorted = distances.filter((distance) => distance > 0).sort((a, b) => a - b);
  const unit = (sorted[Math.floor(sorted.length / 2)] ?? 0) > 60 ? 1e-3 : 1;
  return distances.map((distance) => (distance > 0 ? unit * distance : null));
}

/** (quality, angle, distance) of RPLIDARs, which turn clockwise; degrees and mm. @param {string} text @param {string} name @param {Tell} tell */
function fromTuples(text, name, tell) {
  const scans = text.split(/\r?\n/).flatMap((line) => {
    const tuples = [...line.matchAll(/\(\s*([\d.]+)\s*,\s*([\d.]+)\s*,\s*([\d.]+)\s*\)/g)];
    const ranges = tuples.map(([, , , distance]) => (Number(distance) > 0 ? 1e-3 * Number(distance) : null));
    return tuples.length > 1 ? [{ ranges, angles: tuples.map(([, , angle]) => -DEGREE * Number(angle)) }] : [];
  });
  return written(scans, name, tell);
}

/** SICK's telegrams, as text or as bytes. @param {string | Uint8Array} telegrams @param {string} name @param {Tell} tell */
export function fromSick(telegrams, name, tell) {
  const { scans, numBroken } = typeof telegrams === 'string' ? readSickText(telegrams) : readSickBinary(telegrams);
  if (numBroken > 0) tell(`${numBroken} of its telegrams are cut off or damaged`, true);
  return written(scans, name, tell);
}

/** Answers of Hokuyo's lasers. @param {string} text @param {string} name @param {Tell} tell */
function fromScip(text, name, tell) {
  return whole(readScip(text), 'answers', name, tell);
}

/** Packets of LDROBOT's lasers. @param {Uint8Array} bytes @param {string} name @param {Tell} tell */
export function fromLdrobot(bytes, name, tell) {
  return whole(readLdrobot(bytes), 'packets', name, tell);
}

/**
 * @param {{ scans: Scan[], numBroken: number }} found @param {string} parts what may be broken @param {string} name @param {Tell} tell
 */
function whole({ scans, numBroken }, parts, name, tell) {
  if (numBroken > 0) tell(`${numBroken} of its ${parts} are cut off or damaged`, true);
  return written(scans, name, tell);
}

/** Sections in square brackets, their values below them. @param {string} text @param {string} name @param {Tell} tell */
function fromUrgBenri(text, name, tell) {
  /** @type {Map<string, number>} */
  const known = new Map();
  /** @type {Scan[]} */
  const scans = [];
  let section = '';
  for (const line of text.split(/\r?\n/).map((line) => line.trim())) {
    const title = /^\[(\w+)\]$/.exec(line)?.[1];
    if (title !== undefined) section = title.toLowerCase();
    else if (section === 'scan' && line.includes(';')) {
      const ranges = line.split(/[;|]/).filter(Boolean).map(Number);
      const [turn, front] = [known.get('areatotal') ?? 1440, known.get('frontstep') ?? (ranges.length - 1) / 2];
      const step = (2 * Math.PI) / turn;
      const time = known.get('timestamp');
      scans.push({
        ranges: ranges.map((range) => (range >= FIRST_RANGE_OF_URG ? 1e-3 * range : null)),
        start: ((known.get('startstep') ?? 0) - front) * step,
        step,
        ...given('time', time === undefined ? undefined : 1e-3 * time),
      });
    } else if (line !== '' && Number.isFinite(Number(line))) known.set(section, Number(line));
  }
  return written(scans, name, tell);
}

/** @param {readonly Scan[]} found @param {string} name @param {Tell} tell */
function written(found, name, tell) {
  if (found.length === 0) {
    throw fileError(name, 'No scan of it is whole', 'Give messages with angle_min, angle_increment and ranges');
  }
  const scans = checkedScans(found, name, tell);
  if (scans.some(({ mayBeMirrored }) => mayBeMirrored)) {
    tell(
      'its angles are taken to grow counter-clockwise; of a laser that turns clockwise, as RPLIDAR, YDLIDAR and LDROBOT do, the map is mirrored: write the angles from -180 to 180 degrees, counter-clockwise',
    );
  }
  const hasAngles = scans.every(({ angles, start, step }) => angles !== undefined || (start !== undefined && step));
  if (!hasAngles && scans.some(({ start }) => start !== undefined)) {
    throw fileError(name, 'Its readings have all the same angle', 'Give angle_min, angle_max and angle_increment');
  }
  return hasAngles ? scans.map(asCsm).join('') : asTable(scans);
}

/** @param {Scan} scan */
function asCsm({ ranges, angles, start = 0, step = 0, time, nearest, farthest, odometry, mayBeMirrored }) {
  const whole = {
    readings: ranges.map((range) => (range !== null && farthest !== undefined && range > farthest ? null : range)),
    ...(angles ? { theta: angles } : { min_theta: start, max_theta: start + step * (ranges.length - 1) }),
    ...given('min_range', nearest),
    ...given('timestamp', time),
    ...(odometry ? { odometry } : {}),
    ...(mayBeMirrored && { may_be_mirrored: true }),
  };
  return `${JSON.stringify(whole)}\n`;
}

/** A table without angles: the import dialog asks for them. @param {readonly Scan[]} scans */
function asTable(scans) {
  const hasTimes = scans.every(({ time }) => time !== undefined);
  const [{ ranges: first } = { ranges: [] }] = scans;
  const head = [...(hasTimes ? ['time'] : []), ...first.map((_, at) => `range_${at}`)].join(',');
  const rows = scans.map(({ ranges, time }) =>
    [...(hasTimes ? [time] : []), ...ranges.map((r) => r ?? 'nan')].join(','),
  );
  return `${[head, ...rows].join('\n')}\n`;
}
