/** Axes of figures. */
import { scaleLinear, scaleLog } from 'd3-scale';
import type { Pen } from './pen.js';

export interface Colors {
  text: string;
  muted: string;
  line: string;
  background: string;
  reference: string;
  selected: string;
  /** One for each estimate, in turn. */
  estimates: readonly string[];
  /** From the smallest error to the largest. */
  ramp: readonly string[];
}

export interface Area {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Range {
  low: number;
  high: number;
}

/** The range of all values; null where there are none. */
export function extentOf(lists: readonly ArrayLike<number>[], stride = 1, offset = 0): Range | null {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const list of lists) {
    for (let i = offset; i < list.length; i += stride) {
      const value = list[i] as number;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? { low, high } : null;
}

/** The range of all values, never empty. */
export function rangeOf(lists: readonly ArrayLike<number>[], stride = 1, offset = 0): Range {
  const { low, high } = extentOf(lists, stride, offset) ?? { low: 0, high: 1 };
  return low === high ? { low: low - 0.5, high: high + 0.5 } : { low, high };
}

/** A little room above and below. */
export function padded({ low, high }: Range, share = 0.05): Range {
  const room = (high - low) * share;
  return { low: low - room, high: high + room };
}

/** One axis of a plot. */
export interface Axis {
  /** Where a value lies: 0 at the axis's beginning, 1 at its end. */
  share(value: number): number;
  /** About `about` round values. A label is empty where there is no room for it. */
  ticks(about: number): { value: number; label: string }[];
}

/** The format of an axis that counts: there are no ticks between whole numbers. */
export const WHOLE = 'd';

/** `format`: as d3-format has it; without, as many decimals as the ticks need. */
export function linearAxis({ low, high }: Range, format?: string): Axis {
  const scale = scaleLinear([low, high], [0, 1]);
  return {
    share: (value) => scale(value),
    ticks(about) {
      const word = scale.tickFormat(about, format ?? plainFormat(low, high));
      const values = format === WHOLE ? scale.ticks(about).filter(Number.isInteger) : scale.ticks(about);
      return values.map((value) => ({ value, label: word(value) }));
    },
  };
}

/** Values at or below zero have no place on it: they are drawn at its beginning. */
export function logAxis({ low, high }: Range, format = '~r'): Axis {
  const scale = scaleLog([low, high], [0, 1]).nice().clamp(true);
  return {
    share: (value) => (value > 0 ? scale(value) : 0),
    ticks(about) {
      const word = scale.tickFormat(about, format);
      return scale.ticks(about).map((value) => ({ value, label: word(value) }));
    },
  };
}

/** Very small and very large values in scientific notation. */
function plainFormat(low: number, high: number): string | undefined {
  const size = Math.max(Math.abs(low), Math.abs(high));
  return size >= 1e6 || high - low < 1e-3 ? '~e' : undefined;
}

/** A number in the text of a figure, with `digits` digits. */
export function shortNumber(value: number, digits: number): string {
  return String(Number(value.toPrecision(digits)));
}

/** Grid lines, numbers and names of a plot's two axes. */
export function drawAxes(
  pen: Pen,
  area: Area,
  x: Axis,
  y: Axis,
  names: { x: string; y: string },
  colors: Colors,
): void {
  const small = { color: colors.muted, size: 11 };
  for (const { value, label } of y.ticks(Math.max(area.height / 38, 3.5))) {
    const at = area.y + area.height * (1 - y.share(value));
    pen.line([area.x, at, area.x + area.width, at], { color: colors.line, width: 1 });
    pen.text(area.x - 6, at, label, { ...small, align: 'end' });
  }
  for (const { value, label } of x.ticks(area.width / 80)) {
    const at = area.x + area.width * x.share(value);
    pen.line([at, area.y, at, area.y + area.height], { color: colors.line, width: 1 });
    pen.text(at, area.y + area.height + 11, label, { ...small, align: 'middle' });
  }
  pen.text(area.x + area.width, area.y + area.height + 26, names.x, { ...small, align: 'end' });
  pen.text(area.x - 44, area.y + area.height / 2, names.y, { ...small, align: 'middle', isUpright: true });
}
