import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { cover, shared, stretch } from '../components/theme.js';
import type { Overlay } from './paint.js';
import type { Pixel, Strip } from './protocol.js';
import { watchSize } from '../components/watch-size.js';
import { fire } from '../components/fire.js';

/** A mark that can be taken hold of. */
export interface Handle {
  key: string;
  at: Pixel;
  /** "Point 3", for those who do not see it. */
  label: string;
}

export interface HandleMove {
  key: string;
  at: Pixel;
  /** A drag is one change, from its begin to its end; a key is a whole one. */
  phase: 'begin' | 'drag' | 'key';
}

const ARROWS: Record<string, Pixel> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Side of the magnifier (CSS pixels), and how much it magnifies. */
const LOUPE = 112;
const MAGNIFIED = 6;

/**
 * A picture with marks over it. Its layers are the picture itself, another one blended over it, the drawing, and a
 * button for each mark, so that marks have a place in the order of the keyboard.
 *
 * Fires `picture-pressed` with a pixel where nothing lies, `handle-moved` (HandleMove), `handle-removed` and
 * `handle-focused` with the key, `picture-pointed` with a pixel or null.
 */
@customElement('scanstitch-bev-picture')
export class ScanstitchBevPicture extends LitElement {
  /** Pixels of the picture; without one, of the camera. */
  @property({ type: Number }) width = 512;
  @property({ type: Number }) height = 512;
  @property({ attribute: false }) bitmap: ImageBitmap | null = null;
  @property({ attribute: false }) overlay: Overlay = () => undefined;
  @property({ attribute: false }) handles: readonly Handle[] = [];
  @property() name = '';
  /** What stands where there is no picture. */
  @property() placeholder = '';
  /** How much of the second picture covers the first, 0 to 1. */
  @property({ type: Number }) blend = 0;
  @state() private loupeAt: Pixel | null = null;
  @query('.base') private base!: HTMLCanvasElement;
  @query('.warp') private warp!: HTMLCanvasElement;
  @query('.marks') private marks!: HTMLCanvasElement;
  @query('.loupe') private loupe!: HTMLCanvasElement | null;
  private dragged: { key: string; pointerId: number } | null = null;
  /** The click event at the end of a drag is ignored. */
  private wasDragged = false;
  /** Where the pointer was pressed: a click event has whole CSS pixels only. */
  private pressedAt: Pixel = [0, 0];
  constructor() {
    super();
    watchSize(this, () => this.repaint());
  }

  /** Moves the focus to a mark. */
  focusHandle(key: string): void {
    this.renderRoot.querySelector<HTMLElement>(`[data-key="${key}"]`)?.focus({ preventScroll: true });
  }

  /** Takes over rows of the second picture. */
  takeStrip({ first_row, num_rows, width, rgba }: Strip): void {
    const { warp } = this;
    if (warp.width !== this.width || warp.height !== this.height) [warp.width, warp.height] = [this.width, this.height];
    warp.getContext('2d')?.putImageData(new ImageData(rgba, width, num_rows), 0, first_row);
  }

  forgetWarp(): void {
    this.warp.width = this.width; // which clears it
  }

  /** The picture with its marks, in its own size. */
  async png(): Promise<Blob> {
    const canvas = new OffscreenCanvas(this.width, this.height);
    const context = canvas.getContext('2d') as unknown as CanvasRenderingContext2D | null;
    if (!context) throw new Error('The browser gives no canvas to draw on.');
    context.fillStyle = '#808080';
    context.fillRect(0, 0, this.width, this.height);
    if (this.bitmap) context.drawImage(this.bitmap, 0, 0);
    if (this.blend > 0 && this.warp.width === this.width) {
      context.globalAlpha = this.blend;
      context.drawImage(this.warp, 0, 0);
      context.globalAlpha = 1;
    }
    this.overlay(context, { scale: 1, density: Math.max(1, this.width / 800), width: this.width, height: this.height });
    return canvas.convertToBlob({ type: 'image/png' });
  }

  protected override updated(changed: PropertyValues): void {
    if (changed.has('bitmap') || changed.has('width') || changed.has('height')) this.paintBase();
    if (changed.has('overlay')) this.paint();
    if (this.loupeAt) this.paintLoupe(this.loupeAt);
  }

  protected override render(): TemplateResult {
    const { width, height, loupeAt } = this;
    const place = ([u, v]: Pixel) => `left:${(100 * (u + 0.5)) / width}%;top:${(100 * (v + 0.5)) / height}%`;
    const isLoupeLeft = loupeAt !== null && loupeAt[0] > width / 2;
    return html`<div
      class="stage"
      role="group"
      aria-label=${this.name}
      style="aspect-ratio:${width}/${height}"
      @pointerdown=${this.onPress}
      @click=${this.onClick}
      @pointermove=${this.onMove}
      @pointerup=${this.onRelease}
      @pointercancel=${this.onRelease}
      @pointerleave=${() => fire(this, 'picture-pointed')}
    >
      <canvas class="base"></canvas>
      <canvas class="warp" ?hidden=${this.blend === 0} style="opacity:${this.blend}"></canvas>
      <canvas class="marks"></canvas>
      ${this.bitmap ? nothing : html`<p class="placeholder">${this.placeholder}</p>`}
      ${repeat(
        this.handles,
        ({ key }) => key,
        ({ key, at, label }) =>
          html`<button
            class="handle"
            data-key=${key}
            style=${place(at)}
            aria-label="${label}, pixel ${shortPixel(at)}"
            @keydown=${this.onKey}
            @focus=${() => fire(this, 'handle-focused', key)}
          ></button>`,
      )}
      ${
        loupeAt && this.bitmap
          ? html`<canvas
              class="loupe ${isLoupeLeft ? 'left' : 'right'}"
              width=${LOUPE}
              height=${LOUPE}
              aria-hidden="true"
            ></canvas>`
          : nothing
      }
    </div>`;
  }

  private repaint(): void {
    this.paintBase();
    this.paint();
  }

  /** The picture in its displayed size, so that compositing after every mark is cheaper. */
  private paintBase(): void {
    const { base, bitmap, warp } = this;
    const density = devicePixelRatio || 1;
    const share = Math.min(1, (base.clientWidth * density) / this.width || 1);
    [base.width, base.height] = [Math.round(this.width * share), Math.round(this.height * share)];
    const context = base.getContext('2d');
    if (bitmap && context) {
      context.imageSmoothingQuality = 'high';
      context.drawImage(bitmap, 0, 0, base.width, base.height);
    }
    if (warp.width !== this.width || warp.height !== this.height) [warp.width, warp.height] = [this.width, this.height];
  }

  /** Draws the marks alone: the picture beneath them stays. */
  private paint(): void {
    const { marks } = this;
    const density = devicePixelRatio || 1;
    const [width, height] = [Math.round(marks.clientWidth * density), Math.round(marks.clientHeight * density)];
    if (width === 0 || height === 0) return;
    if (marks.width !== width || marks.height !== height) [marks.width, marks.height] = [width, height];
    const context = marks.getContext('2d');
    if (!context) return;
    context.clearRect(0, 0, width, height);
    this.overlay(context, { scale: width / this.width, density, width: this.width, height: this.height });
  }

  private paintLoupe([u, v]: Pixel): void {
    const context = this.loupe?.getContext('2d');
    if (!context) return;
    const side = LOUPE / MAGNIFIED;
    context.imageSmoothingEnabled = false;
    context.fillStyle = '#808080';
    context.fillRect(0, 0, LOUPE, LOUPE);
    if (this.bitmap)
      context.drawImage(this.bitmap, u + 0.5 - side / 2, v + 0.5 - side / 2, side, side, 0, 0, LOUPE, LOUPE);
    const middle = LOUPE / 2 - MAGNIFIED / 2;
    context.strokeStyle = '#fff';
    context.strokeRect(middle, middle, MAGNIFIED, MAGNIFIED);
    context.strokeStyle = '#ff3d8b';
    context.strokeRect(middle - 1, middle - 1, MAGNIFIED + 2, MAGNIFIED + 2);
  }

  /** The pixel under the pointer: its middle is a whole number. */
  private pixelAt(event: PointerEvent): Pixel {
    const { left, top, width, height } = this.marks.getBoundingClientRect();
    const along = (at: number, size: number, count: number) =>
      Math.min(Math.max(Math.floor((at / size) * count), 0), count - 1);
    return [along(event.clientX - left, width, this.width), along(event.clientY - top, height, this.height)];
  }

  private onPress(event: PointerEvent): void {
    if (event.button !== 0 || !event.isPrimary) return;
    const handle = handleOf(event);
    this.pressedAt = this.pixelAt(event);
    this.wasDragged = handle !== null;
    if (!handle) return;
    const key = handle.dataset.key ?? '';
    this.dragged = { key, pointerId: event.pointerId };
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
    handle.focus({ preventScroll: true });
    this.loupeAt = this.pressedAt;
    fire(this, 'handle-moved', { key, at: this.placeOf(key), phase: 'begin' });
    event.preventDefault();
  }

  /** A click, and not the press before it: a finger that scrolls the page presses as well. */
  private onClick(event: PointerEvent): void {
    if (!this.wasDragged && !handleOf(event)) fire(this, 'picture-pressed', this.pressedAt);
  }

  private onMove(event: PointerEvent): void {
    const at = this.pixelAt(event);
    if (this.dragged?.pointerId === event.pointerId) {
      this.loupeAt = at;
      fire(this, 'handle-moved', { key: this.dragged.key, at, phase: 'drag' });
    } else {
      fire(this, 'picture-pointed', at);
    }
  }

  private onRelease(event: PointerEvent): void {
    if (this.dragged?.pointerId !== event.pointerId) return;
    this.dragged = null;
    this.loupeAt = null;
  }

  private onKey(event: KeyboardEvent): void {
    const key = (event.currentTarget as HTMLElement).dataset.key ?? '';
    const arrow = ARROWS[event.key];
    if (arrow) {
      const [u, v] = this.placeOf(key);
      const step = event.shiftKey ? 10 : 1;
      fire(this, 'handle-moved', { key, at: [u + step * arrow[0], v + step * arrow[1]], phase: 'key' });
    } else if (event.key === 'Delete' || event.key === 'Backspace') {
      fire(this, 'handle-removed', key);
    } else {
      return;
    }
    event.preventDefault();
  }

  private placeOf(key: string): Pixel {
    return this.handles.find((handle) => handle.key === key)?.at ?? [0, 0];
  }

  static override styles = [
    shared,
    css`
      :host {
        min-width: 0;
      }
      .stage {
        position: relative;
        width: 100%;
        overflow: hidden;
        background: repeating-conic-gradient(var(--sunken) 0 25%, var(--surface) 0 50%) 0 0 / 24px 24px;
        cursor: crosshair;
        user-select: none;
      }
      canvas {
        ${cover};
        ${stretch};
        pointer-events: none;
      }
      .placeholder {
        ${cover};
        display: grid;
        place-content: center;
        padding: 20px;
        color: var(--muted);
        text-align: center;
        pointer-events: none;
      }
      .handle {
        position: absolute;
        width: 26px;
        height: 26px;
        min-height: 0;
        margin: -13px;
        padding: 0;
        border: 0;
        border-radius: 50%;
        background: none;
        cursor: grab;
        touch-action: none;
      }
      .handle:hover:not(:disabled) {
        background: rgb(255 255 255 / 0.25);
      }
      .handle:active {
        cursor: grabbing;
      }
      .handle:focus-visible {
        outline: 2px solid #fff;
        outline-offset: -4px;
        box-shadow: 0 0 0 2px var(--accent);
      }
      .loupe {
        inset: 6px auto auto auto;
        width: 112px;
        height: 112px;
        border: 2px solid #fff;
        border-radius: 50%;
        box-shadow: var(--shadow);
      }
      .loupe.left {
        left: 6px;
      }
      .loupe.right {
        right: 6px;
      }
      @media (pointer: coarse) {
        .handle {
          width: 40px;
          height: 40px;
          margin: -20px;
        }
      }
    `,
  ];
}

function handleOf(event: Event): HTMLElement | null {
  const found = event.composedPath().find((one) => one instanceof HTMLElement && one.dataset.key !== undefined);
  return found instanceof HTMLElement ? found : null;
}

/** Whole numbers as they are, others with two decimals. */
export function shortPixel([u, v]: Pixel): string {
  return `${shortNumber(u)}, ${shortNumber(v)}`;
}

export function shortNumber(value: number, digits = 2): string {
  return Number.isInteger(value) ? String(value) : value.toFixed(digits);
}
