/** A depth image from above, with a scale in metres, by which the user decides between several depth scales. */
import { svg, type SVGTemplateResult } from 'lit';
import type { TopView } from '../engine/spatial-protocol.js';

/** Drawn size, in units of the picture. */
const WIDTH = 150;
const HEIGHT = 112;
/** Spacings of the lines (m); the one that gives three to six lines is used. */
const SPACINGS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

/** `image`: what `paintTopView` made of the view. */
export function topView(view: TopView, image: string, depth_scale: number): SVGTemplateResult {
  const far = (view.rows * view.cell) / depth_scale;
  const spacing = SPACINGS.find((metres) => far / metres <= 5) ?? far;
  const marks = Array.from({ length: Math.floor(far / spacing) }, (_, i) => (i + 1) * spacing);
  const y = (metres: number): number => HEIGHT * (1 - metres / far);
  return svg`<svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label=${`From above, surfaces up to ${words(view.far / depth_scale)} away`}>
    <image href=${image} width=${WIDTH} height=${HEIGHT} preserveAspectRatio="none" />
    ${marks.map(
      (metres) => svg`<line x1="0" x2=${WIDTH} y1=${y(metres)} y2=${y(metres)} />
        <text x="3" y=${y(metres) + 10}>${words(metres)}</text>`,
    )}
    <path d=${`M${WIDTH / 2 - 5} ${HEIGHT}h10l-5 -9z`} />
  </svg>`;
}

function words(metres: number): string {
  return `${Number(metres.toPrecision(metres < 1 ? 1 : 2))}\u202fm`;
}

/** The view's surfaces as a picture, dense ones dark (on a light page) or bright. */
export function paintTopView({ columns, rows, density }: TopView, isDark: boolean): string {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext('2d');
  if (!context) return '';
  const image = context.createImageData(columns, rows);
  const [red, green, blue] = isDark ? [138, 176, 255] : [35, 86, 199];
  density.forEach((value, i) => image.data.set([red, green, blue, value], 4 * i));
  context.putImageData(image, 0, 0);
  return canvas.toDataURL();
}
