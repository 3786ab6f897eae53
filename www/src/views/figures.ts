/** Plots of an evaluation. Plain numbers in, strokes out; the same for the screen, for PNG and for SVG. */
import {
  type Area,
  type Colors,
  type Axis,
  drawAxes,
  extentOf,
  linearAxis,
  logAxis,
  padded,
  rangeOf,
  shortNumber,
} from './axes.js';
import type { Pen } from './pen.js';
import type { Size } from './viewport.js';

export type { Size };

/** A line of values over time, distance or number. */
export interface Series {
  x: ArrayLike<number>;
  values: ArrayLike<number>;
  /** Values stand this far apart, from `offset` on: x y z x y z ... */
  stride: number;
  offset: number;
  color: string;
  width: number;
  isDashed: boolean;
}

const LEFT = 58;
const RIGHT = 14;
const TOP = 12;
const BOTTOM = 36;

export function plotArea({ width, height }: Size): Area {
  return { x: LEFT, y: TOP, width: Math.max(width - LEFT - RIGHT, 10), height: Math.max(height - TOP - BOTTOM, 10) };
}

/** How the values of lines stand on their axis. */
export type ValueScale =
  /** All of them, with a little room around. */
  | 'fitted'
  /** From zero on. */
  | 'from_zero'
  | 'log'
  /** As `log`, however small the values are. */
  | 'log_fitted';

/** Lines over a common axis. `format`: of the values at their axis, as d3-format has it. */
export function drawSeries(
  pen: Pen,
  size: Size,
  series: readonly Series[],
  x: Axis,
  names: { x: string; y: string },
  colors: Colors,
  valueScale: ValueScale,
  format?: string,
): void {
  const ends = series.flatMap(({ values, stride, offset }) => {
    const extent = extentOf([values], stride, offset);
    return extent ? [extent.low, extent.high] : [];
  });
  const y = valueAxis(ends, valueScale, format);
  const area = plotArea(size);
  drawAxes(pen, area, x, y, names, colors);
  pen.inside(area.x, area.y, area.width, area.height, () => {
    for (const one of series) {
      const points = columns(one, area, x, y);
      const dash = one.isDashed ? { dash: [5, 4] } : {};
      pen.line(points, { color: one.color, width: one.width, ...dash });
    }
  });
}

/** The smallest value that an axis of scale `log` begins with, and that of one without values. */
const LEAST_ON_LOG_AXIS = 1e-3;

/** `ends`: the smallest and largest values of all lines. */
function valueAxis(ends: readonly number[], valueScale: ValueScale, format: string | undefined): Axis {
  if (valueScale === 'log_fitted') {
    const { low, high } = extentOf([ends]) ?? { low: LEAST_ON_LOG_AXIS, high: 1 };
    return logAxis({ low, high: Math.max(high, low * 1.5) }, format);
  }
  const all = rangeOf([ends]);
  if (valueScale === 'log') {
    const low = Math.max(all.low, LEAST_ON_LOG_AXIS);
    return logAxis({ low, high: Math.max(all.high, low * 10) }, format);
  }
  const range = valueScale === 'from_zero' ? { low: 0, high: Math.max(all.high, 1e-12) * 1.05 } : padded(all);
  return linearAxis(range, format);
}

/** Points of a line; of many that fall on one column of the screen, the first, lowest, highest and last. */
function columns({ x: xs, values, stride, offset }: Series, area: Area, x: Axis, y: Axis): number[] {
  const points: number[] = [];
  const count = Math.min(xs.length, Math.floor((values.length - offset + stride - 1) / stride));
  const atX = (i: number) => area.x + area.width * x.share(xs[i] as number);
  const value = (i: number) => values[i * stride + offset] as number;
  const push = (i: number) => {
    points.push(atX(i), area.y + area.height * (1 - y.share(value(i))));
  };
  if (count <= 3 * area.width) {
    for (let i = 0; i < count; i++) push(i);
    return points;
  }
  for (let start = 0; start < count;) {
    const column = Math.floor(atX(start));
    let [low, high, end] = [start, start, start];
    for (; end < count && Math.floor(atX(end)) === column; end++) {
      if (value(end) < value(low)) low = end;
      if (value(end) > value(high)) high = end;
    }
    for (const i of [...new Set([start, Math.min(low, high), Math.max(low, high), end - 1])]) push(i);
    start = end;
  }
  return points;
}

/** How often which error occurs. */
export function drawHistogram(
  pen: Pen,
  size: Size,
  errors: ArrayLike<number>,
  name: string,
  marks: readonly { name: string; value: number }[],
  colors: Colors,
): void {
  const range = { low: 0, high: rangeOf([errors]).high * 1.001 || 1 };
  const numBins = Math.min(Math.max(Math.ceil(Math.sqrt(errors.length)), 4), 40);
  const counts = new Array<number>(numBins).fill(0);
  for (let i = 0; i < errors.length; i++) {
    const bin = Math.min(Math.floor(((errors[i] as number) / range.high) * numBins), numBins - 1);
    counts[bin] = (counts[bin] ?? 0) + 1;
  }
  const y = { low: 0, high: Math.max(...counts) * 1.08 };
  const area = plotArea(size);
  drawAxes(pen, area, linearAxis(range), linearAxis(y), { x: name, y: 'poses' }, colors);
  const pitch = area.width / numBins;
  counts.forEach((count, bin) => {
    const height = (area.height * count) / y.high;
    const shade = colors.ramp[Math.floor((bin / numBins) * colors.ramp.length)] ?? colors.text;
    pen.rect(area.x + bin * pitch + 0.5, area.y + area.height - height, Math.max(pitch - 1, 1), height, shade);
  });
  marks.forEach(({ value }) => {
    const at = area.x + (area.width * value) / range.high;
    pen.line([at, area.y, at, area.y + area.height], { color: colors.text, width: 1.25, dash: [4, 3] });
  });
  // Words on a ground of their own, on the side of the line that has room.
  marks.forEach(({ name, value }, index) => {
    const at = area.x + (area.width * value) / range.high;
    const words = `${name} ${shortNumber(value, 3)}`;
    const [y, width] = [area.y + 8 + 16 * index, 6.3 * words.length + 6];
    const isLeft = at - width - 6 > area.x && (at + width + 6 > area.x + area.width || value < range.high / 2);
    pen.rect(isLeft ? at - width - 3 : at + 3, y - 7, width, 14, colors.background);
    pen.text(isLeft ? at - 6 : at + 6, y, words, { color: colors.text, size: 11, align: isLeft ? 'end' : 'start' });
  });
}

/** The index of the value nearest to `value` in a rising list. */
export function nearestIndex(list: ArrayLike<number>, value: number): number {
  let [low, high] = [0, list.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((list[middle] as number) < value) low = middle + 1;
    else high = middle;
  }
  const before = low - 1;
  if (low >= list.length) return list.length - 1;
  return before >= 0 && value - (list[before] as number) <= (list[low] as number) - value ? before : low;
}
