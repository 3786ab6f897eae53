/** The map before it is there, and how a plan lies on the screen. How high and how level the map is, the package tells. */
import type { MapPoints } from '../engine/spatial-protocol.js';
import { coordinates } from '../../../package/mesh/leveling.js';
import type { Vec3 } from '../views/vectors.js';

export {
  type Heights,
  heightsOf,
  layOf,
  leveling,
  NORMAL_UNIT,
  NUM_SAMPLES,
  sample,
} from '../../../package/mesh/leveling.js';

export const NO_POINTS: MapPoints = {
  positions: new Float32Array(),
  colors: new Uint8Array(),
  normals: new Int16Array(),
  frames: new Uint32Array(),
};

/** The turn about the vertical (rad) at which the plan fills the smallest rectangle, its long side across the screen. */
export function straightAzimuth(sampled: readonly Vec3[], isWide: boolean): number {
  const STEPS = 60;
  const [xs, zs] = [coordinates(sampled, 0), coordinates(sampled, 2)];
  const along = new Float64Array(sampled.length);
  const spreadAlong = (a: number, b: number): number => {
    for (let i = 0; i < along.length; i++) along[i] = a * (xs[i] ?? 0) + b * (zs[i] ?? 0);
    return spread(along);
  };
  let best = { area: Number.POSITIVE_INFINITY, azimuth: 0, isWide: true };
  for (let step = 0; step < STEPS; step++) {
    const azimuth = ((step / STEPS) * Math.PI) / 2;
    const [cos, sin] = [Math.cos(azimuth), Math.sin(azimuth)];
    const width = spreadAlong(cos, -sin);
    const depth = spreadAlong(sin, cos);
    if (width * depth < best.area * 0.995) best = { area: width * depth, azimuth, isWide: width >= depth };
  }
  return best.isWide === isWide ? best.azimuth : best.azimuth - Math.PI / 2;
}

/** Extent of all but the outermost hundredth on either side. */
export function spread(values: ArrayLike<number>): number {
  if (values.length === 0) return 0;
  // The outermost ones in order, the innermost of them last: few values come in between, and the others need no order.
  const count = Math.floor(values.length / 100) + 1;
  const highest = new Float64Array(count).fill(Number.NEGATIVE_INFINITY);
  const lowest = new Float64Array(count).fill(Number.NEGATIVE_INFINITY);
  for (let i = 0; i < values.length; i++) {
    const value = values[i] ?? 0;
    takeIn(highest, value);
    takeIn(lowest, -value);
  }
  return (highest[count - 1] ?? 0) + (lowest[count - 1] ?? 0);
}

/** Puts a value among the highest, which are in falling order. */
function takeIn(highest: Float64Array, value: number): void {
  let place = highest.length - 1;
  if (value <= (highest[place] ?? 0)) return;
  for (; place > 0 && value > (highest[place - 1] ?? 0); place--) highest[place] = highest[place - 1] ?? 0;
  highest[place] = value;
}
