import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { FrameResult } from '../engine/protocol.ts';
import { barAt, barChart, CHART_VIEW_BOX, lineChart } from '../views/chart.ts';
import {
  baseName,
  formatAngle,
  formatCoordinate,
  formatCount,
  formatDuration,
  formatLength,
  formatPercent,
  plural,
} from '../views/format.ts';
import { cssColor, type Rgb } from '../views/palette.ts';
import { cleaningWords, directionWords, frameSummary } from '../views/words.ts';
import { icon } from './icons.ts';
import { statusBadge } from './status-badge.ts';
import { shared, status_styles } from './theme.ts';

/** Of a run that went wrong as a whole, the first few scans say enough. */
const MAX_BAD_SHOWN = 6;

/**
 * Why a scan was placed where it is: verdict, evidence, uncertainty, the course of the iterations. With no scan
 * selected: all scans at a glance.
 *
 * Fires `frame-selected` with a frame number or null, `pairs-toggled` with a boolean, and `scan-removed` with a name.
 */
@customElement('scanstitch-why')
export class ScanstitchWhy extends LitElement {
  @property({ attribute: false }) frames: readonly FrameResult[] = [];
  @property({ attribute: false }) selected: number | null = null;
  @property({ attribute: false }) ms: readonly number[] = [];
  @property({ attribute: false }) errors: readonly (number | null)[] = [];
  @property({ attribute: false }) reference_name = '';
  @property({ type: Boolean }) pairs_shown = false;
  /** Whether a scan may be left out: not the last one. */
  @property({ type: Boolean }) removable = false;
  @property({ attribute: false }) colors: readonly Rgb[] = [];

  protected override render(): TemplateResult {
    const frame = this.selected === null ? undefined : this.frames[this.selected];
    return frame && this.selected !== null ? this.renderFrame(frame, this.selected) : this.renderAll();
  }

  private renderAll(): TemplateResult {
    const { frames } = this;
    if (frames.length === 0)
      return html`<p class="muted">The result of each scan appears here once scans are loaded.</p>`;
    const bad = frames.flatMap(({ status }, frame) => (status === 'good' ? [] : [frame]));
    return html`
      <header><h2>All scans</h2></header>
      <p>
        ${
          frames.length === 1
            ? 'One scan alone: its points are shown, but there is nothing to align it with. Drop the scans that follow it.'
            : bad.length === 0
              ? `All ${frames.length} scans found their place. Select one, here, in the table or on the map, to see why it lies where it does.`
              : `${plural(bad.length, 'scan')} of ${frames.length} ${bad.length === 1 ? 'needs' : 'need'} a look:`
        }
      </p>
      ${
        bad.length > 0
          ? html`<ul class="bad">
              ${bad.slice(0, MAX_BAD_SHOWN).map(
                (frame) => html`<li>
                  <button @click=${() => this.select(frame)}>
                    <i class="swatch" style="background: ${cssColor(this.colors[frame] ?? [0, 0, 0])}"></i>${baseName(
                      frames[frame]?.name ?? '',
                    )}
                    ${statusBadge(frames[frame]?.status ?? 'good')}
                  </button>
                </li>`,
              )}
              ${bad.length > MAX_BAD_SHOWN ? html`<li class="muted">and ${bad.length - MAX_BAD_SHOWN} more</li>` : nothing}
            </ul>`
          : nothing
      }
      ${
        frames.length > 1
          ? this.renderBars(
              'Distance between partners',
              'After alignment, root mean square per scan: lower is better.',
              frames.map((frame) => (frame.history.length > 0 ? frame.inlier_rmse : null)),
              formatLength,
            )
          : nothing
      }
      ${
        frames.length > 1
          ? this.renderBars(
              'Points that found a partner',
              'Share of each scan that overlaps what it was aligned with: higher is better.',
              frames.map((frame) => (frame.history.length > 0 ? frame.fitness : null)),
              formatPercent,
            )
          : nothing
      }
      ${
        this.errors.some((error) => error !== null)
          ? this.renderBars(
              `Distance to ${baseName(this.reference_name)}`,
              'Per scan, against the reference trajectory: lower is better.',
              this.errors,
              formatLength,
            )
          : nothing
      }
    `;
  }

  private renderBars(
    title: string,
    explanation: string,
    values: readonly (number | null)[],
    format: (value: number) => string,
  ): TemplateResult {
    const colors = this.colors.map((color) => cssColor(color));
    const known = values.filter((value) => value !== null);
    if (known.length === 0) return html``;
    const words = `${title}: from ${format(Math.min(...known))} to ${format(Math.max(...known))} over ${plural(known.length, 'scan')}.`;
    return html`<section>
      <h3>${title}</h3>
      <p class="explanation">${explanation}</p>
      <svg
        class="bars"
        viewBox=${CHART_VIEW_BOX}
        role="img"
        aria-label=${words}
        @click=${(event: MouseEvent) => {
          const box = (event.currentTarget as Element).getBoundingClientRect();
          this.select(barAt((event.clientX - box.left) / box.width, values));
        }}
      >
        ${barChart({ values, format, colors, names: this.frames.map(({ name }) => baseName(name)), selected: this.selected })}
      </svg>
    </section>`;
  }

  private renderFrame(frame: FrameResult, index: number): TemplateResult {
    const { T_world_sensor: pose, std, history } = frame;
    const color = this.colors[index] ?? [0, 0, 0];
    const error = this.errors[index] ?? null;
    const is_matched = history.length > 0;
    return html`
      <header>
        <i class="swatch" style="background: ${cssColor(color)}"></i>
        <h2 title=${frame.name}>${baseName(frame.name)}</h2>
        ${statusBadge(frame.status)}
        <span class="steps">
          <button
            class="quiet icon"
            ?disabled=${index === 0}
            @click=${() => this.select(index - 1)}
            aria-label="Scan before"
            title="Scan before (,)"
          >
            ${icon('previous')}
          </button>
          <button
            class="quiet icon"
            ?disabled=${index === this.frames.length - 1}
            @click=${() => this.select(index + 1)}
            aria-label="Scan after"
            title="Scan after (.)"
          >
            ${icon('next')}
          </button>
          <button class="quiet icon" @click=${() => this.select(null)} aria-label="Back to all scans" title="Back to all scans (Esc)">
            ${icon('close')}
          </button>
        </span>
      </header>
      <p class="summary">${frame.reason || frameSummary(frame, index)}</p>
      ${frame.reason && is_matched ? html`<p class="muted">${frameSummary(frame, index)}</p>` : nothing}
      ${
        frame.undetermined
          ? html`<p class="open-direction">
              ${icon('both_ways')}<span>${directionWords(frame.undetermined)} It is the double arrow on the map.</span>
            </p>`
          : nothing
      }
      <dl class="facts number">
        <dt>Position</dt>
        <dd>x ${formatCoordinate(pose.x)} m, y ${formatCoordinate(pose.y)} m</dd>
        <dt>Heading</dt>
        <dd>${formatAngle(pose.theta)}</dd>
        ${
          std
            ? html`<dt><abbr title="One standard deviation, as far as the scan's own noise tells">Uncertainty</abbr></dt>
                <dd>x ±${formatLength(std.x)}, y ±${formatLength(std.y)}, ±${formatAngle(std.theta, 3)}</dd>`
            : nothing
        }
        ${
          error === null
            ? nothing
            : html`<dt>From ${baseName(this.reference_name)}</dt>
                <dd>${formatLength(error)}</dd>`
        }
        <dt>Points</dt>
        <dd>${cleaningWords(frame.cleaning)}</dd>
        <dt>Time</dt>
        <dd>${formatDuration(this.ms[index] ?? 0)}</dd>
      </dl>
      ${
        is_matched
          ? html`
              <label class="pairs">
                <input
                  type="checkbox"
                  .checked=${this.pairs_shown}
                  @change=${(event: Event) => this.emit('pairs-toggled', (event.target as HTMLInputElement).checked)}
                />
                Draw a line from each point to its partner
              </label>
              ${this.renderHistory(frame)}
            `
          : nothing
      }
      ${
        this.removable
          ? html`<p>
              <button class="quiet remove" @click=${() => this.emit('scan-removed', frame.name)}>
                ${icon('trash')}Leave this scan out
              </button>
            </p>`
          : nothing
      }
    `;
  }

  private renderHistory({ history }: FrameResult): TemplateResult {
    const first = history[0];
    const last = history.at(-1);
    const chart = (title: string, values: number[], format: (value: number) => string, color: string): TemplateResult =>
      html`<h3>${title}</h3>
        <svg
          viewBox=${CHART_VIEW_BOX}
          role="img"
          aria-label="${title}, by round: from ${format(values[0] ?? 0)} to ${format(values.at(-1) ?? 0)} in ${plural(values.length, 'round')}."
        >
          ${lineChart({ values, format, step: 'round', first: 1, color, from_zero: true })}
        </svg>`;
    return html`
      <section>
        ${chart(
          'Distance between partners (rmse)',
          history.map(({ inlier_rmse }) => inlier_rmse),
          formatLength,
          'var(--accent)',
        )}
        ${chart(
          'Points with a partner (inliers)',
          history.map(({ num_inliers }) => num_inliers),
          formatCount,
          'var(--good)',
        )}
        ${
          first && last
            ? html`<p class="explanation">
                The first round moved the scan by ${formatLength(first.translation_step)} and
                ${formatAngle(Math.abs(first.rotation_step))}, the last one by ${formatStep(last.translation_step)} and
                ${formatAngle(Math.abs(last.rotation_step), 4)}.
              </p>`
            : nothing
        }
        <details>
          <summary>All ${plural(history.length, 'round')} in numbers</summary>
          <div class="scroll">
            <table class="number">
              <thead>
                <tr>
                  <th scope="col">round</th>
                  <th scope="col">pairs</th>
                  <th scope="col">inliers</th>
                  <th scope="col">rmse</th>
                  <th scope="col">moved</th>
                  <th scope="col">turned</th>
                </tr>
              </thead>
              <tbody>
                ${history.map(
                  (record, i) => html`<tr>
                    <th scope="row">${i + 1}</th>
                    <td>${formatCount(record.num_correspondences)}</td>
                    <td>${formatCount(record.num_inliers)}</td>
                    <td>${formatLength(record.inlier_rmse)}</td>
                    <td>${formatStep(record.translation_step)}</td>
                    <td>${formatAngle(Math.abs(record.rotation_step), 4)}</td>
                  </tr>`,
                )}
              </tbody>
            </table>
          </div>
        </details>
      </section>
    `;
  }

  private select(frame: number | null): void {
    if (frame === null || (frame >= 0 && frame < this.frames.length)) this.emit('frame-selected', frame);
  }

  private emit(type: string, detail: unknown): void {
    this.dispatchEvent(new CustomEvent(type, { detail, bubbles: true, composed: true }));
  }

  static override styles = [
    shared,
    status_styles,
    css`
      :host {
        display: flex;
        flex-direction: column;
        gap: 12px;
        padding: 14px 16px 24px;
        overflow-wrap: anywhere;
      }
      header {
        display: flex;
        align-items: center;
        gap: 8px;
        min-height: 32px;
      }
      header h2 {
        overflow: hidden;
        text-overflow: ellipsis;
        white-space: nowrap;
      }
      .steps {
        display: flex;
        margin-left: auto;
      }
      .swatch {
        flex: none;
        width: 12px;
        height: 12px;
        border-radius: 50%;
      }
      .bad {
        display: grid;
        justify-items: start;
        gap: 6px;
      }
      .explanation {
        color: var(--muted);
        font-size: 12.5px;
      }
      .open-direction {
        display: flex;
        gap: 8px;
        padding: 8px 10px;
        border-radius: var(--radius);
        background: var(--doubtful-soft);
        color: var(--doubtful);
      }
      .open-direction svg {
        margin-top: 2px;
        color: light-dark(#b3261e, #ff8a80);
      }
      .facts {
        display: grid;
        grid-template-columns: auto 1fr;
        gap: 4px 14px;
        font-size: 13px;
      }
      .facts dt {
        color: var(--muted);
      }
      abbr {
        text-decoration: underline dotted;
        text-underline-offset: 2px;
      }
      section {
        display: flex;
        flex-direction: column;
        gap: 4px;
      }
      section > svg {
        width: 100%;
        height: auto;
        color: var(--muted);
      }
      section > svg + h3 {
        margin-top: 10px;
      }
      svg.bars {
        cursor: pointer;
      }
      .axes line {
        stroke: var(--line);
      }
      .axes text {
        fill: var(--muted);
        font-size: 10.5px;
        font-variant-numeric: tabular-nums;
      }
      .pairs {
        display: flex;
        align-items: center;
        gap: 8px;
        min-height: 28px;
        cursor: pointer;
      }
      .pairs input {
        margin: 0;
        accent-color: var(--accent);
      }
      .remove {
        margin-left: -12px;
        color: var(--muted);
      }
      summary {
        color: var(--muted);
        font-size: 12.5px;
        cursor: pointer;
      }
      .scroll {
        overflow-x: auto;
      }
      table {
        width: 100%;
        margin-top: 6px;
        border-collapse: collapse;
        font-size: 11.5px;
      }
      th,
      td {
        padding: 2px 3px;
        text-align: right;
        font-weight: 400;
        white-space: nowrap;
      }
      thead th {
        color: var(--muted);
      }
    `,
  ];
}

/** The last steps are far below a millimetre. */
function formatStep(metres: number): string {
  const size = Math.abs(metres);
  return size > 0 && size < 5e-5 ? `${(size * 1e6).toFixed(size < 1e-6 ? 2 : 0)}\u202fµm` : formatLength(size);
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-why': ScanstitchWhy;
  }
}
