/** A map for drawings and maps of the world: its walls as DXF and SVG, and the world file of its picture. */
import { type Grid, inWorld, type Point } from './wall_lines.js';

/** AutoCAD's drawing interchange format, release 12, in metres: closed polylines on a layer of their own. */
export function dxf(lines: readonly Point[][]) {
  const header = [0, 'SECTION', 2, 'HEADER', 9, '$ACADVER', 1, 'AC1009', 9, '$INSUNITS', 70, 6, 0, 'ENDSEC'];
  const vertex = ([x, y]: Point) => [0, 'VERTEX', 8, 'WALLS', 10, metres(x), 20, metres(y), 30, '0.0'];
  const polyline = (line: Point[]) => [
    ...[0, 'POLYLINE', 8, 'WALLS', 66, 1, 70, 1, 10, '0.0', 20, '0.0', 30, '0.0'],
    ...line.flatMap(vertex),
    ...[0, 'SEQEND', 8, 'WALLS'],
  ];
  const entities = [0, 'SECTION', 2, 'ENTITIES', ...lines.flatMap(polyline), 0, 'ENDSEC', 0, 'EOF'];
  return `${[...header, ...entities].join('\n')}\n`;
}

/** Walls filled, at their size; a unit of the drawing is a metre. */
export function svg(lines: readonly Point[][]) {
  let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const [x, y] of lines.flat()) {
    [left, right, low, high] = [Math.min(left, x), Math.max(right, x), Math.min(low, y), Math.max(high, y)];
  }
  const [width, height] = lines.length > 0 ? [right - left, high - low] : [0, 0];
  const box = [lines.length > 0 ? left : 0, lines.length > 0 ? -high : 0, width, height].map(metres).join(' ');
  const path = (line: Point[]) => `M${line.map(([x, y]) => `${metres(x)} ${metres(-y)}`).join('L')}Z`;
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${(1000 * width).toFixed(0)}mm" height="${(1000 * height).toFixed(0)}mm" viewBox="${box}">
<path fill-rule="evenodd" d="${lines.map(path).join('\n')}"/>
</svg>
`;
}

/** Six lines: the side of a pixel and its turn, and the middle of the upper left pixel (ESRI). */
export function worldFile(grid: Omit<Grid, 'grey_values'>) {
  return worldLines(grid.resolution, grid.yaw, inWorld(grid, [0.5, grid.height - 0.5]));
}

/** The same of any picture: side of a pixel (m), turn (rad, counter-clockwise), middle of the upper left pixel (m). */
export function worldLines(pixel: number, turn: number, middle: readonly number[]) {
  const [along, down] = [pixel * Math.cos(turn), pixel * Math.sin(turn)];
  return `${[along, down, down, -along, ...middle].map((value) => value.toFixed(9)).join('\n')}\n`;
}

function metres(value: number) {
  return value.toFixed(4);
}
