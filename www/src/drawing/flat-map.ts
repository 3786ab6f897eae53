/** What the flat maps have in common: the canvas with words for those who do not see it, its buttons, and how it moves. */
import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { property, query, state } from 'lit/decorators.js';
import { formatFixed } from '../views/format.js';
import { type KeyedMap, PAN_STEP, pressKey, ZOOM_STEP } from '../views/map-keys.js';
import { panned, toWorld, type Turns, type Viewport, zoomedAt } from '../views/viewport.js';
import { type DrawingHost, DrawingSurface } from './drawing-surface.js';
import { mapButton, mapFrame, mapToolbar } from './map-toolbar.js';

/** `styles`: mapStyles. */
export abstract class FlatMap extends LitElement implements DrawingHost, KeyedMap {
  /** What is on the map, in words. */
  @property({ attribute: false }) description = '';
  @property({ type: Boolean }) dark = false;

  /** Whether the list of what is drawn is open. */
  @state() private layersOpen = false;
  @state() protected pointer: { x: number; y: number } | null = null;
  @query('canvas') protected canvas!: HTMLCanvasElement;
  @query('.stage') readonly stage!: HTMLElement;

  protected view: Viewport = { centerX: 0, centerY: 0, scale: 40, turns: 0 };
  /** The user has moved the view: it is no longer fitted. */
  protected isMoved = false;
  protected surface = new DrawingSurface(this);

  abstract readonly marks: KeyedMap['marks'];
  abstract fit(): void;
  abstract resized(): void;
  abstract paint(): void;
  abstract select(frame: number | null): void;
  abstract tap(x: number, y: number, reach: number): void;
  /** Lays the map so, and shows all of it. */
  protected abstract turnTo(turns: Turns): void;
  /** The list of what is drawn. */
  protected abstract renderLayers(): TemplateResult;
  /** What is under the pointer, beside its coordinates. */
  protected renderReadout(): unknown {
    return nothing;
  }
  /** Buttons that this map alone has. */
  protected renderOwn(): unknown {
    return nothing;
  }
  /** What keys mean on this map alone. */
  protected get ownKeys(): Record<string, () => void> {
    return {};
  }
  /** Below the map. */
  protected renderAfter(): unknown {
    return nothing;
  }

  protected override firstUpdated(): void {
    this.surface.begin();
  }

  protected override render(): TemplateResult {
    const { pointer, layersOpen } = this;
    const world = pointer && this.toWorld(pointer.x, pointer.y);
    const toggleLayers = (): void => {
      this.layersOpen = !layersOpen;
    };
    return mapFrame({
      describedBy: 'map-description map-keys',
      onKey: (event) => this.onKey(event),
      stage: html`<canvas aria-hidden="true"></canvas>
        <p id="map-description" class="visually-hidden">${this.description}</p>
        <p id="map-keys" class="visually-hidden">
          Arrow keys move the map, plus and minus zoom, F shows all of it, R turns it, comma and full stop select the
          scan before and after.
        </p>`,
      over: html`<div class="readout number" aria-hidden="true" ?hidden=${!world}>
          ${world && html`<span>x ${formatFixed(world.x, 2)} m</span><span>y ${formatFixed(world.y, 2)} m</span>${this.renderReadout()}`}
        </div>
        ${mapToolbar({
          zoom: (direction) => this.zoomBy(ZOOM_STEP ** direction),
          fit: () => this.fit(),
          own: html`${mapButton('turn', 'Rotate the map by 90°', 'Rotate by 90° (R)', () => this.turnByQuarter())}
          ${this.renderOwn()}`,
          hasLayers: layersOpen,
          layersHint: 'Layers',
          toggleLayers,
        })}`,
      layers: layersOpen ? this.renderLayers() : null,
      toggleLayers,
      after: this.renderAfter(),
    });
  }

  private onKey(event: KeyboardEvent): void {
    pressKey(event, this, {
      ArrowLeft: () => this.shift(PAN_STEP, 0),
      ArrowRight: () => this.shift(-PAN_STEP, 0),
      ArrowUp: () => this.shift(0, PAN_STEP),
      ArrowDown: () => this.shift(0, -PAN_STEP),
      r: () => this.turnByQuarter(),
      ...this.ownKeys,
    });
  }

  turnByQuarter(): void {
    this.turnTo(((this.view.turns + 1) % 4) as Turns);
  }

  protected move(view: Viewport): void {
    this.view = view;
    this.isMoved = true;
    this.surface.requestPaint();
  }

  zoomBy(factor: number): void {
    this.surface.zoomBy(factor);
  }

  shift(right: number, down: number): void {
    this.move(panned(this.view, right, down));
  }

  zoom(x: number, y: number, factor: number): void {
    this.move(zoomedAt(this.view, this.surface.size, x, y, factor));
  }

  hover(x: number, y: number): void {
    this.pointer = { x, y };
  }

  leave(): void {
    this.pointer = null;
  }

  protected toWorld(x: number, y: number): { x: number; y: number } {
    return toWorld(this.view, this.surface.size, x, y);
  }
}
