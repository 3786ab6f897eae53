/** An occupancy grid in place of the map's points: free, occupied and unknown cells. */
import type { Grid } from '../engine/protocol.js';
import { type Size, toScreenX, toScreenY, type Viewport } from './viewport.js';

/** A grid as a picture, with its position in the world. */
export interface OccupancyPicture {
  image: HTMLCanvasElement;
  /** Side of a cell, m. */
  resolution: number;
  /** The corner with the least x and y, m. */
  originX: number;
  originY: number;
}

/** Grey value of each kind of cell, on a light map and on a dark one. */
const SHADES = {
  light: { free: 255, occupied: 20, unknown: 205 },
  dark: { free: 75, occupied: 240, unknown: 38 },
} as const;
const FREE = 254;
const OCCUPIED = 0;

export function occupancyPicture(grid: Grid, dark: boolean): OccupancyPicture | null {
  const { width, height, resolution, grey_values } = grid;
  const [originX = 0, originY = 0] = grid.origin;
  const image = document.createElement('canvas');
  const context = image.getContext('2d');
  if (!context || width === 0 || height === 0) return null;
  image.width = width;
  image.height = height;
  const pixels = context.createImageData(width, height);
  const shades = dark ? SHADES.dark : SHADES.light;
  for (const [cell, value] of grey_values.entries()) {
    const shade = value === FREE ? shades.free : value === OCCUPIED ? shades.occupied : shades.unknown;
    pixels.data.set([shade, shade, shade, 255], 4 * cell);
  }
  context.putImageData(pixels, 0, 0);
  return { image, resolution, originX, originY };
}

/** Draws the picture at its position, rotated like the view. */
export function paintOccupancy(
  ctx: CanvasRenderingContext2D,
  size: Size,
  view: Viewport,
  { image, resolution, originX, originY }: OccupancyPicture,
): void {
  const top = originY + image.height * resolution;
  const at = (x: number, y: number): [number, number] => [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
  const [leftX, leftY] = at(originX, top);
  const [rightX, rightY] = at(originX + resolution, top);
  const [belowX, belowY] = at(originX, top - resolution);
  ctx.save();
  // One pixel of the picture is one cell.
  ctx.transform(rightX - leftX, rightY - leftY, belowX - leftX, belowY - leftY, leftX, leftY);
  ctx.imageSmoothingEnabled = view.scale * resolution < 1;
  ctx.drawImage(image, 0, 0);
  ctx.restore();
}
