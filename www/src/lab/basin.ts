/** Starts coloured by where they end, as a figure. */
import type { Painter } from '../drawing/figure-view.js';
import type { Colors } from '../views/axes.js';
import { formatLength } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { drawGrid, drawPath, gridPicture, type LandscapeMarks } from './landscape.js';
import type { Basin } from './survey.js';
import type { Rgb } from '../views/palette.js';

/**
 * The reference minimum, then the other minima in turn; starts that do not converge are grey. Okabe and Ito's hues, which can be
 * distinguished with every colour vision.
 */
const ON_LIGHT: readonly Rgb[] = [
  [0, 114, 178],
  [230, 159, 0],
  [204, 121, 167],
  [0, 158, 115],
  [213, 94, 0],
  [240, 228, 66],
];
const ON_DARK: readonly Rgb[] = [
  [86, 180, 233],
  [230, 159, 0],
  [217, 136, 183],
  [47, 192, 143],
  [240, 121, 61],
  [240, 228, 66],
];
const NOT_CONVERGED: Record<'light' | 'dark', Rgb> = { light: [176, 184, 194], dark: [84, 94, 107] };

export function labelColor(label: number, dark: boolean): Rgb {
  if (label < 0) return NOT_CONVERGED[dark ? 'dark' : 'light'];
  const colors = dark ? ON_DARK : ON_LIGHT;
  // The first colour is kept for the reference minimum.
  return colors[label === 0 ? 0 : 1 + ((label - 1) % (colors.length - 1))] ?? [0, 0, 0];
}

/** `layer`: of the third unknown. */
export function basinPainter(
  basin: Basin,
  layer: number,
  marks: LandscapeMarks,
  colors: Colors,
  dark: boolean,
): Painter {
  const picture = layerPicture(basin, layer, dark);
  return (pen, size) =>
    drawGrid(pen, size, basin.grid, picture, marks, colors, ({ place }) => drawPath(pen, marks, colors, place));
}

function layerPicture({ grid, index, labels }: Basin, layer: number, dark: boolean): HTMLCanvasElement {
  const [width = 1, height = 1] = grid.size;
  return gridPicture(grid, (node) => {
    const end = index[layer * width * height + node] ?? -1;
    return end < 0 ? null : labelColor(labels.labels[end] ?? -1, dark);
  });
}

/** "0.82 m, 12°": how far a minimum lies from the reference. */
export const awayWords = ({ translation, rotation }: { translation: number; rotation: number }): string =>
  `${formatLength(translation)}, ${formatAngle(rotation, 1)}`;
