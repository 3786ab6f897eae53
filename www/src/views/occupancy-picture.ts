/** The picture of an occupancy grid: loaded with the first one that is shown. */
import type { Grid } from '../engine/protocol.js';
import { memoizeLast } from './memoize-last.js';
import type { OccupancyPicture } from './occupancy.js';

/** The picture of a grid, by whether the map is dark. */
export type OccupancyPictures = (dark: boolean) => OccupancyPicture | null;

/** Grey value of each kind of cell, on a light map and on a dark one. */
const SHADES = {
  light: { free: 255, occupied: 20, unknown: 205 },
  dark: { free: 75, occupied: 240, unknown: 38 },
} as const;
const FREE = 254;
const OCCUPIED = 0;

export function occupancyPictures(grid: Grid): OccupancyPictures {
  return memoizeLast((dark: boolean) => occupancyPicture(grid, dark));
}

function occupancyPicture(grid: Grid, dark: boolean): OccupancyPicture | null {
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
