/** What the element's appearance depends on besides its attributes: its own size, and the system's choice of dark or light. */
import type { ReactiveController, LitElement } from 'lit';
import type { Layout } from './run-parts.js';
import { watchSize } from './watch-size.js';

const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;
/** Lower than this (CSS pixels), header and controls have one line each. */
const LOW_BELOW = 480;
/** From this width on, type grows with the element: by a quarter for each doubling, and faster where it has the whole screen, which is a projector's. */
const TYPE_GROWS_FROM = 1280;
const GROWTH = 0.25;
const GROWTH_ON_FULL_SCREEN = 0.8;

export class Appearance implements ReactiveController {
  layout: Layout = 'wide';
  is_low = false;
  /** Size of a unit of type, CSS pixels. */
  type_scale = 1;
  is_system_dark = false;
  readonly #host: LitElement;
  readonly #system_dark = matchMedia('(prefers-color-scheme: dark)');
  #fills_screen = false;
  #size = { width: 0, height: 0 };

  /** `frame`: the box whose size counts; null before it is drawn. */
  constructor(host: LitElement, frame: () => Element | null) {
    this.#host = host;
    host.addController(this);
    watchSize(host, (width, height) => this.#fit(width, height), frame);
  }

  hostConnected(): void {
    this.#onSystemTheme();
    this.#system_dark.addEventListener('change', this.#onSystemTheme);
    document.addEventListener('fullscreenchange', this.#onFullScreen);
  }

  hostDisconnected(): void {
    this.#system_dark.removeEventListener('change', this.#onSystemTheme);
    document.removeEventListener('fullscreenchange', this.#onFullScreen);
  }

  /** Whether the element has the whole screen; null where the browser gives it to none. */
  get full_screen(): boolean | null {
    return document.fullscreenEnabled ? this.#fills_screen : null;
  }

  async toggleFullScreen(): Promise<void> {
    if (this.#fills_screen) await document.exitFullscreen();
    else await this.#host.requestFullscreen();
  }

  #fit(width: number, height: number): void {
    this.#size = { width, height };
    // An element that is wide and low is no projector.
    const extent = Math.min(width, (height * 16) / 9);
    const growth = this.#fills_screen ? GROWTH_ON_FULL_SCREEN : GROWTH;
    const type_scale = 1 + (growth * Math.max(extent - TYPE_GROWS_FROM, 0)) / TYPE_GROWS_FROM;
    const wide_from = WIDE_FROM * type_scale;
    const layout = width >= wide_from ? 'wide' : width >= MEDIUM_FROM * type_scale ? 'medium' : 'narrow';
    const is_low = height < LOW_BELOW;
    if (layout === this.layout && is_low === this.is_low && type_scale === this.type_scale) return;
    Object.assign(this, { layout, is_low, type_scale });
    this.#host.requestUpdate();
  }

  #onFullScreen = (): void => {
    this.#fills_screen = (this.#host.getRootNode() as Document | ShadowRoot).fullscreenElement === this.#host;
    this.#fit(this.#size.width, this.#size.height);
    this.#host.requestUpdate();
  };

  #onSystemTheme = (): void => {
    this.is_system_dark = this.#system_dark.matches;
    this.#host.requestUpdate();
  };
}
