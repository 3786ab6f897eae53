import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { FrameResult, IterationRecord } from '../engine/protocol.js';
import { CHART_VIEW_BOX, type ChartSpec, lineChart } from '../views/chart.js';
import {
  baseName,
  formatCount,
  formatDuration,
  formatLength,
  formatPercent,
  plural,
  sentence,
} from '../views/format.js';
import { formatAngle, formatCoordinate, formatStep } from '../views/pose-format.js';
import type { LongestPairs, ShownPairs } from '../views/longest-pairs.js';
import type { Rgb } from '../views/palette.js';
import { cleaningWords, directionWords, frameSummary } from '../views/frame-words.js';
import { facts } from './facts.js';
import { check } from '../components/fields.js';
import { frameStyles, frameHeader } from './frame-parts.js';
import { icon } from '../components/icons.js';
import { BOTH_WAYS, TRASH } from '../components/panel-icons.js';
import { iterationTable } from './iteration-table.js';
import { figureStyles } from '../components/number-table.js';
import { row, shared } from '../components/theme.js';
import { doubt, note, panelStyles, statusStyles } from '../components/panel-theme.js';
import { fire } from '../components/fire.js';

/**
 * Why the selected scan was placed where it is: assessment, evidence, uncertainty, the course of the iterations.
 *
 * Fires `frame-selected` with a frame number or null, `pairs-wanted` with which are to be drawn, `look-inside` with a frame number, and
 * `scan-removed` with a name.
 */
@customElement('scanstitch-why')
export class ScanstitchWhy extends LitElement {
  @property({ attribute: false }) frames: readonly FrameResult[] = [];
  @property({ attribute: false }) index = 0;
  /** Iterations of its registration; empty until they have come. */
  @property({ attribute: false }) history: readonly IterationRecord[] = [];
  @property({ attribute: false }) ms: readonly number[] = [];
  @property({ attribute: false }) errors: readonly (number | null)[] = [];
  @property({ attribute: false }) referenceName = '';
  @property({ attribute: false }) pairsShown: ShownPairs = 'none';
  /** Its longest pairs; null before they are there. */
  @property({ attribute: false }) longest: LongestPairs | null = null;
  /** Whether a scan may be left out: not the last one. */
  @property({ type: Boolean }) removable = false;
  @property({ attribute: false }) colors: readonly Rgb[] = [];

  protected override render(): TemplateResult {
    const { index } = this;
    const frame = this.frames[index];
    if (!frame) return html``;
    const isMatched = frame.iterations > 0;
    return html`
      ${frameHeader('scan', this.frames, index, this.colors[index], (to) => fire(this, 'frame-selected', to))}
      <p class="summary">${sentence(frame.reason || frameSummary(frame, index))}</p>
      ${frame.reason && isMatched ? html`<p class="muted">${frameSummary(frame, index)}</p>` : nothing}
      ${
        frame.undetermined
          ? html`<p class="degenerate-direction">
              ${icon(BOTH_WAYS)}<span>${directionWords(frame.undetermined)} The double arrow on the map shows it.</span>
            </p>`
          : nothing
      }
      ${this.renderFacts(frame)} ${isMatched ? this.renderRegistration() : nothing}
      ${
        this.removable
          ? html`<p>
              <button class="quiet remove" @click=${() => fire(this, 'scan-removed', frame.name)}>
                ${icon(TRASH)}Leave this scan out
              </button>
            </p>`
          : nothing
      }
    `;
  }

  private renderFacts(frame: FrameResult): TemplateResult {
    const { T_world_sensor: pose, std } = frame;
    const error = this.errors[this.index] ?? null;
    return facts([
      ['Position', `x ${formatCoordinate(pose.x)} m, y ${formatCoordinate(pose.y)} m`],
      ['Heading', formatAngle(pose.theta)],
      std && [
        'Uncertainty',
        `x ±${formatLength(std.x)}, y ±${formatLength(std.y)}, ±${formatAngle(std.theta, 3)}`,
        'One standard deviation against the scan before it, by registration, odometry and, where walls leave a direction open, the motion before',
      ],
      error !== null && ['Error', formatLength(error), `Distance to ${baseName(this.referenceName)}`],
      frame.iterations > 0 && [
        'Agreement',
        `${formatPercent(frame.agreement)} with the scans before`,
        'Share of its returns that agree with the scans before it',
      ],
      ['Points', cleaningWords(frame.cleaning)],
      ['Time', formatDuration(this.ms[this.index] ?? 0)],
    ]);
  }

  private renderRegistration(): TemplateResult {
    const box = (which: ShownPairs, label: string): TemplateResult =>
      check(label, this.pairsShown === which, (isOn) => fire(this, 'pairs-wanted', isOn ? which : 'none'), {
        kind: 'pairs',
      });
    return html`${box('longest', 'Show the longest pairs: where it fits worst')}
      ${this.pairsShown === 'longest' && this.longest ? this.renderLongest(this.longest) : nothing}
      ${box('all', 'Show correspondences')}
      <p>
        <button
          @click=${() => fire(this, 'look-inside', this.index)}
          title="Step through this registration in the ICP lab"
        >
          Look inside
        </button>
      </p>
      ${this.history.length > 0 ? this.renderHistory() : nothing}`;
  }

  private renderLongest({ count, total, longest, median, share }: LongestPairs): TemplateResult {
    return html`<p class="explanation">
      On the map: the ${plural(count, 'longest pair')} of ${formatCount(total)}. They have ${formatPercent(share)} of
      the sum of squared distances; the longest is ${formatLength(longest)}, half of all are below
      ${formatLength(median)}. Together in one place they show something that moved, or a surface that the scans before
      did not see. Spread over all walls, they show a pose that is off.
    </p>`;
  }

  private renderHistory(): TemplateResult {
    const { history } = this;
    const last = history.at(-1);
    const chart = (title: string, values: number[], spec: Pick<ChartSpec, 'format' | 'color' | 'scale'>) => {
      const course = `from ${spec.format(values[0] ?? 0)} to ${spec.format(values.at(-1) ?? 0)}`;
      return html`<h3>${title}</h3>
        <svg
          viewBox=${CHART_VIEW_BOX}
          role="img"
          aria-label="${title}, by iteration: ${course} in ${plural(values.length, 'iteration')}."
        >
          ${lineChart({ ...spec, values, step: 'iteration', first: 1 })}
        </svg>`;
    };
    return html`
      <section>
        ${chart(
          'Residual (rmse)',
          history.map(({ inlier_rmse }) => inlier_rmse),
          { format: formatLength, color: 'var(--accent)', scale: 'linear' },
        )}
        ${chart(
          'Matched points (inliers)',
          history.map(({ num_inliers }) => num_inliers),
          { format: formatCount, color: 'var(--good)', scale: 'linear' },
        )}
        ${chart(
          'Step size (logarithmic scale)',
          history.map(({ translation_step }) => Math.abs(translation_step)),
          { format: formatStep, color: 'var(--doubtful)', scale: 'log' },
        )}
        ${
          last
            ? html`<p class="explanation">
                ICP converges when an iteration hardly moves the scan: the last one moved it by
                ${formatStep(last.translation_step)} and turned it by ${formatAngle(Math.abs(last.rotation_step), 4)}.
              </p>`
            : nothing
        }
        ${iterationTable(history)}
      </section>
    `;
  }

  static override styles = [
    shared,
    statusStyles,
    panelStyles,
    frameStyles,
    figureStyles,
    css`
      .degenerate-direction {
        display: flex;
        gap: 8px;
        padding: 8px 10px;
        border-radius: var(--radius);
        ${doubt};
      }
      .degenerate-direction svg {
        margin-top: 2px;
        color: light-dark(#b3261e, #ff8a80);
      }
      .pairs {
        ${row};
        gap: 8px;
        min-height: 28px;
        cursor: pointer;
      }
      .remove {
        margin-left: -12px;
        color: var(--muted);
      }
      summary {
        ${note};
      }
    `,
  ];
}
