/** The cost over two unknowns as a figure: heat map, lines of equal cost, the path of the iterations, the minima. */
import type { Painter } from '../drawing/figure-view.js';
import { type Area, type Axis, type Colors, drawAxes, linearAxis, type Range } from '../views/axes.js';
import { contour } from '../views/contours.js';
import { plotArea, type Size } from '../views/figures.js';
import { DEGREES, plural } from '../views/format.js';
import { cssColor, frameColor, type Rgb } from '../views/palette.js';
import type { Pen } from '../views/pen.js';
import { offsetsOfNode } from './grids.js';
import type { Grid, LocalMinimum } from './protocol.js';

export interface Landscape {
  grid: Grid;
  /** Row by row; NaN where no pair counts, or where it is not known yet. */
  costs: Float64Array;
  /** The most prominent first. */
  minima: readonly LocalMinimum[];
  /** Share of the rows that are known. */
  progress: number;
  milliseconds: number;
}

/** What lies over the heat map. */
export interface LandscapeMarks {
  /** Offsets of poses in the two unknowns, one after the other. */
  path: readonly (readonly [number, number])[];
  current: readonly [number, number];
  names: readonly [string, string];
  /** Whether each of the unknowns is an angle. */
  turns: readonly [boolean, boolean];
}

const NUM_LEVELS = 11;
/** Minima that are less prominent than this share of the highest are ripples of the sampling. */
const LEAST_PROMINENCE = 0.01;

export const seenMinima = ({ minima }: Landscape): readonly LocalMinimum[] => {
  const highest = minima[0]?.prominence ?? 0;
  return minima.filter(({ prominence }) => prominence >= LEAST_PROMINENCE * highest);
};

/** On the edge of the grid, where the cost may fall further outside: no minimum is shown by that. */
export function isAtEdge({ grid: { size } }: Landscape, { column, row }: LocalMinimum): boolean {
  const [columns = 1, rows = 1] = size;
  return column === 0 || row === 0 || column === columns - 1 || row === rows - 1;
}

/** "2 local minima", without those at the edge. */
export const minimaWords = (landscape: Landscape): string =>
  plural(seenMinima(landscape).filter((one) => !isAtEdge(landscape, one)).length, 'local minimum', 'local minima');

export function landscapePainter(landscape: Landscape, marks: LandscapeMarks, colors: Colors, dark: boolean): Painter {
  const picture = heatMap(landscape, dark);
  const lines = contourLines(landscape);
  return (pen, size) =>
    drawGrid(pen, size, landscape.grid, picture, marks, colors, ({ area, cell: [w, h], place }) => {
      const level = { color: dark ? '#ffffff66' : '#00000055', width: 0.8 };
      pen.segments(
        lines.map((v, i) => (i % 2 === 0 ? area.x + v * w : area.y + area.height - v * h)),
        level,
      );
      drawPath(pen, marks, colors, place);
      pen.dots(marks.path.flatMap(place), 2, colors.selected);
      for (const [i, minimum] of seenMinima(landscape).entries()) {
        const at = place(pair(offsetsOfNode(landscape.grid, [minimum.column, minimum.row])));
        pen.circle(
          ...at,
          i === 0 ? 6 : 4.5,
          i === 0 ? colors.text : colors.background,
          i === 0 ? colors.background : colors.text,
        );
      }
    });
}

/** Where a grid is drawn: its area, the size of a cell, and the place of offsets in the two unknowns. */
interface GridPlaces {
  area: Area;
  cell: readonly [number, number];
  place(offsets: readonly [number, number]): [number, number];
}

/** The axes, the picture of a grid, what `draw` puts over it, and the present pose. */
export function drawGrid(
  pen: Pen,
  size: Size,
  grid: Grid,
  picture: HTMLCanvasElement,
  marks: LandscapeMarks,
  colors: Colors,
  draw: (places: GridPlaces) => void,
): void {
  const { area, x, y } = mapAxes(grid, marks.turns, size);
  const place = ([a, b]: readonly [number, number]): [number, number] => [
    area.x + area.width * x.share(onScreen(a, marks.turns[0])),
    area.y + area.height * (1 - y.share(onScreen(b, marks.turns[1]))),
  ];
  drawAxes(pen, area, x, y, { x: marks.names[0], y: marks.names[1] }, colors);
  pen.inside(area.x, area.y, area.width, area.height, () => {
    // Nodes stand at the ends of the axes: the outer cells reach half a cell beyond.
    const [columns = 1, rows = 1] = grid.size;
    const [w, h] = [area.width / Math.max(columns - 1, 1), area.height / Math.max(rows - 1, 1)];
    pen.picture(area.x - w / 2, area.y - h / 2, area.width + w, area.height + h, picture);
    draw({ area, cell: [w, h], place });
    pen.circle(...place(marks.current), 5, colors.selected, colors.background);
  });
}

/** The path of the iterations, with a rim. */
export function drawPath(pen: Pen, { path }: LandscapeMarks, colors: Colors, place: GridPlaces['place']): void {
  const points = path.flatMap(place);
  pen.line(points, { color: colors.background, width: 4 });
  pen.line(points, { color: colors.selected, width: 1.75 });
}

/** The values of the two unknowns at a position in the figure; null outside. */
export function offsetsAt(grid: Grid, size: Size, at: { x: number; y: number }): [number, number] | null {
  const area = plotArea(size);
  const [u, v] = [(at.x - area.x) / area.width, 1 - (at.y - area.y) / area.height];
  if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return null;
  return [(2 * u - 1) * (grid.half_widths[0] ?? 0), (2 * v - 1) * (grid.half_widths[1] ?? 0)];
}

export function mapAxes(grid: Grid, turns: readonly [boolean, boolean], size: Size): { area: Area; x: Axis; y: Axis } {
  const range = (i: 0 | 1): Range => {
    const half = onScreen(grid.half_widths[i] ?? 1, turns[i]);
    return { low: -half, high: half };
  };
  return { area: plotArea(size), x: linearAxis(range(0)), y: linearAxis(range(1)) };
}

export const pair = ([a = 0, b = 0]: readonly number[]): [number, number] => [a, b];

const onScreen = (value: number, isTurn: boolean): number => (isTurn ? value * DEGREES : value);

/** The lowest and the highest cost (m²). */
export function costRange({ costs }: Landscape): Range {
  const known = costs.filter((cost) => !Number.isNaN(cost)).sort();
  return { low: known[0] ?? 0, high: known.at(-1) ?? 1 };
}

/** Square roots of the shares between the lowest and the highest, so that flat valleys show as well. */
function shareOf(landscape: Landscape): (cost: number) => number {
  const { low, high } = costRange(landscape);
  return (cost) => Math.sqrt(Math.max(cost - low, 0) / Math.max(high - low, Number.MIN_VALUE));
}

function heatMap(landscape: Landscape, dark: boolean): HTMLCanvasElement {
  const { grid, costs } = landscape;
  const share = shareOf(landscape);
  const ramp = Array.from({ length: 256 }, (_, i) => frameColor(i / 255, dark));
  return gridPicture(grid, (node) => {
    const cost = costs[node] ?? Number.NaN;
    return Number.isNaN(cost) ? null : (ramp[Math.round(255 * share(cost))] ?? [0, 0, 0]);
  });
}

/** A pixel for each node of the first two unknowns; null leaves it clear. */
export function gridPicture({ size }: Grid, colorOf: (node: number) => Rgb | null): HTMLCanvasElement {
  const [width = 1, height = 1] = size;
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext('2d');
  if (!context) return canvas;
  const image = context.createImageData(width, height);
  for (let node = 0; node < width * height; node++) {
    const color = colorOf(node);
    // The first row is the lowest.
    const at = (height - 1 - Math.floor(node / width)) * width + (node % width);
    if (color) image.data.set([...color, 255], 4 * at);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

/** Lines at equal steps of the share that is coloured. */
function contourLines(landscape: Landscape): number[] {
  const [width = 1] = landscape.grid.size;
  const share = shareOf(landscape);
  const shares = landscape.costs.map(share);
  return Array.from({ length: NUM_LEVELS }, (_, i) => contour(shares, width, (i + 1) / (NUM_LEVELS + 1))).flat();
}

/** The ramp of the heat map, for a legend. */
export const rampStops = (dark: boolean): string =>
  Array.from({ length: 12 }, (_, i) => cssColor(frameColor(i / 11, dark))).join(', ');
