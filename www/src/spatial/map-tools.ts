/** The tools of the map in space, which are loaded on demand; until then none takes a gesture or a key. */
import { html, nothing, type TemplateResult } from 'lit';
import type { ToolHost } from './map-tool.js';
import type { SceneLook } from './scene.js';
import type { ViewTools } from './view-tools.js';

export class MapTools {
  /** Null: not shown. */
  now: ViewTools | null = null;
  #host: ToolHost;

  constructor(host: ToolHost) {
    this.#host = host;
  }

  async toggle(): Promise<void> {
    if (this.now) return this.end();
    const { ViewTools } = await import('./view-tools.js');
    this.now ??= new ViewTools(this.#host);
    this.#host.requestUpdate();
  }

  /** The map turns again, and nothing of it is cut off or measured. */
  end(): void {
    if (!this.now) return;
    this.now.end();
    this.now = null;
    this.#host.requestUpdate();
    this.#host.requestPaint();
  }

  /** How the scene is drawn with them. */
  on(look: SceneLook): SceneLook {
    if (!this.now) return look;
    const { hidden, plane, isInside } = this.now;
    const shows = { ...look.shows, ...Object.fromEntries(hidden.map((layer) => [layer, false])) };
    // Inside, the ceiling is there.
    const section = isInside ? 1e9 : (this.now.section ?? look.section);
    return { ...look, section, plane, isInside, shows };
  }

  /** Below the map, over what else stands there. */
  renderBars(below: unknown): TemplateResult {
    return html`<div class="bars">${this.now?.renderBar() ?? nothing}${below}</div>`;
  }

  renderOver(): TemplateResult | typeof nothing {
    return this.now?.renderOver() ?? nothing;
  }
}
