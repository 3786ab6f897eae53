/** What the user made: cameras, marks and choices. Every change is a new document, so undoing is going back to one. */
import type { BevCamera, Projection, BevPair, BevPoint, BevScene, Pixel, Query, WholePixels } from './protocol.js';

export type Tool = 'polygon' | 'grid' | 'points' | 'pairs';

/** A place marked in the top view; in the front view it may still be missing. */
export interface MarkedPair {
  top: Pixel;
  front: Pixel | null;
}

export interface BevDocument {
  scene: BevScene;
  tool: Tool;
  /** Pixels of the top view: corners of the polygon, or free points. */
  points: readonly Pixel[];
  /** Two opposite corners of the grid, in the top view. */
  corners: readonly Pixel[];
  columns: number;
  rows: number;
  pairs: readonly MarkedPair[];
  whole: WholePixels;
}

export const MAX_GRID = 50;

export function newDocument(scene: BevScene): BevDocument {
  return { scene, tool: 'polygon', points: [], corners: [], columns: 4, rows: 4, pairs: [], whole: 'exact' };
}

/** The pixels that are followed, and shown in the table. */
export function markedPixels(document: BevDocument): readonly Pixel[] {
  switch (document.tool) {
    case 'grid':
      return gridPixels(document);
    case 'pairs':
      return document.pairs.map(({ top }) => top);
    default:
      return document.points;
  }
}

function gridPixels({ corners, columns, rows }: BevDocument): Pixel[] {
  const [from, to] = corners;
  if (!from || !to) return [...corners];
  return range(rows + 1).flatMap((row) =>
    range(columns + 1).map((column): Pixel => [
      from[0] + ((to[0] - from[0]) * column) / columns,
      from[1] + ((to[1] - from[1]) * row) / rows,
    ]),
  );
}

/** Lines of the grid, from one end to the other. */
export function gridLines({ tool, corners, columns, rows }: BevDocument): [Pixel, Pixel][] {
  const [from, to] = corners;
  if (tool !== 'grid' || !from || !to) return [];
  const u = (column: number) => from[0] + ((to[0] - from[0]) * column) / columns;
  const v = (row: number) => from[1] + ((to[1] - from[1]) * row) / rows;
  return [
    ...range(columns + 1).map((column): [Pixel, Pixel] => [
      [u(column), from[1]],
      [u(column), to[1]],
    ]),
    ...range(rows + 1).map((row): [Pixel, Pixel] => [
      [from[0], v(row)],
      [to[0], v(row)],
    ]),
  ];
}

/** The corners of the region that is filled. */
export function regionCorners({ tool, points, corners: [from, to] }: BevDocument): readonly Pixel[] {
  if (tool === 'polygon') return points.length >= 3 ? points : [];
  if (tool !== 'grid' || !from || !to) return [];
  return [from, [to[0], from[1]], to, [from[0], to[1]]];
}

export function queryOf(document: BevDocument): Query {
  return {
    scene: document.scene,
    marked: flat(markedPixels(document)),
    region: flat(regionCorners(document)),
    lines: flat(gridLines(document).flat()),
    pairTops: flat(document.pairs.map(({ top }) => top)),
    whole: document.whole,
  };
}

/** Pairs that are marked in both views. */
export function wholePairs({ pairs }: BevDocument): BevPair[] {
  return pairs.flatMap(({ top, front }) => (front ? [{ top: [...top], front: [...front] }] : []));
}

export function flat(pixels: readonly Pixel[]): Float64Array {
  return Float64Array.from(pixels.flat());
}

/** What became of a point, in words. */
export const STATUS_WORDS: Record<BevPoint['status'], string> = {
  visible: 'visible',
  outside_image: 'outside the front image',
  behind_camera: 'behind the front camera',
  no_ground: 'above the horizon',
};

/** What to do with each tool. */
export const HINTS: Record<Tool, string> = {
  polygon: 'Click the corners of a region; drag them, or move them with the arrow keys.',
  grid: 'Click two opposite corners in the top view.',
  points: 'Click points in either view: the other one follows.',
  pairs: 'Click a place in the top view, then the same place in the front view.',
};

/** How many points have no place in the front view, and why. */
export function hiddenWords({ points, region }: Projection): string {
  const counted = (['behind_camera', 'no_ground', 'outside_image'] as const).flatMap((status) => {
    const count = points.filter((point) => point.status === status).length;
    return count > 0 ? [`${count} ${STATUS_WORDS[status]}`] : [];
  });
  return [...counted, ...(region?.is_clipped ? ['the region is cut where the front view ends'] : [])].join('; ');
}

/** Documents to go back to, and forth. */
export interface History {
  past: readonly BevDocument[];
  present: BevDocument;
  future: readonly BevDocument[];
}

const MAX_PAST = 200;

export function begun(present: BevDocument): History {
  return { past: [], present, future: [] };
}

/** A change that can be undone. */
export function changed({ past, present }: History, next: BevDocument): History {
  return { past: [...past, present].slice(-MAX_PAST), present: next, future: [] };
}

/** A change that belongs to the one before it, as the steps of a drag do. */
export function continued(history: History, next: BevDocument): History {
  return { ...history, present: next, future: [] };
}

export function undone({ past, present, future }: History): History {
  const before = past.at(-1);
  return before
    ? { past: past.slice(0, -1), present: before, future: [present, ...future] }
    : { past, present, future };
}

export function redone({ past, present, future }: History): History {
  const [next, ...rest] = future;
  return next ? { past: [...past, present], present: next, future: rest } : { past, present, future };
}

function range(count: number): number[] {
  return Array.from({ length: count }, (_, i) => i);
}

/** A camera whose picture has another size; focal lengths grow along. */
export function resized(camera: BevCamera, width: number, height: number): BevCamera {
  const { intrinsics } = camera;
  if (intrinsics.kind !== 'focal') return { ...camera, width, height };
  const { fx, fy, cx, cy } = intrinsics;
  const [alongU, alongV] = [width / camera.width, height / camera.height];
  const grown = { ...intrinsics, fx: fx * alongU, cx: cx * alongU, fy: fy * alongV, cy: cy * alongV };
  return { ...camera, width, height, intrinsics: grown };
}
