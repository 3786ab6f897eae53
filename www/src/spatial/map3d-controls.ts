/** What lies over the map in space alone: the section's slider, the readout, its own buttons and what is drawn. */
import { html, nothing, svg, type TemplateResult } from 'lit';
import { slider, typed } from '../components/fields.js';
import { list } from '../components/list-field.js';
import { layerBox, layerList, mapButton } from '../drawing/map-toolbar.js';
import { baseName, formatFixed } from '../views/format.js';
import { cssColor } from '../views/palette.js';
import { roundedDown } from '../views/viewport.js';
import type { GraphicsState } from '../drawing/graphics.js';
import type { Heights } from './leveling.js';
import { COLOR_MODES, chosenMode, type LookChoices, ramp } from './look.js';
import type { ColorMode } from './point-cloud.js';
import type { LayerName } from './scene.js';

const FROM_ABOVE = svg`<path d="M1.8 6.3C3.5 3.9 5.5 2.7 8 2.7s4.5 1.2 6.2 3.6C12.5 8.7 10.5 9.9 8 9.9S3.5 8.7 1.8 6.3z" /><circle cx="8" cy="6.3" r="1.4" /><path d="M2.5 13.2h11" />`;
const TOOLS = svg`<path d="M8 4.2v4.2M8 8.4l-2.4 5M8 8.4l2.4 5M4.9 6.6 8 5.4l3.1 1.2" /><circle cx="8" cy="2.6" r="1.3" />`;
const FLAT = svg`<path d="M3 4.5h10v7H3zM3 8h10M8 4.5v7" />`;

/** For those who do not see the map. */
export const KEY_HELP = html`<p id="map-keys" class="visually-hidden">
  Arrow keys turn the map, with Shift they move it, plus and minus zoom, F shows all of it, T looks from above, P
  changes between perspective and plan, M makes the surface or changes between it and the points, V offers to walk, to
  measure and to cut, comma and full stop select the frame before and after.
</p>`;

/** Above the first camera, m: the heights there are, and where the map is cut. */
export interface Section {
  heights: Heights;
  cut: number;
}

/** The slider of the section's height; nothing where there is little to cut. */
export function sectionSlider(
  { heights, cut }: Section,
  onCut: (height: number) => void,
): TemplateResult | typeof nothing {
  const { floor, top } = heights;
  if (top - floor < 0.3) return nothing;
  const words = cut >= top ? 'no cut' : `${formatFixed(cut - floor, 2)} m`;
  return html`<div class="section">
    <span aria-hidden="true">ceiling</span>
    <input
      type="range"
      min=${floor.toFixed(2)}
      max=${(top + 0.05).toFixed(2)}
      step="0.05"
      .value=${String(Math.min(cut, top + 0.05))}
      aria-label="Section height: what is above is cut away"
      aria-valuetext=${cut >= top ? 'nothing is cut away' : `${formatFixed(cut - floor, 2)} m above the floor`}
      title="What lies above is cut away"
      @input=${(event: Event) => onCut(Number(typed(event)))}
    />
    <output class="number" aria-hidden="true">${words}</output>
  </div>`;
}

/** In the corner: the frame under the pointer, what the colours mean, and the scale. */
export function readout(
  { heights, cut }: Section,
  {
    hovered,
    mode,
    dark,
    metresPerPixel,
  }: { hovered: string | null; mode: ColorMode; dark: boolean; metresPerPixel: number },
): TemplateResult {
  const metres = roundedDown(Math.max(110 * metresPerPixel, 1e-3));
  const { floor, top } = heights;
  const stops = ramp(dark)
    .filter((_, i) => i % 7 === 0)
    .map((color) => cssColor(color));
  return html`<div class="corner" aria-hidden="true">
    ${hovered === null ? nothing : html`<span class="hovered">${baseName(hovered)}</span>`}
    ${
      (mode === 'height' && top > floor) || mode === 'frame'
        ? html`<span class="legend number">
            <span>${mode === 'height' ? '0 m' : 'first'}</span>
            <i style="background: linear-gradient(to right, ${stops.join(', ')})"></i>
            <span>${mode === 'height' ? `${formatFixed(Math.min(cut, top) - floor, 1)} m` : 'last'}</span>
          </span>`
        : nothing
    }
    <span class="scale number" style="width: calc(${(metres / metresPerPixel).toFixed(1)} * var(--px))"
      >${metres} m</span
    >
  </div>`;
}

/** What is said in the map's place where nothing can be drawn. */
export function graphicsNotice(state: GraphicsState, retry: () => void): TemplateResult | typeof nothing {
  if (state === 'there' || state === 'starting') return nothing;
  return html`<div class="notice" role="status">
    ${
      state === 'lost'
        ? 'The graphics context was lost. The map is being redrawn; nothing computed is lost.'
        : html`This browser does not support 3D graphics (WebGL 2), so the map cannot be drawn. Everything else works:
            figures, table, exports. <button @click=${retry}>Try again</button>`
    }
  </div>`;
}

/** What the map in space can do that the flat one cannot. */
export function ownButtons({
  isFlat,
  hasTools,
  fromAbove,
  toggleProjection,
  toggleTools,
}: {
  isFlat: boolean;
  hasTools: boolean;
  fromAbove: () => void;
  toggleProjection: () => void;
  toggleTools: () => void;
}): TemplateResult {
  return html`${mapButton(FROM_ABOVE, 'View from above', 'View from above (T)', fromAbove)}
  ${mapButton(FLAT, 'Orthographic view', 'Orthographic view (P)', toggleProjection, { pressed: isFlat })}
  ${mapButton(TOOLS, 'Walk, measure, cut', 'Walk, camera’s path, measure, section (V)', toggleTools, { expanded: hasTools })}`;
}

/** Layers and how, and what is to change. */
export interface LayersState {
  choices: LookChoices;
  hasColors: boolean;
  /** m. */
  voxel_size: number;
  /** Side of the floor's squares, m. */
  gridStep: number;
  /** Name of the reference file; null: there is none. */
  referenceName: string | null;
  hasCameras: boolean;
  choose: (change: Partial<LookChoices>) => void;
}

export function layers({ choices, choose, ...has }: LayersState): TemplateResult {
  const { shows, sizeFactor } = choices;
  const layer = (name: LayerName, label: string, sign: string): TemplateResult =>
    layerBox(label, sign, shows[name], (shown) => choose({ shows: { ...shows, [name]: shown } }));
  const chosen = chosenMode(choices, has.hasColors);
  const size = `${formatFixed(sizeFactor * has.voxel_size * 100, 1)} cm`;
  const modes = COLOR_MODES.filter(([mode]) => has.hasColors || mode !== 'image');
  return layerList(html`
    <label class="row">Colour ${list(modes, chosen, (mode) => choose({ mode }))}</label>
    <label class="row"
      >Point size
      ${slider(sizeFactor, { min: 0.4, max: 4, step: 0.1, words: size }, (factor) => choose({ sizeFactor: factor }))}
    </label>
    ${layer('points', 'Points', 'dots')} ${layer('estimate', 'Estimated path', 'estimate')}
    ${has.referenceName === null ? nothing : layer('reference', `Ground truth: ${baseName(has.referenceName)}`, 'reference')}
    ${has.hasCameras ? layer('cameras', 'Cameras', 'cameras') : nothing}
    ${layer('grid', `Grid of ${has.gridStep} m`, 'grid')}
  `);
}
