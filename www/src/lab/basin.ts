/** Starts coloured by where they end, as a figure. */
import type { Painter } from '../components/figure-view.js';
import { type Colors, drawAxes } from '../views/axes.js';
import type { Size } from '../views/figures.js';
import { DEGREES, formatLength, formatAngle } from '../views/format.js';
import type { LandscapeMarks } from './landscape.js';
import { mapAxes } from './landscape.js';
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
  return (pen, size: Size) => {
    const { area, x, y } = mapAxes(basin.grid, marks.turns, size);
    drawAxes(pen, area, x, y, { x: marks.names[0], y: marks.names[1] }, colors);
    pen.inside(area.x, area.y, area.width, area.height, () => {
      const [columns = 1, rows = 1] = basin.grid.size;
      const [w, h] = [area.width / Math.max(columns - 1, 1), area.height / Math.max(rows - 1, 1)];
      pen.picture(area.x - w / 2, area.y - h / 2, area.width + w, area.height + h, picture);
      const place = ([a, b]: readonly [number, number]): [number, number] => [
        area.x + area.width * x.share(marks.turns[0] ? a * DEGREES : a),
        area.y + area.height * (1 - y.share(marks.turns[1] ? b * DEGREES : b)),
      ];
      const path = marks.path.flatMap(place);
      pen.line(path, { color: colors.background, width: 3.5 });
      pen.line(path, { color: colors.selected, width: 1.5 });
      pen.circle(...place(marks.current), 5, colors.selected, colors.background);
    });
  };
}

function layerPicture({ grid, index, labels }: Basin, layer: number, dark: boolean): HTMLCanvasElement {
  const [width = 1, height = 1] = grid.size;
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext('2d');
  if (!context) return canvas;
  const image = context.createImageData(width, height);
  for (let i = 0; i < width * height; i++) {
    const end = index[layer * width * height + i] ?? -1;
    if (end < 0) continue;
    const color = labelColor(labels.labels[end] ?? -1, dark);
    const at = (height - 1 - Math.floor(i / width)) * width + (i % width);
    image.data.set([...color, 255], 4 * at);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

/** "0.82 m, 12°": how far a minimum lies from the reference. */
export const awayWords = ({ translation, rotation }: { translation: number; rotation: number }): string =>
  `${formatLength(translation)}, ${formatAngle(rotation, 1)}`;
