// @ts-check
/** A drive through a room with a niche, for layouts of other programs: what a laser that turns all round sees at each place. */
import { ROOM } from './support.mjs';

export const DEGREE = Math.PI / 180;

/** Where it is at each scan: x, y (m), heading (rad). @type {readonly [number, number, number][]} */
export const PLACES = Array.from({ length: 8 }, (_, i) => [0.12 * i, 0.06 * i, 0.04 * i]);

/**
 * Ranges (m) along these bearings (rad, counter-clockwise from ahead).
 * @param {readonly [number, number, number]} place
 * @param {readonly number[]} bearings
 */
export function rangesAt([x, y, heading], bearings) {
  return bearings.map((bearing) => {
    const [dx, dy] = [Math.cos(bearing + heading), Math.sin(bearing + heading)];
    return Math.min(
      ...ROOM.map(([x0, y0, x1, y1]) => {
        const [ex, ey] = [x1 - x0, y1 - y0];
        const cross = dx * ey - dy * ex;
        const range = ((x0 - x) * ey - (y0 - y) * ex) / cross;
        const along = ((x0 - x) * dy - (y0 - y) * dx) / cross;
        return range > 0 && along >= 0 && along <= 1 ? range : Number.POSITIVE_INFINITY;
      }),
    );
  });
}

/** Evenly spaced bearings (rad). @param {number} count @param {number} first degrees @param {number} step degrees */
export function bearings(count, first, step) {
  return Array.from({ length: count }, (_, i) => DEGREE * (first + step * i));
}

/** The last place, seen from the first: it is the world's origin. */
export const LAST = /** @type {const} */ ([0.84, 0.42, 0.28]);
