/** Colours of pairs: by residual, by weight, or by what they say of the direction that is determined least. */
import { cssColor, type Rgb } from '../views/palette.js';
import type { LabIteration } from './protocol.js';

export type PairColor = 'residual' | 'weight' | 'contribution';

export const PAIR_COLORS: readonly { value: PairColor; label: string; ends: readonly [string, string] }[] = [
  { value: 'residual', label: 'Residual', ends: ['≤ 1 mm', '≥ 1 m'] },
  { value: 'weight', label: 'Weight', ends: ['0', '1'] },
  { value: 'contribution', label: 'Weakest direction', ends: ['none', 'most'] },
];

/** From small to large; blue to orange can be distinguished with every colour vision. */
const ON_LIGHT: readonly Rgb[] = [
  [35, 110, 180],
  [120, 106, 176],
  [219, 118, 12],
  [190, 20, 20],
];
const ON_DARK: readonly Rgb[] = [
  [98, 178, 255],
  [176, 158, 236],
  [255, 176, 64],
  [255, 92, 78],
];

/** Number of distinct shades. */
export const NUM_SHADES = 16;
/** Residuals at the ends of the scale, which is logarithmic (m): it stays the same, so that convergence is seen. */
const LEAST_RESIDUAL = 1e-3;
const LARGEST_RESIDUAL = 1;

export function shades(dark: boolean): Rgb[] {
  const stops = dark ? ON_DARK : ON_LIGHT;
  return Array.from({ length: NUM_SHADES }, (_, i) => {
    const place = (i / (NUM_SHADES - 1)) * (stops.length - 1);
    const before = Math.min(Math.floor(place), stops.length - 2);
    const [from, to] = [stops[before] ?? [0, 0, 0], stops[before + 1] ?? [0, 0, 0]];
    const mix = (k: 0 | 1 | 2): number => Math.round(from[k] + (to[k] - from[k]) * (place - before));
    return [mix(0), mix(1), mix(2)];
  });
}

/** For a legend. */
export const gradient = (dark: boolean): string =>
  shades(dark)
    .map((shade) => cssColor(shade))
    .join(', ');

/** The shade of each pair. */
export function shadesOf(iteration: LabIteration, by: PairColor): Uint8Array {
  const { residual, weight, contribution } = iteration;
  const largest = contribution.reduce((a, b) => Math.max(a, b), 0) || 1;
  const result = new Uint8Array(residual.length);
  const decades = Math.log(LARGEST_RESIDUAL / LEAST_RESIDUAL);
  for (let i = 0; i < residual.length; i++) {
    const share =
      by === 'residual'
        ? Math.log(Math.max(Math.abs(residual[i] ?? 0), LEAST_RESIDUAL) / LEAST_RESIDUAL) / decades
        : by === 'weight'
          ? (weight[i] ?? 0)
          : Math.sqrt(Math.max(contribution[i] ?? 0, 0) / largest);
    result[i] = Math.round(Math.min(Math.max(share, 0), 1) * (NUM_SHADES - 1));
  }
  return result;
}

/** Of points that are rejected, by the reason: with a sign of their own, so that no colour is needed. */
export const REJECTION_COLORS: readonly { light: string; dark: string }[] = [
  { light: '#2356c7', dark: '#8ab0ff' },
  { light: '#c4126a', dark: '#ff6fb1' },
  { light: '#7a5a00', dark: '#e6c65c' },
  { light: '#3f4a57', dark: '#c0c8d2' },
];
