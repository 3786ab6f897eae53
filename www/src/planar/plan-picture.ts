/** The picture of a building plan, in which points are tapped: it moves and zooms as the map does. */
import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { fire } from '../components/fire.js';
import { row, shared } from '../components/theme.js';
import { type DrawingHost, DrawingSurface } from '../drawing/drawing-surface.js';
import { mapButton } from '../drawing/map-toolbar.js';
import { context2d } from '../views/canvas.js';
import { type KeyedMap, PAN_STEP, pressKey, ZOOM_STEP } from '../views/map-keys.js';
import { LIGHT_MAP } from '../views/map-painter.js';
import { cssColor } from '../views/palette.js';
import { fitted, panned, toScreenX, toScreenY, toWorld, type Viewport, zoomedAt } from '../views/viewport.js';
import type { Place } from './grid-tools.js';
import { paintCross, paintNumbered } from './numbered-places.js';
import { paintSheet, type Sheet } from './plan-sheet.js';

const MARGIN = { top: 6, right: 6, bottom: 6, left: 6 };
/** In a plane whose unit is a pixel. */
const AS_IT_IS = { pixel: 1, corner: [0, 0], turn: 0 } as const;

/** Fires `picture-chosen` with a file, `picture-tapped` with a point (pixels), `picture-moved` with the number of one and where it is now. */
@customElement('scanstitch-plan-picture')
export class ScanstitchPlanPicture extends LitElement implements DrawingHost, KeyedMap {
  @property({ attribute: false }) sheet: Sheet | null = null;
  @property({ attribute: false }) places: readonly (Place | null)[] = [];
  @query('.stage') readonly stage!: HTMLElement;
  @query('canvas') private canvas!: HTMLCanvasElement;

  readonly marks = { selected: null, poses: [] };
  private view: Viewport = { centerX: 0, centerY: 0, scale: 1, turns: 0 };
  private surface = new DrawingSurface(this);
  private dragged: { at: number; x: number; y: number } | null = null;

  protected override firstUpdated(): void {
    this.surface.begin();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('sheet')) this.fit();
    this.surface.requestPaint();
  }

  private choose(file: File | undefined): void {
    if (file) fire(this, 'picture-chosen', file);
  }

  fit(): void {
    const { sheet, surface } = this;
    if (!sheet || surface.isEmpty) return;
    const bounds = { minX: 0, minY: -sheet.height, maxX: sheet.width, maxY: 0 };
    this.move(fitted(bounds, surface.size, MARGIN, 0));
  }

  resized(wasEmpty: boolean): void {
    const { canvas, surface } = this;
    canvas.width = Math.max(Math.round(surface.size.width * surface.pixelRatio), 1);
    canvas.height = Math.max(Math.round(surface.size.height * surface.pixelRatio), 1);
    if (wasEmpty) this.fit();
  }

  paint(): void {
    const { sheet, view } = this;
    const { size, pixelRatio } = this.surface;
    const ctx = context2d(this.canvas);
    ctx.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
    ctx.clearRect(0, 0, size.width, size.height);
    if (!sheet) return;
    paintSheet(ctx, size, view, sheet, AS_IT_IS, false);
    const onScreen = ([u, v]: Place): [number, number] => [toScreenX(view, size, u, -v), toScreenY(view, size, u, -v)];
    const places = this.places.map((place) => place && onScreen(place));
    paintNumbered(ctx, places, cssColor(LIGHT_MAP.selected), LIGHT_MAP.halo);
    paintCross(ctx, size, LIGHT_MAP.text);
  }

  private move(view: Viewport): void {
    this.view = view;
    this.surface.requestPaint();
  }

  zoom(x: number, y: number, factor: number): void {
    this.dragged = null;
    this.move(zoomedAt(this.view, this.surface.size, x, y, factor));
  }

  zoomBy(factor: number): void {
    this.surface.zoomBy(factor);
  }

  shift(right: number, down: number): void {
    const { dragged, view } = this;
    if (!dragged) return this.move(panned(view, right, down));
    [dragged.x, dragged.y] = [dragged.x + right / view.scale, dragged.y + down / view.scale];
    fire(this, 'picture-moved', { at: dragged.at, place: [dragged.x, dragged.y] });
  }

  press(x: number, y: number, reach: number): void {
    const [u, v] = this.pixelAt(x, y);
    const far = reach / this.view.scale;
    const at = this.places.findIndex((place) => place && Math.hypot(place[0] - u, place[1] - v) <= far);
    const place = this.places[at];
    this.dragged = place ? { at, x: place[0], y: place[1] } : null;
  }

  release(): void {
    this.dragged = null;
  }

  tap(x: number, y: number): void {
    if (!this.dragged) fire(this, 'picture-tapped', this.pixelAt(x, y));
  }

  private pixelAt(x: number, y: number): Place {
    const at = toWorld(this.view, this.surface.size, x, y);
    return [at.x, -at.y];
  }

  select(): void {
    // A picture has no frames.
  }

  hover(): void {
    // Nothing is told of what is under the pointer.
  }

  leave(): void {
    // Nothing was told.
  }

  private onKey(event: KeyboardEvent): void {
    const { width, height } = this.surface.size;
    pressKey(event, this, {
      ArrowLeft: () => this.shift(PAN_STEP, 0),
      ArrowRight: () => this.shift(-PAN_STEP, 0),
      ArrowUp: () => this.shift(0, PAN_STEP),
      ArrowDown: () => this.shift(0, -PAN_STEP),
      Enter: () => this.tap(width / 2, height / 2),
    });
  }

  protected override render(): TemplateResult {
    const { sheet } = this;
    const zoom = (factor: number) => (): void => this.zoomBy(factor);
    return html`<div
        class="stage"
        tabindex=${sheet ? 0 : -1}
        aria-hidden=${sheet ? nothing : 'true'}
        role="group"
        aria-label="Building plan"
        aria-describedby="keys"
        @keydown=${(event: KeyboardEvent) => this.onKey(event)}
      >
        <canvas aria-hidden="true"></canvas>
        <p id="keys" class="visually-hidden">
          Arrow keys move the picture, plus and minus zoom, F shows all of it, Enter takes the point under the cross.
        </p>
      </div>
      ${
        sheet
          ? html`<div class="controls" role="toolbar" aria-label="Picture">
              ${mapButton('plus', 'Zoom into the picture', 'Zoom in (+)', zoom(ZOOM_STEP))}
              ${mapButton('minus', 'Zoom out of the picture', 'Zoom out (−)', zoom(1 / ZOOM_STEP))}
              ${mapButton('fit', 'Show the whole picture', 'Show all of it (F)', () => this.fit())}
            </div>`
          : html`<label class="empty"
              ><span>Drop a picture of the plan here (PNG, JPEG), or</span
              ><span class="button">Choose a picture</span>${this.fileInput('visually-hidden')}</label
            >`
      }
      ${sheet ? html`<label class="other">Another picture${this.fileInput('visually-hidden')}</label>` : nothing}`;
  }

  private fileInput(kind: string): TemplateResult {
    return html`<input
      class=${kind}
      type="file"
      accept="image/*"
      aria-label="Picture of the plan"
      @change=${({ target }: Event) => {
        const input = target as HTMLInputElement;
        this.choose(input.files?.[0]);
        input.value = '';
      }}
    />`;
  }

  static override styles = [
    shared,
    css`
      :host {
        position: relative;
        display: block;
        height: clamp(calc(150 * var(--px)), 40cqh, calc(300 * var(--px)));
        border: 1px solid var(--line-strong);
        border-radius: var(--radius);
        background: var(--sunken);
        overflow: hidden;
      }
      @container (max-width: 600px) {
        :host {
          height: clamp(calc(140 * var(--px)), 25cqh, calc(220 * var(--px)));
        }
      }
      .stage {
        position: absolute;
        inset: 0;
        touch-action: none;
        cursor: crosshair;
      }
      .stage[data-guarded] {
        touch-action: pan-x pan-y;
      }
      .stage:focus-visible {
        outline-offset: -2px;
      }
      canvas {
        display: block;
        width: 100%;
        height: 100%;
      }
      .controls {
        position: absolute;
        top: 6px;
        right: 6px;
        display: grid;
        gap: 4px;
      }
      .controls > button {
        background: var(--surface);
        color: var(--muted);
      }
      .empty {
        position: absolute;
        inset: 0;
        ${row};
        flex-direction: column;
        justify-content: center;
        gap: 8px;
        padding: 12px;
        text-align: center;
        cursor: pointer;
      }
      .button,
      .other {
        padding: 5px 12px;
        border: 1px solid var(--line-strong);
        border-radius: 7px;
        background: var(--surface);
        font-weight: 550;
        cursor: pointer;
      }
      .other {
        position: absolute;
        bottom: 6px;
        right: 6px;
        font-size: calc(12.5 * var(--px));
      }
      label:focus-within:has(:focus-visible) .button,
      .other:focus-within:has(:focus-visible) {
        outline: 2px solid var(--accent);
        outline-offset: 1px;
      }
    `,
  ];
}
