/** A picture of located scans over their map. */
import type { Localization, LocalizationResult, OccupancyGrid } from '../../pkg/scanstitch.js';
import { png } from './png.js';

type Color = [number, number, number];
const RETURN: Color = [0, 114, 178];
const CERTAIN: Color = [0, 140, 60];
const DOUBTFUL: Color = [230, 120, 0];
/** Most scans whose returns are drawn. */
const MOST_SCANS = 500;

export function localizationPicture(grid: OccupancyGrid, localization: Localization, { scans }: LocalizationResult) {
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
  const step = Math.ceil(scans.length / MOST_SCANS);
  scans.forEach(({ status }, index) => {
    if (status !== 'good' || index % step > 0) return;
    const points = localization.scan_points(index);
    for (let i = 0; i + 1 < points.length; i += 2) dot(points[i] ?? 0, points[i + 1] ?? 0, RETURN);
  });
  for (const { status, place } of scans) {
    if (place && status !== 'lost') {
      dot(place.T_world_sensor.x, place.T_world_sensor.y, status === 'good' ? CERTAIN : DOUBTFUL, 1);
    }
  }
  return png(width, height, rgb);
}
