/** Paths seen from a side. Plain numbers in, strokes out. */
import { type Area, type Colors, drawAxes, linearAxis, type Range, shortNumber } from '../views/axes.js';
import { plotArea, type Size } from '../views/figures.js';
import { axes, type Direction, Z_UP } from '../views/orbit.js';
import type { Pen } from '../views/pen.js';

export type Look = 'top' | 'side' | 'front' | 'space';

/** Viewing direction and zoom of the paths. */
export interface Camera extends Direction {
  /** The direction is of `space` alone. */
  look: Look;
  /** Around the middle of what is shown. */
  zoom: number;
  panX: number;
  panY: number;
}

/** Right and up on the screen, as directions in the world. */
function directions({ look, ...direction }: Camera): [right: readonly number[], up: readonly number[]] {
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
  const { right, up } = axes(direction, Z_UP);
  return [right, up];
}

type Row = readonly [number, number, number, number];

/** World to screen. */
export interface Projection {
  area: Area;
  scale: number;
  /** What x, y, z and 1 are multiplied by to give the place on the screen (pixels). */
  toX: Row;
  toY: Row;
  project(x: number, y: number, z: number): [number, number];
  /** Shown range across and up (m). */
  across: Range;
  up: Range;
}

function along([a, b, c, d]: Row, x: number, y: number, z: number): number {
  return a * x + b * y + c * z + d;
}

export function projection(size: Size, paths: readonly Float64Array[], camera: Camera): Projection {
  const [right, up] = directions(camera);
  const limits = [right, up].map(([a = 0, b = 0, c = 0]) => {
    let low = Number.POSITIVE_INFINITY;
    let high = Number.NEGATIVE_INFINITY;
    for (const path of paths) {
      for (let i = 0; i + 2 < path.length; i += 3) {
        const value = a * (path[i] as number) + b * (path[i + 1] as number) + c * (path[i + 2] as number);
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
  const [middleA, middleB] = [(a.low + a.high) / 2 - camera.panX, (b.low + b.high) / 2 - camera.panY];
  const [centerX, centerY] = [area.x + area.width / 2, area.y + area.height / 2];
  const row = (direction: readonly number[], factor: number, rest: number): Row => [
    factor * (direction[0] ?? 0),
    factor * (direction[1] ?? 0),
    factor * (direction[2] ?? 0),
    rest,
  ];
  const toX = row(right, scale, centerX - scale * middleA);
  const toY = row(up, -scale, centerY + scale * middleB);
  return {
    area,
    scale,
    toX,
    toY,
    across: { low: middleA - area.width / 2 / scale, high: middleA + area.width / 2 / scale },
    up: { low: middleB - area.height / 2 / scale, high: middleB + area.height / 2 / scale },
    project: (x, y, z) => [along(toX, x, y, z), along(toY, x, y, z)],
  };
}

/** A path seen: x y z of each pose, and what colour it has. */
export interface ShownPath {
  positions: Float64Array;
  /** One colour, or one index into the ramp for each pose. */
  color: string | Uint8Array;
  width: number;
  isDashed: boolean;
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
  if (look !== 'space') drawAxes(pen, area, linearAxis(view.across), linearAxis(view.up), AXIS_NAMES[look], colors);
  pen.inside(area.x, area.y, area.width, area.height, () => {
    if (look === 'space') drawTriad(pen, view, colors);
    for (const { positions, color, width, isDashed } of paths) {
      const dash = isDashed ? { dash: [6, 4] } : {};
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
  let [lastX, lastY, lastPose] = [Number.NaN, Number.NaN, 0];
  const numPoses = positions.length / 3;
  for (let pose = 0; pose < numPoses; pose++) {
    const i = 3 * pose;
    const [x, y] = view.project(positions[i] as number, positions[i + 1] as number, positions[i + 2] as number);
    const isEnd = pose + 1 === numPoses;
    if (!isEnd && Math.abs(x - lastX) < SHORTEST_STEP && Math.abs(y - lastY) < SHORTEST_STEP) continue;
    if (shades && run.length > 0 && shades[pose] !== shades[lastPose]) {
      run.push(x, y);
      stroke(run, lastPose);
      run = [];
    }
    run.push(x, y);
    [lastX, lastY, lastPose] = [x, y, pose];
  }
  if (run.length > 0) stroke(run.length === 2 ? [...run, ...run] : run, lastPose);
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
  pen.text(area.x + 34, y, 'ground truth', small);
  const width = Math.min(120, area.width / 4);
  const right = area.x + area.width - 62;
  const step = width / colors.ramp.length;
  colors.ramp.forEach((color, i) => {
    pen.rect(right - width + i * step, y - 4, step + 0.5, 8, color);
  });
  pen.text(right - width - 6, y, shortNumber(range.low, 2), { ...small, align: 'end' });
  pen.text(right + 6, y, `${shortNumber(range.high, 2)} ${unit}`.trim(), small);
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
  // Asked at every move of the pointer, of a hundred thousand poses: numbers alone, and nothing to collect.
  const [ax, bx, cx, dx] = view.toX;
  const [ay, by, cy, dy] = view.toY;
  let best = reach * reach;
  let nearest = -1;
  for (let i = 0; i + 2 < positions.length; i += 3) {
    const px = positions[i] as number;
    const py = positions[i + 1] as number;
    const pz = positions[i + 2] as number;
    const right = ax * px + bx * py + cx * pz + dx - x;
    const down = ay * px + by * py + cy * pz + dy - y;
    const distance = right * right + down * down;
    if (distance < best) {
      best = distance;
      nearest = i / 3;
    }
  }
  return nearest < 0 ? null : nearest;
}
