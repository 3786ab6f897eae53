import { html, nothing, type TemplateResult } from 'lit';
import { customElement, state } from 'lit/decorators.js';
import { slider } from '../components/fields.js';
import { formatCount, formatDuration, formatPercent } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { cssColor } from '../views/palette.js';
import { awayWords, basinPainter, labelColor } from './basin.js';
import { unknowns } from './equation.js';
import { isTurn, offsetsOfNode } from './grids.js';
import { difference } from './poses.js';
import type { Grid, LabFacts, Pose } from './protocol.js';

import { type Basin, type BasinSurvey } from './survey.js';
import { SurveyPanel } from './survey-panel.js';
import { strideWords } from './thinning.js';

/** Other minima that are listed. */
const MAX_LISTED = 5;

/** The basin of attraction around the result of the run. Fires `ghost-shown` with a pose or null. */
@customElement('scanstitch-lab-basin')
export class ScanstitchLabBasin extends SurveyPanel<BasinSurvey> {
  /** Share of the way through the third unknown. */
  @state() private depth = 0.5;
  protected override readonly isBasin = true;
  private painterOf = memoizeLast(basinPainter);

  /** In the plane all three unknowns. */
  protected override allAxes(facts: LabFacts): readonly number[] {
    const axes = this.axes(facts);
    return facts.is_planar ? [...axes, [0, 1, 2].find((axis) => !axes.includes(axis)) ?? 0] : axes;
  }

  protected override renderResult(facts: LabFacts): TemplateResult {
    const basin = this.survey.result;
    return html`
      <header>
        <h2>Basin of attraction</h2>
        <span class="muted"
          >${
            basin?.progress === 1
              ? `${formatCount(basin.index.length)} starts, ${formatDuration(basin.milliseconds)}${strideWords(basin.grid.stride)}`
              : 'computing…'
          }</span
        >
      </header>
      ${this.renderChoices(facts)} ${basin ? this.renderBasin(basin, facts) : nothing}
      <p class="explanation">
        Every cell is a start: a whole registration was run from there, and its colour says where it ended.
        ${
          this.session.trace?.converged
            ? nothing
            : 'This run did not converge: its end is where it stopped. A higher iteration limit (under Methods) leads on.'
        }
      </p>
    `;
  }

  private renderBasin(basin: Basin, facts: LabFacts): TemplateResult {
    const { labels, grid, progress } = basin;
    return html`
      <p class="number">
        <span class="big">${formatPercent(labels.share_home)}</span> of these starts lead to the same result as this run
      </p>
      ${progress < 1 ? html`<progress max="1" .value=${progress} aria-label="Starts done"></progress>` : nothing}
      <scanstitch-figure
        class="map"
        steppable
        label="Starts, coloured by where they end"
        description="${formatPercent(labels.share_home)} of these starts lead to the same result as this run. ${this.readout(facts)} Arrow keys go from start to start, Enter runs from there."
        .painter=${this.painterOf(
          basin,
          this.layerOf(grid),
          this.marksOf(this.session.pose, this.session.trace, facts, grid),
          this.colorsOf(this.dark),
          this.dark,
        )}
        @figure-pointer=${this.onPointer}
        @keydown=${this.onKey}
        @click=${this.startHere}
      ></scanstitch-figure>
      ${grid.size.length > 2 ? this.renderDepth(grid, facts) : nothing}
      <p class="readout number muted">
        ${this.readout(facts) || 'Point at a start to see where it ends; click to run from there'}
      </p>
      <ul class="minima number">
        ${labels.minima.slice(0, MAX_LISTED).map(({ count, lowest }, label) => {
          const T = lowest?.[0] ?? null;
          const words =
            label === 0 || !T ? 'the same result' : `another minimum, ${awayWords(difference(grid.T_center, T))} away`;
          return this.renderLabel(label, count, words, T);
        })}
        ${this.renderLabel(-1, labels.labels.filter((label) => label < 0).length, 'did not converge', null)}
      </ul>
    `;
  }

  private renderLabel(label: number, count: number, words: string, T: Pose | null): TemplateResult | typeof nothing {
    const total = this.survey.result?.labels.labels.length ?? 0;
    if (count === 0) return nothing;
    return html`<li @pointerenter=${() => this.tellGhost(T)} @pointerleave=${() => this.tellGhost(null)}>
      <i style="background: ${cssColor(labelColor(label, this.dark))}"></i>${formatPercent(count / Math.max(total, 1))}
      ${words}
    </li>`;
  }

  private renderDepth(grid: Grid, { is_planar }: LabFacts): TemplateResult {
    const axis = grid.axes[2] ?? 0;
    const offset = offsetsOfNode(grid, [0, 0, this.layerOf(grid)])[2] ?? 0;
    const value = isTurn(axis, is_planar) ? `${((offset * 180) / Math.PI).toFixed(0)}°` : `${offset.toFixed(2)} m`;
    const name = unknowns(is_planar ? 3 : 6)[axis];
    const step = 1 / Math.max((grid.size[2] ?? 1) - 1, 1);
    const choose = (depth: number): void => {
      this.depth = depth;
      this.node = null;
    };
    return html`<label class="row number"
      >Start at ${name} = ${value} ${slider(this.depth, { step, words: `${name} ${value}` }, choose)}</label
    >`;
  }

  private layerOf({ size }: Grid): number {
    return Math.round(this.depth * ((size[2] ?? 1) - 1));
  }

  protected override withLayer(node: readonly number[] | null): readonly number[] | null {
    const grid = this.survey.result?.grid;
    return node && grid && grid.size.length > 2 ? [...node.slice(0, 2), this.layerOf(grid)] : node;
  }

  /** Index of the end of the start that is pointed at; -1: not known. */
  private endOfNode(): number {
    const basin = this.survey.result;
    if (!basin || !this.node) return -1;
    const [columns = 1, rows = 1] = basin.grid.size;
    const [column = 0, row = 0, layer = 0] = this.node;
    return basin.index[(layer * rows + row) * columns + column] ?? -1;
  }

  private readout(facts: LabFacts): string {
    const basin = this.survey.result;
    const end = this.endOfNode();
    if (!basin || end < 0) return '';
    const label = basin.labels.labels[end] ?? -1;
    const where = label === 0 ? 'the same result' : label < 0 ? 'not converged' : 'another minimum';
    return `From ${this.nodeWords(facts)}: ${where} after ${basin.ends.iterations[end]} iterations`;
  }

  /** Where the start that is pointed at ends. */
  protected override onNode(): void {
    const end = this.endOfNode();
    const basin = this.survey.result;
    this.tellGhost(basin && end >= 0 ? basin.ends.T_target_source.subarray(16 * end, 16 * end + 16) : null);
  }
}
