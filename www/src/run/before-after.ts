import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { check } from '../components/fields.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { RESET } from '../components/panel-icons.js';
import { row, shared, wrap } from '../components/theme.js';
import { fire } from '../components/fire.js';

/** One figure of a result, to be compared with the same one of another result. */
export interface Measure {
  label: string;
  /** Null: this result has none. */
  value: number | null;
  format: (value: number) => string;
}

/** Changes that are named; a preset makes more. */
const MOST_NAMED = 3;

/**
 * What a changed setting has made of the result: the figures before and after it, side by side, and the result before it on the
 * map.
 *
 * Fires `before-shown` with whether the map shows it, `before-wanted` to go back to it, and `before-dismissed`.
 */
@customElement('scanstitch-before-after')
export class ScanstitchBeforeAfter extends LitElement {
  /** "Strategy: Joint → Scan to map", one for each setting. */
  @property({ attribute: false }) changes: readonly string[] = [];
  @property({ attribute: false }) earlier: readonly Measure[] = [];
  /** Null while it is computed. */
  @property({ attribute: false }) later: readonly Measure[] | null = null;
  @property({ type: Boolean }) shown = true;

  protected override render(): TemplateResult {
    const { changes } = this;
    const words = changes.length > MOST_NAMED ? `${changes.length} settings changed` : changes.join('; ');
    return html`<section aria-label="Before and after">
      <p class="changes" title=${changes.join('; ')}>${words}</p>
      <dl class="number">${this.earlier.map((measure) => this.renderMeasure(measure))}</dl>
      <span class="actions">
        ${check('Before, in grey', this.shown, (isOn) => fire(this, 'before-shown', isOn))}
        <button @click=${() => fire(this, 'before-wanted')}>${icon(RESET)}Back</button>
        ${iconButton('close', 'Dismiss the comparison with the result before', () => fire(this, 'before-dismissed'), { hint: 'Dismiss' })}
      </span>
    </section>`;
  }

  private renderMeasure({ label, value, format }: Measure): TemplateResult | typeof nothing {
    const now = this.later?.find((other) => other.label === label)?.value ?? null;
    if (value === null && now === null) return nothing;
    const words = (one: number | null): string => (one === null ? '–' : format(one));
    const difference = value === null || now === null ? 0 : now - value;
    const sign = difference > 0 ? '+' : '\u2212';
    return html`<div>
      <dt>${label}</dt>
      <dd>
        ${words(value)} → ${this.later ? html`<b>${words(now)}</b>` : '…'}
        ${difference === 0 ? nothing : html`<span class="muted">${sign}${format(Math.abs(difference))}</span>`}
      </dd>
    </div>`;
  }

  static override styles = [
    shared,
    css`
      :host {
        flex: none;
      }
      section {
        ${wrap};
        gap: 2px 20px;
        padding: 4px 8px 4px 16px;
        border-bottom: 1px solid var(--line);
        background: var(--accent-soft);
        font-size: calc(13 * var(--px));
      }
      .changes {
        font-weight: 600;
      }
      dl {
        display: flex;
        flex: 1 1 100%;
        flex-wrap: wrap;
        gap: 2px 18px;
        order: 1;
      }
      dl > div {
        display: flex;
        gap: 6px;
      }
      dt {
        color: var(--muted);
      }
      .actions {
        ${row};
        gap: 8px;
        margin-left: auto;
      }
      .actions button {
        min-height: 28px;
      }
      label {
        ${row};
        gap: 6px;
        min-height: 24px;
      }
    `,
  ];
}
