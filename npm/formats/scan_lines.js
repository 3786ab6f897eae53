// @ts-check
/**
 * Scans as older programs and sample programs log them, a message a line.
 *
 * Sources: Player's manual, "writelog", laser, ranger and position2d formats; DP-SLAM's readme (`Odometry x y theta`, `Laser n r1 ..
 * rn`); the output of `ultra_simple` in the SDK of RPLIDARs (`S  theta: 0.00 Dist: 1200.00 Q: 47`, degrees clockwise, mm).
 */

/** @typedef {import('./scan_messages.js').Scan} Scan */

const DEGREE = Math.PI / 180;
/** What all lines of Player begin with: time, host, robot, interface, index, type, subtype. */
const PLAYER = /^(\d+\.\d+) \d+ \d+ (laser|ranger|position2d) \d+ (\d+) (\d+) (.*)$/;
const RPLIDAR = /theta:\s*([\d.]+)\s+Dist:\s*([\d.]+)/i;

/** @param {string} head */
export function isPlayer(head) {
  return /^\d+\.\d+ \d+ \d+ (laser|ranger) \d+ 0*1 0*[12] /m.test(head);
}

/** @param {string} text @returns {Scan[]} */
export function fromPlayer(text) {
  /** @type {Scan[]} */
  const scans = [];
  /** @type {{ odometry?: number[] }} */
  let known = {};
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
 * @param {readonly number[]} values @param {boolean} hasPose @returns {Scan | null} null where it is cut off
 */
function playerScan(values, hasPose) {
  const [start = 0, end = 0, step = 0, farthest = 0, count = 0, ...readings] = values.slice(hasPose ? 4 : 1);
  if (!(count > 1) || readings.length < 2 * count) return null;
  const ranges = readings.filter((_, at) => at % 2 === 0).slice(0, count);
  return { ranges, start, step, end, ...(farthest > 0 ? { farthest } : {}) };
}

/** A count and the ranges; the angles stand elsewhere. @param {readonly number[]} values @returns {Scan | null} */
function rangerScan([count = 0, ...ranges]) {
  return count > 1 && ranges.length >= count ? { ranges: ranges.slice(0, count) } : null;
}

/** @param {string} head */
export function isDpSlam(head) {
  return /^Odometry\s+-?[\d.]+\s+-?[\d.]+\s+-?[\d.]+\s*$/m.test(head) && /^Laser\s+\d+\s+[\d.]+\s/m.test(head);
}

/** Of a laser that looks ahead over half a turn, as that program takes it. @param {string} text @returns {Scan[]} */
export function fromDpSlam(text) {
  /** @type {Scan[]} */
  const scans = [];
  /** @type {{ odometry?: number[] }} */
  let known = {};
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

/** @param {string} head */
export function isRplidar(head) {
  return RPLIDAR.test(head);
}

/** A scan begins with an S, or where the angle jumps back. @param {string} text @returns {Scan[]} */
export function fromRplidar(text) {
  /** @type {(Scan & { angles: number[] })[]} */
  const scans = [];
  let last = Infinity;
  for (const line of text.split(/\r?\n/)) {
    const [, degrees, distance] = RPLIDAR.exec(line) ?? [];
    if (degrees === undefined) continue;
    const angle = Number(degrees);
    if (/^\s*S\s/.test(line) || angle < last - 180) scans.push({ ranges: [], angles: [] });
    last = angle;
    scans.at(-1)?.angles.push(-DEGREE * angle);
    scans.at(-1)?.ranges.push(Number(distance) > 0 ? 1e-3 * Number(distance) : null);
  }
  return scans.filter(({ ranges }) => ranges.length > 1);
}
