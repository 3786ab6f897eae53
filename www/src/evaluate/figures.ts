/** The figures of an evaluation. Plain numbers in, strokes out; the same for the screen, for PNG and for SVG. */
import { type Area, type Colors, drawAxes, padded, type Range, rangeOf, tickWord } from './axes.js';
import type { Pen } from './pen.js';

export interface Size {
  width: number;
  height: number;
}

/** A line of values over time, distance or number. */
export interface Series {
  x: ArrayLike<number>;
  values: ArrayLike<number>;
  /** Values stand this far apart, from `offset` on: x y z x y z ... */
  stride: number;
  offset: number;
  color: string;
  width: number;
  is_dashed: boolean;
}

const LEFT = 58;
const RIGHT = 14;
const TOP = 12;
const BOTTOM = 36;

export function plotArea({ width, height }: Size): Area {
  return { x: LEFT, y: TOP, width: Math.max(width - LEFT - RIGHT, 10), height: Math.max(height - TOP - BOTTOM, 10) };
}

/** Lines over a common axis. */
export function drawSeries(
  pen: Pen,
  size: Size,
  series: readonly Series[],
  x: Range,
  names: { x: string; y: string },
  colors: Colors,
  from_zero: boolean,
): Range {
  const ranges = series.map(({ values, stride, offset }) => rangeOf([values], stride, offset));
  const all = rangeOf(ranges.map(({ low, high }) => [low, high]));
  const y = from_zero ? { low: 0, high: Math.max(all.high, 1e-12) * 1.05 } : padded(all);
  const area = plotArea(size);
  drawAxes(pen, area, x, y, names, colors);
  pen.inside(area.x, area.y, area.width, area.height, () => {
    for (const one of series) {
      const points = columns(one, area, x, y);
      const dash = one.is_dashed ? { dash: [5, 4] } : {};
      pen.line(points, { color: one.color, width: one.width, ...dash });
    }
  });
  return y;
}

/** Points of a line; of many that fall on one column of the screen, the first, lowest, highest and last. */
function columns({ x: xs, values, stride, offset }: Series, area: Area, x: Range, y: Range): number[] {
  const points: number[] = [];
  const count = Math.min(xs.length, Math.floor((values.length - offset + stride - 1) / stride));
  const atX = (i: number) => area.x + (area.width * ((xs[i] as number) - x.low)) / (x.high - x.low);
  const value = (i: number) => values[i * stride + offset] as number;
  const push = (i: number) => {
    points.push(atX(i), area.y + area.height * (1 - (value(i) - y.low) / (y.high - y.low)));
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
  const num_bins = Math.min(Math.max(Math.ceil(Math.sqrt(errors.length)), 4), 40);
  const counts = new Array<number>(num_bins).fill(0);
  for (let i = 0; i < errors.length; i++) {
    const bin = Math.min(Math.floor(((errors[i] as number) / range.high) * num_bins), num_bins - 1);
    counts[bin] = (counts[bin] ?? 0) + 1;
  }
  const y = { low: 0, high: Math.max(...counts) * 1.08 };
  const area = plotArea(size);
  drawAxes(pen, area, range, y, { x: name, y: 'poses' }, colors);
  const pitch = area.width / num_bins;
  counts.forEach((count, bin) => {
    const height = (area.height * count) / y.high;
    const shade = colors.ramp[Math.floor((bin / num_bins) * colors.ramp.length)] ?? colors.text;
    pen.rect(area.x + bin * pitch + 0.5, area.y + area.height - height, Math.max(pitch - 1, 1), height, shade);
  });
  marks.forEach(({ name, value }, index) => {
    const at = area.x + (area.width * value) / range.high;
    pen.line([at, area.y, at, area.y + area.height], { color: colors.text, width: 1.25, dash: [4, 3] });
    pen.text(at + 4, area.y + 7 + 13 * index, `${name} ${tickWord(Number(value.toPrecision(3)))}`, {
      color: colors.text,
      size: 11,
    });
  });
}

export type Look = 'top' | 'side' | 'front' | 'space';

/** Which way the paths are looked at, and how near. */
export interface Camera {
  look: Look;
  /** rad; of `space` alone. */
  azimuth: number;
  elevation: number;
  /** Around the middle of what is shown. */
  zoom: number;
  pan_x: number;
  pan_y: number;
}

/** Right and up on the screen, as directions in the world. */
function directions({ look, azimuth, elevation }: Camera): [right: readonly number[], up: readonly number[]] {
  if (look === 'top')
    return [
      [1, 0, 0],
      [0, 1, 0],
    ];
  if (look === 'side')
    return [
      [1, 0, 0],
      [0, 0, 1],
    ];
  if (look === 'front')
    return [
      [0, 1, 0],
      [0, 0, 1],
    ];
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  return [
    [-sa, ca, 0],
    [-ca * se, -sa * se, ce],
  ];
}

/** World to screen. */
export interface Projection {
  area: Area;
  scale: number;
  project(x: number, y: number, z: number): [number, number];
  /** Shown range across and up (m). */
  across: Range;
  up: Range;
}

export function projection(size: Size, paths: readonly Float64Array[], camera: Camera): Projection {
  const [right, up] = directions(camera);
  const along = (direction: readonly number[], path: Float64Array, i: number) =>
    (direction[0] ?? 0) * (path[i] as number) +
    (direction[1] ?? 0) * (path[i + 1] as number) +
    (direction[2] ?? 0) * (path[i + 2] as number);
  const limits = [right, up].map((direction) => {
    let low = Number.POSITIVE_INFINITY;
    let high = Number.NEGATIVE_INFINITY;
    for (const path of paths) {
      for (let i = 0; i + 2 < path.length; i += 3) {
        const value = along(direction, path, i);
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    return low <= high ? { low, high } : { low: -1, high: 1 };
  });
  const [a, b] = limits as [Range, Range];
  const whole = plotArea(size);
  const area = { ...whole, y: whole.y + KEY_HEIGHT, height: Math.max(whole.height - KEY_HEIGHT, 10) };
  const fit = Math.min(area.width / Math.max(a.high - a.low, 1e-9), area.height / Math.max(b.high - b.low, 1e-9));
  const scale = Math.min(fit * 0.92, 1e9) * camera.zoom;
  const [middle_a, middle_b] = [(a.low + a.high) / 2 - camera.pan_x, (b.low + b.high) / 2 - camera.pan_y];
  const [center_x, center_y] = [area.x + area.width / 2, area.y + area.height / 2];
  return {
    area,
    scale,
    across: { low: middle_a - area.width / 2 / scale, high: middle_a + area.width / 2 / scale },
    up: { low: middle_b - area.height / 2 / scale, high: middle_b + area.height / 2 / scale },
    project: (x, y, z) => [
      center_x + scale * ((right[0] ?? 0) * x + (right[1] ?? 0) * y + (right[2] ?? 0) * z - middle_a),
      center_y - scale * ((up[0] ?? 0) * x + (up[1] ?? 0) * y + (up[2] ?? 0) * z - middle_b),
    ],
  };
}

/** A path seen: x y z of each pose, and what colour it has. */
export interface ShownPath {
  positions: Float64Array;
  /** One colour, or one index into the ramp for each pose. */
  color: string | Uint8Array;
  width: number;
  is_dashed: boolean;
}

/** Steps shorter than this on the screen are drawn together (pixels). */
const SHORTEST_STEP = 0.7;

const AXIS_NAMES: Record<Look, { x: string; y: string }> = {
  top: { x: 'x (m)', y: 'y (m)' },
  side: { x: 'x (m)', y: 'z (m)' },
  front: { x: 'y (m)', y: 'z (m)' },
  space: { x: '', y: '' },
};

export function drawPaths(pen: Pen, view: Projection, paths: readonly ShownPath[], look: Look, colors: Colors): void {
  const { area } = view;
  if (look !== 'space') drawAxes(pen, area, view.across, view.up, AXIS_NAMES[look], colors);
  pen.inside(area.x, area.y, area.width, area.height, () => {
    if (look === 'space') drawTriad(pen, view, colors);
    for (const { positions, color, width, is_dashed } of paths) {
      const dash = is_dashed ? { dash: [6, 4] } : {};
      drawPath(
        view,
        positions,
        (points, pose) => {
          const shade = typeof color === 'string' ? color : (colors.ramp[color[pose] ?? 0] ?? colors.text);
          pen.line(points, { color: shade, width, ...dash });
        },
        typeof color === 'string' ? null : color,
      );
    }
  });
}

/** Calls `stroke` for each run of poses of one colour, with the points on the screen and the run's last pose. */
function drawPath(
  view: Projection,
  positions: Float64Array,
  stroke: (points: number[], pose: number) => void,
  shades: Uint8Array | null,
): void {
  let run: number[] = [];
  let [last_x, last_y, last_pose] = [Number.NaN, Number.NaN, 0];
  const num_poses = positions.length / 3;
  for (let pose = 0; pose < num_poses; pose++) {
    const i = 3 * pose;
    const [x, y] = view.project(positions[i] as number, positions[i + 1] as number, positions[i + 2] as number);
    const is_end = pose + 1 === num_poses;
    if (!is_end && Math.abs(x - last_x) < SHORTEST_STEP && Math.abs(y - last_y) < SHORTEST_STEP) continue;
    if (shades && run.length > 0 && shades[pose] !== shades[last_pose]) {
      run.push(x, y);
      stroke(run, last_pose);
      run = [];
    }
    run.push(x, y);
    [last_x, last_y, last_pose] = [x, y, pose];
  }
  if (run.length > 0) stroke(run.length === 2 ? [...run, ...run] : run, last_pose);
}

/** The directions of the world's axes, from the corner. */
function drawTriad(pen: Pen, { area, project }: Projection, colors: Colors): void {
  const origin = project(0, 0, 0);
  const [x0, y0] = [area.x + 34, area.y + area.height - 30];
  for (const [name, x, y, z] of [
    ['x', 1, 0, 0],
    ['y', 0, 1, 0],
    ['z', 0, 0, 1],
  ] as const) {
    const [ax, ay] = project(x, y, z);
    const unit = Math.hypot(...project(1, 0, 0).map((value, i) => value - (origin[i] ?? 0)), 1e-9);
    const longest = Math.max(unit, Math.hypot(ax - origin[0], ay - origin[1]));
    const [dx, dy] = [((ax - origin[0]) / longest) * 24, ((ay - origin[1]) / longest) * 24];
    pen.line([x0, y0, x0 + dx, y0 + dy], { color: colors.muted, width: 1.5 });
    pen.text(x0 + dx * 1.35, y0 + dy * 1.35, name, { color: colors.muted, size: 11, align: 'middle' });
  }
}

/** Room for the key above the paths. */
const KEY_HEIGHT = 20;

/** The key: how the reference is drawn, and which colour the least and the largest error have. */
export function drawKey(pen: Pen, { area }: Projection, range: Range, unit: string, colors: Colors): void {
  const y = area.y - KEY_HEIGHT / 2;
  const small = { color: colors.muted, size: 11 };
  pen.line([area.x, y, area.x + 28, y], { color: colors.reference, width: 1.5, dash: [6, 4] });
  pen.text(area.x + 34, y, 'reference', small);
  const width = Math.min(120, area.width / 4);
  const right = area.x + area.width - 62;
  const step = width / colors.ramp.length;
  colors.ramp.forEach((color, i) => {
    pen.rect(right - width + i * step, y - 4, step + 0.5, 8, color);
  });
  pen.text(right - width - 6, y, tickWord(Number(range.low.toPrecision(2))), { ...small, align: 'end' });
  pen.text(right + 6, y, `${tickWord(Number(range.high.toPrecision(2)))} ${unit}`.trim(), small);
}

/** The side from which paths are seen at their widest: those of cameras lie in x and z. */
export function widestLook(paths: readonly Float64Array[]): Look {
  const [x = 0, y = 0, z = 0] = [0, 1, 2].map((axis) => extent(paths, axis));
  if (z <= Math.min(x, y)) return 'top';
  return y <= x ? 'side' : 'front';
}

function extent(paths: readonly Float64Array[], axis: number): number {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (const path of paths) {
    for (let i = axis; i < path.length; i += 3) {
      low = Math.min(low, path[i] as number);
      high = Math.max(high, path[i] as number);
    }
  }
  return Math.max(high - low, 0);
}

/** The pose nearest to a place on the screen, within `reach` pixels; null beside the path. */
export function poseAt(view: Projection, positions: Float64Array, x: number, y: number, reach: number): number | null {
  let [best, nearest] = [reach * reach, -1];
  for (let i = 0; i + 2 < positions.length; i += 3) {
    const [px, py] = view.project(positions[i] as number, positions[i + 1] as number, positions[i + 2] as number);
    const distance = (px - x) ** 2 + (py - y) ** 2;
    if (distance < best) [best, nearest] = [distance, i / 3];
  }
  return nearest < 0 ? null : nearest;
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
