/** Small worlds of walls, and what a laser sees of them: the scans of the lab's scenes. Nothing is random but by its seed. */

/** X y of one end, x y of the other (m). */
export type Wall = [number, number, number, number];
/** M, m, rad. */
export type Sensor = { x: number; y: number; theta: number };

/** Numbers of a normal distribution, always the same ones for a seed. */
export function normalNumbers(seed: number) {
  const random = numbers(seed);
  return () => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}

/** Numbers in [0, 1), always the same ones for a seed. */
export function numbers(seed: number) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 16), 0x45d9f3b);
    mixed = Math.imul(mixed ^ (mixed >>> 16), 0x45d9f3b);
    return ((mixed ^ (mixed >>> 16)) >>> 0) / 2 ** 32;
  };
}

/** Walls from corner to corner. */
export function walls(corners: [number, number][]): Wall[] {
  return corners.slice(1).map(([x, y], i) => [...(corners[i] ?? [0, 0]), x, y]);
}

/** A circle of short walls. */
export function circle(radius: number, count: number): Wall[] {
  const corner = (i: number) => {
    const angle = (2 * Math.PI * i) / count;
    return [radius * Math.cos(angle), radius * Math.sin(angle)] as [number, number];
  };
  return walls(Array.from({ length: count + 1 }, (_, i) => corner(i)));
}

/**
 * Returns of a laser, x y 0 x y 0 ... in its own frame (m).
 * @param laser field of view (rad), noise of the ranges (m)
 */
export function scan(
  world: Wall[],
  sensor: Sensor,
  {
    beams = 360,
    field = 2 * Math.PI,
    max_range = 12,
    sigma = 0,
    seed = 1,
  }: { beams?: number; field?: number; max_range?: number; sigma?: number; seed?: number } = {},
) {
  const noise = normalNumbers(seed);
  const points: number[] = [];
  for (let beam = 0; beam < beams; beam++) {
    const angle = field * ((beam + 0.5) / beams - 0.5);
    const direction = [Math.cos(angle + sensor.theta), Math.sin(angle + sensor.theta)];
    const range = Math.min(...world.map((wall) => distance(wall, sensor, direction)));
    const error = sigma * noise();
    if (range <= max_range) points.push((range + error) * Math.cos(angle), (range + error) * Math.sin(angle), 0);
  }
  return Float32Array.from(points);
}

/** To a wall along a direction (m); infinite where it is not hit. */
function distance([x1, y1, x2, y2]: Wall, { x, y }: Sensor, [dx = 0, dy = 0]: number[]) {
  const [ex, ey, px, py] = [x2 - x1, y2 - y1, x1 - x, y1 - y];
  const cross = dx * ey - dy * ex;
  if (cross === 0) return Infinity;
  const [range, share] = [(px * ey - py * ex) / cross, (px * dy - py * dx) / cross];
  return range > 0 && share >= 0 && share <= 1 ? range : Infinity;
}

/** A planar pose as 4 x 4, row by row. */
export function poseIn({ x, y, theta }: Sensor) {
  const [c, s] = [Math.cos(theta), Math.sin(theta)];
  return [c, -s, 0, x, s, c, 0, y, 0, 0, 1, 0, 0, 0, 0, 1];
}
