import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { column, row, shared, stretch } from '../components/theme.js';
import type { Assumption, Suggestion, TopView } from '../engine/spatial-protocol.js';
import { formatFixed } from '../views/format.js';
import { valueText } from './reading.js';
import { paintTopView, topView } from './top-view.js';
import { fire } from '../components/fire.js';

/** What the user chose: a value of a setting, the dialog with all values, or to leave it as it is. */
export type ReadingChoice =
  { choice: 'value'; setting: Suggestion['setting']; value: number } | { choice: 'more' } | { choice: 'dismiss' };

const TITLES = {
  depth_scale: 'The ground truth suggests another depth scale',
  fx: 'Another focal length fits better',
  cloud_unit: 'The ground truth suggests another unit',
  depth_values: 'What these values are',
  max_range: 'Depth is cut off',
} as const;
/** So many scales are shown with a picture. */
const MOST_PICTURES = 3;

/**
 * A question beside the map: which depth scale, with a picture of each that may be, or which unit of clouds is right; or whether to compute again with
 * the one that the ground truth suggests.
 *
 * Fires `reading-chosen` with a `ReadingChoice`.
 */
@customElement('scanstitch-reading-card')
export class ScanstitchReadingCard extends LitElement {
  @property({ attribute: false }) suggestion: Suggestion | null = null;
  /** An assumption about the depth scale or the unit of clouds that is open. */
  @property({ attribute: false }) question: Assumption | null = null;
  @property({ attribute: false }) view: TopView | null = null;
  @property({ type: Boolean }) dark = false;

  protected override render(): TemplateResult | typeof nothing {
    const { suggestion, question } = this;
    const content = suggestion ? this.renderSuggestion(suggestion) : question ? this.renderQuestion(question) : nothing;
    if (content === nothing) return nothing;
    return html`<section class="card" aria-labelledby="title">
      <header>
        ${icon('info')}
        <h2 id="title">${suggestion ? TITLES[suggestion.setting] : 'Which size is right?'}</h2>
        ${iconButton('close', 'Dismiss the question', () => this.choose({ choice: 'dismiss' }), { hint: 'Dismiss' })}
      </header>
      ${content}
    </section>`;
  }

  private renderSuggestion({ text, setting, value }: Suggestion): TemplateResult {
    return html`<p>${text}.</p>
      ${
        value === null
          ? nothing
          : html`<p class="actions">
              <button class="primary" @click=${() => this.choose({ choice: 'value', setting, value })}>
                Compute with ${setting} ${valueText(value)}
              </button>
            </p>`
      }`;
  }

  private renderQuestion({ value, why, likely, setting }: Assumption): TemplateResult {
    const image = this.view && paintTopView(this.view, this.dark);
    const isCloud = setting === 'cloud_unit';
    const unit = isCloud ? 'm' : 'per metre';
    return html`<p>
        ${
          isCloud
            ? `No file says the unit of the clouds' coordinates: ${valueText(value)} m is assumed, as ${why}.`
            : `No file says how many raw depth values make a metre: ${valueText(value)} is assumed, ${why}. The first image from above, at each scale:`
        }
      </p>
      <ul>
        ${likely.slice(0, MOST_PICTURES).map(
          (scale) =>
            html`<li>
              <button
                class="choice"
                aria-pressed=${scale === value}
                @click=${() => this.choose(scale === value ? { choice: 'dismiss' } : { choice: 'value', setting, value: scale })}
              >
                ${this.view && image ? topView(this.view, image, scale) : nothing}
                <span class="number"
                  >${valueText(scale)} ${isCloud ? unit : ''} ${scale === value ? 'assumed' : isCloud ? '' : unit}</span
                >
                ${
                  this.view
                    ? html`<span class="muted">up to ${formatFixed(this.view.far / scale, 1)}&#8239;m</span>`
                    : nothing
                }
              </button>
            </li>`,
        )}
      </ul>
      <p class="actions">
        <button @click=${() => this.choose({ choice: 'more' })}>${isCloud ? 'Another unit…' : 'Another scale…'}</button>
        <button class="primary" @click=${() => this.choose({ choice: 'dismiss' })}>Keep ${valueText(value)}</button>
      </p>`;
  }

  private choose(detail: ReadingChoice): void {
    fire(this, 'reading-chosen', detail);
  }

  static override styles = [
    shared,
    css`
      :host {
        grid-area: question;
        width: calc(270 * var(--px));
        overflow: auto;
        border-left: 1px solid var(--line);
        background: var(--surface);
        font-size: calc(13 * var(--px));
      }
      .card {
        ${column};
        gap: 8px;
        padding-bottom: 12px;
      }
      header {
        ${row};
        gap: 8px;
        padding: 4px 4px 0 12px;
        color: var(--doubtful);
      }
      h2 {
        flex: 1;
        color: var(--text);
      }
      header button {
        color: var(--muted);
      }
      .card > p {
        padding: 0 12px;
      }
      ul {
        display: grid;
        grid-template-columns: repeat(auto-fit, minmax(76px, 1fr));
        gap: 8px;
        padding: 0 12px;
      }
      .actions button {
        max-width: 100%;
        white-space: normal;
      }
      .choice {
        display: grid;
        justify-items: start;
        gap: 0;
        ${stretch};
        padding: 6px;
        text-align: left;
        white-space: normal;
      }
      .choice[aria-pressed='true'] {
        border-color: var(--accent);
        box-shadow: inset 0 0 0 1px var(--accent);
      }
      .choice svg {
        width: 100%;
        height: auto;
        border-radius: 4px;
        background: var(--sunken);
      }
      .choice line {
        stroke: var(--line-strong);
        stroke-width: 0.6;
        stroke-dasharray: 2 3;
      }
      .choice text {
        fill: var(--muted);
        font-size: 10px;
      }
      .choice path {
        fill: var(--selected);
      }
      .choice span {
        font-size: calc(12.5 * var(--px));
      }
      .actions {
        display: flex;
        flex-wrap: wrap;
        justify-content: flex-end;
        gap: 8px;
      }
      /* Below the map: without the pictures, which would leave it no height. */
      @container (max-width: 600px) {
        :host {
          width: auto;
          max-height: 40cqh;
          border-top: 1px solid var(--line);
          border-left: 0;
        }
        .choice svg {
          display: none;
        }
      }
    `,
  ];
}
