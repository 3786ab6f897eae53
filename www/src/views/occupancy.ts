/** An occupancy grid in place of the map's points: free, occupied and unknown cells. */
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
