/** What lies over the map in space: the section's slider, the readout, buttons and layers. */
import { html, nothing, type TemplateResult } from 'lit';
import { icon } from '../components/icons.js';
import { baseName, formatFixed } from '../views/format.js';
import { cssColor } from '../views/palette.js';
import type { Heights } from './leveling.js';
import { COLOR_MODES, ramp } from './look.js';
import type { ColorMode } from './point-cloud.js';
import type { LayerName } from './scene.js';

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
  const words = cut >= top ? 'nothing cut' : `${formatFixed(cut - floor, 2)} m`;
  return html`<div class="section">
    <span aria-hidden="true">ceiling</span>
    <input
      type="range"
      class="upright"
      min=${floor.toFixed(2)}
      max=${(top + 0.05).toFixed(2)}
      step="0.05"
      .value=${String(Math.min(cut, top + 0.05))}
      aria-label="Section height: what is above is cut away"
      aria-valuetext=${cut >= top ? 'nothing is cut away' : `${formatFixed(cut - floor, 2)} m above the floor`}
      title="What lies above is cut away"
      @input=${(event: Event) => onCut(Number((event.target as HTMLInputElement).value))}
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
    metres_per_pixel,
  }: { hovered: string | null; mode: ColorMode; dark: boolean; metres_per_pixel: number },
): TemplateResult {
  const metres = niceLength(110 * metres_per_pixel);
  const { floor, top } = heights;
  const stops = ramp(dark)
    .filter((_, i) => i % 7 === 0)
    .map((color) => cssColor(color));
  return html`<div class="corner" aria-hidden="true">
    ${hovered === null ? nothing : html`<span class="hovered">${baseName(hovered)}</span>`}
    ${
      mode === 'height' || mode === 'frame'
        ? html`<span class="legend number">
            <span>${mode === 'height' ? '0 m' : 'first'}</span>
            <i style="background: linear-gradient(to right, ${stops.join(', ')})"></i>
            <span>${mode === 'height' ? `${formatFixed(Math.min(cut, top) - floor, 1)} m` : 'last'}</span>
          </span>`
        : nothing
    }
    <span class="scale number" style="width: ${(metres / metres_per_pixel).toFixed(1)}px">${metres} m</span>
  </div>`;
}

/** The largest of 1, 2, 5, 10, ... that is not longer. */
function niceLength(longest: number): number {
  const power = 10 ** Math.floor(Math.log10(Math.max(longest, 1e-3)));
  return Number((([5, 2, 1].find((step) => step * power <= longest) ?? 1) * power).toPrecision(1));
}

/** What the buttons show, and what they ask for. */
export interface ButtonsState {
  is_flat: boolean;
  /** What is drawn, where that is open. */
  layers: LayersState | null;
  zoom: (direction: 1 | -1) => void;
  fit: () => void;
  fromAbove: () => void;
  toggleProjection: () => void;
  toggleLayers: () => void;
}

/** The buttons beside the map. */
export function buttons(has: ButtonsState): TemplateResult {
  return html`<div class="controls" role="toolbar" aria-label="Map view">
    <button class="icon" @click=${() => has.zoom(1)} aria-label="Zoom in" title="Zoom in (+)">${icon('plus')}</button>
    <button class="icon" @click=${() => has.zoom(-1)} aria-label="Zoom out" title="Zoom out (−)">
      ${icon('minus')}
    </button>
    <button class="icon" @click=${has.fit} aria-label="Show the whole map" title="Show the whole map (F)">
      ${icon('fit')}
    </button>
    <button class="icon" @click=${has.fromAbove} aria-label="Look from above" title="Look from above (T)">
      ${icon('from_above')}
    </button>
    <button
      class="icon"
      aria-pressed=${has.is_flat}
      @click=${has.toggleProjection}
      aria-label="Plan without perspective"
      title="Plan without perspective (P)"
    >
      ${icon('flat')}
    </button>
    <button
      class="icon"
      @click=${has.toggleLayers}
      aria-label="What is drawn"
      aria-expanded=${has.layers !== null}
      title="What is drawn, and how"
    >
      ${icon('layers')}
    </button>
    ${has.layers ? layers(has.layers) : nothing}
  </div>`;
}

/** What is drawn and how, and what is to change. */
export interface LayersState {
  mode: ColorMode;
  has_colors: boolean;
  /** Of a point, in sides of a voxel. */
  size_factor: number;
  /** m. */
  voxel_size: number;
  shows: Record<LayerName, boolean>;
  /** Name of the true path's file; null: there is none. */
  reference_name: string | null;
  has_cameras: boolean;
  setMode: (mode: ColorMode) => void;
  setSize: (factor: number) => void;
  show: (name: LayerName, shown: boolean) => void;
}

function layers(has: LayersState): TemplateResult {
  const layer = (name: LayerName, label: string, sign: string): TemplateResult => html`
    <label>
      <input
        type="checkbox"
        .checked=${has.shows[name]}
        @change=${(event: Event) => has.show(name, (event.target as HTMLInputElement).checked)}
      />
      <i class="sign ${sign}"></i>${label}
    </label>
  `;
  const modes = COLOR_MODES.filter(({ mode }) => has.has_colors || mode !== 'image');
  return html`<fieldset class="layers">
    <legend class="visually-hidden">What is drawn</legend>
    <label class="row"
      >Colour
      <select @change=${(event: Event) => has.setMode((event.target as HTMLSelectElement).value as ColorMode)}>
        ${modes.map(({ mode, label }) => html`<option value=${mode} .selected=${mode === has.mode}>${label}</option>`)}
      </select>
    </label>
    <label class="row"
      >Point size
      <input
        type="range"
        min="0.4"
        max="4"
        step="0.1"
        .value=${String(has.size_factor)}
        aria-valuetext="${formatFixed(has.size_factor * has.voxel_size * 100, 1)} cm"
        @input=${(event: Event) => has.setSize(Number((event.target as HTMLInputElement).value))}
      />
    </label>
    ${layer('points', 'Points', 'dots')} ${layer('estimate', 'Estimated path', 'estimate')}
    ${has.reference_name === null ? nothing : layer('reference', `True path: ${baseName(has.reference_name)}`, 'truth')}
    ${has.has_cameras ? layer('cameras', 'Cameras', 'cameras') : nothing} ${layer('grid', 'Grid of 1 m', 'grid')}
  </fieldset>`;
}
