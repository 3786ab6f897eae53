/** Opens and closes what a map is mended with; its code is loaded with the first use. */
import { html, nothing, type ReactiveControllerHost, type TemplateResult } from 'lit';
import type { Mending } from './mending.js';
import type { PlanarSession } from './session.js';

export class MendSwitch {
  #mending: Mending | null = null;

  constructor(readonly host: ReactiveControllerHost & { readonly session: PlanarSession }) {}

  /** Null while the map is not mended; another session has another map. */
  get mending(): Mending | null {
    return this.#mending?.session === this.host.session ? this.#mending : null;
  }

  readonly toggle = async (): Promise<void> => {
    const { host, mending } = this;
    const { mendLayer, Mending } = await import('./mend-panel.js');
    this.#mending = mending ? null : new Mending(host.session, () => host.requestUpdate(), mendLayer);
    host.requestUpdate();
  };

  /** Beside the map, with the scan that is selected. */
  panel(selected: number | null): TemplateResult | typeof nothing {
    return this.mending
      ? html`<scanstitch-mend .mending=${this.mending} .selected=${selected} @closed=${this.toggle}></scanstitch-mend>`
      : nothing;
  }
}
