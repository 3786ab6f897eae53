/** The panel beside a map that is mended: its loops, the one that is looked at, the step that is prepared. */
import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { isImageName } from '../../../package/files/kinds.js';
import { fire } from '../components/fire.js';
import { iconButton } from '../components/icon-button.js';
import { whileConnected } from '../components/while-connected.js';
import { shared } from '../components/theme.js';
import { panelStyles, statusStyles } from '../components/panel-theme.js';
import { plural } from '../views/format.js';
import type { MapLayer } from '../views/map-layer.js';
import { gridLayer } from './grid-layer.js';
import { gridPanel } from './grid-panel.js';
import { loopLayer } from './loop-layer.js';
import { loopPanel } from './loop-panel.js';
import { measureLayer } from './measure-layer.js';
import { measurePanel, measureStyles } from './measure-panel.js';
import { fieldStyles } from './panel-fields.js';
import { planLayer } from './plan-layer.js';
import { planPanel, planStyles } from './plan-panel.js';
import { type Draft, type MendPart, Mending } from './mending.js';

export { Mending };

/** What lies over the map. */
export function mendLayer(mending: Mending): MapLayer {
  if (mending.part === 'measure') return measureLayer(mending.measuring, mending.keys);
  if (mending.part === 'plan') return planLayer(mending.plan, mending.keys);
  return mending.isOnGrid ? gridLayer(mending.grid, mending.keys) : loopLayer(mending);
}

/** Fires `closed`. Escape goes back, Delete takes out the loop that is looked at, Ctrl+Z undoes. */
@customElement('scanstitch-mend')
export class ScanstitchMend extends LitElement {
  @property({ attribute: false, hasChanged: () => true }) mending!: Mending;
  /** The scan that is selected. */
  @property({ attribute: false }) selected: number | null = null;
  /** The kind of step that was prepared at the last update. */
  private shown: Draft['kind'] | undefined;

  constructor() {
    super();
    whileConnected(this, document, 'keydown', (event) => this.onKey(event));
    whileConnected(this, document, 'drop', (event) => this.onDrop(event), true);
  }

  protected override firstUpdated(): void {
    this.renderRoot.querySelector<HTMLElement>('h2')?.focus();
  }

  /** What is shown anew is read from its beginning. */
  protected override updated(): void {
    const shown = this.mending.draft?.kind;
    if (shown !== this.shown) this.scrollTop = 0;
    this.shown = shown;
  }

  private close(): void {
    fire(this, 'closed');
  }

  /** A picture is the plan, wherever it is dropped while one is laid. */
  private onDrop(event: DragEvent): void {
    const [file, ...others] = event.dataTransfer?.files ?? [];
    if (this.mending.part !== 'plan' || !file || !isImageName(file.name) || others.length > 0) return;
    event.preventDefault();
    void this.mending.plan.choose(file);
  }

  private onKey(event: KeyboardEvent): void {
    const path = event.composedPath();
    const view = (this.getRootNode() as ShadowRoot).host;
    if (event.defaultPrevented || path[0] instanceof HTMLInputElement) return;
    if (path[0] !== document.body && !path.includes(view)) return;
    const { mending } = this;
    const isUndo = event.key.toLowerCase() === 'z' && (event.ctrlKey || event.metaKey) && !event.shiftKey;
    if (isUndo) mending.undo();
    else if (event.key === 'Delete' && mending.draft?.kind === 'old') mending.take();
    else if (event.key === 'Escape' && mending.draft) mending.prepare(null);
    else if (event.key === 'Escape' && mending.isOnGrid && mending.grid.places.length > 0) mending.grid.clear();
    else if (event.key === 'Escape' && mending.part === 'measure' && !mending.measuring.isEmpty)
      mending.measuring.clear();
    else if (event.key === 'Escape') this.close();
    else return;
    event.preventDefault();
  }

  protected override render(): TemplateResult {
    const { isOnGrid, part, measuring } = this.mending;
    const body = (): TemplateResult => {
      if (isOnGrid) return gridPanel(this.mending);
      if (part === 'plan') return planPanel(this.mending);
      if (part === 'measure')
        return measurePanel(measuring, this.selected, (scan) => fire(this, 'frame-selected', scan));
      return loopPanel(this.mending);
    };
    return html`<header>
        <h2 tabindex="-1">Mend the map</h2>
        ${iconButton('close', 'Close', () => this.close(), { hint: 'Close (Escape)' })}
      </header>
      <div class="choice" role="group" aria-label="What is mended">
        ${this.renderPart('loops', 'Loops')} ${this.renderPart('grid', 'Grid and frame')}
        ${this.renderPart('plan', 'Plan')} ${this.renderPart('measure', 'Measure')}
      </div>
      ${body()} ${part === 'measure' ? nothing : this.renderSteps()}`;
  }

  private renderPart(part: MendPart, label: string): TemplateResult {
    const { mending } = this;
    return html`<button aria-pressed=${mending.part === part} @click=${() => mending.turnTo(part)}>${label}</button>`;
  }

  private renderSteps(): TemplateResult {
    const { mending } = this;
    const { steps, isDone: isIdle } = mending;
    return html`<section aria-label="Steps">
      <h3>${plural(steps.length, 'step')} taken</h3>
      <div class="actions">
        <button ?disabled=${!isIdle || steps.length === 0} title="Undo (Ctrl+Z)" @click=${() => mending.undo()}>
          Undo
        </button>
        <button ?disabled=${steps.length === 0} @click=${() => mending.save()}>Save the steps</button>
        <button
          ?disabled=${!isIdle}
          @click=${() => this.renderRoot.querySelector<HTMLElement>('input[type=file]')?.click()}
        >
          Open steps
        </button>
        <button ?disabled=${!isIdle} title="graph.g2o, with information matrices" @click=${() => mending.saveGraph()}>
          Save the graph
        </button>
        <input
          type="file"
          hidden
          accept=".json"
          aria-label="File of steps"
          @change=${({ target }: Event) => {
            const input = target as HTMLInputElement;
            const [file] = input.files ?? [];
            if (file) void mending.open(file);
            input.value = '';
          }}
        />
      </div>
    </section>`;
  }

  static override styles = [
    shared,
    panelStyles,
    statusStyles,
    fieldStyles,
    planStyles,
    measureStyles,
    css`
      :host {
        grid-area: question;
        width: calc(300 * var(--px));
        overflow: auto;
        border-left: 1px solid var(--line);
        background: var(--surface);
      }
      @container (max-width: 600px) {
        :host {
          width: auto;
          max-height: 50cqh;
          border: solid var(--line);
          border-width: 1px 0 0;
        }
      }
      header {
        justify-content: space-between;
      }
      section {
        gap: 8px;
      }
      .loops {
        display: grid;
        grid-template-columns: minmax(0, 1fr);
        gap: 4px;
        max-height: 40cqh;
        overflow: auto;
      }
      .loops button {
        display: grid;
        grid-template-columns: 1fr auto auto;
        gap: 8px;
        width: 100%;
        text-align: left;
      }
      dl {
        display: grid;
        grid-template-columns: auto 1fr;
        gap: 4px 12px;
        font-size: calc(13 * var(--px));
      }
      dt {
        color: var(--muted);
      }
      dd {
        text-align: right;
      }
      .actions,
      .fields {
        display: flex;
        flex-wrap: wrap;
        gap: 6px;
      }
      /* In sight, however much is told above: over the padding of the panel, too. */
      .decision {
        position: sticky;
        bottom: -24px;
        padding: 8px 0;
        background: var(--surface);
      }
      .fields label {
        display: grid;
        flex: 1;
        font-size: calc(13 * var(--px));
      }
      input[type='number'] {
        width: 100%;
        min-height: 32px;
        border: 1px solid var(--line-strong);
        border-radius: 7px;
        background: var(--surface);
      }
      .consequence {
        padding: 8px 10px 8px 24px;
        border-radius: var(--radius);
        background: var(--sunken);
        font-size: calc(13 * var(--px));
        list-style: disc;
      }
    `,
  ];
}
