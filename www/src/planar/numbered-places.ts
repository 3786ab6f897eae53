/** Places that are given on a map or a picture: dots, with numbers where each has a counterpart elsewhere. */
import type { Context } from '../views/map-painter.js';

export function paintDots(ctx: Context, places: readonly [number, number][], color: string): void {
  ctx.fillStyle = color;
  for (const place of places) {
    ctx.beginPath();
    ctx.arc(...place, 6, 0, 2 * Math.PI);
    ctx.fill();
  }
}

/** `places`: on the screen; null: not given yet. */
export function paintNumbered(
  ctx: Context,
  places: readonly ([number, number] | null)[],
  color: string,
  halo: string,
): void {
  ctx.save();
  ctx.font = '600 13px system-ui, sans-serif';
  ctx.lineWidth = 3;
  ctx.strokeStyle = halo;
  ctx.fillStyle = color;
  places.forEach((place, at) => {
    if (!place) return;
    const [x, y] = place;
    ctx.beginPath();
    ctx.arc(x, y, 6, 0, 2 * Math.PI);
    ctx.stroke();
    paintDots(ctx, [place], color);
    ctx.strokeText(String(at + 1), x + 9, y - 7);
    ctx.fillText(String(at + 1), x + 9, y - 7);
  });
  ctx.restore();
}

/** Half the length of the cross (CSS pixels). */
const CROSS = 9;

/** The cross in the middle, whose place is taken by a key. */
export function paintCross(ctx: Context, size: { width: number; height: number }, color: string): void {
  const [x, y] = [size.width / 2, size.height / 2];
  ctx.save();
  ctx.strokeStyle = color;
  ctx.lineWidth = 1;
  ctx.beginPath();
  ctx.moveTo(x - CROSS, y);
  ctx.lineTo(x + CROSS, y);
  ctx.moveTo(x, y - CROSS);
  ctx.lineTo(x, y + CROSS);
  ctx.stroke();
  ctx.restore();
}
