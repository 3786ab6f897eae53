/** The shape over the map that a tool of the grid has drawn. */
import type { MapLayer } from '../views/map-layer.js';
import { type Context, DARK_MAP, LIGHT_MAP } from '../views/map-painter.js';
import { cssColor } from '../views/palette.js';
import { type Size, toScreenX, toScreenY, toWorld, type Viewport } from '../views/viewport.js';
import type { GridTools, Place } from './grid-tools.js';
import { paintDots, paintNumbered } from './numbered-places.js';

/** As the cells are drawn on the map, but for a tint that shows them on cells of their kind. */
const FILLS = { occupied: 'rgb(20 20 20 / 75%)', free: 'rgb(255 255 255 / 75%)', unknown: 'rgb(128 128 128 / 75%)' };
const CUT_OFF = { light: 'rgb(128 128 128 / 60%)', dark: 'rgb(0 0 0 / 65%)' };
/** Thinner than this (CSS pixels), a line is not seen. */
const MIN_LINE = 3;

/** `keys`: what they mean while it is there. */
export function gridLayer(tools: GridTools, keys: Record<string, () => void>): MapLayer {
  return {
    showsGrid: true,
    keys,
    paint: (ctx, size, view, dark) => paint(tools, ctx, size, view, dark),
    tap: (x, y, _reach, size, view) => {
      const at = toWorld(view, size, x, y);
      tools.tap([at.x, at.y]);
      return true;
    },
    press: (x, y, reach) => tools.press([x, y], reach),
    drag: (x, y) => tools.drag(x, y),
    cancel: () => tools.cancel(),
    release: () => tools.release(),
  };
}

function paint(tools: GridTools, ctx: Context, size: Size, view: Viewport, dark: boolean): void {
  const theme = dark ? DARK_MAP : LIGHT_MAP;
  const color = cssColor(theme.selected);
  const onScreen = ([x, y]: Place): [number, number] => [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
  const [from, to] = tools.places;
  ctx.save();
  if (from && to && tools.tool === 'line') {
    ctx.lineWidth = Math.max(tools.width * view.scale, MIN_LINE);
    ctx.lineCap = 'round';
    ctx.beginPath();
    ctx.moveTo(...onScreen(from));
    ctx.lineTo(...onScreen(to));
    for (const [style, extra] of [
      [color, 3],
      [FILLS[tools.cells], 0],
    ] as const) {
      ctx.strokeStyle = style;
      ctx.lineWidth += extra;
      ctx.stroke();
      ctx.lineWidth -= extra;
    }
  } else if (from && to && tools.tool === 'polygon') {
    ctx.beginPath();
    for (const place of tools.places) ctx.lineTo(...onScreen(place));
    ctx.closePath();
    ctx.fillStyle = FILLS[tools.cells];
    ctx.fill('evenodd');
    ctx.strokeStyle = color;
    ctx.lineWidth = 2;
    ctx.stroke();
  } else if (from && to && tools.tool !== 'anchor') {
    const [[x0, y0], [x1, y1]] = [onScreen(from), onScreen(to)];
    ctx.beginPath();
    ctx.rect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
    if (tools.tool === 'crop') {
      // Two rectangles in each other: what lies between them is cut off.
      ctx.rect(0, 0, size.width, size.height);
      ctx.fillStyle = dark ? CUT_OFF.dark : CUT_OFF.light;
      ctx.fill('evenodd');
    } else {
      ctx.fillStyle = FILLS[tools.cells];
      ctx.fill();
    }
    ctx.strokeStyle = color;
    ctx.lineWidth = 2;
    ctx.strokeRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
  }
  if (tools.tool === 'anchor') paintNumbered(ctx, tools.places.map(onScreen), color, theme.halo);
  else paintDots(ctx, tools.places.map(onScreen), color);
  ctx.restore();
}
