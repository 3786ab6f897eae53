/**
 * Scans as older programs and sample programs log them, a message a line.
 *
 * Sources: Player's manual, "writelog", laser, ranger and position2d formats; DP-SLAM's readme (`Odometry x y theta`, `Laser n r1 ..
 * rn`); the output of `ultra_simple` in the SDK of RPLIDARs (`S  theta: 0.00 Dist: 1200.00 Q: 47`, degrees clockwise, mm).
 */

import { DEGREE } from '../base/units.js';
import { scanOfPoints } from './point_scans.js';
import { ReadingScans, type Scan } from './scan.js';

/** What all lines of Player begin with: time, host, robot, interface, index, type, subtype. */
const PLAYER = /^(\d+\.\d+) \d+ \d+ (laser|ranger|position2d) \d+ (\d+) (\d+) (.*)$/;
const RPLIDAR = /theta:\s*([\d.]+)\s+Dist:\s*([\d.]+)/i;

export function isPlayer(head: string) {
  return /^\d+\.\d+ \d+ \d+ (laser|ranger) \d+ 0*1 0*[12] /m.test(head);
}

export function fromPlayer(text: string): Scan[] {
  const scans: Scan[] = [];
  let known: { odometry?: number[] } = {};
  for (const line of text.split(/\r?\n/)) {
    const [, time, device, type, subtype, rest = ''] = PLAYER.exec(line) ?? [];
    const values = rest.trim().split(/\s+/).map(Number);
    if (Number(type) !== 1) continue;
    if (device === 'position2d' && Number(subtype) === 1) known = { odometry: values.slice(0, 3) };
    const scan =
      device === 'laser' ? playerScan(values, Number(subtype) === 2) : device === 'ranger' ? rangerScan(values) : null;
    if (scan) scans.push({ ...scan, ...known, time: Number(time) });
  }
  return scans;
}

/**
 * A number, the pose of what carries the laser, the angles, the limit, the count, then a range and an intensity each.
 * @returns null where it is cut off
 */
function playerScan(values: readonly number[], hasPose: boolean): Scan | null {
  const [start = 0, end = 0, step = 0, farthest = 0, count = 0, ...readings] = values.slice(hasPose ? 4 : 1);
  if (!(count > 1) || readings.length < 2 * count) return null;
  const ranges = readings.filter((_, at) => at % 2 === 0).slice(0, count);
  return { ranges, start, step, end, ...(farthest > 0 ? { farthest } : {}) };
}

/** A count and the ranges; the angles stand elsewhere. */
function rangerScan([count = 0, ...ranges]: readonly number[]): Scan | null {
  return count > 1 && ranges.length >= count ? { ranges: ranges.slice(0, count) } : null;
}

export function isDpSlam(head: string) {
  return /^Odometry\s+-?[\d.]+\s+-?[\d.]+\s+-?[\d.]+\s*$/m.test(head) && /^Laser\s+\d+\s+[\d.]+\s/m.test(head);
}

/** Of a laser that looks ahead over half a turn, as that program takes it. */
export function fromDpSlam(text: string): Scan[] {
  const scans: Scan[] = [];
  let known: { odometry?: number[] } = {};
  for (const line of text.split(/\r?\n/)) {
    const [word, ...values] = line.trim().split(/\s+/);
    if (word === 'Odometry') known = { odometry: values.slice(0, 3).map(Number) };
    const count = Number(values[0]);
    if (word !== 'Laser' || !(count > 1) || values.length <= count) continue;
    const step = Math.PI / (count % 2 === 1 ? count - 1 : count);
    scans.push({ ranges: values.slice(1, count + 1).map(Number), start: -Math.PI / 2, step, ...known });
  }
  return scans;
}

export function isRplidar(head: string) {
  return RPLIDAR.test(head);
}

/** A scan begins with an S, or where the angle jumps back. */
export function fromRplidar(text: string): Scan[] {
  let last = Infinity;
  return readingScans(text, (scans, line) => {
    const [, degrees, distance] = RPLIDAR.exec(line) ?? [];
    if (degrees === undefined) return;
    const angle = Number(degrees);
    if (/^\s*S\s/.test(line) || angle < last - 180) scans.begin();
    last = angle;
    scans.add(-DEGREE * angle, 1e-3 * Number(distance));
  });
}

/** Scans of a reading a line. */
function readingScans(text: string, add: (scans: ReadingScans, line: string) => void) {
  const scans = new ReadingScans();
  for (const line of text.split(/\r?\n/)) add(scans, line);
  return scans.whole();
}

/** What the listeners of RPLIDARs' and YDLIDARs' ROS packages print, with whatever stands before it: degrees and metres. */
const LISTENER =
  /(?:angle-distance\s*:|\]:\s*:|^\s*:)\s*\[\s*(-?[\d.]+),\s*(-?[\d.]+|inf|nan)\s*(?:,\s*\d+\s*)?\]\s*$/i;
const LISTENS = /I heard a laser scan .*\[\d+\]/;

export function isListener(head: string) {
  return LISTENS.test(head) && head.split(/\r?\n/).some((line) => LISTENER.test(line));
}

/** A scan begins where it is announced. */
export function fromListener(text: string): Scan[] {
  return readingScans(text, (scans, line) => {
    if (LISTENS.test(line)) scans.begin();
    const [, angle, range] = LISTENER.exec(line) ?? [];
    if (angle !== undefined) scans.add(DEGREE * Number(angle), Number(range));
  });
}

const NEATO_HEAD = /^AngleInDegrees\s*,\s*DistInMM\s*,\s*Intensity\s*,\s*ErrorCodeHEX/im;

/** What a vacuum cleaner of Neato answers to GetLDSScan. */
export function isNeato(head: string) {
  return NEATO_HEAD.test(head);
}

/** Degrees counter-clockwise, mm; what has an error code is none. */
export function fromNeato(text: string): Scan[] {
  return readingScans(text, (scans, line) => {
    if (NEATO_HEAD.test(line)) scans.begin();
    const [, angle, distance, code] = /^\s*(\d{1,3})\s*,\s*(\d+)\s*,\s*\d+\s*,\s*([0-9a-f]+)\s*$/i.exec(line) ?? [];
    if (angle === undefined) return;
    const isGood = Number.parseInt(code ?? '', 16) === 0;
    scans.add(DEGREE * Number(angle), isGood ? 1e-3 * Number(distance) : 0);
  });
}

/** Logs of MobileRobots' ARIA and ARNL: mm and degrees. */
export function isAria(head: string) {
  return /^LaserOdometryLog\s*$/m.test(head);
}

/**
 * `sick1conf: first last count` tells the angles, `robot: x y heading` the odometry, `sick1:` the ranges; the second
 * form of it has
 * the returns as `scan1: x y x y ...`, in the robot's frame.
 */
export function fromAria(text: string): Scan[] {
  const scans: Scan[] = [];
  let known: { odometry?: number[]; time?: number } = {};
  let [start, view] = [-Math.PI / 2, Math.PI];
  for (const line of text.split(/\r?\n/)) {
    const [, word = '', rest = ''] = /^(\w+):\s*(.*)$/.exec(line) ?? [];
    const values = rest.trim().split(/\s+/).map(Number);
    const [first = 0, second = 0, third = 0] = values;
    if (/^(sick|laser)1?conf$/i.test(word) && second > first)
      [start, view] = [DEGREE * first, DEGREE * (second - first)];
    if (word === 'time' && Number.isFinite(first)) known = { ...known, time: first };
    if (word === 'robot') known = { ...known, odometry: [1e-3 * first, 1e-3 * second, DEGREE * third] };
    if (/^(sick|laser)1?$/i.test(word) && values.length > 2) {
      scans.push({
        ranges: values.map((range) => (range > 0 ? 1e-3 * range : null)),
        start,
        step: view / (values.length - 1),
        ...known,
      });
    }
    if (word === 'scan1' && values.length > 4) {
      const points = Array.from({ length: values.length >> 1 }, (_, at) => {
        return [1e-3 * (values[2 * at] ?? 0), 1e-3 * (values[2 * at + 1] ?? 0)] as [number, number];
      });
      scans.push({ ...scanOfPoints(points), ...known });
    }
  }
  return scans;
}
