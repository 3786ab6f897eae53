/** What the element's appearance depends on besides its attributes: its own size, and the system's choice of dark or light. */
import type { ReactiveController, LitElement } from 'lit';
import type { Layout } from '../run/run-parts.js';
import { watchSize } from '../components/watch-size.js';
import { whileConnected } from '../components/while-connected.js';

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
  isLow = false;
  /** Size of a unit of type, CSS pixels. */
  typeScale = 1;
  isSystemDark = false;
  readonly #host: LitElement;
  readonly #systemDark = matchMedia('(prefers-color-scheme: dark)');
  #fillsScreen = false;
  #size = { width: 0, height: 0 };

  /** `frame`: the box whose size counts; null before it is drawn. */
  constructor(host: LitElement, frame: () => Element | null) {
    this.#host = host;
    host.addController(this);
    watchSize(host, (width, height) => this.#fit(width, height), frame);
    whileConnected(host, this.#systemDark, 'change', () => this.hostConnected());
    whileConnected(host, document, 'fullscreenchange', () => this.#onFullScreen());
  }

  hostConnected(): void {
    this.isSystemDark = this.#systemDark.matches;
    this.#host.requestUpdate();
  }

  /** Whether the element has the whole screen; null where the browser gives it to none. */
  get fullScreen(): boolean | null {
    return document.fullscreenEnabled ? this.#fillsScreen : null;
  }

  async toggleFullScreen(): Promise<void> {
    if (this.#fillsScreen) await document.exitFullscreen();
    else await this.#host.requestFullscreen();
  }

  #fit(width: number, height: number): void {
    this.#size = { width, height };
    // An element that is wide and low is no projector.
    const extent = Math.min(width, (height * 16) / 9);
    const growth = this.#fillsScreen ? GROWTH_ON_FULL_SCREEN : GROWTH;
    const typeScale = 1 + (growth * Math.max(extent - TYPE_GROWS_FROM, 0)) / TYPE_GROWS_FROM;
    const wideFrom = WIDE_FROM * typeScale;
    const layout = width >= wideFrom ? 'wide' : width >= MEDIUM_FROM * typeScale ? 'medium' : 'narrow';
    const isLow = height < LOW_BELOW;
    if (layout === this.layout && isLow === this.isLow && typeScale === this.typeScale) return;
    Object.assign(this, { layout, isLow, typeScale });
    this.#host.requestUpdate();
  }

  #onFullScreen(): void {
    this.#fillsScreen = (this.#host.getRootNode() as Document | ShadowRoot).fullscreenElement === this.#host;
    this.#fit(this.#size.width, this.#size.height);
    this.#host.requestUpdate();
  }
}
