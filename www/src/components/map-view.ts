import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { baseName, formatFixed } from '../views/format.js';
import { MapCanvas, type MapContent } from '../views/map-canvas.js';
import { type Layers, type MapMarks, poseAt } from '../views/map-painter.js';
import type { Rgb } from '../views/palette.js';
import type { OccupancyPicture } from '../views/occupancy.js';
import { NO_POINTS, nearestFrame, type PointSet } from '../views/point-layer.js';
import {
  type Bounds,
  bestTurns,
  fitted,
  mapBounds,
  panned,
  type Size,
  type Turns,
  toWorld,
  type Viewport,
  zoomedAt,
} from '../views/viewport.js';
import { icon } from './icons.js';
import { map_styles } from './map-styles.js';
import { shared } from './theme.js';

const NO_MARKS: MapMarks = {
  poses: [],
  statuses: [],
  look_direction: 0,
  until: 0,
  selected: null,
  hovered: null,
  reference: [],
  pairs: null,
  undetermined: null,
};

const ZOOM_STEP = 1.3;
const PAN_STEP = 60; // CSS pixels
/** The map is in motion until the hand has rested for so long. */
const REST_MS = 90;

/**
 * The map: points, paths and poses on a canvas that pans and zooms.
 *
 * Fires `frame-selected` with a frame number or null, `map-painted` when a new set of points is on the screen, and
 * `occupancy-wanted` with whether the occupancy grid is to be shown.
 */
@customElement('scanstitch-map')
export class ScanstitchMap extends LitElement {
  @property({ attribute: false }) points: PointSet = NO_POINTS;
  @property({ attribute: false }) marks: MapMarks = NO_MARKS;
  @property({ attribute: false }) names: readonly string[] = [];
  /** One for each frame, or more. */
  @property({ attribute: false }) colors: readonly Rgb[] = [];
  @property({ attribute: false }) reference_name = '';
  @property({ type: Boolean }) dark = false;
  /** Whether there is a grid to ask for; and the grid, once it has come. */
  @property({ type: Boolean }) has_occupancy = false;
  @property({ attribute: false }) occupancy: OccupancyPicture | null = null;
  /** Changes with the data set: the view is fitted anew. */
  @property({ attribute: false }) fit_key: unknown = null;
  @property({ attribute: false }) description = '';

  @state() private layers: Layers = { grid: true, occupancy: false, path: true, reference: true };
  @state() private layers_open = false;
  @state() private pointer: { x: number; y: number } | null = null;
  @state() private hovered: number | null = null;
  /** In a page that scrolls, wheel and finger belong to the page until the map is clicked. */
  @state() private guarded = false;

  @query('canvas') private canvas!: HTMLCanvasElement;
  @query('.stage') private stage!: HTMLElement;

  private view: Viewport = { center_x: 0, center_y: 0, scale: 40, turns: 0 };
  private size: Size = { width: 0, height: 0 };
  private pixel_ratio = 1;
  /** How the user has turned the map; null: as it is best laid. */
  private turns: Turns | null = null;
  /** The user has moved the view: it is no longer fitted behind his back. */
  private is_moved = false;
  private map_canvas: MapCanvas | null = null;
  private last_motion = Number.NEGATIVE_INFINITY;
  private animation_frame = 0;
  private rest_timer: ReturnType<typeof setTimeout> | undefined;
  private has_new_points = false;
  private fingers = new Map<number, { x: number; y: number }>();
  private drag_distance = 0;
  private resize_observer = new ResizeObserver(() => this.resize());

  override connectedCallback(): void {
    super.connectedCallback();
    if (this.hasUpdated) this.resize_observer.observe(this.stage);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.resize_observer.disconnect();
    cancelAnimationFrame(this.animation_frame);
    this.animation_frame = 0;
    clearTimeout(this.rest_timer);
  }

  protected override firstUpdated(): void {
    this.map_canvas = new MapCanvas(this.canvas);
    this.resize_observer.observe(this.stage);
    this.resize();
    // Registered here because Lit's listeners are passive where the browser decides so.
    this.stage.addEventListener('wheel', (event) => this.onWheel(event), { passive: false });
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('fit_key')) {
      this.is_moved = false;
      this.turns = null;
    }
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('points') || changed.has('fit_key')) {
      if (changed.has('points')) this.has_new_points = true;
      if (!this.is_moved) this.fit();
    }
    const previous = changed.get('marks');
    const repaint =
      changed.has('points') ||
      changed.has('dark') ||
      changed.has('colors') ||
      (changed.has('marks') && (previous?.until !== this.marks.until || previous?.selected !== this.marks.selected));
    if (repaint) this.map_canvas?.invalidate();
    this.requestPaint();
  }

  /** Shows the whole map. */
  fit(): void {
    this.is_moved = false;
    const bounds = this.bounds();
    if (bounds && this.size.width > 0) {
      const is_small = this.size.width < 520;
      const margin = is_small
        ? { top: 24, right: 24, bottom: 44, left: 24 }
        : { top: 36, right: 64, bottom: 52, left: 36 };
      this.view = fitted(bounds, this.size, margin, this.turns ?? bestTurns(bounds, this.size));
    }
    this.requestPaint();
  }

  /** Turns the map by a quarter. */
  turn(): void {
    this.turns = ((this.view.turns + 1) % 4) as Turns;
    this.fit();
  }

  /** The map as a picture, at twice the resolution of the screen or better. */
  async picture(): Promise<Blob> {
    const print = new MapCanvas();
    print.resize(this.size, Math.max(2, this.pixel_ratio));
    print.paint(this.content(), this.view, false);
    const { canvas } = print;
    return new Promise((resolve, reject) => {
      canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('The browser could not make the picture.'))));
    });
  }

  protected override render(): TemplateResult {
    const { hovered, pointer } = this;
    const world = pointer && toWorld(this.view, this.size, pointer.x, pointer.y);
    return html`
      <div
        class="stage"
        tabindex="0"
        role="group"
        aria-label="Map"
        aria-describedby="map-description map-keys"
        ?data-guarded=${this.guarded}
        @keydown=${this.onKey}
        @pointerdown=${this.onPointerDown}
        @pointermove=${this.onPointerMove}
        @pointerup=${this.onPointerUp}
        @pointercancel=${this.onPointerUp}
        @pointerleave=${this.onPointerLeave}
        @dblclick=${this.onDoubleClick}
        @focus=${this.updateGuard}
        @blur=${this.updateGuard}
      >
        <canvas aria-hidden="true"></canvas>
        <p id="map-description" class="visually-hidden">${this.description}</p>
        <p id="map-keys" class="visually-hidden">
          Arrow keys move the map, plus and minus zoom, F shows all of it, R turns it, comma and full stop select the
          scan before and after.
        </p>
      </div>
      <div class="readout number" aria-hidden="true" ?hidden=${!world}>
        ${
          world &&
          html`<span>x ${formatFixed(world.x, 2)} m</span><span>y ${formatFixed(world.y, 2)} m</span>${
              hovered === null
                ? nothing
                : html`<span class="frame"
                    ><i style="background: rgb(${this.colors[hovered]?.join(' ')})"></i>${baseName(
                      this.names[hovered] ?? `scan ${hovered}`,
                    )}</span
                  >`
            }`
        }
      </div>
      <div class="controls" role="toolbar" aria-label="Map view">
        <button class="icon" @click=${() => this.zoomBy(ZOOM_STEP)} aria-label="Zoom in" title="Zoom in (+)">
          ${icon('plus')}
        </button>
        <button class="icon" @click=${() => this.zoomBy(1 / ZOOM_STEP)} aria-label="Zoom out" title="Zoom out (−)">
          ${icon('minus')}
        </button>
        <button class="icon" @click=${() => this.fit()} aria-label="Show the whole map" title="Show the whole map (F)">
          ${icon('fit')}
        </button>
        <button
          class="icon"
          @click=${() => this.turn()}
          aria-label="Turn the map by a quarter"
          title="Turn by a quarter (R)"
        >
          ${icon('turn')}
        </button>
        <button
          class="icon"
          @click=${() => {
            this.layers_open = !this.layers_open;
          }}
          aria-label="What is drawn"
          aria-expanded=${this.layers_open}
          title="What is drawn"
        >
          ${icon('layers')}
        </button>
        ${this.layers_open ? this.renderLayers() : nothing}
      </div>
    `;
  }

  private renderLayers(): TemplateResult {
    const layer = (name: keyof Layers, label: string, sign: string): TemplateResult => html`
      <label>
        <input
          type="checkbox"
          .checked=${this.layers[name]}
          @change=${(event: Event) => {
            this.layers = { ...this.layers, [name]: (event.target as HTMLInputElement).checked };
            if (name === 'occupancy') {
              this.dispatchEvent(new CustomEvent('occupancy-wanted', { detail: this.layers.occupancy }));
            }
            this.requestPaint();
          }}
        />
        <i class="sign ${sign}"></i>${label}
      </label>
    `;
    return html`<fieldset class="layers">
      <legend class="visually-hidden">What is drawn</legend>
      ${layer('path', 'Path and poses', 'path')}
      ${this.marks.reference.length > 0 ? layer('reference', `Reference: ${baseName(this.reference_name)}`, 'reference') : nothing}
      ${this.has_occupancy ? layer('occupancy', 'Free and occupied, in place of points', 'occupancy') : nothing}
      ${layer('grid', 'Grid', 'grid')}
    </fieldset>`;
  }

  private bounds(): Bounds | null {
    return mapBounds(this.points.points, [...this.marks.poses, ...this.marks.reference]);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.stage;
    this.pixel_ratio = Math.min(window.devicePixelRatio || 1, 3);
    this.size = { width, height };
    this.map_canvas?.resize(this.size, this.pixel_ratio);
    this.updateGuard();
    if (!this.is_moved) this.fit();
    // At once: the canvas is empty now, and an animation frame later the eye would see it so.
    cancelAnimationFrame(this.animation_frame);
    this.paint();
  }

  private updateGuard(): void {
    const page = document.scrollingElement;
    const scrolls = page !== null && page.scrollHeight > page.clientHeight + 1;
    this.guarded = scrolls && this.shadowRoot?.activeElement !== this.stage;
  }

  // Painting. One frame at most per refresh of the screen, and none when nothing changed.

  private requestPaint(): void {
    if (this.animation_frame === 0) this.animation_frame = requestAnimationFrame(() => this.paint());
  }

  private paint(): void {
    this.animation_frame = 0;
    if (this.size.width === 0 || this.size.height === 0) return;
    const is_in_motion = performance.now() - this.last_motion < REST_MS;
    const is_exact = this.map_canvas?.paint(this.content(), this.view, is_in_motion) ?? true;
    clearTimeout(this.rest_timer);
    if (!is_exact) this.rest_timer = setTimeout(() => this.requestPaint(), REST_MS + 10);
    if (this.has_new_points) {
      this.has_new_points = false;
      this.dispatchEvent(new CustomEvent('map-painted', { bubbles: true, composed: true }));
    }
  }

  private content(): MapContent {
    const { points, colors, layers, occupancy, dark } = this;
    return {
      points,
      colors,
      layers,
      occupancy,
      dark,
      marks: { ...this.marks, hovered: this.hovered ?? this.marks.hovered },
    };
  }

  // Moving about.

  private move(view: Viewport): void {
    this.view = view;
    this.is_moved = true;
    this.last_motion = performance.now();
    this.requestPaint();
  }

  private zoomBy(factor: number): void {
    this.move(zoomedAt(this.view, this.size, this.size.width / 2, this.size.height / 2, factor));
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const count = this.marks.poses.length;
    const selected = this.marks.selected;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => this.move(panned(this.view, PAN_STEP, 0)),
      ArrowRight: () => this.move(panned(this.view, -PAN_STEP, 0)),
      ArrowUp: () => this.move(panned(this.view, 0, PAN_STEP)),
      ArrowDown: () => this.move(panned(this.view, 0, -PAN_STEP)),
      '+': () => this.zoomBy(ZOOM_STEP),
      '=': () => this.zoomBy(ZOOM_STEP),
      '-': () => this.zoomBy(1 / ZOOM_STEP),
      f: () => this.fit(),
      F: () => this.fit(),
      r: () => this.turn(),
      R: () => this.turn(),
      '.': () => this.select(Math.min((selected ?? -1) + 1, count - 1)),
      ',': () => this.select(Math.max((selected ?? count) - 1, 0)),
      Escape: () => this.select(null),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private onWheel(event: WheelEvent): void {
    if (this.guarded && !event.ctrlKey) return;
    event.preventDefault();
    const { x, y } = this.place(event);
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    // A pinch on a trackpad arrives as a wheel with the control key and small steps.
    const speed = event.ctrlKey ? 0.01 : 0.0016;
    this.move(zoomedAt(this.view, this.size, x, y, Math.exp(-event.deltaY * lines * speed)));
    this.hover(x, y);
  }

  private onPointerDown(event: PointerEvent): void {
    if (event.button !== 0) return;
    if (this.guarded && event.pointerType === 'touch') return;
    this.stage.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.place(event));
    if (this.fingers.size === 1) this.drag_distance = 0;
  }

  private onPointerMove(event: PointerEvent): void {
    const now = this.place(event);
    const before = this.fingers.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== 'touch') this.hover(now.x, now.y);
      return;
    }
    this.fingers.set(event.pointerId, now);
    this.drag_distance += Math.hypot(now.x - before.x, now.y - before.y);
    if (this.fingers.size === 1) {
      if (this.drag_distance > 4) this.move(panned(this.view, now.x - before.x, now.y - before.y));
      return;
    }
    const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) return;
    const spread =
      Math.hypot(now.x - other.x, now.y - other.y) / Math.max(Math.hypot(before.x - other.x, before.y - other.y), 1);
    const moved = panned(this.view, (now.x - before.x) / 2, (now.y - before.y) / 2);
    this.move(zoomedAt(moved, this.size, (now.x + other.x) / 2, (now.y + other.y) / 2, spread));
  }

  private onPointerUp(event: PointerEvent): void {
    const was_pressed = this.fingers.delete(event.pointerId);
    const is_tap = event.type === 'pointerup' && this.drag_distance <= (event.pointerType === 'touch' ? 10 : 4);
    if ((was_pressed || this.guarded) && is_tap && this.fingers.size === 0) {
      const { x, y } = this.place(event);
      this.select(this.frameAt(x, y, event.pointerType === 'touch' ? 22 : 10));
    }
  }

  private onPointerLeave(): void {
    this.pointer = null;
    this.hovered = null;
  }

  private onDoubleClick(): void {
    this.fit();
  }

  private place(event: MouseEvent): { x: number; y: number } {
    const box = this.stage.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  private hover(x: number, y: number): void {
    this.pointer = { x, y };
    this.hovered = this.frameAt(x, y, 10);
  }

  /** The frame whose pose, or else whose point, lies under a place on the screen. */
  private frameAt(x: number, y: number, reach: number): number | null {
    const pose = this.layers.path ? poseAt(this.marks, this.size, this.view, x, y, reach + 2) : null;
    if (pose !== null) return pose;
    const world = toWorld(this.view, this.size, x, y);
    return nearestFrame(this.points, this.marks.until, world.x, world.y, reach / this.view.scale);
  }

  private select(frame: number | null): void {
    this.dispatchEvent(new CustomEvent('frame-selected', { detail: frame, bubbles: true, composed: true }));
  }

  static override styles = [
    shared,
    map_styles,
    css`
      .readout .frame {
        display: inline-flex;
        align-items: center;
        gap: 5px;
        color: var(--text);
      }
      .readout i {
        width: 9px;
        height: 9px;
        border-radius: 50%;
      }
      .sign.reference {
        border-top: 2px dashed light-dark(#b4530a, #ffad5c);
      }
    `,
  ];
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-map': ScanstitchMap;
  }
}
