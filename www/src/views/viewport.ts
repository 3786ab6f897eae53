/** By how many quarter turns, counter-clockwise, the world is turned on the screen. */
export type Turns = 0 | 1 | 2 | 3;

/** Which part of the world the canvas shows. World: metres, y up. Screen: CSS pixels, y down. */
export interface Viewport {
  /** The world point in the middle of the canvas, m. */
  centerX: number;
  centerY: number;
  /** CSS pixels per metre. */
  scale: number;
  turns: Turns;
}

export interface Size {
  width: number;
  height: number;
}

export interface Bounds {
  minX: number;
  minY: number;
  maxX: number;
  maxY: number;
}

const MIN_SCALE = 0.02; // 1 km in 20 pixels
const MAX_SCALE = 200_000; // a fifth of a metre in 40,000 pixels: far below the noise of any scanner

const COS = [1, 0, -1, 0] as const;
const SIN = [0, 1, 0, -1] as const;

export function toScreenX(view: Viewport, size: Size, x: number, y: number): number {
  const { centerX, centerY, scale, turns } = view;
  return size.width / 2 + ((x - centerX) * COS[turns] - (y - centerY) * SIN[turns]) * scale;
}

export function toScreenY(view: Viewport, size: Size, x: number, y: number): number {
  const { centerX, centerY, scale, turns } = view;
  return size.height / 2 - ((x - centerX) * SIN[turns] + (y - centerY) * COS[turns]) * scale;
}

/** A direction in the world, rad, as it appears on the screen, still counter-clockwise. */
export function toScreenAngle(view: Viewport, angle: number): number {
  return angle + (view.turns * Math.PI) / 2;
}

export function toWorld(view: Viewport, size: Size, screenX: number, screenY: number): { x: number; y: number } {
  const offset = unturned(view, screenX - size.width / 2, size.height / 2 - screenY);
  return { x: view.centerX + offset.x, y: view.centerY + offset.y };
}

/** Moved by `dx` to the right and `dy` down, CSS pixels. */
export function panned(view: Viewport, dx: number, dy: number): Viewport {
  const offset = unturned(view, dx, -dy);
  return { ...view, centerX: view.centerX - offset.x, centerY: view.centerY - offset.y };
}

/** A vector of CSS pixels, right and up, as a vector in the world, m. */
function unturned({ scale, turns }: Viewport, right: number, up: number): { x: number; y: number } {
  return { x: (right * COS[turns] + up * SIN[turns]) / scale, y: (up * COS[turns] - right * SIN[turns]) / scale };
}

/** Zoomed by `factor` so that the world point under the screen point stays where it is. */
export function zoomedAt(view: Viewport, size: Size, screenX: number, screenY: number, factor: number): Viewport {
  const scale = Math.min(Math.max(view.scale * factor, MIN_SCALE), MAX_SCALE);
  const fixed = toWorld(view, size, screenX, screenY);
  const zoomed = { ...view, scale };
  const nowThere = toWorld(zoomed, size, screenX, screenY);
  return {
    ...zoomed,
    centerX: view.centerX + fixed.x - nowThere.x,
    centerY: view.centerY + fixed.y - nowThere.y,
  };
}

export interface Margin {
  top: number;
  right: number;
  bottom: number;
  left: number;
}

/** The box around both. */
export function united(a: Bounds | null, b: Bounds | null): Bounds | null {
  if (!a || !b) return a ?? b;
  return {
    minX: Math.min(a.minX, b.minX),
    minY: Math.min(a.minY, b.minY),
    maxX: Math.max(a.maxX, b.maxX),
    maxY: Math.max(a.maxY, b.maxY),
  };
}

/** The viewport that shows all of `bounds` with a margin on each side, in CSS pixels. */
export function fitted(bounds: Bounds, size: Size, margin: Margin, turns: Turns): Viewport {
  const { width, height } = extent(bounds, turns);
  const scale = Math.min(
    Math.max(size.width - margin.left - margin.right, 40) / width,
    Math.max(size.height - margin.top - margin.bottom, 40) / height,
  );
  const middle: Viewport = {
    centerX: (bounds.minX + bounds.maxX) / 2,
    centerY: (bounds.minY + bounds.maxY) / 2,
    scale,
    turns,
  };
  return panned(middle, (margin.left - margin.right) / 2, (margin.top - margin.bottom) / 2);
}

/**
 * How the map is best laid: turned by a quarter when that shows it at least half as large again, so that a corridor
 * that runs upwards fills a wide screen.
 */
export function bestTurns(bounds: Bounds, size: Size): Turns {
  const upright = extent(bounds, 0);
  const lying = extent(bounds, 1);
  const scale = ({ width, height }: Size): number => Math.min(size.width / width, size.height / height);
  return scale(lying) > 1.5 * scale(upright) ? 3 : 0;
}

function extent(bounds: Bounds, turns: Turns): Size {
  const alongX = Math.max(bounds.maxX - bounds.minX, 0.5);
  const alongY = Math.max(bounds.maxY - bounds.minY, 0.5);
  return turns % 2 === 0 ? { width: alongX, height: alongY } : { width: alongY, height: alongX };
}

/** A round length (m) for the scale bar, which is at most `maxPixels` on the screen. */
export function roundLength(view: Viewport, maxPixels: number): number {
  return roundedDown(maxPixels / view.scale);
}

/** The largest of 1, 2 or 5 times a power of ten that is not larger. */
export function roundedDown(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const factor = value / power;
  return Number(((factor >= 5 ? 5 : factor >= 2 ? 2 : 1) * power).toPrecision(1));
}
