// @ts-check
/** Angles of readings: their unit, whether they are evenly spaced, and in which sense the laser turns. */

/** One degree (rad). */
export const DEGREE = Math.PI / 180;
/** Angles beyond this are in degrees: no angle of a scan is larger in radians. */
export const MAX_RADIANS = 7;

/** @param {readonly number[]} angles in radians or degrees */
export function areDegrees(angles) {
  return angles.some((angle) => Math.abs(angle) > MAX_RADIANS);
}

/** @param {readonly number[]} angles in radians or degrees @returns {number[]} rad */
export function inRadians(angles) {
  return areDegrees(angles) ? angles.map((angle) => DEGREE * angle) : [...angles];
}

/** From each number to the next one. @param {readonly number[]} angles */
export function stepsOf(angles) {
  return angles.slice(1).map((angle, at) => angle - (angles[at] ?? 0));
}

/** @param {readonly number[]} values */
export function median(values) {
  return values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
}

/**
 * The share of the steps that differ from their median by at most this share of it.
 * @param {readonly number[]} steps @param {number} tolerance
 */
export function evenShare(steps, tolerance) {
  const step = median(steps);
  return steps.filter((value) => Math.abs(value - step) <= tolerance * Math.abs(step)).length / steps.length;
}

/** @param {readonly number[]} values @returns {[least: number, most: number]} */
export function extent(values) {
  return values.reduce(
    ([least, most], value) => [Math.min(least, value), Math.max(most, value)],
    [Infinity, -Infinity],
  );
}

/**
 * Whether nothing tells which way the laser turns: angles from 0 to beyond half a turn are counted clockwise by some lasers and
 * counter-clockwise by others.
 * @param {readonly number[]} angles rad
 */
export function mayBeMirrored(angles) {
  return angles.every((angle) => !(angle < 0)) && angles.some((angle) => angle > Math.PI);
}
