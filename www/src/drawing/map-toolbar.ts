/** What lies over the flat map and over the map in space alike: the buttons, and the list of what is drawn. */
import { html, nothing, type TemplateResult } from 'lit';
import { check } from '../components/fields.js';
import { type IconButton, iconButton } from '../components/icon-button.js';

/** A button on a map. */
export const mapButton = (
  sign: Parameters<typeof iconButton>[0],
  label: string,
  hint: string,
  press: () => void,
  state: IconButton = {},
): TemplateResult => iconButton(sign, label, press, { hint, kind: '', ...state });

export interface MapToolbar {
  /** In, or out. */
  zoom: (direction: 1 | -1) => void;
  fit: () => void;
  /** Buttons that this map alone has. */
  own: unknown;
  /** Whether the list of what is drawn is open. */
  hasLayers: boolean;
  /** What that list is for. */
  layersHint: string;
  toggleLayers: () => void;
}

/** `styles`: mapStyles. */
export function mapToolbar({ zoom, fit, own, hasLayers, layersHint, toggleLayers }: MapToolbar): TemplateResult {
  return html`<div class="controls" role="toolbar" aria-label="Map view">
    ${mapButton('plus', 'Zoom in', 'Zoom in (+)', () => zoom(1))}
    ${mapButton('minus', 'Zoom out', 'Zoom out (−)', () => zoom(-1))}
    ${mapButton('fit', 'Show the whole map', 'Show the whole map (F)', fit)} ${own}
    ${mapButton('layers', 'Layers', layersHint, toggleLayers, { expanded: hasLayers })}
  </div>`;
}

/** Closes the list of what is drawn by Escape, wherever on the map the focus is, and gives the focus back to its button. */
function closeByEscape(event: KeyboardEvent, close: () => void): void {
  if (event.key !== 'Escape') return;
  event.stopPropagation();
  event.preventDefault();
  close();
  const root = (event.currentTarget as Element).getRootNode() as ShadowRoot;
  root.querySelector<HTMLElement>('.controls [aria-expanded]')?.focus();
}

/** The list of what is drawn, one `layerBox` each, and what else there is to choose; beside the map, not on it. */
export function layerList(entries: unknown): TemplateResult {
  return html`<fieldset class="layers">
    <legend class="visually-hidden">Layers</legend>
    ${entries}
  </fieldset>`;
}

/** `sign`: the class of the line or dots that stand for it on the map. */
export function layerBox(
  label: string,
  sign: string,
  isShown: boolean,
  show: (shown: boolean) => void,
): TemplateResult {
  return check(html`<i class="sign ${sign}"></i>${label}`, isShown, show);
}

export interface MapFrame {
  /** Which elements describe the map. */
  describedBy: string;
  /** The canvas, and words for those who do not see it. */
  stage: unknown;
  onKey: (event: KeyboardEvent) => void;
  /** Beside the map. */
  before?: unknown;
  /** On the map. */
  over: unknown;
  /** The list of what is drawn, while it is open. */
  layers: TemplateResult | null;
  toggleLayers: () => void;
  /** Below it. */
  after: unknown;
}

/** How the parts of a map lie; Escape closes the list of what is drawn. `styles`: mapStyles. */
export function mapFrame(parts: MapFrame): TemplateResult {
  const { describedBy, stage, onKey, before = nothing, over, layers, toggleLayers, after } = parts;
  const onEscape = (event: KeyboardEvent): void => {
    if (layers) closeByEscape(event, toggleLayers);
  };
  return html`<div class="frame" @keydown=${{ handleEvent: onEscape, capture: true }}>
    ${before}
    <div class="view">
      <div class="stage" tabindex="0" role="group" aria-label="Map" aria-describedby=${describedBy} @keydown=${onKey}>
        ${stage}
      </div>
      ${over}
    </div>
    ${layers ?? nothing} ${after}
  </div>`;
}
