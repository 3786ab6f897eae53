/** What is measured, over the map: points with the ways between them, the beams of the scans that saw a place, and the cross. */
import type { MapLayer } from '../views/map-layer.js';
import { type Context, DARK_MAP, LIGHT_MAP, type MapTheme } from '../views/map-painter.js';
import { formatFixed } from '../views/format.js';
import { cssColor } from '../views/palette.js';
import { type Size, toScreenX, toScreenY, toWorld, type Viewport } from '../views/viewport.js';
import type { Place } from './grid-tools.js';
import type { MapMeasuring } from './map-measuring.js';
import { paintCross } from './numbered-places.js';

export function measureLayer(measuring: MapMeasuring, keys: Record<string, () => void>): MapLayer {
  return {
    keys,
    paint: (ctx, size, view, dark) => {
      follow(measuring, view);
      paint(measuring, new Pen(ctx, size, view, dark ? DARK_MAP : LIGHT_MAP));
    },
    tap: (x, y, _reach, size, view) => {
      const at = toWorld(view, size, x, y);
      measuring.take([at.x, at.y]);
      return true;
    },
    press: (x, y, reach) => measuring.mode === 'points' && measuring.points.press([x, y], reach),
    drag: (x, y) => measuring.mode === 'points' && measuring.points.drag(x, y),
    cancel: () => measuring.points.cancel(),
    release: () => measuring.points.release(),
  };
}

/** The cross stays in the middle while the map moves; the panel is told where it comes to rest. */
function follow(measuring: MapMeasuring, { centerX: x, centerY: y, scale }: Viewport): void {
  const decimals = scale < 100 ? 2 : 3;
  const { cross } = measuring;
  if (cross && cross.x === x && cross.y === y && cross.decimals === decimals) return;
  measuring.cross = { x, y, decimals };
  measuring.crossMoved();
}

function paint({ mode, points, place, scans, side }: MapMeasuring, pen: Pen): void {
  if (mode === 'points') pen.way(points.corners);
  else if (place) {
    for (const { laser, num_ended: ended } of scans ?? []) pen.beam(laser, place, ended > 0);
    pen.cell(place, side);
  }
  paintCross(pen.ctx, pen.size, pen.theme.text);
}

class Pen {
  constructor(
    readonly ctx: Context,
    readonly size: Size,
    readonly view: Viewport,
    readonly theme: MapTheme,
  ) {}

  #at([x, y]: Place): [number, number] {
    return [toScreenX(this.view, this.size, x, y), toScreenY(this.view, this.size, x, y)];
  }

  get #color(): string {
    return cssColor(this.theme.selected);
  }

  /** The way along places, with the lengths of its parts; from three on closed, and filled. */
  way(places: readonly Place[]): void {
    const { ctx } = this;
    ctx.save();
    ctx.strokeStyle = this.#color;
    ctx.fillStyle = this.#color;
    ctx.lineWidth = 2;
    ctx.beginPath();
    for (const place of places) ctx.lineTo(...this.#at(place));
    ctx.stroke();
    if (places.length > 2) {
      ctx.globalAlpha = 0.12;
      ctx.fill('evenodd');
      ctx.globalAlpha = 1;
    }
    for (const place of places) {
      ctx.beginPath();
      ctx.arc(...this.#at(place), 5, 0, 2 * Math.PI);
      ctx.fill();
    }
    places.slice(1).forEach((place, before) => this.#label(places[before] ?? place, place));
    ctx.restore();
  }

  #label(from: Place, to: Place): void {
    const { ctx, theme } = this;
    const [[x0, y0], [x1, y1]] = [this.#at(from), this.#at(to)];
    // A word over a short line would hide it.
    if (Math.hypot(x1 - x0, y1 - y0) < 56) return;
    ctx.font = '600 12px system-ui, sans-serif';
    ctx.textAlign = 'center';
    ctx.lineWidth = 4;
    ctx.strokeStyle = theme.halo;
    const words = `${formatFixed(Math.hypot(to[0] - from[0], to[1] - from[1]), 2)} m`;
    const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2 - 6];
    ctx.strokeText(words, x, y);
    ctx.fillText(words, x, y);
  }

  /** From a laser to a place; `ends`: whether beams end there. */
  beam(laser: readonly [number, number], place: Place, ends: boolean): void {
    const { ctx } = this;
    ctx.save();
    ctx.strokeStyle = ends ? this.#color : this.theme.path;
    ctx.globalAlpha = ends ? 0.7 : 0.25;
    ctx.lineWidth = 1;
    ctx.beginPath();
    ctx.moveTo(...this.#at(laser));
    ctx.lineTo(...this.#at(place));
    ctx.stroke();
    ctx.restore();
  }

  /** A cell around a place, at least as large as is seen. */
  cell(place: Place, side: number): void {
    const { ctx } = this;
    const [[x, y], half] = [this.#at(place), Math.max((side * this.view.scale) / 2, 4)];
    ctx.save();
    ctx.strokeStyle = this.#color;
    ctx.lineWidth = 2;
    ctx.strokeRect(x - half, y - half, 2 * half, 2 * half);
    ctx.restore();
  }
}
