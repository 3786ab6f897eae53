/** The picture of a building plan, decoded to be drawn, and how it is drawn where it lies. */
import { context2d } from '../views/canvas.js';
import type { Context } from '../views/map-painter.js';
import { type Size, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';

export interface Sheet {
  /** Pixels of the picture, which may be kept with fewer. */
  width: number;
  height: number;
  image: HTMLCanvasElement;
  /** White on black, for a dark map. */
  negative: HTMLCanvasElement;
}

/** Where a picture lies in a plane with y upwards. */
export interface Placement {
  /** Side of a pixel. */
  pixel: number;
  /** The upper left corner. */
  corner: readonly [number, number];
  /** Of its rows, counter-clockwise (rad). */
  turn: number;
}

/** More pixels a side than this are more than a screen shows, and than the canvas of a phone takes (16.7 million in all). */
const MAX_SIDE = 4096;

/** Rejects where the bytes are no picture. */
export async function sheetOf(bytes: Uint8Array<ArrayBuffer>): Promise<Sheet> {
  const bitmap = await createImageBitmap(new Blob([bytes]));
  const { width, height } = bitmap;
  const factor = Math.min(1, MAX_SIDE / Math.max(width, height));
  const draw = (isNegative: boolean): HTMLCanvasElement => {
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [Math.ceil(width * factor), Math.ceil(height * factor)];
    const ctx = context2d(canvas);
    ctx.fillStyle = '#fff'; // behind what is transparent
    ctx.fillRect(0, 0, canvas.width, canvas.height);
    ctx.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
    ctx.globalCompositeOperation = 'difference';
    if (isNegative) ctx.fillRect(0, 0, canvas.width, canvas.height);
    return canvas;
  };
  const sheet = { width, height, image: draw(false), negative: draw(true) };
  bitmap.close();
  return sheet;
}

export function paintSheet(ctx: Context, size: Size, view: Viewport, sheet: Sheet, at: Placement, dark: boolean): void {
  const { pixel, corner, turn } = at;
  const [right, up] = [pixel * Math.cos(turn), pixel * Math.sin(turn)];
  const onScreen = (x: number, y: number): [number, number] => [
    toScreenX(view, size, corner[0] + x, corner[1] + y),
    toScreenY(view, size, corner[0] + x, corner[1] + y),
  ];
  const [[x0, y0], [x1, y1], [x2, y2]] = [onScreen(0, 0), onScreen(right, up), onScreen(up, -right)];
  ctx.save();
  ctx.transform(x1 - x0, y1 - y0, x2 - x0, y2 - y0, x0, y0);
  ctx.imageSmoothingEnabled = view.scale * pixel < 2;
  ctx.drawImage(dark ? sheet.negative : sheet.image, 0, 0, sheet.width, sheet.height);
  ctx.restore();
}
