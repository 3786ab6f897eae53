/** The path of the robot on the map: certain and uncertain links, and the poses. */
import type { Context, MapMarks, MapTheme, Pose } from './map-painter.js';
import { cssColor, type Rgb } from './palette.js';
import { type Size, toScreenAngle, toScreenX, toScreenY, type Viewport } from './viewport.js';

/** Side of the cells in which one arrow has room, CSS pixels: of short runs, and of long ones, whose walls would be hidden. */
const ARROW_CELL = 20;
const LONG_RUN_ARROW_CELL = 44;
/** More poses than this make a long run. */
const LONG_RUN = 200;
/** Shorter pieces of its path are drawn as one, CSS pixels: on a curve of a radius of 10 they lie off it by 0.2. */
const MIN_LINK = 4;

/**
 * The robot's path, dashed where a link is uncertain, and an arrow for every pose, pointing where the robot looks; `only`: of
 * these frames alone.
 */
export function paintTrajectory(
  ctx: Context,
  size: Size,
  view: Viewport,
  marks: MapMarks,
  colors: readonly Rgb[],
  theme: MapTheme,
  only: readonly number[] | null,
): void {
  const shown = marks.poses.slice(0, marks.until);
  const among = only && new Set(only);
  const isShown = (frame: number): boolean => among?.has(frame) ?? true;
  paintPath(ctx, size, view, shown, marks.uncertainLinks, theme, isShown);

  const arrow = (frame: number, radius: number, fill: string, outline: string): void => {
    const pose = shown[frame];
    if (!pose) return;
    const [x, y] = [toScreenX(view, size, pose.x, pose.y), toScreenY(view, size, pose.x, pose.y)];
    if (marks.statuses[frame] === 'lost') {
      paintCross(ctx, x, y, 0.6 * radius, theme);
      return;
    }
    const heading = toScreenAngle(view, pose.theta + marks.lookDirection);
    paintArrow(ctx, x, y, heading, radius, fill, outline);
  };
  const ownColor = (frame: number): string => cssColor(colors[frame] ?? theme.selected);

  // Where poses are dense, only the first in each cell of the screen is drawn; the selected and the hovered one
  // are always there.
  const side = shown.length > LONG_RUN ? LONG_RUN_ARROW_CELL : ARROW_CELL;
  const taken = new Set<number>();
  shown.forEach((pose, frame) => {
    if (frame === marks.selected || frame === marks.hovered || !isShown(frame)) return;
    const column = Math.floor(toScreenX(view, size, pose.x, pose.y) / side);
    const row = Math.floor(toScreenY(view, size, pose.x, pose.y) / side);
    const cell = column * 1e6 + row;
    if (taken.has(cell)) return;
    taken.add(cell);
    arrow(frame, shown.length > 60 ? 6.5 : 8, ownColor(frame), theme.halo);
  });
  if (marks.hovered !== null && marks.hovered !== marks.selected)
    arrow(marks.hovered, 11, ownColor(marks.hovered), theme.path);
  if (marks.selected !== null) arrow(marks.selected, 12, cssColor(theme.selected), theme.halo);
}

/** The nearest shown pose within `reach` CSS pixels of a place on the screen; else null. */
export function poseAt(
  marks: MapMarks,
  size: Size,
  view: Viewport,
  screenX: number,
  screenY: number,
  reach: number,
): number | null {
  let nearest: number | null = null;
  let best = reach;
  marks.poses.slice(0, marks.until).forEach((pose, frame) => {
    const distance = Math.hypot(
      toScreenX(view, size, pose.x, pose.y) - screenX,
      toScreenY(view, size, pose.x, pose.y) - screenY,
    );
    if (distance <= best) {
      best = distance;
      nearest = frame;
    }
  });
  return nearest;
}

/** The path over a halo; uncertain links are dashed and lighter. */
function paintPath(
  ctx: Context,
  size: Size,
  view: Viewport,
  poses: readonly Pose[],
  uncertainLinks: readonly boolean[],
  theme: MapTheme,
  isShown: (frame: number) => boolean,
): void {
  const [certain, uncertain] = [new Path2D(), new Path2D()];
  // What was drawn last, and to where.
  let last: Path2D | null = null;
  let [fromX, fromY] = [0, 0];
  poses.forEach((pose, i) => {
    if (!isShown(i)) return;
    const x = toScreenX(view, size, pose.x, pose.y);
    const y = toScreenY(view, size, pose.x, pose.y);
    if (i > 0 && isShown(i - 1)) {
      const links = uncertainLinks[i] ? uncertain : certain;
      // Drawn with the next link.
      if (
        links === last &&
        poses.length > LONG_RUN &&
        i + 1 < poses.length &&
        !uncertainLinks[i + 1] === !uncertainLinks[i] &&
        Math.abs(x - fromX) + Math.abs(y - fromY) < MIN_LINK
      )
        return;
      if (links !== last) links.moveTo(fromX, fromY);
      links.lineTo(x, y);
      last = links;
    } else last = null;
    [fromX, fromY] = [x, y];
  });
  const stroke = (links: Path2D, color: string, width: number): void => {
    ctx.strokeStyle = color;
    ctx.lineWidth = width;
    ctx.stroke(links);
  };
  ctx.lineJoin = 'round';
  ctx.lineCap = 'round';
  stroke(certain, theme.halo, 4);
  stroke(certain, theme.path, 1.5);
  ctx.setLineDash([2, 5]);
  ctx.globalAlpha = 0.7;
  stroke(uncertain, theme.path, 1.5);
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}

/** Where a lost frame was expected. */
function paintCross(ctx: Context, x: number, y: number, radius: number, theme: MapTheme): void {
  ctx.beginPath();
  for (const side of [-1, 1]) {
    ctx.moveTo(x - radius, y - side * radius);
    ctx.lineTo(x + radius, y + side * radius);
  }
  ctx.strokeStyle = theme.halo;
  ctx.lineWidth = 5;
  ctx.stroke();
  ctx.strokeStyle = theme.warning;
  ctx.lineWidth = 2;
  ctx.stroke();
}

/** A kite whose tip points along `angle`, counter-clockwise on the screen. */
export function paintArrow(
  ctx: Context,
  x: number,
  y: number,
  angle: number,
  radius: number,
  fill: string,
  outline: string,
): void {
  const cos = Math.cos(angle);
  const sin = Math.sin(angle);
  const corner = (forward: number, left: number): [number, number] => [
    x + radius * (forward * cos - left * sin),
    y - radius * (forward * sin + left * cos),
  ];
  ctx.beginPath();
  ctx.moveTo(...corner(1, 0));
  ctx.lineTo(...corner(-0.75, 0.68));
  ctx.lineTo(...corner(-0.35, 0));
  ctx.lineTo(...corner(-0.75, -0.68));
  ctx.closePath();
  ctx.lineJoin = 'round';
  ctx.strokeStyle = outline;
  ctx.lineWidth = 2.5;
  ctx.stroke();
  ctx.fillStyle = fill;
  ctx.fill();
}
