// @ts-check
/** Tables of two columns that are bearings and ranges, though nothing names them: bearings are evenly spaced, the x of points is not. */

const DEGREE = Math.PI / 180;
/** Fewer readings are no scan. */
const MIN_READINGS = 24;
/** A step is even within so much of the median step. */
const EVEN = 0.2;
/** So many of the steps are even: lasers leave readings out, and the count of a turn begins anew. */
const MIN_EVEN = 0.9;
/** Narrower views (degrees) are those of no laser. */
const MIN_VIEW = 45;
/** Wider ones, too. */
const MAX_VIEW = 365;
/** Wider steps (degrees), too. */
const MAX_STEP = 5;
/** Beyond this (rad) bearings are in degrees. */
const MAX_RADIANS = 7;

/**
 * The readings as a table that the engine reads; null where the columns are no bearings and ranges.
 * @param {readonly (readonly number[])[]} rows of two numbers each
 * @returns {Uint8Array | null}
 */
export function polarTable(rows) {
  const found = [
    [0, 1],
    [1, 0],
  ].find(([angle = 0, range = 1]) => areReadings(column(rows, angle), column(rows, range)));
  if (!found) return null;
  const [angles = [], ranges = []] = found.map((index) => column(rows, index));
  const angle = inDegrees(angles) ? 'deg' : 'rad';
  const lines = withoutJump(angles).map((bearing, at) => `${bearing},${ranges[at]}\n`);
  return new TextEncoder().encode(
    `# table: range=2,angle=1:${angle}\nangle,range\n${lines.join('')}# direction: unknown\n`,
  );
}

/** @param {readonly number[]} angles @param {readonly number[]} ranges */
function areReadings(angles, ranges) {
  if (angles.length < MIN_READINGS || !angles.every(Number.isFinite) || ranges.some((range) => range < 0)) return false;
  const unit = inDegrees(angles) ? 1 : 1 / DEGREE;
  const steps = angles.slice(1).map((angle, at) => unit * (angle - (angles[at] ?? 0)));
  const step = median(steps);
  const numEven = steps.filter((value) => Math.abs(value - step) < EVEN * Math.abs(step)).length;
  const [least, most] = angles.reduce(
    ([least, most], angle) => [Math.min(least, angle), Math.max(most, angle)],
    [Infinity, -Infinity],
  );
  const view = unit * (most - least);
  const isView = view > MIN_VIEW && view < MAX_VIEW && step !== 0 && Math.abs(step) <= MAX_STEP;
  return isView && numEven >= MIN_EVEN * steps.length;
}

/**
 * The bearings of a single turn that begins anywhere, going on beyond the end of the circle: a new scan begins where they jump.
 * @param {readonly number[]} angles
 */
function withoutJump(angles) {
  const turn = inDegrees(angles) ? 360 : 2 * Math.PI;
  const step = median(angles.slice(1).map((angle, at) => angle - (angles[at] ?? 0)));
  if (Math.abs(step) * angles.length > 1.01 * turn) return angles;
  const jump = angles.findIndex((angle, at) => at > 0 && Math.abs(angle - (angles[at - 1] ?? 0) - step) > turn / 2);
  return jump < 0 ? angles : angles.map((angle, at) => (at < jump ? angle : angle + Math.sign(step) * turn));
}

/** @param {readonly number[]} angles */
function inDegrees(angles) {
  return angles.some((angle) => Math.abs(angle) > MAX_RADIANS);
}

/** @param {readonly (readonly number[])[]} rows @param {number} index */
function column(rows, index) {
  return rows.map((row) => row[index] ?? Number.NaN);
}

/** @param {readonly number[]} values */
function median(values) {
  return values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
}
