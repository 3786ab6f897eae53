/** What the map shows of the selected scan alone: its pairs, and the direction that the scene leaves open. Loaded when a scan has one. */
import { arrowHead, type Context, type MapTheme, type Pose } from './map-painter.js';
import { cssColor } from './palette.js';
import { type Size, toScreenAngle, toScreenX, toScreenY, type Viewport } from './viewport.js';

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
