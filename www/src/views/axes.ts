/** Axes: round numbers at even distances, and where values lie between them. */
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

/** The range of all values, never empty. */
export function rangeOf(lists: readonly ArrayLike<number>[], stride = 1, offset = 0): Range {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const list of lists) {
    for (let i = offset; i < list.length; i += stride) {
      const value = list[i] as number;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(low <= high)) return { low: 0, high: 1 };
  return low === high ? { low: low - 0.5, high: high + 0.5 } : { low, high };
}

/** A little room above and below. */
export function padded({ low, high }: Range, share = 0.05): Range {
  const room = (high - low) * share;
  return { low: low - room, high: high + room };
}

/** Round numbers in the range, about so many: steps of 1, 2 or 5 times a power of ten. */
export function ticks({ low, high }: Range, about: number): number[] {
  const rough = (high - low) / Math.max(about, 1);
  const decade = 10 ** Math.floor(Math.log10(rough));
  const step = decade * ([1, 2, 5, 10].find((digit) => digit * decade >= rough * 0.999) ?? 10);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => (first + i) * step);
}

/** A number at an axis: no digit that tells nothing. */
export function tickWord(value: number): string {
  if (value === 0 || Math.abs(value) < 1e-12) return '0';
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(0) : String(Number(value.toPrecision(6)));
}

/** Grid lines, numbers and names of a plot's two axes. */
export function drawAxes(
  pen: Pen,
  area: Area,
  x: Range,
  y: Range,
  names: { x: string; y: string },
  colors: Colors,
  yWord: (value: number) => string = tickWord,
): void {
  const small = { color: colors.muted, size: 11 };
  for (const value of ticks(y, Math.max(area.height / 38, 3.5))) {
    const at = area.y + area.height * (1 - (value - y.low) / (y.high - y.low));
    pen.line([area.x, at, area.x + area.width, at], { color: colors.line, width: 1 });
    pen.text(area.x - 6, at, yWord(value), { ...small, align: 'end' });
  }
  for (const value of ticks(x, area.width / 80)) {
    const at = area.x + (area.width * (value - x.low)) / (x.high - x.low);
    pen.line([at, area.y, at, area.y + area.height], { color: colors.line, width: 1 });
    pen.text(at, area.y + area.height + 11, tickWord(value), { ...small, align: 'middle' });
  }
  pen.text(area.x + area.width, area.y + area.height + 26, names.x, { ...small, align: 'end' });
  pen.text(area.x - 44, area.y + area.height / 2, names.y, { ...small, align: 'middle', is_upright: true });
}
