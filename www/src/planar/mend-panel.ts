/** The panel beside a map that is mended: its loops, the one that is looked at, the step that is prepared. */
import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { isImageName } from '../../../package/files/kinds.js';
import { facts } from '../run/facts.js';
import { fire } from '../components/fire.js';
import { iconButton } from '../components/icon-button.js';
import { statusBadge } from '../components/status-badge.js';
import { whileConnected } from '../components/while-connected.js';
import { shared } from '../components/theme.js';
import { panelStyles, statusStyles } from '../components/panel-theme.js';
import type { Consequence, GraphLoop } from '../engine/protocol.js';
import { formatFixed, formatLength, formatPercent, plural, sentence } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import type { MapLayer } from '../views/map-layer.js';
import type { Status } from '../views/map-painter.js';
import { composed } from './loop-poses.js';
import { gridLayer } from './grid-layer.js';
import { gridPanel } from './grid-panel.js';
import { fitOf, loopLayer } from './loop-layer.js';
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

const WORDS: Record<Status, string> = { good: 'fits', doubtful: 'strained', lost: 'contradicted' };
/** So many loops are listed; all are drawn. */
const MOST_LISTED = 100;

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
    const { loops, draft, problem, isOnGrid, part, measuring } = this.mending;
    const body = (): TemplateResult => {
      if (isOnGrid) return gridPanel(this.mending);
      if (part === 'plan') return planPanel(this.mending);
      if (part === 'measure')
        return measurePanel(measuring, this.selected, (scan) => fire(this, 'frame-selected', scan));
      if (problem !== '') return html`<p>${problem}</p>`;
      if (!loops) return html`<p class="muted">Looking at the loops</p>`;
      if (!draft) return this.renderList(loops.loops);
      return draft.kind === 'old' ? this.renderLoop(draft.loop) : this.renderNew(draft);
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

  private renderList(loops: readonly GraphLoop[]): TemplateResult {
    const { mending } = this;
    return html`<section aria-label="Loops">
      <p class="explanation">
        ${
          loops.length === 0
            ? 'The map has no loops.'
            : `${plural(loops.length, 'loop')} between scans, the least fitting first: how far each is from what the rest of the graph tells, in standard deviations.`
        }
      </p>
      <ol class="loops">
        ${loops.slice(0, MOST_LISTED).map(
          (loop) =>
            html`<li>
              <button @click=${() => mending.prepare({ kind: 'old', loop })}>
                <span class="number">${loop.target} – ${loop.source}</span
                ><span class="number">${sigmasOf(loop)}</span>${badge(loop)}
              </button>
            </li>`,
        )}
      </ol>
      <button ?disabled=${!mending.isIdle} @click=${() => mending.prepare({ kind: 'new', scans: [], pose: null })}>
        Propose a loop
      </button>
    </section>`;
  }

  private renderLoop(loop: GraphLoop): TemplateResult {
    const { x, y, theta } = loop.T_target_source;
    const told = loop.chi_squared > 0 ? formatFixed(loop.chi_squared, 1) : 'nothing else tells';
    return html`<section aria-label="Loop">
      <h3>Loop between ${scansOf(loop)}</h3>
      <p class="explanation">
        Both scans are drawn as the loop lays them on each other: the first green, the second pink.
      </p>
      ${facts(
        [
          ['Fit', badge(loop)],
          ['Chi-squared', told],
          ['The second from the first', `${formatFixed(x, 2)}, ${formatFixed(y, 2)} m, ${formatAngle(theta, 1)}`],
          ['Known to', `${formatLength(loop.position_sigma)}, ${formatAngle(loop.heading_sigma, 1)}`],
          ['Returns that agree', loop.is_unchecked ? 'put in without a match' : formatPercent(loop.agreement)],
        ],
        'number',
      )}
      ${this.renderConsequence('Remove this loop')}
    </section>`;
  }

  private renderNew({ scans, pose }: Draft & { kind: 'new' }): TemplateResult {
    const { mending } = this;
    const { poses } = mending;
    const field = (at: 0 | 1, label: string): TemplateResult =>
      html`<label
        >${label}<input
          type="number"
          min="0"
          max=${poses.length - 1}
          .value=${String(scans[at] ?? '')}
          ?disabled=${at > scans.length}
          @change=${({ target }: Event) => {
            const scan = (target as HTMLInputElement).valueAsNumber;
            if (poses[scan]) mending.chooseScan(scan, at);
          }}
      /></label>`;
    const first = poses[scans[0] ?? -1];
    const lay = (label: string, turn: number): TemplateResult =>
      html`<button @click=${() => first && mending.lay(composed(first, { x: 0, y: 0, theta: turn }))}>
        ${label}
      </button>`;
    return html`<section aria-label="New loop">
      <h3>New loop</h3>
      <p class="explanation">
        ${
          pose
            ? 'Drag the second scan (pink) to where it fits the first (green), within 1 m and 17°; arrow keys move it, [ and ] turn it.'
            : 'Choose two scans of one place, on the map or by number.'
        }
      </p>
      <div class="fields">${field(0, 'First scan')}${field(1, 'Second scan')}</div>
      ${
        pose
          ? html`<div class="actions" role="group" aria-label="Where the second scan lies">
              ${lay('On the first', 0)} ${lay('Turned round', Math.PI)}
              <button @click=${() => mending.chooseScan(scans[1] ?? 0, 1)}>As in the map</button>
              <button aria-label="Turn left" @click=${() => mending.move(0, 0, Math.PI / 18)}>⟲</button>
              <button aria-label="Turn right" @click=${() => mending.move(0, 0, -Math.PI / 18)}>⟳</button>
            </div>`
          : nothing
      }
      ${this.renderConsequence('Add this loop')}
    </section>`;
  }

  private renderConsequence(action: string): TemplateResult {
    const { mending } = this;
    const { consequence } = mending;
    const isRefused = consequence === null || consequence.refusal !== null;
    return html`${
        consequence
          ? html`<ul class="consequence" aria-label="What it changes">
              ${consequenceWords(consequence).map((words) => html`<li>${words}</li>`)}
            </ul>`
          : nothing
      }
      <div class="actions decision">
        <button class="primary" ?disabled=${isRefused || !mending.isIdle} @click=${() => mending.take()}>
          ${action}
        </button>
        <button @click=${() => mending.prepare(null)}>Back</button>
      </div>`;
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

function scansOf({ target, source }: { target: number; source: number }): string {
  return `scans ${target} and ${source}`;
}

function sigmasOf({ chi_squared: chiSquared }: GraphLoop): string {
  return chiSquared > 0 ? `${formatFixed(Math.sqrt(chiSquared), 1)} σ` : '';
}

function badge(loop: GraphLoop): TemplateResult {
  const fit = fitOf(loop);
  return statusBadge(fit, WORDS[fit]);
}

/** In whole sentences. */
function consequenceWords(consequence: Consequence): string[] {
  const { refusal, chi_squared: [before, after] = [0, 0], num_pieces: [piecesBefore, pieces] = [0, 0] } = consequence;
  if (refusal !== null) return [`Refused: ${sentence(refusal)}`];
  const { furthest, furthest_moves: far, mean_moves: mean } = consequence;
  const { num_becoming_good: numBetter, num_no_longer_good: numWorse, left_out: leftOut } = consequence;
  const [first] = leftOut;
  return [
    far < 0.001
      ? 'No scan moves by a millimetre.'
      : `Scans move by ${formatLength(mean)} in the mean, scan ${furthest} by ${formatLength(far)}.`,
    `Chi-squared of the graph is ${formatFixed(before, 1)} before and ${formatFixed(after, 1)} after.`,
    ...(pieces === piecesBefore ? [] : [`${plural(pieces, 'piece')} in place of ${piecesBefore}.`]),
    ...(numBetter === 0 ? [] : [`${plural(numBetter, 'scan')} become good.`]),
    ...(numWorse === 0 ? [] : [`${plural(numWorse, 'scan')} are no longer good.`]),
    ...(first
      ? [`${plural(leftOut.length, 'loop')} no longer fit, the first between scans ${first.join(' and ')}.`]
      : []),
  ];
}
