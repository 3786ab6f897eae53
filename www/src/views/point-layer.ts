/**
 * The points of the map, painted by our own loop into the pixels of an ImageData: half a million points take a few
 * milliseconds, where half a million calls of a canvas take seconds.
 */
import type { Journal } from './journal.js';
import { type Size, toScreenX, toScreenY, type Viewport } from './viewport.js';

/** Points ordered by frame: frame f owns points `offsets[f]` to `offsets[f + 1]`. */
export interface PointSet {
  /** x y x y ..., world frame, m. */
  points: Float32Array;
  offsets: Uint32Array;
}

export const NO_POINTS: PointSet = { points: new Float32Array(0), offsets: new Uint32Array(1) };

/** A round dot: the pixels it covers around its centre, and how much of each, 0..255. */
export interface Dot {
  dx: Int32Array;
  dy: Int32Array;
  coverage: Uint8Array;
}

/** A dot of `diameter` device pixels with smooth edges. */
function makeDot(diameter: number): Dot {
  const radius = diameter / 2;
  const reach = Math.ceil(radius);
  const pixels: [number, number, number][] = [];
  for (let y = -reach; y <= reach; y++) {
    for (let x = -reach; x <= reach; x++) {
      const coverage = Math.min(Math.max(radius + 0.5 - Math.hypot(x, y), 0), 1);
      if (coverage > 0.05) pixels.push([x, y, Math.round(255 * coverage)]);
    }
  }
  return {
    dx: Int32Array.from(pixels, ([x]) => x),
    dy: Int32Array.from(pixels, ([, y]) => y),
    coverage: Uint8Array.from(pixels, ([, , coverage]) => coverage),
  };
}

export interface PointStyle {
  /** One packed colour per frame, alpha 255. */
  colors: Uint32Array;
  /** Diameter of a point in device pixels. */
  diameter: number;
  /** Of so many points of a frame one is painted. */
  stride?: number;
}

/** How large points should be, in CSS pixels: large where they are few on the screen, one pixel where they are dense. */
export function pointDiameter(num_points: number, size: Size): number {
  const areaPerPoint = (size.width * size.height) / Math.max(num_points, 1);
  return Math.min(Math.max(Math.sqrt(areaPerPoint) / 5, 1), 3.4);
}

/**
 * Paints frames `first` to `last` (exclusive) over what `pixels` holds. Later frames lie on top; a pixel keeps the
 * strongest coverage it has seen, so overlapping dots neither darken nor fringe. `journal`: of these pixels, to take frames off again.
 */
export function paintPoints(
  pixels: Uint32Array,
  deviceSize: Size,
  view: Viewport,
  pixelRatio: number,
  set: PointSet,
  first: number,
  last: number,
  style: PointStyle,
  journal: Journal | null = null,
): void {
  const { width, height } = deviceSize;
  // The map from the world to pixels is affine: three points of it give its six numbers.
  const deviceView = { ...view, scale: view.scale * pixelRatio };
  const originX = toScreenX(deviceView, deviceSize, 0, 0);
  const originY = toScreenY(deviceView, deviceSize, 0, 0);
  const xOfX = toScreenX(deviceView, deviceSize, 1, 0) - originX;
  const yOfX = toScreenY(deviceView, deviceSize, 1, 0) - originY;
  const xOfY = toScreenX(deviceView, deviceSize, 0, 1) - originX;
  const yOfY = toScreenY(deviceView, deviceSize, 0, 1) - originY;
  const { points, offsets } = set;
  const diameter = Math.round(style.diameter);
  const stride = style.stride ?? 1;
  const dot = diameter > 2 ? makeDot(style.diameter) : null;
  const write = (at: number, color: number): void => {
    if (journal === null) pixels[at] = color;
    else journal.write(at, color);
  };
  for (let frame = first; frame < last; frame++) {
    const color = style.colors[frame] ?? 0;
    const rgb = color & 0xffffff;
    const end = 2 * (offsets[frame + 1] ?? 0);
    // Each frame begins with another one: the same beams of all would leave gaps.
    for (let i = 2 * ((offsets[frame] ?? 0) + (frame % stride)); i < end; i += 2 * stride) {
      const worldX = points[i] as number;
      const worldY = points[i + 1] as number;
      const x = Math.floor(originX + worldX * xOfX + worldY * xOfY);
      const y = Math.floor(originY + worldX * yOfX + worldY * yOfY);
      if (x < 0 || x >= width || y < 0 || y >= height) continue;
      const at = y * width + x;
      if (dot === null) {
        write(at, color);
        if (diameter === 2 && x + 1 < width && y + 1 < height) {
          write(at + 1, color);
          write(at + width, color);
          write(at + width + 1, color);
        }
        continue;
      }
      for (let k = 0; k < dot.coverage.length; k++) {
        const px = x + (dot.dx[k] as number);
        const py = y + (dot.dy[k] as number);
        if (px < 0 || px >= width || py < 0 || py >= height) continue;
        const coverage = dot.coverage[k] as number;
        const to = py * width + px;
        if ((pixels[to] as number) >>> 24 <= coverage) write(to, (rgb | (coverage << 24)) >>> 0);
      }
    }
    journal?.endFrame();
  }
}

/** The frame whose point lies nearest to a world point within `radius` m, among frames before `until`; else null. */
export function nearestFrame(set: PointSet, until: number, x: number, y: number, radius: number): number | null {
  let nearest: number | null = null;
  let best = radius * radius;
  for (let frame = 0; frame < until; frame++) {
    const end = 2 * (set.offsets[frame + 1] ?? 0);
    for (let i = 2 * (set.offsets[frame] ?? 0); i < end; i += 2) {
      const dx = (set.points[i] as number) - x;
      const dy = (set.points[i + 1] as number) - y;
      const squared = dx * dx + dy * dy;
      if (squared <= best) {
        best = squared;
        nearest = frame;
      }
    }
  }
  return nearest;
}
