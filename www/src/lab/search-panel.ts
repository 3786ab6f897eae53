import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { slider } from '../components/fields.js';
import { type Choices, list } from '../components/list-field.js';
import '../drawing/figure-view.js';
import { figureStyles, numberTable } from '../components/number-table.js';
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { shared } from '../components/theme.js';
import { DEGREES, formatCount, formatDuration, formatLength } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import { makeColors } from '../views/figure-colors.js';
import { memoizeLast } from '../views/memoize-last.js';
import { labStyles } from './lab-styles.js';
import { IDENTITY } from './poses.js';
import type { LabSession } from './session.js';
import { type CorrelativeSearch, poseOfBlock, searchPainter, stateAt } from './search.js';
import { sideStyles } from './side-styles.js';

/** Half widths of the window (m, degrees). */
const REACHES: Choices<number> = [0.5, 1, 2, 4].map((reach) => [reach, `± ${reach} m`]);
const TURNS: Choices<number> = [10, 30, 90, 180].map((turn) => [turn, `± ${turn}°`]);

/**
 * Where the correlative search goes around the start, block after block of its pyramid, and the pose that it hands to ICP.
 *
 * Fires `ghost-shown` with the pose of the selected block, or null.
 */
@customElement('scanstitch-lab-search')
export class ScanstitchLabSearch extends LitElement {
  @property({ attribute: false }) session!: LabSession;
  @property({ type: Boolean }) dark = false;
  /** Changes whenever there is something new to draw. */
  @property({ attribute: false }) tick: unknown = null;
  @state() private reach = 2;
  @state() private turn = 30;
  @state() private search: CorrelativeSearch | null = null;
  @state() private milliseconds = 0;
  /** Number of blocks that have been shown. */
  @state() private count = 0;
  private madeOf: readonly unknown[] = [];
  private colorsOf = memoizeLast(makeColors);
  private painterOf = memoizeLast(searchPainter);

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.madeOf = [];
    this.point(null);
  }

  protected override updated(): void {
    const { run, client, generation, start } = this.session;
    if (!run?.trace || !client) return;
    const madeOf = [run.id, run.options, generation, client, start, this.reach, this.turn];
    if (madeOf.every((part, i) => part === this.madeOf[i])) return;
    this.madeOf = madeOf;
    void this.compute(madeOf);
  }

  private async compute(madeOf: readonly unknown[]): Promise<void> {
    const { run, client, start } = this.session;
    if (!run || !client) return;
    const center = start ?? IDENTITY;
    try {
      const begin = performance.now();
      const blocks = await client.ask('search_path', run.id, center, this.reach, this.turn / DEGREES);
      if (this.madeOf !== madeOf) return;
      this.milliseconds = performance.now() - begin;
      this.search = { center, reach: this.reach, blocks };
      // The best pose is what one wants to see first; what comes after it is only ruled out.
      this.count = Math.max(blocks.findLastIndex(({ level }) => level === 0) + 1, 1);
    } catch (error) {
      if (!(error instanceof WorkerDied || error instanceof EngineProblem)) throw error; // which has been told
    }
  }

  protected override render(): TemplateResult {
    const { search } = this;
    return html`<div class="panel">
      <header>
        <h2>Correlative search around the start</h2>
        <span class="muted"
          >${search ? `${formatCount(search.blocks.length)} blocks, ${formatDuration(this.milliseconds)}` : 'searching…'}</span
        >
      </header>
      <div class="row field">
        <label class="choice">Distance ${list(REACHES, this.reach, (reach) => (this.reach = reach))}</label>
        <label class="choice">Heading ${list(TURNS, this.turn, (turn) => (this.turn = turn))}</label>
      </div>
      ${search ? this.renderSearch(search) : nothing}
      <p class="explanation">
        ICP finds the nearest minimum; this search finds the best pose of a whole window, to ${formatLength(0.1)}. The
        target is drawn as a grid of likelihoods and as its maxima over ever larger squares. The maxima bound the score
        of all poses of a block at once, so that a block whose bound is below the best pose found is never entered
        (branch and bound: Olson 2009, Hess et al. 2016). Drawn are the blocks of one heading, coloured by their bounds.
      </p>
    </div>`;
  }

  private renderSearch(search: CorrelativeSearch): TemplateResult {
    const { block, best, levels } = stateAt(search, this.count);
    const words = block
      ? `Block ${formatCount(this.count)} of ${formatCount(search.blocks.length)}: ${formatLength(block.side)} wide, heading ${formatAngle(block.turn)}, bound ${block.bound.toFixed(3)}`
      : 'No pose of this window meets the target';
    return html`<scanstitch-figure
        class="map"
        steppable
        label="Blocks of the correlative search"
        description=${words}
        .painter=${this.painterOf(search, this.count, this.colorsOf(this.dark), this.dark)}
        @figure-stepped=${({ detail }: CustomEvent<{ direction: number }>) => this.lookAt(this.count + detail.direction)}
      ></scanstitch-figure>
      ${slider(this.count, { label: 'Block', min: 1, max: Math.max(search.blocks.length, 1), words }, (at) => this.lookAt(at))}
      <p class="readout number muted">${words}</p>
      ${numberTable(
        ['Level', 'Block', 'Looked at'],
        levels.map(({ level, side, count }) => [
          level,
          level === 0 ? 'one pose' : formatLength(side),
          formatCount(count),
        ]),
      )}
      <button
        ?disabled=${!best}
        @click=${() => {
          if (best) void this.session.startFrom(poseOfBlock(search.center, best));
        }}
      >
        Run ICP from the best pose${best ? ` (score ${best.bound.toFixed(3)})` : ''}
      </button>`;
  }

  private lookAt(count: number): void {
    const { search } = this;
    if (!search) return;
    this.count = Math.min(Math.max(count, 1), search.blocks.length);
    const block = search.blocks[this.count - 1];
    this.point(block ? poseOfBlock(search.center, block) : null);
  }

  private point(detail: ArrayLike<number> | null): void {
    this.dispatchEvent(new CustomEvent('ghost-shown', { detail, bubbles: true, composed: true }));
  }

  static override styles = [shared, labStyles, sideStyles, figureStyles];
}
