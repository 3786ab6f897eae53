/** Particles on the map: the larger and the darker the more weight, with their headings where there is room. */
import { type Size, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';

/** From this weight on, in weights of the mean particle, a particle is drawn with this opacity, side and length of heading (CSS pixels). */
const CLASSES = [
  { from: 0, alpha: 0.18, side: 2, heading: 0 },
  { from: 0.25, alpha: 0.4, side: 2.5, heading: 6 },
  { from: 1, alpha: 0.7, side: 3, heading: 8 },
  { from: 4, alpha: 1, side: 4, heading: 10 },
] as const;
/** Up to so many particles have a line for their heading. */
const MOST_HEADINGS = 3000;

/** `values`: x, y, theta and weight of each. */
export function paintParticles(
  ctx: CanvasRenderingContext2D,
  size: Size,
  view: Viewport,
  values: Float32Array,
  color: string,
): void {
  const count = values.length / 4;
  const hasHeadings = count <= MOST_HEADINGS;
  [ctx.fillStyle, ctx.strokeStyle, ctx.lineWidth] = [color, color, 1];
  CLASSES.forEach(({ from, alpha, side, heading }, index) => {
    const until = CLASSES[index + 1]?.from ?? Number.POSITIVE_INFINITY;
    const [dots, lines] = [new Path2D(), new Path2D()];
    for (let i = 0; i + 3 < values.length; i += 4) {
      const relative = (values[i + 3] ?? 0) * count;
      if (relative < from || relative >= until) continue;
      const [x, y, theta] = [values[i] ?? 0, values[i + 1] ?? 0, values[i + 2] ?? 0];
      const [left, top] = [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
      if (left < 0 || top < 0 || left > size.width || top > size.height) continue;
      dots.rect(left - side / 2, top - side / 2, side, side);
      if (!hasHeadings || heading === 0) continue;
      const ahead = heading / view.scale;
      const [aheadX, aheadY] = [x + ahead * Math.cos(theta), y + ahead * Math.sin(theta)];
      lines.moveTo(left, top);
      lines.lineTo(toScreenX(view, size, aheadX, aheadY), toScreenY(view, size, aheadX, aheadY));
    }
    ctx.globalAlpha = alpha;
    ctx.fill(dots);
    ctx.stroke(lines);
  });
  ctx.globalAlpha = 1;
}
