/** A picture of located scans over their map, a pixel a cell. */
import type { Localization, OccupancyGrid } from '../../pkg/scanstitch.js';

type Color = [number, number, number];
const RETURN: Color = [0, 114, 178];
const CERTAIN: Color = [0, 140, 60];
const DOUBTFUL: Color = [230, 120, 0];
/** Most scans whose returns are drawn. */
const MOST_SCANS = 500;

/** Row by row from the top, as `localization.png` shows them. */
export function localizationPixels(grid: OccupancyGrid, localization: Localization) {
  const { width, height, resolution, yaw } = grid;
  const [x0 = 0, y0 = 0] = grid.origin;
  const rgb = new Uint8Array(3 * width * height);
  grid.grey_values().forEach((grey, index) => rgb.fill(grey, 3 * index, 3 * index + 3));
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const dot = (x: number, y: number, color: Color, radius = 0) => {
    const [dx, dy] = [x - x0, y - y0];
    const column = Math.floor((cos * dx + sin * dy) / resolution);
    const row = height - 1 - Math.floor((cos * dy - sin * dx) / resolution);
    for (let v = Math.max(0, row - radius); v <= Math.min(height - 1, row + radius); v++) {
      for (let u = Math.max(0, column - radius); u <= Math.min(width - 1, column + radius); u++) {
        rgb.set(color, 3 * (v * width + u));
      }
    }
  };
  const track = localization.track();
  const num_scans = track.length / 4;
  const step = Math.ceil(num_scans / MOST_SCANS);
  for (let scan = 0; scan < num_scans; scan += step) {
    if (track[4 * scan] !== 0) continue;
    const points = localization.scan_points(scan);
    for (let i = 0; i + 1 < points.length; i += 2) dot(points[i] ?? 0, points[i + 1] ?? 0, RETURN);
  }
  for (let i = 0; i < track.length; i += 4) {
    const [status = 2, x = Number.NaN, y = Number.NaN] = track.subarray(i, i + 3);
    if (status < 2 && Number.isFinite(x)) dot(x, y, status === 0 ? CERTAIN : DOUBTFUL, 1);
  }
  return { width, height, rgb };
}
