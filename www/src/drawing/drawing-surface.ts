import type { LitElement, ReactiveController } from 'lit';
import { Gestures, type GestureTarget } from '../views/gestures.js';
import { belongsToPage } from '../views/map-keys.js';
import type { Size } from '../views/viewport.js';
import { watchSize } from '../components/watch-size.js';

/** Of device pixels per CSS pixel: beyond it, more pixels cost more than the eye sees. */
const MAX_PIXEL_RATIO = 3;

/** An element that draws on a canvas in a box of its own. */
export interface DrawingHost extends LitElement, GestureTarget {
  /** The box: it has the canvas' size, takes the gestures and has the focus. */
  readonly stage: HTMLElement;
  /** Shows everything there is. */
  fit(): void;
  /** Takes over the surface's size and pixel ratio, which are never empty here. `wasEmpty`: before, the box had no size. */
  resized(wasEmpty: boolean): void;
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
  pixelRatio = 1;
  #typeScale = 1;
  /** In a page that scrolls, wheel and finger belong to the page until the box is clicked. */
  #isGuarded = false;
  #animationFrame = 0;
  #host: DrawingHost;
  #gestures: Gestures;

  constructor(host: DrawingHost) {
    this.#host = host;
    this.#gestures = new Gestures(
      host,
      host,
      () => this.#isGuarded,
      () => this.#typeScale,
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
    cancelAnimationFrame(this.#animationFrame);
    this.#animationFrame = 0;
  }

  requestPaint(): void {
    if (this.#animationFrame === 0) this.#animationFrame = requestAnimationFrame(() => this.paintNow());
  }

  paintNow(): void {
    this.hostDisconnected();
    if (!this.isEmpty) this.#host.paint();
  }

  get isEmpty(): boolean {
    return this.size.width * this.size.height === 0;
  }

  /** Zooms about the middle. */
  zoomBy(factor: number): void {
    this.#host.zoom(this.size.width / 2, this.size.height / 2, factor);
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.#host.stage;
    const wasEmpty = this.isEmpty;
    const scale = parseFloat(getComputedStyle(this.#host).getPropertyValue('--px')) || 1;
    this.#typeScale = scale;
    this.size = { width: width / scale, height: height / scale };
    this.pixelRatio = Math.min(devicePixelRatio || 1, MAX_PIXEL_RATIO) * scale;
    this.#updateGuard();
    if (this.isEmpty) return;
    this.#host.resized(wasEmpty);
    // At once: the canvas is empty now, and would be seen so until the next animation frame.
    this.paintNow();
    this.#host.requestUpdate();
  }

  #updateGuard(): void {
    const { stage } = this.#host;
    this.#isGuarded = belongsToPage(stage);
    stage.toggleAttribute('data-guarded', this.#isGuarded);
  }
}
