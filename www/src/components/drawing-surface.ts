import type { LitElement, ReactiveController } from 'lit';
import { Gestures, type GestureTarget } from '../views/gestures.js';
import { belongsToPage } from '../views/map-keys.js';
import type { Size } from '../views/viewport.js';
import { watchSize } from './watch-size.js';

/** Of device pixels per CSS pixel: beyond it, more pixels cost more than the eye sees. */
const MAX_PIXEL_RATIO = 3;

/** An element that draws on a canvas in a box of its own. */
export interface DrawingHost extends LitElement, GestureTarget {
  /** The box: it has the canvas' size, takes the gestures and has the focus. */
  readonly stage: HTMLElement;
  /** Shows everything there is. */
  fit(): void;
  /** Takes over the surface's size and pixel ratio, which are never empty here. `was_empty`: before, the box had no size. */
  resized(was_empty: boolean): void;
  /** Draws once; the surface has a size. */
  paint(): void;
}

/**
 * The life cycle of an element that draws on a canvas: the size and the pixel ratio of its box, its gestures, and when it
 * is painted. One picture at most per refresh of the screen, and none when nothing changed.
 */
export class DrawingSurface implements ReactiveController {
  /** CSS pixels at the usual size of type: where that is larger, so is all that is drawn. */
  size: Size = { width: 0, height: 0 };
  /** Device pixels per pixel of `size`. */
  pixel_ratio = 1;
  #type_scale = 1;
  /** In a page that scrolls, wheel and finger belong to the page until the box is clicked. */
  #is_guarded = false;
  #animation_frame = 0;
  #host: DrawingHost;
  #gestures: Gestures;

  constructor(host: DrawingHost) {
    this.#host = host;
    this.#gestures = new Gestures(
      host,
      host,
      () => this.#is_guarded,
      () => this.#type_scale,
    );
    watchSize(
      host,
      () => this.#resize(),
      () => host.stage,
    );
    host.addController(this);
  }

  /** To be called once, when the box and its canvas are there. */
  begin(): void {
    const { stage } = this.#host;
    this.#gestures.listen(stage);
    stage.addEventListener('dblclick', () => this.#host.fit());
    for (const event of ['focus', 'blur']) stage.addEventListener(event, () => this.#updateGuard());
  }

  hostDisconnected(): void {
    cancelAnimationFrame(this.#animation_frame);
    this.#animation_frame = 0;
  }

  requestPaint(): void {
    if (this.#animation_frame === 0) this.#animation_frame = requestAnimationFrame(() => this.paintNow());
  }

  paintNow(): void {
    this.hostDisconnected();
    if (!this.is_empty) this.#host.paint();
  }

  get is_empty(): boolean {
    return this.size.width * this.size.height === 0;
  }

  /** Zooms about the middle. */
  zoomBy(factor: number): void {
    this.#host.zoom(this.size.width / 2, this.size.height / 2, factor);
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.#host.stage;
    const was_empty = this.is_empty;
    const scale = parseFloat(getComputedStyle(this.#host).getPropertyValue('--px')) || 1;
    this.#type_scale = scale;
    this.size = { width: width / scale, height: height / scale };
    this.pixel_ratio = Math.min(devicePixelRatio || 1, MAX_PIXEL_RATIO) * scale;
    this.#updateGuard();
    if (this.is_empty) return;
    this.#host.resized(was_empty);
    // At once: the canvas is empty now, and would be seen so until the next animation frame.
    this.paintNow();
    this.#host.requestUpdate();
  }

  #updateGuard(): void {
    const { stage } = this.#host;
    this.#is_guarded = belongsToPage(stage);
    stage.toggleAttribute('data-guarded', this.#is_guarded);
  }
}
