/** What figures are drawn with: the same strokes on a canvas and in an SVG file. */

import { context2d } from './canvas.js';
import type { Size } from './viewport.js';

export interface Stroke {
  color: string;
  width: number;
  dash?: readonly number[];
}

export interface TextStyle {
  color: string;
  size: number;
  align?: 'start' | 'middle' | 'end';
  /** Turned by a quarter to the left. */
  isUpright?: boolean;
  /** Colour of a rim that keeps the words apart from what lies behind them. */
  halo?: string;
}

export interface Pen {
  /** x y x y ... */
  line(points: ArrayLike<number>, stroke: Stroke): void;
  /** x1 y1 x2 y2 for each, all in one stroke. */
  segments(ends: ArrayLike<number>, stroke: Stroke): void;
  /** Round dots, x y x y ..., all of one colour. */
  dots(centers: ArrayLike<number>, radius: number, color: string): void;
  rect(x: number, y: number, width: number, height: number, color: string): void;
  /** Pixels, stretched to the rectangle. */
  picture(x: number, y: number, width: number, height: number, pixels: HTMLCanvasElement): void;
  circle(x: number, y: number, radius: number, color: string, rim?: string): void;
  /** `y` is the middle of the letters. */
  text(x: number, y: number, words: string, style: TextStyle): void;
  /** What `draw` draws shows inside the rectangle alone. */
  inside(x: number, y: number, width: number, height: number, draw: () => void): void;
}

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

/** Dots up to this radius are drawn as squares, CSS pixels. */
const SQUARE_RADIUS = 1.1;

export class CanvasPen implements Pen {
  constructor(private readonly context: CanvasRenderingContext2D) {
    context.lineJoin = 'round';
    context.lineCap = 'round';
  }

  line(points: ArrayLike<number>, { color, width, dash }: Stroke): void {
    const { context } = this;
    context.strokeStyle = color;
    context.lineWidth = width;
    context.setLineDash(dash ? [...dash] : []);
    context.beginPath();
    for (let i = 0; i + 1 < points.length; i += 2) context.lineTo(points[i] as number, points[i + 1] as number);
    context.stroke();
  }

  segments(ends: ArrayLike<number>, { color, width, dash }: Stroke): void {
    const { context } = this;
    context.strokeStyle = color;
    context.lineWidth = width;
    context.setLineDash(dash ? [...dash] : []);
    context.beginPath();
    for (let i = 0; i + 3 < ends.length; i += 4) {
      context.moveTo(ends[i] as number, ends[i + 1] as number);
      context.lineTo(ends[i + 2] as number, ends[i + 3] as number);
    }
    context.stroke();
  }

  dots(centers: ArrayLike<number>, radius: number, color: string): void {
    const { context } = this;
    context.fillStyle = color;
    context.beginPath();
    for (let i = 0; i + 1 < centers.length; i += 2) {
      const [x, y] = [centers[i] as number, centers[i + 1] as number];
      // A square of two pixels looks like a dot, and is drawn many times as fast.
      if (radius <= SQUARE_RADIUS) context.rect(x - radius, y - radius, 2 * radius, 2 * radius);
      else {
        context.moveTo(x + radius, y);
        context.arc(x, y, radius, 0, 2 * Math.PI);
      }
    }
    context.fill();
  }

  rect(x: number, y: number, width: number, height: number, color: string): void {
    this.context.fillStyle = color;
    this.context.fillRect(x, y, width, height);
  }

  picture(x: number, y: number, width: number, height: number, pixels: HTMLCanvasElement): void {
    this.context.imageSmoothingEnabled = false;
    this.context.drawImage(pixels, x, y, width, height);
  }

  circle(x: number, y: number, radius: number, color: string, rim?: string): void {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = color;
    context.fill();
    if (!rim) return;
    context.setLineDash([]);
    context.lineWidth = 2;
    context.strokeStyle = rim;
    context.stroke();
  }

  text(x: number, y: number, words: string, style: TextStyle): void {
    const { color, size, align = 'start', isUpright = false, halo } = style;
    const { context } = this;
    context.save();
    context.translate(x, y);
    if (isUpright) context.rotate(-Math.PI / 2);
    context.fillStyle = color;
    context.font = `${size}px ${FONT}`;
    context.textAlign = align === 'middle' ? 'center' : align;
    context.textBaseline = 'middle';
    if (halo) {
      context.setLineDash([]);
      context.lineJoin = 'round';
      context.lineWidth = 4;
      context.strokeStyle = halo;
      context.strokeText(words, 0, 0);
    }
    context.fillText(words, 0, 0);
    context.restore();
  }

  inside(x: number, y: number, width: number, height: number, draw: () => void): void {
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(x, y, width, height);
    context.clip();
    draw();
    context.restore();
  }
}

export class SvgPen implements Pen {
  #parts: string[] = [];
  #numClips = 0;

  line(points: ArrayLike<number>, { color, width, dash }: Stroke): void {
    const words: string[] = [];
    for (let i = 0; i + 1 < points.length; i += 2) words.push(`${short(points[i])},${short(points[i + 1])}`);
    const dashes = dash ? ` stroke-dasharray="${dash.join(' ')}"` : '';
    this.#parts.push(
      `<polyline points="${words.join(' ')}" fill="none" stroke="${color}" stroke-width="${width}"${dashes} stroke-linejoin="round" stroke-linecap="round"/>`,
    );
  }

  segments(ends: ArrayLike<number>, { color, width, dash }: Stroke): void {
    const words: string[] = [];
    for (let i = 0; i + 3 < ends.length; i += 4) {
      words.push(`M${short(ends[i])} ${short(ends[i + 1])}L${short(ends[i + 2])} ${short(ends[i + 3])}`);
    }
    const dashes = dash ? ` stroke-dasharray="${dash.join(' ')}"` : '';
    this.#parts.push(
      `<path d="${words.join('')}" fill="none" stroke="${color}" stroke-width="${width}"${dashes} stroke-linecap="round"/>`,
    );
  }

  dots(centers: ArrayLike<number>, radius: number, color: string): void {
    const words: string[] = [];
    for (let i = 0; i + 1 < centers.length; i += 2) words.push(`M${short(centers[i])} ${short(centers[i + 1])}h0`);
    const stroke = `stroke="${color}" stroke-width="${short(2 * radius)}" stroke-linecap="round"`;
    this.#parts.push(`<path d="${words.join('')}" fill="none" ${stroke}/>`);
  }

  rect(x: number, y: number, width: number, height: number, color: string): void {
    const [w, h] = [short(width), short(height)];
    this.#parts.push(`<rect x="${short(x)}" y="${short(y)}" width="${w}" height="${h}" fill="${color}"/>`);
  }

  picture(x: number, y: number, width: number, height: number, pixels: HTMLCanvasElement): void {
    const [w, h] = [short(width), short(height)];
    const box = `x="${short(x)}" y="${short(y)}" width="${w}" height="${h}"`;
    this.#parts.push(
      `<image ${box} preserveAspectRatio="none" style="image-rendering:pixelated" href="${pixels.toDataURL()}"/>`,
    );
  }

  circle(x: number, y: number, radius: number, color: string, rim?: string): void {
    const stroke = rim ? ` stroke="${rim}" stroke-width="2"` : '';
    this.#parts.push(`<circle cx="${short(x)}" cy="${short(y)}" r="${radius}" fill="${color}"${stroke}/>`);
  }

  text(x: number, y: number, words: string, style: TextStyle): void {
    const { color, size, align = 'start', isUpright = false, halo } = style;
    const rim = halo ? ` stroke="${halo}" stroke-width="4" stroke-linejoin="round" paint-order="stroke"` : '';
    const place = isUpright
      ? `transform="translate(${short(x)} ${short(y)}) rotate(-90)"`
      : `x="${short(x)}" y="${short(y)}"`;
    this.#parts.push(
      `<text ${place} fill="${color}" font-size="${size}" text-anchor="${align}" dominant-baseline="central"${rim}>${escape(words)}</text>`,
    );
  }

  inside(x: number, y: number, width: number, height: number, draw: () => void): void {
    const id = `clip${this.#numClips++}`;
    const rect = `<rect x="${short(x)}" y="${short(y)}" width="${short(width)}" height="${short(height)}"/>`;
    this.#parts.push(`<clipPath id="${id}">${rect}</clipPath><g clip-path="url(#${id})">`);
    draw();
    this.#parts.push('</g>');
  }

  /** The file. */
  finish(width: number, height: number): string {
    const size = `width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"`;
    return `<svg xmlns="http://www.w3.org/2000/svg" ${size} font-family="${FONT}">\n${this.#parts.join('\n')}\n</svg>\n`;
  }
}

function short(value: number | undefined): string {
  return String(Math.round((value ?? 0) * 100) / 100);
}

function escape(words: string): string {
  return words.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;');
}

/** A pen on a canvas of this size (CSS pixels), which begins with the pixels of another one, or empty. `ratio`: device
 * pixels per CSS pixel. */
export function penOn(canvas: HTMLCanvasElement, size: Size, ratio: number, ground?: HTMLCanvasElement): CanvasPen {
  const [width, height] = [Math.round(size.width * ratio), Math.round(size.height * ratio)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const context = context2d(canvas);
  context.setTransform(1, 0, 0, 1, 0, 0);
  if (ground && ground.width > 0) context.drawImage(ground, 0, 0);
  else context.clearRect(0, 0, width, height);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return new CanvasPen(context);
}
