/** What the element's appearance depends on besides its attributes: its own width, and the system's choice of dark or light. */
import type { ReactiveController, LitElement } from 'lit';
import type { Layout } from './run-parts.js';
import { watchSize } from './watch-size.js';

const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;

export class Appearance implements ReactiveController {
  layout: Layout = 'wide';
  is_system_dark = false;
  readonly #host: LitElement;
  readonly #system_dark = matchMedia('(prefers-color-scheme: dark)');

  /** `frame`: the box whose width counts; null before it is drawn. */
  constructor(host: LitElement, frame: () => Element | null) {
    this.#host = host;
    host.addController(this);
    watchSize(host, (width) => this.#fit(width), frame);
  }

  hostConnected(): void {
    this.#onSystemTheme();
    this.#system_dark.addEventListener('change', this.#onSystemTheme);
  }

  hostDisconnected(): void {
    this.#system_dark.removeEventListener('change', this.#onSystemTheme);
  }

  #fit(width: number): void {
    const layout = width >= WIDE_FROM ? 'wide' : width >= MEDIUM_FROM ? 'medium' : 'narrow';
    if (layout === this.layout) return;
    this.layout = layout;
    this.#host.requestUpdate();
  }

  #onSystemTheme = (): void => {
    this.is_system_dark = this.#system_dark.matches;
    this.#host.requestUpdate();
  };
}
