import { css, html, LitElement, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { shared } from '../components/theme.js';
import { CanvasPen, type Pen } from './pen.js';
import type { Size } from './figures.js';

/** Draws on a surface of this size. */
export type Painter = (pen: Pen, size: Size) => void;

/**
 * Two canvases on top of each other: what is drawn once, and the marks that follow the pointer.
 *
 * Fires `figure-pointer` with the place on it ({ x, y }, or null where the pointer has left), `figure-dragged` with
 * { dx, dy }, `figure-zoomed` with { factor }, and `figure-resized`.
 */
@customElement('scanstitch-figure')
export class ScanstitchFigure extends LitElement {
  /** What is drawn once. A new function is drawn anew. */
  @property({ attribute: false }) painter: Painter = () => undefined;
  /** What follows the pointer. */
  @property({ attribute: false }) marker: Painter = () => undefined;
  @property() description = '';
  /** Whether dragging and the wheel mean something. */
  @property({ type: Boolean }) movable = false;
  @query('.base') private base!: HTMLCanvasElement;
  @query('.marks') private marks!: HTMLCanvasElement;
  private observer = new ResizeObserver(() => {
    this.paint();
    this.paintMarks();
  });
  private dragged_from: { x: number; y: number } | null = null;

  /** CSS pixels. */
  get size(): Size {
    return { width: this.clientWidth, height: this.clientHeight };
  }

  override connectedCallback(): void {
    super.connectedCallback();
    this.observer.observe(this);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.observer.disconnect();
  }

  protected override updated(changed: PropertyValues): void {
    if (changed.has('painter')) this.paint();
    if (changed.has('painter') || changed.has('marker')) this.paintMarks();
  }

  protected override render(): TemplateResult {
    return html`<div
      role="img"
      aria-label=${this.description}
      class=${this.movable ? 'movable' : ''}
      @pointermove=${this.onMove}
      @pointerdown=${this.onDown}
      @pointerup=${this.onUp}
      @pointercancel=${this.onUp}
      @pointerleave=${() => this.tell('figure-pointer', null)}
      @wheel=${this.onWheel}
    >
      <canvas class="base"></canvas><canvas class="marks"></canvas>
    </div>`;
  }

  private paint(): void {
    draw(this.base, this.size, this.painter);
  }

  private paintMarks(): void {
    draw(this.marks, this.size, this.marker);
  }

  private onMove(event: PointerEvent): void {
    const place = this.place(event);
    if (this.dragged_from && this.movable) {
      this.tell('figure-dragged', { dx: place.x - this.dragged_from.x, dy: place.y - this.dragged_from.y });
      this.dragged_from = place;
    } else {
      this.tell('figure-pointer', place);
    }
  }

  private onDown(event: PointerEvent): void {
    if (!this.movable || event.button !== 0) return;
    this.dragged_from = this.place(event);
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
  }

  private onUp(): void {
    this.dragged_from = null;
  }

  private onWheel(event: WheelEvent): void {
    if (!this.movable) return;
    event.preventDefault();
    this.tell('figure-zoomed', { factor: Math.exp(-event.deltaY * 0.0015) });
  }

  private place(event: MouseEvent): { x: number; y: number } {
    const { left, top } = this.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }

  private tell(name: string, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  static override styles = [
    shared,
    css`
      :host {
        display: block;
        position: relative;
        min-width: 0;
        overflow: hidden;
      }
      div {
        position: absolute;
        inset: 0;
      }
      .movable {
        cursor: grab;
        touch-action: none;
      }
      .movable:active {
        cursor: grabbing;
      }
      canvas {
        position: absolute;
        width: 100%;
        height: 100%;
      }
      .marks {
        pointer-events: none;
      }
    `,
  ];
}

function draw(canvas: HTMLCanvasElement | null, size: Size, painter: Painter): void {
  const context = canvas?.getContext('2d');
  if (!canvas || !context || size.width === 0 || size.height === 0) return;
  const density = devicePixelRatio || 1;
  const [width, height] = [Math.round(size.width * density), Math.round(size.height * density)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, width, height);
  context.setTransform(density, 0, 0, density, 0, 0);
  painter(new CanvasPen(context), size);
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-figure': ScanstitchFigure;
  }
}
