/** The outlines of a map's walls as closed lines, for drawings. */
import type { OccupancyGrid } from '../../pkg/scanstitch.js';

export type Grid = Pick<OccupancyGrid, 'width' | 'height' | 'resolution' | 'origin' | 'yaw' | 'grey_values'>;
export type Point = readonly [x: number, y: number];

/** The grey of an occupied cell. */
const OCCUPIED = 0;
/** Largest distance of a line from the edges of the cells (cells): more than the steps of a slanted wall, 0.71, and no more than is known. */
export const TOLERANCE = 1;
/** Along x, y, -x and -y: each is the one before, turned to the left. */
const DIRECTIONS: readonly Point[] = [
  [1, 0],
  [0, 1],
  [-1, 0],
  [0, -1],
];

/** Closed lines in the world (m): walls lie to the left of them, so that holes run the other way round. */
export function wallLines(grid: Grid): Point[][] {
  return outlines(grid).map((line) => {
    const corners = simplified(line, TOLERANCE);
    // The sides of what is one cell thick would fall on each other: no chord has both within half a cell.
    const kept = corners.length > 2 ? corners : simplified(line, TOLERANCE / 2);
    return kept.map((corner) => inWorld(grid, corner));
  });
}

/** A point of the world, from its columns and rows in the grid, counted from the corner with the smallest x and y. */
export function inWorld({ resolution, origin, yaw }: Omit<Grid, 'grey_values'>, [column, row]: Point): Point {
  const [x0 = 0, y0 = 0] = origin;
  const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
  return [x0 + resolution * (cos * column - sin * row), y0 + resolution * (sin * column + cos * row)];
}

/** Follows the edges between occupied cells and others, corner by corner (columns and rows): never across one another. */
export function outlines(grid: Grid) {
  const edges = edgesFrom(grid);
  const lines: Point[][] = [];
  for (let start = 0; start < edges.length; start++) {
    while (edges[start] !== 0) lines.push(followed(edges, start, grid.width + 1));
  }
  return lines;
}

/** For each corner of cells the directions in which an edge leaves it, as bits. */
function edgesFrom(grid: Grid) {
  const { width, height } = grid;
  const grey = grid.grey_values();
  const isWall = (x: number, y: number) =>
    x >= 0 && y >= 0 && x < width && y < height && grey[(height - 1 - y) * width + x] === OCCUPIED;
  const edges = new Uint8Array((width + 1) * (height + 1));
  const add = (x: number, y: number, direction: number) => {
    const corner = y * (width + 1) + x;
    edges[corner] = (edges[corner] ?? 0) | (1 << direction);
  };
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      if (!isWall(x, y)) continue;
      if (!isWall(x, y - 1)) add(x, y, 0);
      if (!isWall(x + 1, y)) add(x + 1, y, 1);
      if (!isWall(x, y + 1)) add(x + 1, y + 1, 2);
      if (!isWall(x - 1, y)) add(x, y + 1, 3);
    }
  }
  return edges;
}

/** The line that leaves a corner, with its edges taken away. Where walls touch in a corner only, it goes on along the other one. */
function followed(edges: Uint8Array, start: number, stride: number) {
  const line: Point[] = [];
  const leave = (corner: number, direction: number) => {
    edges[corner] = (edges[corner] ?? 0) & ~(1 << direction);
  };
  const has = (corner: number, direction: number) => ((edges[corner] ?? 0) & (1 << direction)) !== 0;
  let corner = start;
  let direction = [0, 1, 2, 3].find((each) => has(start, each));
  while (direction !== undefined) {
    line.push([corner % stride, Math.floor(corner / stride)]);
    leave(corner, direction);
    const [dx, dy] = DIRECTIONS[direction] as Point;
    corner += dx + dy * stride;
    const came = direction;
    direction = corner === start ? undefined : [3, 0, 1].map((turn) => (came + turn) % 4).find((to) => has(corner, to));
  }
  return line;
}

/** Douglas and Peucker 1973, between two corners that stay. */
export function simplified(line: Point[], tolerance: number) {
  const first = line[0] as Point;
  const distances = line.map(([x, y]) => Math.hypot(x - first[0], y - first[1]));
  const furthest = distances.indexOf(distances.reduce((a, b) => Math.max(a, b), 0));
  const closed = [...line, first];
  const isKept = new Uint8Array(closed.length);
  const ranges: [number, number][] = [
    [0, furthest],
    [furthest, closed.length - 1],
  ];
  for (let range = ranges.pop(); range; range = ranges.pop()) {
    const [from, to] = range;
    isKept[from] = 1;
    const [split, distance] = furthestFrom(closed, from, to);
    if (distance > tolerance) ranges.push([from, split], [split, to]);
  }
  return line.filter((_, index) => isKept[index] === 1);
}

/** The point between two of a line that lies furthest from the straight line between them, and how far. */
function furthestFrom(line: Point[], from: number, to: number): [number, number] {
  const [[x0, y0], [x1, y1]] = [line[from] as Point, line[to] as Point];
  const length = Math.hypot(x1 - x0, y1 - y0) || 1;
  let [index, largest] = [from, 0];
  for (let between = from + 1; between < to; between++) {
    const [x, y] = line[between] as Point;
    const distance = Math.abs((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)) / length;
    if (distance > largest) [index, largest] = [between, distance];
  }
  return [index, largest];
}
