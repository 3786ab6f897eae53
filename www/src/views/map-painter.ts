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
    const lines = (origin: number, extent: number, line: (at: number) => void): void => {
      for (let i = Math.ceil(-origin / pitch); origin + i * pitch <= extent; i++)
        if ((i === 0) === isAxis) line(Math.round(origin + i * pitch) + 0.5);
    };
    ctx.strokeStyle = color;
    ctx.beginPath();
    lines(originX, size.width, (x) => {
      ctx.moveTo(x, 0);
      ctx.lineTo(x, size.height);
    });
    lines(originY, size.height, (y) => {
      ctx.moveTo(0, y);
      ctx.lineTo(size.width, y);
    });
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
  // The first line begins where it ends.
  for (const { x, y } of points) ctx.lineTo(toScreenX(view, size, x, y), toScreenY(view, size, x, y));
  ctx.stroke();
}

export function arrowHead(ctx: Context, x: number, y: number, angle: number, length = 9): void {
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
