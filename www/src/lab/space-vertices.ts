/** From clouds and pairs to the vertices that are drawn in space. */
import type { Rgb } from '../views/palette.js';
import { directionsOf, directionColor, isTurning } from './degeneracy.js';
import { REJECTION_COLORS, shades, shadesOf } from './pair-colors.js';
import type { PlaneScene } from './plane-painter.js';
import { NO_PARTNER } from './protocol.js';
import type { Vertices } from './space-scene.js';

export const TARGET_COLORS: Record<'light' | 'dark', readonly [low: Rgb, high: Rgb]> = {
  light: [
    [150, 160, 172],
    [40, 48, 58],
  ],
  dark: [
    [92, 104, 118],
    [222, 230, 240],
  ],
};
const SOURCE_COLOR: Record<'light' | 'dark', Rgb> = { light: [35, 86, 199], dark: [138, 176, 255] };

const themeOf = (dark: boolean): 'light' | 'dark' => (dark ? 'dark' : 'light');

/** Darker or lighter with the height along `up`, so that shapes are seen. */
export function targetVertices({ facts, dark }: PlaneScene, up: readonly number[]): Vertices {
  const positions = facts.target_points;
  const count = positions.length / 3;
  const height = (i: number): number =>
    (positions[3 * i] ?? 0) * (up[0] ?? 0) +
    (positions[3 * i + 1] ?? 0) * (up[1] ?? 0) +
    (positions[3 * i + 2] ?? 0) * (up[2] ?? 0);
  const heights = Float32Array.from({ length: count }, (_, i) => height(i));
  const sorted = heights.slice().sort();
  const [low, high] = [sorted[Math.floor(0.02 * count)] ?? 0, sorted[Math.floor(0.98 * count)] ?? 1];
  const [from, to] = TARGET_COLORS[themeOf(dark)];
  const colors = new Uint8Array(3 * count);
  heights.forEach((value, i) => {
    const share = Math.min(Math.max((value - low) / Math.max(high - low, 1e-6), 0), 1);
    for (const k of [0, 1, 2] as const) colors[3 * i + k] = from[k] + share * (to[k] - from[k]);
  });
  return { positions, colors, moves: new Uint8Array(count) };
}

/** Each point in the colour of its pair. */
export function sourceVertices({ facts, iteration, look, dark }: PlaneScene): Vertices {
  const positions = facts.source_points;
  const count = positions.length / 3;
  const colors = new Uint8Array(3 * count);
  const own = SOURCE_COLOR[themeOf(dark)];
  for (let i = 0; i < count; i++) paint(colors, i, own);
  if (iteration) {
    const ramp = shades(dark);
    const reasons = REJECTION_COLORS.map((_, reason) => rejectionColor(reason, dark));
    const shade = shadesOf(iteration, look.colorBy);
    iteration.source.forEach((point, i) => paint(colors, point, ramp[shade[i] ?? 0] ?? own));
    iteration.rejected_source.forEach((point, i) =>
      paint(colors, point, reasons[iteration.rejected_reason[i] ?? 0] ?? own),
    );
  }
  return { positions, colors, moves: new Uint8Array(count).fill(1) };
}

/** Called for every point and pair of each iteration: `set` with a list would take ten times as long. */
function paint(colors: Uint8Array, at: number, [red, green, blue]: Rgb): void {
  colors[3 * at] = red;
  colors[3 * at + 1] = green;
  colors[3 * at + 2] = blue;
}

const NOTHING: Vertices = { positions: new Float32Array(0), colors: new Uint8Array(0), moves: new Uint8Array(0) };

export function pairVertices({ facts, iteration, look, dark }: PlaneScene): Vertices {
  if (!iteration || !look.pairs) return NOTHING;
  const ramp = shades(dark);
  const shade = shadesOf(iteration, look.colorBy);
  return lines(
    facts.source_points,
    facts.target_points,
    iteration.source,
    iteration.target,
    (i) => ramp[shade[i] ?? 0] ?? [0, 0, 0],
  );
}

export function rejectedVertices({ facts, iteration, look, dark }: PlaneScene): Vertices {
  if (!iteration || !look.rejected) return NOTHING;
  const { rejected_source, rejected_target, rejected_reason } = iteration;
  const known = Array.from(rejected_target.keys()).filter((i) => rejected_target[i] !== NO_PARTNER);
  const pick = (values: Uint32Array): Uint32Array => Uint32Array.from(known, (i) => values[i] ?? 0);
  const reasons = REJECTION_COLORS.map((_, reason) => rejectionColor(reason, dark));
  return lines(
    facts.source_points,
    facts.target_points,
    pick(rejected_source),
    pick(rejected_target),
    (i) => reasons[rejected_reason[known[i] ?? 0] ?? 0] ?? [0, 0, 0],
  );
}

/** The directions of motion at the middle of the pairs, as lines; a turn by its axis. */
export function directionVertices({ iteration, dark, arrows }: PlaneScene): Vertices {
  const degeneracy = iteration?.degeneracy;
  if (!degeneracy || arrows.length === 0) return NOTHING;
  const ends: number[] = [];
  const colors: number[] = [];
  for (const direction of directionsOf(iteration)) {
    const along = isTurning(direction) ? direction.turn : direction.shift;
    const length = Math.hypot(...along) || 1;
    const reach = degeneracy.radius * (isTurning(direction) ? 0.35 : 0.7);
    for (const sign of [-1, 1])
      ends.push(...degeneracy.center.map((value, k) => value + (sign * reach * (along[k] ?? 0)) / length));
    const color = hexColor(directionColor(direction, dark));
    colors.push(...color, ...color);
  }
  return {
    positions: Float32Array.from(ends),
    colors: Uint8Array.from(colors),
    moves: new Uint8Array(colors.length / 3),
  };
}

function lines(
  from: Float32Array,
  to: Float32Array,
  sources: Uint32Array,
  targets: Uint32Array,
  color: (i: number) => Rgb,
): Vertices {
  const count = sources.length;
  const positions = new Float32Array(6 * count);
  const colors = new Uint8Array(6 * count);
  const moves = new Uint8Array(2 * count);
  for (let i = 0; i < count; i++) {
    const s = 3 * (sources[i] as number);
    const t = 3 * (targets[i] as number);
    for (let k = 0; k < 3; k++) {
      positions[6 * i + k] = from[s + k] as number;
      positions[6 * i + 3 + k] = to[t + k] as number;
    }
    const rgb = color(i);
    paint(colors, 2 * i, rgb);
    paint(colors, 2 * i + 1, rgb);
    moves[2 * i] = 1;
  }
  return { positions, colors, moves };
}

const rejectionColor = (reason: number, dark: boolean): Rgb =>
  hexColor(REJECTION_COLORS[reason]?.[themeOf(dark)] ?? '#888888');

function hexColor(hex: string): Rgb {
  const value = Number.parseInt(hex.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
