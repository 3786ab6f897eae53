/** Angles of readings: their unit, whether they are evenly spaced, and in which sense the laser turns. */
import { DEGREE } from '../base/units.js';

/** Angles beyond this are in degrees: no angle of a scan is larger in radians. */
export const MAX_RADIANS = 7;

/** @param angles in radians or degrees */
export function areDegrees(angles: readonly number[]) {
  return angles.some((angle) => Math.abs(angle) > MAX_RADIANS);
}

/**
 * @param angles in radians or degrees
 * @returns rad
 */
export function inRadians(angles: readonly number[]): number[] {
  return areDegrees(angles) ? angles.map((angle) => DEGREE * angle) : [...angles];
}

/** From each number to the next one. */
export function stepsOf(angles: readonly number[]) {
  return angles.slice(1).map((angle, at) => angle - (angles[at] ?? 0));
}

export function median(values: readonly number[]) {
  return values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
}

/** The share of the steps that differ from their median by at most this share of it. */
export function evenShare(steps: readonly number[], tolerance: number) {
  const step = median(steps);
  return steps.filter((value) => Math.abs(value - step) <= tolerance * Math.abs(step)).length / steps.length;
}

export function extent(values: readonly number[]): [least: number, most: number] {
  return values.reduce(
    ([least, most], value) => [Math.min(least, value), Math.max(most, value)],
    [Infinity, -Infinity],
  );
}

/**
 * Whether nothing tells which way the laser turns: angles from 0 to beyond half a turn are counted clockwise by some
 * lasers and
 * counter-clockwise by others.
 * @param angles rad
 */
export function mayBeMirrored(angles: readonly number[]) {
  return angles.every((angle) => !(angle < 0)) && angles.some((angle) => angle > Math.PI);
}
