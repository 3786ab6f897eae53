import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { Figure } from '../views/headline.js';
import { cut, heard, shared, small } from '../components/theme.js';
import { fire } from '../components/fire.js';

/**
 * The figures of the whole run, each with the line that says what it means.
 *
 * Fires `figure-action` with the id of a figure's button.
 */
@customElement('scanstitch-headline')
export class ScanstitchHeadline extends LitElement {
  @property({ attribute: false }) figures: readonly Figure[] = [];
  /** In one line: what a figure means is only seen where that casts doubt on it. */
  @property({ type: Boolean, reflect: true }) compact = false;

  protected override render(): TemplateResult {
    return html`<dl aria-label="Result in figures">
      ${this.figures.map(
        ({ label, value, meaning, tone, action }) =>
          html`<div class=${tone} title=${this.compact ? meaning : nothing}>
            <dt>
              ${label}${
                action
                  ? html`<button
                      class="link"
                      aria-label=${action.description}
                      @click=${() => fire(this, 'figure-action', action.id)}
                    >
                      ${action.label}
                    </button>`
                  : nothing
              }
            </dt>
            <dd class="value number">${value}</dd>
            <dd class="meaning" title=${meaning}>${meaning}</dd>
          </div>`,
      )}
    </dl>`;
  }

  static override styles = [
    shared,
    css`
      dl {
        display: flex;
        flex-wrap: wrap;
        gap: 1px;
        background: var(--line);
      }
      dl > div {
        flex: 1 1 150px;
        min-width: 0;
        padding: 9px 16px 10px;
        background: var(--surface);
      }
      dt {
        ${small};
        ${cut};
      }
      dt button.link {
        min-height: 24px;
        margin: -4px 0 -4px 8px;
      }
      .value {
        font-size: calc(20 * var(--px));
        font-weight: 620;
        letter-spacing: -0.015em;
        line-height: 1.25;
        overflow: hidden;
        text-overflow: ellipsis;
        white-space: var(--value-wrap, nowrap);
      }
      /* Never cut: what a figure rests on often stands at its end. */
      .meaning {
        overflow-wrap: anywhere;
        ${small};
        line-height: 1.35;
      }
      :host([compact]) dl {
        gap: 4px 22px;
        padding: 6px 16px;
        background: var(--surface);
      }
      :host([compact]) dl > div {
        display: flex;
        flex: 0 1 auto;
        flex-wrap: wrap;
        align-items: baseline;
        gap: 0 6px;
        padding: 0;
      }
      :host([compact]) .value {
        font-size: calc(14 * var(--px));
      }
      :host([compact]) .plain .meaning {
        ${heard};
        white-space: nowrap;
      }
      .doubtful .meaning {
        color: var(--doubtful);
        font-weight: 550;
      }
      .lost .meaning {
        color: var(--lost);
        font-weight: 550;
      }
    `,
  ];
}
