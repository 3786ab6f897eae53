/** Where all scans are, as the map draws it and finds them again. */
import type { Status } from '../views/map-painter.js';
import type { Bounds } from '../views/viewport.js';
import type { GridPicture } from './protocol.js';

const STATUSES: readonly Status[] = ['good', 'doubtful', 'lost'];

export interface Track {
  /** Status, x, y, theta of each scan. */
  values: Float64Array;
  statuses: readonly Status[];
  /** World frame: the way between scans of which the places are certain, and the most likely places of the others, as dots. */
  certain: Path2D;
  doubtful: Path2D;
}

export interface TrackPose {
  status: Status;
  x: number;
  y: number;
  theta: number;
}

/** A line so short (m), with round ends, is a dot; one without a length is not drawn. */
const DOT_LENGTH = 1e-4;

export function trackOf(values: Float64Array): Track {
  const statuses = Array.from({ length: values.length / 4 }, (_, scan) => STATUSES[values[4 * scan] ?? 2] ?? 'lost');
  const [certain, doubtful] = [new Path2D(), new Path2D()];
  let isOnWay = false;
  for (let scan = 0; scan < statuses.length; scan++) {
    const pose = poseOf(values, scan);
    const isCertain = pose?.status === 'good';
    if (isCertain && isOnWay) certain.lineTo(pose.x, pose.y);
    else if (isCertain) certain.moveTo(pose.x, pose.y);
    // Of doubtful scans one may be here and the next there: no line joins them.
    else if (pose) {
      doubtful.moveTo(pose.x, pose.y);
      doubtful.lineTo(pose.x + DOT_LENGTH, pose.y);
    }
    isOnWay = isCertain;
  }
  return { values, statuses, certain, doubtful };
}

/** Null where a scan has no place, or was taken elsewhere. */
export function poseOf(values: Float64Array, scan: number): TrackPose | null {
  const [code = 2, x = Number.NaN, y = Number.NaN, theta = 0] = values.subarray(4 * scan, 4 * scan + 4);
  return code < 2 && Number.isFinite(x) ? { status: STATUSES[code] ?? 'lost', x, y, theta } : null;
}

/** The scan that was taken nearest to a place, within `reach` (m); null where there is none. */
export function scanAt({ values }: Track, x: number, y: number, reach: number): number | null {
  let [nearest, best]: [number | null, number] = [null, reach * reach];
  for (let i = 0; i < values.length; i += 4) {
    const squared = ((values[i + 1] ?? 0) - x) ** 2 + ((values[i + 2] ?? 0) - y) ** 2;
    if (values[i] !== 2 && squared <= best) [nearest, best] = [i / 4, squared];
  }
  return nearest;
}

/** A place of the map in the world (m): so many cells to the right and up from its lower left corner. */
export function worldOf(
  { resolution, originX, originY, yaw }: GridPicture,
  right: number,
  up: number,
): [number, number] {
  const [cos, sin] = [Math.cos(yaw) * resolution, Math.sin(yaw) * resolution];
  return [originX + cos * right - sin * up, originY + sin * right + cos * up];
}

/** The box around what is known of a map, world frame; all of it where nothing is. */
export function boundsOf(grid: GridPicture): Bounds {
  const { width, height, grey_values } = grid;
  let [left, right, top, bottom] = [width, 0, height, 0];
  for (let row = 0, i = 0; row < height; row++) {
    for (let column = 0; column < width; column++, i++) {
      if (grey_values[i] !== 0 && grey_values[i] !== 254) continue;
      left = Math.min(left, column);
      right = Math.max(right, column + 1);
      top = Math.min(top, row);
      bottom = row + 1;
    }
  }
  const known = right > left ? { left, right, top, bottom } : { left: 0, right: width, top: 0, bottom: height };
  const corners = [known.left, known.right].flatMap((right) =>
    [height - known.bottom, height - known.top].map((up) => worldOf(grid, right, up)),
  );
  const [xs, ys] = [corners.map(([x]) => x), corners.map(([, y]) => y)];
  return { minX: Math.min(...xs), maxX: Math.max(...xs), minY: Math.min(...ys), maxY: Math.max(...ys) };
}
