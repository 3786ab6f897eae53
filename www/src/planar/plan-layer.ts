/** A building plan on the map: behind its points, and the points that it is laid by over them. */
import type { PlacedPlan } from '../engine/protocol.js';
import type { MapExtra, MapLayer } from '../views/map-layer.js';
import { type Context, DARK_MAP, LIGHT_MAP } from '../views/map-painter.js';
import { cssColor } from '../views/palette.js';
import { type Size, toScreenX, toScreenY, toWorld, type Viewport } from '../views/viewport.js';
import type { Place } from './grid-tools.js';
import { paintCross, paintNumbered } from './numbered-places.js';
import { paintSheet, type Sheet, sheetOf } from './plan-sheet.js';
import type { PlanTools } from './plan-tools.js';

/** The plan behind the map with its picture; null where there is none. */
export async function laidPlan(
  placed: PlacedPlan | null,
  pictures: Readonly<Record<string, Uint8Array<ArrayBuffer>>>,
): Promise<{ placed: PlacedPlan; sheet: Sheet } | null> {
  const bytes = placed && pictures[placed.picture];
  return bytes ? { placed, sheet: await sheetOf(bytes) } : null;
}

export function planExtra(placed: PlacedPlan, sheet: Sheet, opacity: number): MapExtra {
  return {
    label: `Building plan: ${placed.picture}`,
    sign: 'plan',
    isBehind: true,
    paint: (ctx, size, view, dark) => {
      ctx.globalAlpha = opacity;
      paintSheet(ctx, size, view, sheet, placed, dark);
      ctx.globalAlpha = 1;
    },
  };
}

/** `keys`: what they mean while it is there. */
export function planLayer(plan: PlanTools, keys: Record<string, () => void>): MapLayer {
  return {
    keys,
    paint: (ctx, size, view, dark) => {
      plan.cross = [view.centerX, view.centerY];
      paint(plan, ctx, size, view, dark);
    },
    tap: (x, y, _reach, size, view) => {
      const at = toWorld(view, size, x, y);
      plan.tapMap([at.x, at.y]);
      return true;
    },
    press: (x, y, reach) => plan.press([x, y], reach),
    drag: (x, y) => plan.drag(x, y),
    cancel: () => plan.release(),
    release: () => plan.release(),
  };
}

function paint({ pairs, placed }: PlanTools, ctx: Context, size: Size, view: Viewport, dark: boolean): void {
  const theme = dark ? DARK_MAP : LIGHT_MAP;
  const color = cssColor(theme.selected);
  const onScreen = ([x, y]: Place): [number, number] => [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
  const places = pairs.map(({ map: [x, y] }) => (x === null || y === null ? null : onScreen([x, y])));
  // From each place to where the plan has it.
  ctx.save();
  ctx.strokeStyle = color;
  ctx.lineWidth = 2;
  pairs.forEach(({ picture }, at) => {
    const from = places[at];
    if (!placed || !picture || !from) return;
    const [x, y] = onScreen(inMap(placed, picture));
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(x, y);
    ctx.moveTo(x + 9, y);
    ctx.arc(x, y, 9, 0, 2 * Math.PI);
    ctx.stroke();
  });
  ctx.restore();
  paintNumbered(ctx, places, color, theme.halo);
  paintCross(ctx, size, theme.text);
}

/** Where a point of the picture lies in the map (m). */
function inMap({ pixel, turn, corner: [x, y] }: PlacedPlan, [u, v]: Place): Place {
  const [cos, sin] = [pixel * Math.cos(turn), pixel * Math.sin(turn)];
  return [x + u * cos + v * sin, y + u * sin - v * cos];
}
