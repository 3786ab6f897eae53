import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { FrameResult, IterationRecord } from '../engine/protocol.js';
import { CHART_VIEW_BOX, lineChart } from '../views/chart.js';
import { baseName, formatLength, formatPercent, plural } from '../views/format.js';
import type { Rgb } from '../views/palette.js';
import { badList, frameStyles, frameBars, numBad } from './frame-parts.js';
import { shared, wrap } from '../components/theme.js';
import { panelStyles, statusStyles } from '../components/panel-theme.js';
import { fire } from '../components/fire.js';

/**
 * All scans at a glance, while none is selected: which need a look, how well each fits, what the engine has to say.
 *
 * Fires `frame-selected` with a frame number, and with it `why-wanted` where that scan is to explain its residual.
 */
@customElement('scanstitch-overview')
export class ScanstitchOverview extends LitElement {
  @property({ attribute: false }) frames: readonly FrameResult[] = [];
  /** Rounds of the joint solution; empty without one. */
  @property({ attribute: false }) joint_history: readonly IterationRecord[] = [];
  /** What else the engine has to say, in whole sentences. */
  @property({ attribute: false }) notes: readonly string[] = [];
  @property({ attribute: false }) errors: readonly (number | null)[] = [];
  @property({ attribute: false }) referenceName = '';
  @property({ attribute: false }) colors: readonly Rgb[] = [];

  protected override render(): TemplateResult {
    const { frames, notes } = this;
    if (frames.length === 0) {
      return html`<p class="muted">The result of each scan appears here once scans are loaded.</p>`;
    }
    const badCount = numBad(frames);
    return html`
      <header><h2>All scans</h2></header>
      <p>${this.assessment(badCount)}</p>
      ${badCount > 0 ? badList(frames, this.colors, (frame) => this.select(frame)) : nothing}
      ${notes.map((note) => html`<p class="explanation">${note}</p>`)} ${this.renderWorst()}
      ${frames.length > 1 ? this.renderCharts() : nothing}
    `;
  }

  private assessment(badCount: number): string {
    const { length } = this.frames;
    if (length === 1) {
      return 'A single scan: there is nothing to register it against. Drop the scans that follow it.';
    }
    if (badCount > 0) return `${plural(badCount, 'scan')} of ${length} to check:`;
    return `All ${length} scans were registered. Select one here, in the table or on the map to see how.`;
  }

  /** The scan with the largest residual, where there are others to compare it with. */
  private renderWorst(): TemplateResult | typeof nothing {
    const matched = this.frames.flatMap((frame, at) => (frame.iterations > 0 ? [{ frame, at }] : []));
    const [first, second] = matched.sort((a, b) => b.frame.inlier_rmse - a.frame.inlier_rmse);
    if (!first || !second) return nothing;
    const { frame, at } = first;
    return html`<p class="worst">
      <span>Largest residual: ${baseName(frame.name)}, ${formatLength(frame.inlier_rmse)}</span>
      <button
        @click=${() => {
          fire(this, 'why-wanted');
          this.select(at);
        }}
      >
        Why is this scan worst?
      </button>
    </p>`;
  }

  private renderCharts(): TemplateResult {
    const { frames, joint_history } = this;
    const matched = (value: (frame: FrameResult) => number): (number | null)[] =>
      frames.map((frame) => (frame.iterations > 0 ? value(frame) : null));
    return html`
      ${this.renderBars(
        'Residual (rmse)',
        'Root mean square distance of matched points where the scan was registered: lower is better.',
        matched(({ inlier_rmse }) => inlier_rmse),
        formatLength,
      )}
      ${this.renderBars(
        'Matched points (inliers)',
        'Share of the scan’s points: higher is better.',
        matched(({ fitness }) => fitness),
        formatPercent,
      )}
      ${this.renderBars(`Distance to ${baseName(this.referenceName)}`, 'Lower is better.', this.errors, formatLength)}
      ${joint_history.length > 0 ? this.renderJoint() : nothing}
    `;
  }

  private renderJoint(): TemplateResult {
    const values = this.joint_history.map(({ inlier_rmse }) => inlier_rmse);
    return html`<section>
      <h3>Joint optimisation of all scans</h3>
      <p class="explanation">
        Root mean square distance of the matched points of all pairs of scans, while their poses are solved together, by
        iteration. The sharpness above is another measure: the mean distance between the surfaces of overlapping scans
        in the finished map.
      </p>
      <svg
        viewBox=${CHART_VIEW_BOX}
        role="img"
        aria-label="From ${formatLength(values[0] ?? 0)} to ${formatLength(values.at(-1) ?? 0)} in ${plural(
          values.length,
          'iteration',
        )}."
      >
        ${lineChart({ values, format: formatLength, step: 'iteration', first: 1, color: 'var(--accent)', scale: 'linear' })}
      </svg>
    </section>`;
  }

  private renderBars(
    title: string,
    explanation: string,
    values: readonly (number | null)[],
    format: (value: number) => string,
  ): TemplateResult | typeof nothing {
    const { frames, colors } = this;
    const select = (frame: number | null): void => this.select(frame);
    return frameBars({ noun: 'scan', frames, colors, selected: null, select, title, explanation, values, format });
  }

  private select(frame: number | null): void {
    fire(this, 'frame-selected', frame);
  }

  static override styles = [
    shared,
    statusStyles,
    panelStyles,
    frameStyles,
    css`
      .worst {
        ${wrap};
        justify-content: space-between;
        gap: 6px 10px;
      }
    `,
  ];
}
