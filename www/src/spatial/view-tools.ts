/** What the map in space is used for besides turning it: the bar below it, and the tool that is chosen. Loaded on demand. */
import { html, nothing, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import { list } from '../components/list-field.js';
import { formatFixed } from '../views/format.js';
import type { Orbit } from '../views/orbit.js';
import { Flattening } from './flattening.js';
import type { MapTool, ToolHost } from './map-tool.js';
import { Measuring } from './measuring.js';
import { Riding } from './riding.js';
import { type Cut, NO_CUT, type Plane, planeOf } from './section.js';
import type { LayerName } from './scene.js';
import { Walking } from './walking.js';

const TOOLS = {
  turn: { label: 'Turn', make: () => null },
  walk: { label: 'Walk', make: (host: ToolHost) => new Walking(host) },
  path: { label: 'Camera’s path', make: (host: ToolHost) => new Riding(host) },
  measure: { label: 'Measure', make: (host: ToolHost) => new Measuring(host) },
  grid: { label: 'Floor grid', make: (host: ToolHost) => new Flattening(host) },
} as const;
type ToolName = keyof typeof TOOLS;

const CUTS = { none: 'none', across: 'across', deep: 'lengthwise' } as const;

export class ViewTools {
  cut: Cut = NO_CUT;
  #host: ToolHost;
  #name: ToolName = 'turn';
  #tool: MapTool | null = null;
  /** The view to come back to. */
  #before: Orbit | null = null;
  #releases: () => void;

  constructor(host: ToolHost) {
    this.#host = host;
    const onKeyUp = ({ key }: KeyboardEvent): void => this.#tool?.keyUp?.(letter(key));
    const onBlur = (): void => this.#tool?.keyUp?.('');
    host.stage.addEventListener('keyup', onKeyUp);
    host.stage.addEventListener('blur', onBlur);
    this.#releases = () => {
      host.stage.removeEventListener('keyup', onKeyUp);
      host.stage.removeEventListener('blur', onBlur);
    };
  }

  get plane(): Plane | null {
    return this.#tool?.plane ?? planeOf(this.cut, this.#host.survey)?.plane ?? null;
  }

  /** Null: the one that is chosen. */
  get section(): number | null {
    return this.#tool?.section ?? null;
  }

  get isInside(): boolean {
    return this.#tool?.isInside ?? false;
  }

  get hidden(): readonly LayerName[] {
    return this.#tool?.hidden ?? [];
  }

  advance(now: number): boolean {
    return this.#tool?.advance?.(now) ?? false;
  }

  /** Whether the key was meant for the tool. */
  key(event: KeyboardEvent): boolean {
    if (!this.#tool || event.ctrlKey || event.metaKey || event.altKey) return false;
    if (event.key === 'Escape') this.choose('turn');
    else if (!this.#tool.key(letter(event.key), event.shiftKey)) return false;
    event.preventDefault();
    return true;
  }

  turn = (right: number, down: number): boolean => this.#tool?.turn?.(right, down) ?? false;
  shift = (right: number, down: number): boolean => this.#tool?.shift?.(right, down) ?? false;
  zoom = (factor: number): boolean => this.#tool?.zoom?.(factor) ?? false;
  tap = (x: number, y: number): boolean => this.#tool?.tap?.(x, y) ?? false;

  choose(name: ToolName): void {
    this.#tool?.end?.();
    if (this.#before) this.#host.move(this.#before);
    this.#before = null;
    this.#name = name;
    const { orbit } = this.#host;
    this.#tool = TOOLS[name].make(this.#host);
    if (this.isInside) this.#before = orbit;
    this.#host.requestUpdate();
    this.#host.requestPaint();
  }

  /** Looks at the map from outside. */
  goOutside(): void {
    if (this.isInside) this.choose('turn');
  }

  /** The map as it was before. */
  end(): void {
    this.choose('turn');
    this.#releases();
  }

  renderOver(): TemplateResult | null {
    return this.#tool?.renderOver() ?? null;
  }

  renderBar(): TemplateResult {
    return html`<div class="surface-bar tools">
      <fieldset>
        <legend class="visually-hidden">Tool</legend>
        ${(Object.keys(TOOLS) as ToolName[]).map(
          (name) =>
            html`<label
              ><input
                type="radio"
                name="tool"
                .checked=${this.#name === name}
                @change=${() => this.choose(name)}
                @click=${({ detail }: MouseEvent) => {
                  // Keys are the tool's next; one who has come here by the keyboard stays among the tools.
                  if (detail > 0) this.#host.stage.focus();
                }}
              />${TOOLS[name].label}</label
            >`,
        )}
      </fieldset>
      ${this.#tool?.renderBar() ?? nothing} ${this.#tool?.plane ? nothing : this.#renderCut()}
      ${this.#tool ? html`<span class="muted keys">${this.#tool.help}</span>` : nothing}
    </div>`;
  }

  #renderCut(): TemplateResult {
    const { cut } = this;
    const change = (part: Partial<Cut>): void => {
      this.cut = { ...cut, ...part };
      this.#host.requestUpdate();
      this.#host.requestPaint();
    };
    const kept = planeOf(cut, this.#host.survey)?.kept ?? 0;
    const words = `${formatFixed(kept, 2)} m`;
    return html`<label>Section ${list(CUTS, cut.along, (along) => change({ along }))}</label> ${
        cut.along === 'none'
          ? nothing
          : html`${slider(cut.share, { label: 'Place of the section', step: 0.005, words: `${words} are left` }, (share) => change({ share }))}
              <output class="number">${words}</output>
              <button type="button" aria-pressed=${cut.isTurned} @click=${() => change({ isTurned: !cut.isTurned })}>
                Other side
              </button>`
      }`;
  }
}

const letter = (key: string): string => (key.length === 1 ? key.toLowerCase() : key);
