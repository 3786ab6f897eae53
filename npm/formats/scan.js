// @ts-check
/** A laser scan as the readers here find it, and how it is made of named fields. */

/**
 * A scan: ranges (m; null where nothing came back), angles in rad.
 * @typedef {{ ranges: (number | null)[], start?: number, step?: number, end?: number, angles?: number[], time?: number,
 *   nearest?: number, farthest?: number, odometry?: number[], mayBeMirrored?: boolean }} Scan
 *   end: the angle of the last reading, where it is told; odometry: x, y (m) and heading (rad) by the wheels;
 *   mayBeMirrored: whether nothing tells which way the laser turns
 */

/** Scans whose readings come one by one. */
export class ReadingScans {
  /** @type {(Scan & { angles: number[] })[]} */
  all = [];

  /** The readings to come belong to a new scan. @param {Partial<Scan>} [fields] of that scan */
  begin(fields = {}) {
    this.all.push({ ...fields, ranges: [], angles: [] });
  }

  /** A reading of the last scan, if one has begun. @param {number} angle rad @param {number} range m; not positive: no return */
  add(angle, range) {
    const scan = this.all.at(-1);
    scan?.angles.push(angle);
    scan?.ranges.push(range > 0 ? range : null);
  }

  /** Those with two readings and more. */
  whole() {
    return this.all.filter(({ ranges }) => ranges.length > 1);
  }
}

/** A field that is there only where it has a value. @param {string} name @param {number | undefined} value */
export function given(name, value) {
  return value === undefined ? {} : { [name]: value };
}

/** A scan of a message's fields, by the names that ROS and Gazebo give them, and its ranges. @param {(key: string) => unknown} field @param {readonly unknown[]} ranges @returns {Scan} */
export function scanOf(field, ranges) {
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

/** The number that a field holds, as a number or as text; NaN where it is none. @param {unknown} value */
export function numberOf(value) {
  if (typeof value === 'number') return value;
  return typeof value === 'string' && value.trim() !== '' ? Number(value) : Number.NaN;
}
