/**
 * Laser scans of ROS as a text log: a JSON object a line, as CSM (A. Censi, "An ICP variant using a point-to-line
 * metric", ICRA 2008) writes them.
 */
import { DEGREE } from '../base/units.js';
import { MOST_ANGLE } from '../files/laser_logs.js';
import { MessageError } from './cdr.js';
import type { ScanMessage } from './messages.js';
import { plural } from './stamps.js';

/**
 * One line of the log. A reading is null where the message's own rules call it invalid: not a number, infinite, nearer
 * than `range_min` or farther than `range_max` (sensor_msgs/LaserScan, REP 117).
 * Drivers that leave `range_max` or `angle_increment` unset send 0; angles in degrees are left to the engine, which tells of them.
 * @param isUpsideDown whether the laser's z axis points down: in the robot's plane its readings turn the other way
 */
export function scanLine(scan: ScanMessage, isUpsideDown = false) {
  const { angleMin, angleMax, rangeMin, ranges, stamp } = scan;
  const rangeMax = scan.rangeMax > 0 ? scan.rangeMax : Infinity;
  const nrays = ranges.length;
  if (nrays < 2) throw new MessageError(`The scan has ${nrays} readings`, 'Leave it out');
  const angleIncrement = scan.angleIncrement === 0 ? (angleMax - angleMin) / (nrays - 1) : scan.angleIncrement;
  const last = angleMin + (nrays - 1) * angleIncrement;
  if (!Number.isFinite(last) || angleIncrement === 0) {
    throw new MessageError(`The scan's readings lie ${angleIncrement} rad apart, from ${angleMin} rad on`);
  }
  if (DEGREE * Math.abs(last - angleMin) > MOST_ANGLE) {
    const degrees = Math.round(Math.abs(last - angleMin) / DEGREE);
    throw new MessageError(`The scan's readings cover ${degrees} degrees: its angles are not in radians`);
  }
  if (!(rangeMax > rangeMin)) {
    throw new MessageError(
      `No reading can lie between the scan's range_min, ${rangeMin}, and its range_max, ${rangeMax}`,
    );
  }
  const isValid = (range: number) => range >= rangeMin && range <= rangeMax && Number.isFinite(range);
  // The shortest decimal that is the same 32-bit number: half the text.
  const readings = Array.from(ranges, (range) => (isValid(range) ? shortest(range) : null));
  const sign = isUpsideDown ? -1 : 1;
  const isClockwise = sign * angleIncrement < 0;
  if (isClockwise) readings.reverse();
  const [min_theta, max_theta] = isClockwise ? [sign * last, sign * angleMin] : [sign * angleMin, sign * last];
  return JSON.stringify({
    nrays,
    min_theta,
    max_theta,
    readings,
    timestamp: [stamp.sec, Math.floor(stamp.nsec / 1000)],
    odometry: null,
    estimate: null,
    true_pose: null,
  });
}

function shortest(value: number) {
  for (let digits = 4; digits < 9; digits += 1) {
    const rounded = Number(value.toPrecision(digits));
    if (Math.fround(rounded) === value) return rounded;
  }
  return value;
}

/** A scan of a log, and the frame that its message names. */
export type FramedLine = { frame: string; line: string };

/** The scans of the first one's frame, where those of others come in between; all of them where a frame was only renamed. */
export function ofOneLaser(scans: readonly FramedLine[]) {
  const first = scans[0]?.frame;
  const other = scans.findIndex(({ frame }) => frame !== first);
  const areInTurn = other >= 0 && scans.slice(other).some(({ frame }) => frame === first);
  const lines = scans.filter(({ frame }) => !areInTurn || frame === first).map(({ line }) => line);
  const others = plural(scans.length - lines.length, 'scan');
  const loss = `${others} of other frames than ${first} left out: one laser is used; record each on a topic of its own`;
  return { lines, loss: lines.length < scans.length ? loss : null };
}
