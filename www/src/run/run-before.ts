/** The result that a changed setting has replaced: it stays beside the new one until it is dismissed. */
import { html, nothing, type ReactiveControllerHost, type TemplateResult } from 'lit';
import { changeWords, type LabelledField } from '../views/setting-fields.js';
import type { Measure } from './before-after.js';

/** `overlay`: what the map draws of it. */
interface Before<Settings, Overlay> {
  settings: Settings;
  measures: readonly Measure[];
  overlay: Overlay;
}

export class ResultBefore<Settings extends object, Overlay> {
  readonly #host: ReactiveControllerHost;
  #before: Before<Settings, Overlay> | null = null;
  #isShown = true;
  /** The recording that it is of. */
  #recording: unknown = null;

  constructor(host: ReactiveControllerHost) {
    this.#host = host;
  }

  get isThere(): boolean {
    return this.#before !== null;
  }

  /** What the map draws of it, while that is wanted. */
  get overlay(): Overlay | null {
    return this.#isShown ? (this.#before?.overlay ?? null) : null;
  }

  /** Of another recording there is none. */
  follow(recording: unknown): void {
    if (recording !== this.#recording) this.#before = null;
    this.#recording = recording;
  }

  keep(before: Before<Settings, Overlay> | null): void {
    this.#before = before;
    this.#show(true);
  }

  #show(isShown: boolean): void {
    this.#isShown = isShown;
    this.#host.requestUpdate();
  }

  /** `after`: null while it is computed. */
  render(
    now: Settings,
    after: readonly Measure[] | null,
    descriptions: readonly LabelledField<Settings>[],
    goBack: (settings: Settings) => void,
  ): TemplateResult | typeof nothing {
    const before = this.#before;
    if (!before) return nothing;
    void import('./before-after.js');
    return html`<scanstitch-before-after
      .changes=${changeWords(descriptions, before.settings, now)}
      .earlier=${before.measures}
      .later=${after}
      ?shown=${this.#isShown}
      @before-shown=${({ detail }: CustomEvent<boolean>) => this.#show(detail)}
      @before-wanted=${() => goBack(before.settings)}
      @before-dismissed=${() => this.keep(null)}
    ></scanstitch-before-after>`;
  }
}
