/** Tables of two columns that are bearings and ranges, though nothing names them: bearings are evenly spaced, the x of points is not. */
import { DEGREE } from '../base/units.js';
import { areDegrees, evenShare, extent, median, stepsOf } from './angles.js';

/** Fewer readings are no scan. */
const MIN_READINGS = 24;
/** A step is even within this share of the median step. */
const EVEN = 0.2;
/** Smallest share of even steps: lasers leave readings out, and bearings jump where a turn begins anew. */
const MIN_EVEN = 0.9;
/** Smallest field of view of a laser (degrees). */
const MIN_VIEW = 45;
/** Largest field of view of a scan (degrees). */
const MAX_VIEW = 365;
/** Largest angle between two readings of a laser (degrees). */
const MAX_STEP = 5;

/**
 * The readings as a table that the engine reads; null where the columns are no bearings and ranges.
 * @param rows of two numbers each
 */
export function polarTable(rows: readonly (readonly number[])[]): Uint8Array | null {
  const found = [
    [0, 1],
    [1, 0],
  ].find(([angle = 0, range = 1]) => areReadings(column(rows, angle), column(rows, range)));
  if (!found) return null;
  const [angles = [], ranges = []] = found.map((index) => column(rows, index));
  const angle = areDegrees(angles) ? 'deg' : 'rad';
  const lines = withoutJump(angles).map((bearing, at) => `${bearing},${ranges[at]}\n`);
  return new TextEncoder().encode(
    `# table: range=2,angle=1:${angle}\nangle,range\n${lines.join('')}# direction: unknown\n`,
  );
}

function areReadings(angles: readonly number[], ranges: readonly number[]) {
  if (angles.length < MIN_READINGS || !angles.every(Number.isFinite) || ranges.some((range) => range < 0)) return false;
  const unit = areDegrees(angles) ? 1 : 1 / DEGREE;
  const steps = stepsOf(angles).map((step) => unit * step);
  const step = median(steps);
  const [least, most] = extent(angles);
  const view = unit * (most - least);
  const isView = view > MIN_VIEW && view < MAX_VIEW && step !== 0 && Math.abs(step) <= MAX_STEP;
  return isView && evenShare(steps, EVEN) >= MIN_EVEN;
}

/**
 * The bearings of a single turn that begins anywhere, going on beyond the end of the circle: a new scan begins where
 * they jump.
 */
function withoutJump(angles: readonly number[]) {
  const turn = areDegrees(angles) ? 360 : 2 * Math.PI;
  const step = median(stepsOf(angles));
  if (Math.abs(step) * angles.length > 1.01 * turn) return angles;
  const jump = angles.findIndex((angle, at) => at > 0 && Math.abs(angle - (angles[at - 1] ?? 0) - step) > turn / 2);
  return jump < 0 ? angles : angles.map((angle, at) => (at < jump ? angle : angle + Math.sign(step) * turn));
}

function column(rows: readonly (readonly number[])[], index: number) {
  return rows.map((row) => row[index] ?? Number.NaN);
}
