/** Figures as files. */
import type { Painter } from './figure-view.js';
import type { Size } from '../views/figures.js';
import { CanvasPen, SvgPen } from '../views/pen.js';

/** Pixels of a PNG for each of the screen's: sharp in print. */
const DENSITY = 3;

export function svgFile(painter: Painter, size: Size, background: string): Blob {
  const pen = new SvgPen();
  pen.rect(0, 0, size.width, size.height, background);
  painter(pen, size);
  return new Blob([pen.finish(size.width, size.height)], { type: 'image/svg+xml' });
}

export function pngFile(painter: Painter, size: Size, background: string): Promise<Blob> {
  const canvas = new OffscreenCanvas(Math.round(size.width * DENSITY), Math.round(size.height * DENSITY));
  const context = canvas.getContext('2d');
  if (!context) return Promise.reject(new Error('The browser gives no canvas to draw on.'));
  context.scale(DENSITY, DENSITY);
  // An offscreen canvas draws as one on the page does; only its type is another.
  const pen = new CanvasPen(context as unknown as CanvasRenderingContext2D);
  pen.rect(0, 0, size.width, size.height, background);
  painter(pen, size);
  return canvas.convertToBlob({ type: 'image/png' });
}
