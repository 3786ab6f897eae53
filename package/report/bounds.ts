/** How far something may be off, by its standard deviations. */

/** 95 % of a normal distribution lie within so many standard deviations. */
export const BOUND_95 = 1.96;

/** How far a position may be off along the least certain axis of the world (m, 95 %). */
export function positionBound({ x, y, z }: { x: number; y: number; z: number }): number {
  return BOUND_95 * Math.max(x, y, z);
}
