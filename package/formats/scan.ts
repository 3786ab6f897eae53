/** A laser scan as the readers here find it, and how it is made of named fields. */
import { DEGREE } from '../base/units.js';

/**
 * A scan: ranges (m; null where nothing came back), angles in rad.
 * end: the angle of the last reading, where it is told; odometry: x, y (m) and heading (rad) by the wheels;
 * mayBeMirrored: whether nothing tells which way the laser turns
 */
export type Scan = {
  ranges: (number | null)[];
  start?: number;
  step?: number;
  end?: number;
  angles?: number[];
  time?: number;
  nearest?: number;
  farthest?: number;
  odometry?: number[];
  mayBeMirrored?: boolean;
};

/** Scans whose readings come one by one. */
export class ReadingScans {
  all: (Scan & { angles: number[] })[] = [];

  /**
   * The readings to come belong to a new scan.
   * @param fields of that scan
   */
  begin(fields: Partial<Scan> = {}) {
    this.all.push({ ...fields, ranges: [], angles: [] });
  }

  /**
   * A reading of the last scan, if one has begun.
   * @param angle rad
   * @param range m; not positive: no return
   */
  add(angle: number, range: number) {
    const scan = this.all.at(-1);
    scan?.angles.push(angle);
    scan?.ranges.push(range > 0 ? range : null);
  }

  /** Those with two readings and more. */
  whole() {
    return this.all.filter(({ ranges }) => ranges.length > 1);
  }
}

/** A field that is there only where it has a value. */
export function given(name: string, value: number | undefined) {
  return value === undefined ? {} : { [name]: value };
}

/** A scan of a message's fields, by the names that ROS and Gazebo give them, and its ranges. */
export function scanOf(field: (key: string) => unknown, ranges: readonly unknown[]): Scan {
  const number = (...keys: string[]) => {
    const value = keys.map(field).find((value) => value !== undefined && value !== null);
    const known = numberOf(value);
    return Number.isFinite(known) ? known : undefined;
  };
  const seconds = number('secs', 'sec');
  const nanoseconds = number('nsecs', 'nanosec', 'nsec') ?? 0;
  // Radians, or degrees where the name says so.
  const angle = (...keys: string[]) => {
    const degrees = number(...keys.flatMap((key) => [`${key}_deg`, `${key}_degrees`]));
    return degrees === undefined ? number(...keys.flatMap((key) => [key, `${key}_rad`])) : DEGREE * degrees;
  };
  const start = angle('angle_min', 'angleMin', 'min_angle', 'angle_start', 'start_angle');
  const end = angle('angle_max', 'angleMax', 'max_angle', 'angle_end', 'end_angle');
  const even = start === undefined || end === undefined ? undefined : (end - start) / Math.max(ranges.length - 1, 1);
  const step = angle('angle_increment', 'angle_step', 'angleIncrement') || even;
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

/** The number that a field holds, as a number or as text; NaN where it is none. */
export function numberOf(value: unknown) {
  if (typeof value === 'number') return value;
  return typeof value === 'string' && value.trim() !== '' ? Number(value) : Number.NaN;
}
