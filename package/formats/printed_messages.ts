/**
 * Scans as ROS, Gazebo and Python print them: `name: value` lines, a message after the other; `LaserScan(header=..., ranges=[...])`;
 * arrays alone; lists of (quality, angle, distance).
 */
import { fileError } from '../base/errors.js';
import { DEGREE } from '../base/units.js';
import { type Scan, scanOf } from './scan.js';
import type { Tell } from './scan_checks.js';

/** A scan's message has these from its beginning on. */
const OF_A_MESSAGE = ['seq', 'sec', 'secs', 'frame_id', 'angle_min'];
/** Arrays alone, as Python prints them: `array('f', [1.25, ...])`. */
const ARRAYS = /^\s*(---\s*)*array\('[fd]', \[/;

export function isArrays(head: string) {
  return ARRAYS.test(head);
}

/** The field of a message alone: `ros2 topic echo --field ranges`. */
export function readArrays(text: string) {
  const lists = [...text.matchAll(/array\('[fd]', \[([^\]]*)\]\)/g)];
  return lists.map(([, list = '']) =>
    scanOf(
      () => undefined,
      list.split(',').map((word) => word.trim()),
    ),
  );
}

export function isEcho(head: string) {
  return /^\s*angle_min:/m.test(head) && /^\s*angle_(increment|step):/m.test(head);
}

/** Messages as ROS and Gazebo print them: only the fields that are needed are looked at. */
export function readEcho(text: string, name: string, tell: Tell) {
  const scans: Scan[] = [];
  let fields: Map<string, string[]> = new Map();
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
      const values = wordsOf(value);
      // Gazebo has a line for each range.
      fields.set(key, key === 'ranges' ? [...(fields.get(key) ?? []), ...values] : values);
    } else if (/^[\s\d.,\]einfa+-]+$/i.test(line)) fields.get(list)?.push(...wordsOf(line)); // A list goes on in the next line.
  }
  finish();
  if (scans.length > 0) mustBeWhole(text, name);
  if (numBroken > 0) tell(`${numBroken} of its messages have no ranges, as where it is cut off`, true);
  return scans;
}

/** The words of a list, without its brackets and quotes. */
function wordsOf(text: string) {
  return text
    .replaceAll(/[[\]'"]/g, ' ')
    .split(/[\s,]+/)
    .filter(Boolean);
}

/** @param text of messages */
function mustBeWhole(text: string, name: string) {
  if (!/^\s*(- )?'?\.\.\.'?\s*$/m.test(text)) return;
  throw fileError(
    name,
    'The ranges are shortened (...): ros2 topic echo shortens long lists',
    'Record them whole: ros2 topic echo --full-length /scan > FILE, or a bag: ros2 bag record /scan',
  );
}

export function isRepr(head: string) {
  return /LaserScan\(header=.*angle_min=/.test(head);
}

/** Messages as Python prints them: `LaserScan(header=..., angle_min=-1.57, ..., ranges=[...], ...)`. */
export function readRepr(text: string): Scan[] {
  return text
    .split(/LaserScan\((?=header=)/)
    .slice(1)
    .flatMap((message) => {
      const start = /\branges=(?:array\('f', )?\[/.exec(message);
      const end = start ? message.indexOf(']', start.index) : -1;
      const list = start && end > 0 ? message.slice(start.index + start[0].length, end) : null;
      const field = (key: string) => new RegExp(`\\b${key}=(-?[\\d.e+-]+|-?inf|nan)`).exec(message)?.[1];
      return list === null
        ? []
        : [
            scanOf(
              field,
              list.split(',').map((word) => word.trim()),
            ),
          ];
    });
}

export function isTuples(head: string) {
  return /^\s*\[?\s*\(\s*\d+(\.\d+)?\s*,\s*\d+(\.\d+)?\s*,\s*\d+(\.\d+)?\s*\)\s*,\s*\(/.test(head);
}

/** (quality, angle, distance) of RPLIDARs, which turn clockwise; degrees and mm. */
export function readTuples(text: string): Scan[] {
  return text.split(/\r?\n/).flatMap((line) => {
    const tuples = [...line.matchAll(/\(\s*([\d.]+)\s*,\s*([\d.]+)\s*,\s*([\d.]+)\s*\)/g)];
    const ranges = tuples.map(([, , , distance]) => (Number(distance) > 0 ? 1e-3 * Number(distance) : null));
    return tuples.length > 1 ? [{ ranges, angles: tuples.map(([, , angle]) => -DEGREE * Number(angle)) }] : [];
  });
}
