/** The parts that the flat maps have in common: the canvas with words for those who do not see it, readout and buttons. */
import { html, nothing, type TemplateResult } from 'lit';
import { formatFixed } from '../views/format.js';
import { ZOOM_STEP } from '../views/map-keys.js';
import { mapButton, mapFrame, mapToolbar } from './map-toolbar.js';

export interface FlatMap {
  /** What is on the map, in words. */
  description: string;
  /** Under the pointer (m), if it is on the map. */
  world: { x: number; y: number } | null;
  /** What else is under it. */
  readout?: unknown;
  zoomBy: (factor: number) => void;
  fit: () => void;
  turnByQuarter: () => void;
  /** Buttons that this map alone has. */
  own?: unknown;
  onKey: (event: KeyboardEvent) => void;
  /** The list of what is drawn, while it is open. */
  layers: TemplateResult | null;
  toggleLayers: () => void;
  /** Below the map. */
  after?: unknown;
}

/** `styles`: mapStyles. */
export function flatMap(map: FlatMap): TemplateResult {
  const { description, world, readout = nothing, layers, toggleLayers, after = nothing } = map;
  return mapFrame({
    describedBy: 'map-description map-keys',
    onKey: map.onKey,
    stage: html`<canvas aria-hidden="true"></canvas>
      <p id="map-description" class="visually-hidden">${description}</p>
      <p id="map-keys" class="visually-hidden">
        Arrow keys move the map, plus and minus zoom, F shows all of it, R turns it, comma and full stop select the scan
        before and after.
      </p>`,
    over: html`<div class="readout number" aria-hidden="true" ?hidden=${!world}>
        ${world && html`<span>x ${formatFixed(world.x, 2)} m</span><span>y ${formatFixed(world.y, 2)} m</span>${readout}`}
      </div>
      ${mapToolbar({
        zoom: (direction) => map.zoomBy(ZOOM_STEP ** direction),
        fit: map.fit,
        own: html`${mapButton('turn', 'Rotate the map by 90°', 'Rotate by 90° (R)', map.turnByQuarter)}${map.own ?? nothing}`,
        hasLayers: layers !== null,
        layersHint: 'Layers',
        toggleLayers,
      })}`,
    layers,
    toggleLayers,
    after,
  });
}
