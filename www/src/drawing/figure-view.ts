import {
  css,
  html,
  LitElement,
  nothing,
  type PropertyValues,
  type SVGTemplateResult,
  svg,
  type TemplateResult,
} from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { cover, shared, stretch } from '../components/theme.js';
import type { Size } from '../views/figures.js';
import { type Pen, penOn } from '../views/pen.js';
import { watchSize } from '../components/watch-size.js';
import { fire } from '../components/fire.js';

/** Draws on a surface of this size. */
export type Painter = (pen: Pen, size: Size) => void;

/** A stroke or a dot that follows the pointer. */
export type Mark =
  | { line: readonly [number, number, number, number]; color: string; width: number }
  | { dot: readonly [number, number]; radius: number; color: string };
export type Marker = (size: Size) => readonly Mark[];

/** Steps of the arrow keys: of a figure that moves, in pixels; of an instant, in shares of the axis. */
const KEY_PIXELS = 30;
const KEY_ZOOM = 1.25;

/**
 * A canvas that is drawn once, and marks above it that follow the pointer: elements, so that moving them costs the few
 * pixels that they cover, and not the figure.
 *
 * Fires `figure-pointer` with the place on it ({ x, y }, or null where the pointer has left), `figure-dragged` with
 * { dx, dy }, `figure-zoomed` with { factor }, and `figure-stepped` with { direction } for the arrow keys of a figure that
 * does not move.
 */
@customElement('scanstitch-figure')
export class ScanstitchFigure extends LitElement {
  /** The drawing function; a new one triggers a redraw. */
  @property({ attribute: false }) painter: Painter = () => undefined;
  /** What follows the pointer. */
  @property({ attribute: false }) marker: Marker = () => [];
  @property() label = '';
  @property() description = '';
  /** Whether dragging and the wheel move what is shown. */
  @property({ type: Boolean }) movable = false;
  /** Whether places on it mean instants. */
  @property({ type: Boolean }) steppable = false;
  @query('canvas') private canvas!: HTMLCanvasElement;
  /** As last observed, since a query at every pointer move would force a layout; null while it is hidden. */
  private knownSize: Size | null = null;
  private draggedFrom: { x: number; y: number } | null = null;
  /** CSS pixels per pixel of the figure: more than 1 where type is large. */
  private typeScale = 1;

  constructor() {
    super();
    watchSize(this, () => this.resize());
  }

  /** CSS pixels at the usual size of type. */
  get size(): Size {
    const { typeScale: scale } = this;
    return this.knownSize ?? { width: this.clientWidth / scale, height: this.clientHeight / scale };
  }

  protected override updated(changed: PropertyValues): void {
    if (changed.has('painter')) this.paint();
  }

  protected override render(): TemplateResult {
    const isLive = this.movable || this.steppable;
    return html`<div
      role=${isLive ? 'group' : 'img'}
      aria-label=${this.label}
      aria-describedby="description"
      tabindex=${isLive ? 0 : nothing}
      class=${this.movable ? 'movable' : ''}
      @pointermove=${this.onMove}
      @pointerdown=${this.onDown}
      @pointerup=${this.onUp}
      @pointercancel=${this.onUp}
      @pointerleave=${() => fire(this, 'figure-pointer')}
      @wheel=${this.onWheel}
      @keydown=${this.onKey}
    >
      <canvas aria-hidden="true"></canvas>
      <svg class="marks" viewBox="0 0 ${this.size.width} ${this.size.height}" aria-hidden="true">
        ${this.marker(this.size).map(drawn)}
      </svg>
      <p id="description" hidden>
        ${this.description}
        ${this.movable ? 'Arrow keys move it, plus and minus zoom.' : this.steppable ? 'Arrow keys go along it.' : ''}
      </p>
    </div>`;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this;
    const scale = parseFloat(getComputedStyle(this).getPropertyValue('--px')) || 1;
    this.typeScale = scale;
    this.knownSize = width > 0 ? { width: width / scale, height: height / scale } : null;
    this.paint();
    this.requestUpdate();
  }

  private paint(): void {
    const { canvas, size } = this;
    if (!canvas || size.width === 0 || size.height === 0) return;
    this.painter(penOn(canvas, size, (devicePixelRatio || 1) * this.typeScale), size);
  }

  private onMove(event: PointerEvent): void {
    const place = this.place(event);
    if (this.draggedFrom && this.movable) {
      fire(this, 'figure-dragged', { dx: place.x - this.draggedFrom.x, dy: place.y - this.draggedFrom.y });
      this.draggedFrom = place;
    } else {
      fire(this, 'figure-pointer', place);
    }
  }

  private onDown(event: PointerEvent): void {
    if (!this.movable || event.button !== 0) return;
    this.draggedFrom = this.place(event);
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
  }

  private onUp(): void {
    this.draggedFrom = null;
  }

  private onWheel(event: WheelEvent): void {
    if (!this.movable) return;
    event.preventDefault();
    fire(this, 'figure-zoomed', { factor: Math.exp(-event.deltaY * 0.0015) });
  }

  private onKey(event: KeyboardEvent): void {
    const [right, down] = ARROWS[event.key] ?? [0, 0];
    const factor = { '+': KEY_ZOOM, '=': KEY_ZOOM, '-': 1 / KEY_ZOOM }[event.key];
    if (this.movable && (right || down)) {
      fire(this, 'figure-dragged', { dx: -right * KEY_PIXELS, dy: -down * KEY_PIXELS });
    } else if (this.movable && factor) fire(this, 'figure-zoomed', { factor });
    else if (this.steppable && right) fire(this, 'figure-stepped', { direction: event.shiftKey ? 10 * right : right });
    else return;
    event.preventDefault();
  }

  private place(event: MouseEvent): { x: number; y: number } {
    const { left, top } = this.getBoundingClientRect();
    const { typeScale: scale } = this;
    return { x: (event.clientX - left) / scale, y: (event.clientY - top) / scale };
  }

  static override styles = [
    shared,
    css`
      :host {
        position: relative;
        min-width: 0;
        overflow: hidden;
      }
      div {
        ${cover};
      }
      div:focus-visible {
        outline-offset: -2px;
      }
      .movable {
        cursor: grab;
        touch-action: none;
      }
      .movable:active {
        cursor: grabbing;
      }
      canvas,
      .marks {
        position: absolute;
        ${stretch};
      }
      .marks {
        pointer-events: none;
      }
      circle {
        stroke: var(--surface);
        stroke-width: 2;
      }
    `,
  ];
}

const ARROWS: Record<string, readonly [right: number, down: number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

function drawn(mark: Mark): SVGTemplateResult {
  if ('dot' in mark) {
    const [x, y] = mark.dot;
    return svg`<circle cx=${x.toFixed(1)} cy=${y.toFixed(1)} r=${mark.radius} fill=${mark.color} />`;
  }
  const [x1, y1, x2, y2] = mark.line.map((value) => value.toFixed(1));
  return svg`<line x1=${x1} y1=${y1} x2=${x2} y2=${y2} stroke=${mark.color} stroke-width=${mark.width} />`;
}
