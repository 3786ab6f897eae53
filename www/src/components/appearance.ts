/** What the element's appearance depends on besides its attributes: its own width, and the system's choice of dark or light. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { Layout } from './run-parts.js';

const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;

export class Appearance implements ReactiveController {
  layout: Layout = 'wide';
  is_system_dark = false;
  readonly #host: ReactiveControllerHost;
  readonly #frame: () => Element | null;
  #observed: Element | null = null;
  readonly #system_dark = matchMedia('(prefers-color-scheme: dark)');
  readonly #resize_observer = new ResizeObserver(([entry]) => {
    const width = entry?.contentRect.width ?? WIDE_FROM;
    const layout = width >= WIDE_FROM ? 'wide' : width >= MEDIUM_FROM ? 'medium' : 'narrow';
    if (layout === this.layout) return;
    this.layout = layout;
    this.#host.requestUpdate();
  });

  /** `frame`: the box whose width counts; null before it is drawn. */
  constructor(host: ReactiveControllerHost, frame: () => Element | null) {
    this.#host = host;
    this.#frame = frame;
    host.addController(this);
  }

  hostConnected(): void {
    this.#onSystemTheme();
    this.#system_dark.addEventListener('change', this.#onSystemTheme);
    this.#observe();
  }

  hostUpdated(): void {
    this.#observe();
  }

  hostDisconnected(): void {
    this.#system_dark.removeEventListener('change', this.#onSystemTheme);
    this.#resize_observer.disconnect();
    this.#observed = null;
  }

  #observe(): void {
    const frame = this.#frame();
    if (this.#observed || !frame) return;
    this.#observed = frame;
    this.#resize_observer.observe(frame);
  }

  #onSystemTheme = (): void => {
    if (this.#system_dark.matches === this.is_system_dark) return;
    this.is_system_dark = this.#system_dark.matches;
    this.#host.requestUpdate();
  };
}
