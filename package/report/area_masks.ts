/**
 * Masks of nav2's costmap filters from areas that a file keeps: where a robot must not go, and where it goes slower. The values are those
 * of nav2's keepout filter (type 0: base 0, multiplier 1) and speed filter (type 1, per cent: base 100, multiplier -1).
 */
import { object, parsed, show } from './checked_json.js';
import type { Grid, Point } from './wall_lines.js';

/** Raised when an older reader could not use what a newer writer keeps. */
const VERSION = 1;

/** A polygon in the world of the map (m). */
export type Area = { polygon: Point[] } & ({ kind: 'keepout' } | { kind: 'speed'; percent: number });

/** Reads a file of areas; throws an Error whose message says what is wrong with it. */
export function readAreas(text: string): Area[] {
  const { scanstitch_areas: version, areas } = object(parsed(text, 'file of areas'), 'the file');
  if (version === undefined) throw new Error('This is no file of areas: it has no "scanstitch_areas"');
  if (version !== VERSION)
    throw new Error(`These areas are of version ${show(version)}; this program reads ${VERSION}`);
  if (!Array.isArray(areas)) throw new Error('It has no list of "areas"');
  return areas.map((area, index) => readArea(area, `Area ${index + 1}`));
}

function readArea(value: unknown, where: string): Area {
  const { kind, percent, polygon, ...others } = object(value, where);
  const [unknown] = Object.keys(others);
  if (unknown !== undefined) throw new Error(`${where} has ${show(unknown)}, which no area has`);
  if (!Array.isArray(polygon) || polygon.length < 3)
    throw new Error(`${where}: "polygon" is a list of three points or more, not ${show(polygon)}`);
  const points = polygon.map((point: unknown) => readPoint(point, where));
  if (kind === 'keepout' && percent === undefined) return { kind, polygon: points };
  if (kind !== 'speed') throw new Error(`${where}: "kind" is keepout, without "percent", or speed, not ${show(kind)}`);
  // Of 0 nav2 makes no limit at all.
  if (typeof percent === 'number' && Number.isInteger(percent) && percent >= 1 && percent <= 99)
    return { kind, percent, polygon: points };
  throw new Error(`${where}: "percent" of the speed is a whole number from 1 to 99, not ${show(percent)}`);
}

function readPoint(value: unknown, where: string): Point {
  const [x, y, ...others] = Array.isArray(value) ? (value as unknown[]) : [];
  const isCoordinate = (coordinate: unknown) => typeof coordinate === 'number' && Number.isFinite(coordinate);
  if (isCoordinate(x) && isCoordinate(y) && others.length === 0) return [x as number, y as number];
  throw new Error(`${where}: a point of "polygon" is [x, y] in metres, not ${show(value)}`);
}

/**
 * The files of the masks that areas ask for, by their names.
 * @param complain told of areas that hold the middle of no cell
 */
export function maskFiles(grid: Grid, areas: readonly Area[], complain: (problem: string) => void) {
  const values = { keepout: new Uint8Array(grid.width * grid.height), speed: new Uint8Array(grid.width * grid.height) };
  areas.forEach((area, index) => {
    const [mask, value] = [values[area.kind], area.kind === 'keepout' ? 100 : 100 - area.percent];
    const cells = cellsIn(grid, area.polygon);
    // Where speeds overlap, the lower one holds.
    for (const cell of cells) mask[cell] = Math.max(mask[cell] ?? 0, value);
    if (cells.length === 0) complain(`Area ${index + 1} holds no cell of the map.`);
  });
  const files: Record<string, Uint8Array | string> = {};
  for (const kind of ['keepout', 'speed'] as const) {
    if (!areas.some((area) => area.kind === kind)) continue;
    files[`${kind}_mask.pgm`] = pgm(grid, values[kind]);
    files[`${kind}_mask.yaml`] = yaml(grid, kind);
  }
  return files;
}

/** The cells whose middles lie in a polygon (even-odd), as indices row by row from the top. */
function cellsIn({ width, height, resolution, origin, yaw }: Grid, polygon: readonly Point[]) {
  const [x0 = 0, y0 = 0] = origin;
  const [sin, cos] = [Math.sin(yaw), Math.cos(yaw)];
  const inCells = ([x, y]: Point): Point => [
    (cos * (x - x0) + sin * (y - y0)) / resolution,
    (cos * (y - y0) - sin * (x - x0)) / resolution,
  ];
  const corners = polygon.map(inCells);
  const cells: number[] = [];
  for (let row = 0; row < height; row++) {
    const crossings = crossingsAt(corners, row + 0.5);
    for (let pair = 0; pair + 1 < crossings.length; pair += 2) {
      const [from = 0, to = 0] = crossings.slice(pair, pair + 2);
      const last = Math.min(Math.ceil(to - 0.5), width);
      for (let x = Math.max(Math.ceil(from - 0.5), 0); x < last; x++) cells.push((height - 1 - row) * width + x);
    }
  }
  return cells;
}

/** Where the sides of a polygon cross a line along x, ascending. */
function crossingsAt(corners: readonly Point[], y: number) {
  const crossings = corners.flatMap((from, index) => {
    const to = corners[(index + 1) % corners.length] as Point;
    if (from[1] > y === to[1] > y) return [];
    return [from[0] + ((y - from[1]) / (to[1] - from[1])) * (to[0] - from[0])];
  });
  return crossings.sort((a, b) => a - b);
}

/** Per cent as greys: map_server reads them back, rounded, as 100 * (255 - grey) / 255. */
function pgm({ width, height }: Grid, values: Uint8Array) {
  const header = new TextEncoder().encode(`P5\n${width} ${height}\n255\n`);
  const file = new Uint8Array(header.length + values.length);
  file.set(header);
  file.set(
    values.map((value) => Math.round(255 - 2.55 * value)),
    header.length,
  );
  return file;
}

/** As nav2's own masks have them: a keepout mask has two values, a speed mask all between. */
function yaml({ resolution, origin, yaw }: Grid, kind: Area['kind']) {
  const [mode, occupied, free] = kind === 'keepout' ? ['trinary', 0.65, 0.196] : ['scale', '1.0', '0.0'];
  const number = (value: number) => Number(value.toFixed(9));
  return `image: ${kind}_mask.pgm
mode: ${mode}
resolution: ${number(resolution)}
origin: [${[...origin, yaw].map(number).join(', ')}]
negate: 0
occupied_thresh: ${occupied}
free_thresh: ${free}
`;
}
