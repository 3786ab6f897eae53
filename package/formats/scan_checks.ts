/** Scans that programs print, against what a laser can be: their units, and limits and angles that contradict each other. */
import { fileError } from '../base/errors.js';
import { MOST_ANGLE } from '../files/laser_logs.js';
import { DEGREE } from '../base/units.js';
import { given, type Scan } from './scan.js';

/** completes "FILE: ..."; isLoss: something could not be used */
export type Tell = (reason: string, isLoss?: boolean) => void;

/** Smallest share of the ranges of a file in metres that is below `MAX_COMMON_RANGE`: the rest may stand for no return. */
const LEAST_SHARE = 0.05;
/** Ranges in metres: at least LEAST_SHARE of them are below this (m). */
const MAX_COMMON_RANGE = 60;
/** Largest value that stands for no return in metres: the range limit of the laser (m). Outdoors nearly all ranges may have it. */
const MOST_NO_RETURN = 200;
/** A stated limit beyond this is in millimetres. */
const MOST_LIMIT = 500;
/** The last angle may be off by so many steps, or by this share of the whole: some count the last reading, some do not. */
const MOST_STEPS_OFF = 2;
const MOST_SHARE_OFF = 0.1;

/**
 * The scans with ranges in metres, angles in radians, and no limits that no reading can meet; without those that are cut off.
 */
export function checkedScans(scans: readonly Scan[], name: string, tell: Tell): Scan[] {
  const inMetres = withMetres(scans, tell);
  const isLimited = inMetres.every(({ nearest = 0, farthest = Infinity }) => nearest < farthest);
  if (!isLimited) tell('range_max is not above range_min, and both are left out of account');
  const inLimits = isLimited ? inMetres : inMetres.map(({ nearest, farthest, ...scan }) => scan);
  return withoutDamaged(withRadians(inLimits, name, tell), tell);
}

function withMetres(scans: readonly Scan[], tell: Tell): readonly Scan[] {
  const positive = scans.flatMap(({ ranges }) => ranges.flatMap((range) => (range !== null && range > 0 ? range : [])));
  const sorted = Float64Array.from(positive).sort();
  const least = sorted[Math.floor(LEAST_SHARE * sorted.length)] ?? 0;
  const median = sorted[sorted.length >> 1] ?? 0;
  if (least <= MAX_COMMON_RANGE || median <= MOST_NO_RETURN) return scans;
  tell(`its ranges (median ${median.toPrecision(4)}) cannot be metres and are read as millimetres`);
  return scans.map(({ nearest, farthest, ...scan }) => {
    const unit = farthest !== undefined && farthest > MOST_LIMIT ? 1e-3 : 1;
    return {
      ...scan,
      ranges: scan.ranges.map((range) => (range === null ? null : 1e-3 * range)),
      ...given('nearest', nearest === undefined ? undefined : unit * nearest),
      ...given('farthest', farthest === undefined ? undefined : unit * farthest),
    };
  });
}

/** Between the first reading and the last (rad). */
function coverage({ ranges, step = 0 }: Scan) {
  return Math.abs(step) * (ranges.length - 1);
}

function withRadians(scans: readonly Scan[], name: string, tell: Tell): readonly Scan[] {
  const covered = scans.reduce((most, scan) => Math.max(most, coverage(scan)), 0);
  if (covered <= MOST_ANGLE) return scans;
  // What contradicts the step in degrees as well is of no unit.
  if (DEGREE * covered > MOST_ANGLE || scans.some(isContradictory)) {
    const problem = `The readings of a scan cover ${Math.round(covered / DEGREE)} degrees`;
    throw fileError(name, problem, 'angle_increment is the angle from a reading to the next one, in radians');
  }
  tell(`readings over an angle of ${covered.toFixed(0)} cannot be in radians: its angles are read as degrees`);
  return scans.map(({ start, step, end, ...scan }) => ({
    ...scan,
    ...Object.assign(
      {},
      ...Object.entries({ start, step, end }).map(([key, angle]) => given(key, angle && DEGREE * angle)),
    ),
  }));
}

/** Where most scans have as many readings as their angles say, those that have not are damaged. */
function withoutDamaged(scans: readonly Scan[], tell: Tell): Scan[] {
  const good = scans.filter((scan) => !isContradictory(scan));
  const numBad = scans.length - good.length;
  if (numBad === 0) return [...scans];
  if (good.length > numBad) {
    tell(
      `${numBad} of ${scans.length} scans have fewer or more readings than their angles say, and are left out`,
      true,
    );
    return good;
  }
  const [scan] = scans as [Scan];
  const degrees = (angle: number) => (angle / DEGREE).toFixed(0);
  const stated = degrees(Math.abs((scan.end ?? 0) - (scan.start ?? 0)));
  const reason = `angle_max says that the readings cover ${stated} degrees, angle_increment ${degrees(coverage(scan))}`;
  tell(`${reason}: angle_increment is used, and the map is distorted where it is wrong`, true);
  return [...scans];
}

function isContradictory(scan: Scan) {
  const { start, step, end, ranges } = scan;
  if (start === undefined || step === undefined || end === undefined) return false;
  const off = Math.abs(start + step * (ranges.length - 1) - end);
  return off > Math.max(MOST_STEPS_OFF * Math.abs(step), MOST_SHARE_OFF * coverage(scan));
}
