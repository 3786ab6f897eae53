/** What lies on the map beside the points and the path: grid, reference, pairs, scale bar. Plain data in, strokes out. */
import { cssColor, type Rgb } from './palette.js';
import type { PointSet } from './point-layer.js';
import { roundLength, type Size, toScreenAngle, toScreenX, toScreenY, type Viewport } from './viewport.js';

export interface Pose {
  x: number;
  y: number;
  theta: number;
}

export type Status = 'good' | 'doubtful' | 'lost';

export interface MapMarks {
  /** One pose per frame, world frame. */
  poses: readonly Pose[];
  statuses: readonly Status[];
  /** For each frame whether its link to the frame before is uncertain. */
  uncertainLinks: readonly boolean[];
  /** Direction in which the scanner looks, from the x axis of its own frame, rad. */
  lookDirection: number;
  /** Frames before this one are shown. */
  until: number;
  selected: number | null;
  hovered: number | null;
  /** The trajectory the result is compared with. */
  reference: readonly { x: number; y: number }[];
  /** x y x y quadruples, source and target, of the selected frame. */
  pairs: Float32Array | null;
  /** The direction the scene leaves open for the selected frame, world frame. */
  undetermined: Pose | null;
}

/** A map that another one has replaced: it lies in grey under that. */
export interface BeforeMap {
  points: PointSet;
  poses: readonly Pose[];
}

export interface Layers {
  grid: boolean;
  /** The occupancy grid that is drawn in place of the points. */
  occupancy: boolean;
  path: boolean;
  reference: boolean;
}

export interface MapTheme {
  background: string;
  grid: string;
  axis: string;
  text: string;
  halo: string;
  path: string;
  reference: string;
  selected: Rgb;
  warning: string;
  /** Of the map before. */
  before: Rgb;
}

export const LIGHT_MAP: MapTheme = {
  background: '#fcfdfe',
  grid: '#e9edf2',
  axis: '#d3dae3',
  text: '#4a5565',
  halo: '#ffffff',
  path: '#1c2633',
  reference: '#b4530a',
  selected: [214, 20, 112],
  warning: '#b3261e',
  before: [158, 166, 177],
};

export const DARK_MAP: MapTheme = {
  background: '#0b0f14',
  grid: '#171e27',
  axis: '#27313d',
  text: '#a3afbf',
  halo: '#0b0f14',
  path: '#e4eaf2',
  reference: '#ffad5c',
  selected: [255, 92, 168],
  warning: '#ff8a80',
  before: [96, 106, 119],
};

export type Context = CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D;

const FONT = '12px system-ui, sans-serif';

/** Lines one round length apart; the axes of the first scan's frame a little stronger. */
export function paintGrid(ctx: Context, size: Size, view: Viewport, theme: MapTheme): void {
  const step = roundLength(view, 110);
  // Quarter turns keep the lines upright; on the screen the origin and the pitch are all there is to know.
  const pitch = step * view.scale;
  const originX = toScreenX(view, size, 0, 0);
  const originY = toScreenY(view, size, 0, 0);
  const stroke = (color: string, isAxis: boolean): void => {
    ctx.strokeStyle = color;
    ctx.beginPath();
    for (let i = Math.ceil(-originX / pitch); originX + i * pitch <= size.width; i++) {
      if ((i === 0) !== isAxis) continue;
      const x = Math.round(originX + i * pitch) + 0.5;
      ctx.moveTo(x, 0);
      ctx.lineTo(x, size.height);
    }
    for (let i = Math.ceil(-originY / pitch); originY + i * pitch <= size.height; i++) {
      if ((i === 0) !== isAxis) continue;
      const y = Math.round(originY + i * pitch) + 0.5;
      ctx.moveTo(0, y);
      ctx.lineTo(size.width, y);
    }
    ctx.stroke();
  };
  ctx.lineWidth = 1;
  stroke(theme.grid, false);
  stroke(theme.axis, true);
}

/** Which way x and y run, in the lower left corner. */
export function paintAxes(ctx: Context, size: Size, view: Viewport, theme: MapTheme): void {
  ctx.font = FONT;
  ctx.textAlign = 'center';
  ctx.textBaseline = 'middle';
  ctx.lineCap = 'round';
  const angles = [toScreenAngle(view, 0), toScreenAngle(view, Math.PI / 2)];
  const reachLeft = Math.max(...angles.map((angle) => -Math.cos(angle)));
  const reachDown = Math.max(...angles.map((angle) => -Math.sin(angle)));
  const x = 16 + 34 * Math.max(reachLeft, 0);
  const y = size.height - 16 - 34 * Math.max(reachDown, 0);
  const arrows = (): void => {
    ctx.beginPath();
    for (const angle of angles) {
      const tipX = x + 24 * Math.cos(angle);
      const tipY = y - 24 * Math.sin(angle);
      ctx.moveTo(x, y);
      ctx.lineTo(tipX, tipY);
      arrowHead(ctx, tipX, tipY, -angle, 5);
    }
    ctx.stroke();
  };
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth = 4;
  arrows();
  ctx.strokeStyle = theme.text;
  ctx.lineWidth = 1.5;
  arrows();
  for (const [i, name] of ['x', 'y'].entries()) {
    const angle = angles[i] as number;
    haloText(ctx, name, x + 33 * Math.cos(angle), y - 33 * Math.sin(angle), theme.text, theme.halo);
  }
}

/** The reference trajectory, dashed, with a cross at its start. */
export function paintReference(ctx: Context, size: Size, view: Viewport, marks: MapMarks, theme: MapTheme): void {
  if (marks.reference.length === 0) return;
  ctx.strokeStyle = theme.reference;
  ctx.lineWidth = 1.75;
  ctx.lineJoin = 'round';
  ctx.setLineDash([6, 4]);
  polyline(ctx, size, view, marks.reference);
  ctx.setLineDash([]);
  if (marks.reference.length <= 200) {
    ctx.lineWidth = 1.25;
    ctx.beginPath();
    for (const point of marks.reference) {
      const x = toScreenX(view, size, point.x, point.y);
      const y = toScreenY(view, size, point.x, point.y);
      ctx.moveTo(x - 3, y);
      ctx.lineTo(x + 3, y);
      ctx.moveTo(x, y - 3);
      ctx.lineTo(x, y + 3);
    }
    ctx.stroke();
  }
}

/** The path of the map before. */
export function paintBefore(ctx: Context, size: Size, view: Viewport, { poses }: BeforeMap, theme: MapTheme): void {
  ctx.strokeStyle = cssColor(theme.before);
  ctx.lineWidth = 2.5;
  ctx.lineJoin = 'round';
  polyline(ctx, size, view, poses);
}

/** So many pairs or more are drawn thin; fewer stand out from the points. */
const MANY_PAIRS = 60;

/** Lines from each point of the selected scan to the point it was matched with. */
export function paintPairs(ctx: Context, size: Size, view: Viewport, pairs: Float32Array, theme: MapTheme): void {
  const at = (i: number, axis: typeof toScreenX): number =>
    axis(view, size, pairs[i] as number, pairs[i + 1] as number);
  const lines = (color: string, width: number): void => {
    ctx.strokeStyle = color;
    ctx.lineWidth = width;
    ctx.beginPath();
    for (let i = 0; i + 3 < pairs.length; i += 4) {
      ctx.moveTo(at(i, toScreenX), at(i, toScreenY));
      ctx.lineTo(at(i + 2, toScreenX), at(i + 2, toScreenY));
    }
    ctx.stroke();
  };
  ctx.lineCap = 'round';
  if (pairs.length >= 4 * MANY_PAIRS) lines(cssColor(theme.selected, 0.75), 1);
  else {
    lines(theme.halo, 5);
    lines(theme.warning, 2.5);
  }
  ctx.fillStyle = theme.path;
  for (let i = 0; i + 3 < pairs.length; i += 4) {
    ctx.fillRect(at(i + 2, toScreenX) - 1, at(i + 2, toScreenY) - 1, 2, 2);
  }
}

/** A double arrow along the direction the scene leaves open; an arc with two heads when that is the turning. */
export function paintUndetermined(
  ctx: Context,
  size: Size,
  view: Viewport,
  pose: Pose,
  direction: Pose,
  theme: MapTheme,
): void {
  const x = toScreenX(view, size, pose.x, pose.y);
  const y = toScreenY(view, size, pose.x, pose.y);
  const along = Math.hypot(direction.x, direction.y);
  const strokes = (): void => {
    if (along >= Math.abs(direction.theta)) {
      const angle = toScreenAngle(view, Math.atan2(direction.y, direction.x));
      const dx = 46 * Math.cos(angle);
      const dy = -46 * Math.sin(angle);
      ctx.beginPath();
      ctx.moveTo(x - dx, y - dy);
      ctx.lineTo(x + dx, y + dy);
      arrowHead(ctx, x + dx, y + dy, Math.atan2(dy, dx));
      arrowHead(ctx, x - dx, y - dy, Math.atan2(-dy, -dx));
      ctx.stroke();
      return;
    }
    const middle = -toScreenAngle(view, pose.theta);
    ctx.beginPath();
    ctx.arc(x, y, 34, middle - 1.1, middle + 1.1);
    for (const side of [-1, 1]) {
      const end = middle + 1.1 * side;
      arrowHead(ctx, x + 34 * Math.cos(end), y + 34 * Math.sin(end), end + (Math.PI / 2) * side);
    }
    ctx.stroke();
  };
  ctx.lineCap = 'round';
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth = 6;
  strokes();
  ctx.strokeStyle = theme.warning;
  ctx.lineWidth = 2.5;
  strokes();
}

/** A round length and its name, in the lower right corner. */
export function paintScaleBar(ctx: Context, size: Size, view: Viewport, theme: MapTheme): void {
  const length = roundLength(view, Math.min(160, size.width * 0.35));
  const pixels = length * view.scale;
  const right = size.width - 16;
  const bottom = size.height - 14;
  ctx.lineCap = 'butt';
  const bar = (): void => {
    ctx.beginPath();
    ctx.moveTo(right - pixels, bottom - 6);
    ctx.lineTo(right - pixels, bottom);
    ctx.lineTo(right, bottom);
    ctx.lineTo(right, bottom - 6);
    ctx.stroke();
  };
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth = 4;
  bar();
  ctx.strokeStyle = theme.text;
  ctx.lineWidth = 1.5;
  bar();
  ctx.font = FONT;
  ctx.textAlign = 'center';
  ctx.textBaseline = 'bottom';
  haloText(ctx, lengthName(length), right - pixels / 2, bottom - 5, theme.text, theme.halo);
}

function lengthName(metres: number): string {
  if (metres < 0.0099) return `${Math.round(metres * 10_000) / 10} mm`;
  if (metres < 0.99) return `${Math.round(metres * 1000) / 10} cm`;
  if (metres < 999) return `${metres} m`;
  return `${metres / 1000} km`;
}

function polyline(ctx: Context, size: Size, view: Viewport, points: readonly { x: number; y: number }[]): void {
  ctx.beginPath();
  points.forEach((point, i) => {
    const x = toScreenX(view, size, point.x, point.y);
    const y = toScreenY(view, size, point.x, point.y);
    if (i === 0) ctx.moveTo(x, y);
    else ctx.lineTo(x, y);
  });
  ctx.stroke();
}

function arrowHead(ctx: Context, x: number, y: number, angle: number, length = 9): void {
  for (const side of [-1, 1]) {
    ctx.moveTo(x, y);
    ctx.lineTo(x - length * Math.cos(angle + 0.5 * side), y - length * Math.sin(angle + 0.5 * side));
  }
}

function haloText(ctx: Context, text: string, x: number, y: number, color: string, halo: string): void {
  ctx.strokeStyle = halo;
  ctx.lineWidth = 4;
  ctx.lineJoin = 'round';
  ctx.strokeText(text, x, y);
  ctx.fillStyle = color;
  ctx.fillText(text, x, y);
}
