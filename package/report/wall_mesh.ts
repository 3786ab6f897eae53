/** The walls of a planar map, as high as a room: a mesh for pictures of a floor and for printing. */
import { type Grid, inWorld, outlines, type Point, simplified, TOLERANCE } from './wall_lines.js';
import { toGlb } from '../mesh/glb.js';

/** Height of the walls (m): that of most rooms. Planar scans do not tell it. */
export const WALL_HEIGHT = { usual: 2.5, least: 0.01, most: 100 };
export type WallFormat = 'glb' | 'stl';

/** Triangles with three vertices of their own each, counter-clockwise from outside (m, z up, the map's frame). */
type Triangles = number[];

/** A wall: its outline, and those of the rooms within it (columns and rows). */
type Wall = { outline: Point[]; holes: Point[][] };

/** The walls as a file: GLB in metres, STL in millimetres, as printers read it. Throws where there is no wall. */
export async function wallFile(grid: Grid, height: number, format: WallFormat): Promise<Uint8Array> {
  const positions = Float32Array.from(await extruded(grid, height));
  if (positions.length === 0) throw new Error('The map shows no wall');
  if (format === 'stl') return stl(positions);
  const normals = normalsOf(positions);
  return toGlb({
    positions: () => positions,
    normals: () => normals,
    colors: () => new Uint8Array(),
    triangles: () => Uint32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex),
    is_of_clouds: true,
  });
}

async function extruded(grid: Grid, height: number) {
  const { default: earcut, flatten } = await import('earcut');
  const triangles: Triangles = [];
  for (const wall of wallsOf(outlines(grid)).map(straightened)) {
    const rings = [wall.outline, ...wall.holes];
    const { vertices, holes } = flatten(rings);
    // Whole numbers, so that it sees the same corners on one line as `cornersOf`, and the faces end where the sides do.
    const faces = earcut(vertices, holes);
    const corners = rings.flat().map((corner) => inWorld(grid, corner));
    let first = 0;
    for (const { length } of rings) {
      addSides(triangles, corners.slice(first, first + length), height);
      first += length;
    }
    const face = (order: readonly number[], z: number) => {
      for (const at of order) triangles.push(...(corners[faces[at] ?? 0] as Point), z);
    };
    for (let at = 0; at < faces.length; at += 3) {
      face([at, at + 1, at + 2], height);
      face([at, at + 2, at + 1], 0);
    }
  }
  return triangles;
}

function addSides(triangles: Triangles, ring: readonly Point[], height: number) {
  ring.forEach((from, index) => {
    const to = ring[(index + 1) % ring.length] as Point;
    triangles.push(...from, 0, ...to, 0, ...to, height, ...from, 0, ...to, height, ...from, height);
  });
}

/** Outlines run counter-clockwise, holes clockwise: each belongs to the smallest outline around it. */
function wallsOf(rings: readonly Point[][]): Wall[] {
  const sized = rings.map((ring) => ({ ring, area: areaOf(ring), box: boxOf(ring) }));
  const walls = sized
    .filter(({ area }) => area > 0)
    .toSorted((a, b) => a.area - b.area)
    .map((outline) => ({ ...outline, holes: [] as Point[][] }));
  for (const { ring, area } of sized) {
    if (area > 0) continue;
    // The middle of an edge: no edge is part of two outlines.
    const [[x0, y0], [x1, y1]] = ring as [Point, Point, ...Point[]];
    const middle: Point = [(x0 + x1) / 2, (y0 + y1) / 2];
    walls.find((wall) => isInBox(wall.box, middle) && isInside(wall.ring, middle))?.holes.push(ring);
  }
  return walls.map(({ ring, holes }) => ({ outline: ring, holes }));
}

/** With lines in place of the steps of cells, unless these would meet elsewhere than at their ends. */
function straightened({ outline, holes }: Wall): Wall {
  const withTolerance = (tolerance: number): Wall => ({
    outline: cornersOf(simplified(outline, tolerance)),
    holes: holes.map((hole) => cornersOf(simplified(hole, tolerance))),
  });
  const straight = withTolerance(TOLERANCE);
  const rings = [straight.outline, ...straight.holes];
  return rings.every((ring) => ring.length > 2) && !doEdgesMeet(rings) ? straight : withTolerance(0);
}

/** Without those on a straight line between their neighbours. */
function cornersOf(ring: readonly Point[]) {
  return ring.filter(
    (corner, index) => sideOf(ring.at(index - 1) as Point, corner, ring[(index + 1) % ring.length] as Point) !== 0,
  );
}

type Edge = readonly [from: Point, to: Point];

/** Whether two edges meet elsewhere than at ends of both, or one has no length; by a sweep along x. */
function doEdgesMeet(rings: readonly Point[][]) {
  const edges = rings.flatMap((ring) =>
    ring.map((from, index): Edge => [from, ring[(index + 1) % ring.length] as Point]),
  );
  const left = ([a, b]: Edge) => Math.min(a[0], b[0]);
  const right = ([a, b]: Edge) => Math.max(a[0], b[0]);
  edges.sort((a, b) => left(a) - left(b));
  let open: Edge[] = [];
  for (const edge of edges) {
    open = open.filter((other) => right(other) >= left(edge));
    if (areSame(...edge) || open.some((other) => doMeet(edge, other))) return true;
    open.push(edge);
  }
  return false;
}

function doMeet([a, b]: Edge, [c, d]: Edge) {
  if (sideOf(a, b, c) * sideOf(a, b, d) < 0 && sideOf(c, d, a) * sideOf(c, d, b) < 0) return true;
  return isWithin([a, b], c) || isWithin([a, b], d) || isWithin([c, d], a) || isWithin([c, d], b);
}

/** Whether a point lies on an edge, between its ends. */
function isWithin([a, b]: Edge, point: Point) {
  const along = (point[0] - a[0]) * (point[0] - b[0]) + (point[1] - a[1]) * (point[1] - b[1]);
  return along < 0 && sideOf(a, b, point) === 0;
}

function areSame(a: Point, b: Point) {
  return a[0] === b[0] && a[1] === b[1];
}

/** On which side of a line a point lies: 1 left, -1 right, 0 on it. */
function sideOf(from: Point, to: Point, [x, y]: Point) {
  return Math.sign((to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]));
}

function areaOf(ring: readonly Point[]) {
  return ring.reduce((sum, [x, y], index) => {
    const [nextX, nextY] = ring[(index + 1) % ring.length] as Point;
    return sum + (x * nextY - nextX * y) / 2;
  }, 0);
}

type Box = { low: Point; high: Point };

function boxOf(ring: readonly Point[]): Box {
  let [left, low, right, high] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of ring) {
    [left, low, right, high] = [Math.min(left, x), Math.min(low, y), Math.max(right, x), Math.max(high, y)];
  }
  return { low: [left, low], high: [right, high] };
}

function isInBox({ low, high }: Box, [x, y]: Point) {
  return x >= low[0] && x <= high[0] && y >= low[1] && y <= high[1];
}

/** By how many edges a ray along x crosses. */
function isInside(ring: readonly Point[], [x, y]: Point) {
  let isOdd = false;
  ring.forEach(([x0, y0], index) => {
    const [x1, y1] = ring[(index + 1) % ring.length] as Point;
    if (y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0)) isOdd = !isOdd;
  });
  return isOdd;
}

/** Of each vertex that of its triangle. */
function normalsOf(positions: Float32Array) {
  const normals = new Float32Array(positions.length);
  for (let at = 0; at < positions.length; at += 9) {
    const normal = normalOf(positions, at);
    for (let vertex = 0; vertex < 9; vertex += 3) normals.set(normal, at + vertex);
  }
  return normals;
}

function normalOf(positions: Float32Array, at: number): [number, number, number] {
  const along = (vertex: number, axis: number) =>
    (positions[at + 3 * vertex + axis] ?? 0) - (positions[at + axis] ?? 0);
  const [ax, ay, az, bx, by, bz] = [along(1, 0), along(1, 1), along(1, 2), along(2, 0), along(2, 1), along(2, 2)];
  const [x, y, z] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
  const length = Math.hypot(x, y, z) || 1;
  return [x / length, y / length, z / length];
}

/** Stereolithography, binary, in millimetres. */
function stl(positions: Float32Array) {
  const count = positions.length / 9;
  const bytes = new Uint8Array(84 + 50 * count);
  bytes.set(new TextEncoder().encode('Walls in millimetres'));
  const view = new DataView(bytes.buffer);
  view.setUint32(80, count, true);
  for (let triangle = 0; triangle < count; triangle++) {
    const numbers = [...normalOf(positions, 9 * triangle)];
    for (let at = 0; at < 9; at++) numbers.push(1000 * (positions[9 * triangle + at] ?? 0));
    numbers.forEach((number, at) => view.setFloat32(84 + 50 * triangle + 4 * at, number, true));
  }
  return bytes;
}
