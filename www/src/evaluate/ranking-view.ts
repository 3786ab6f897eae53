import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { sortHead } from '../components/number-table.js';
import { shared } from '../components/theme.js';
import { tableStyles } from '../components/panel-theme.js';
import { rankingStyles, sectionStyles } from '../components/section-styles.js';
import type { Comparison, Refusal } from './protocol.js';
import { bareProblem, type Column, csv, formatValue, markdown } from './table.js';
import { fire } from '../components/fire.js';

export interface Sort {
  id: string;
  isDescending: boolean;
}

/**
 * The estimates, ranked by a figure, and those that could not be compared, with the reason. Fires `estimate-selected` and
 * `estimate-removed` (the id), `sort-changed`, and `said` (words for those who do not see it).
 */
@customElement('scanstitch-ranking')
export class ScanstitchRanking extends LitElement {
  /** From the first of the present order. */
  @property({ attribute: false }) ranked: readonly Comparison[] = [];
  @property({ attribute: false }) refusals: readonly Refusal[] = [];
  @property({ attribute: false }) columns: readonly Column[] = [];
  @property({ attribute: false }) sort: Sort = { id: 'rmse', isDescending: false };
  @property({ attribute: false }) selectedId = -1;
  @property({ attribute: false }) elapsed_ms = 0;
  @property({ attribute: false }) referenceName = '';
  @property({ attribute: false }) colors: ReadonlyMap<number, string> = new Map();

  protected override render(): TemplateResult {
    const { ranked, refusals } = this;
    const count = ranked.length + refusals.length;
    const words =
      ranked.length === 0
        ? `${refusals.length === 1 ? 'The estimate' : `None of the ${count} estimates`} could ${refusals.length === 1 ? 'not ' : ''}be compared with ${this.referenceName}`
        : `${ranked.length} compared with ${this.referenceName} in ${this.elapsed_ms.toFixed(0)} ms${
            refusals.length === 0 ? '' : `, ${refusals.length} could not be`
          }`;
    return html`<section class="ranking" aria-label=${count === 1 ? 'Figures' : 'Ranking'}>
      <header>
        <h2>${count === 1 ? 'Figures' : 'Ranking'}</h2>
        <span class="muted">${words}${ranked.length > 1 ? '; select a column to sort by it' : ''}</span>
        <span class="save">
          <button class="quiet" @click=${() => this.copy(markdown, 'Markdown')}>Copy Markdown</button>
          <button class="quiet" @click=${() => this.copy(csv, 'CSV')}>Copy CSV</button>
        </span>
      </header>
      <div class="scroll" role="region" aria-label="Table" tabindex="0">
        <table aria-label="Estimates, ranked">
          <thead>
            <tr>
              <th scope="col">#</th>
              <th scope="col" class="name">estimate</th>
              <th scope="col">poses</th>
              ${this.columns.map((column) => this.renderHead(column))}
              <th scope="col"><span class="visually-hidden">remove</span></th>
            </tr>
          </thead>
          <tbody>
            ${ranked.map((comparison, index) => this.renderRow(comparison, index))}
            ${refusals.map((refusal) => this.renderRefusal(refusal))}
          </tbody>
        </table>
      </div>
    </section>`;
  }

  private renderHead({ id, label, hint }: Column): TemplateResult {
    const { sort } = this;
    const isDescending = sort.id === id ? sort.isDescending : null;
    return sortHead(label, hint, isDescending, (next) => fire(this, 'sort-changed', { id, isDescending: next }));
  }

  private renderRow(comparison: Comparison, index: number): TemplateResult {
    const { id, name, summary } = comparison;
    const isSelected = id === this.selectedId;
    return html`<tr class=${isSelected ? 'selected' : ''} @click=${() => fire(this, 'estimate-selected', id)}>
      <td>${index + 1}</td>
      <td class="name">
        <button
          class="link"
          aria-pressed=${isSelected}
          @click=${(event: Event) => {
            event.stopPropagation();
            fire(this, 'estimate-selected', id);
          }}
        >
          <i style="background:${this.colors.get(id) ?? 'none'}"></i>${name}
        </button>
      </td>
      <td>${summary.num_matched}/${summary.num_estimate}</td>
      ${this.columns.map((column) => html`<td>${formatValue(column.value(comparison))}</td>`)}
      <td>${this.renderRemove(id, name)}</td>
    </tr>`;
  }

  private renderRefusal(refusal: Refusal): TemplateResult {
    return html`<tr class="refused">
      <td>–</td>
      <td class="name">${refusal.name}</td>
      <td colspan=${this.columns.length + 1} class="why">${icon('doubtful', 14)}${bareProblem(refusal)}</td>
      <td>${this.renderRemove(refusal.id, refusal.name)}</td>
    </tr>`;
  }

  private renderRemove(id: number, name: string): TemplateResult | typeof nothing {
    return iconButton(
      'close',
      `Remove ${name}`,
      (event: Event) => {
        event.stopPropagation();
        fire(this, 'estimate-removed', id);
      },
      { size: 12 },
    );
  }

  private async copy(write: typeof markdown, form: string): Promise<void> {
    const { ranked, refusals, columns, referenceName } = this;
    try {
      await navigator.clipboard.writeText(write({ ranked, refusals, columns, referenceName }));
      fire(this, 'said', `The table was copied as ${form}.`);
    } catch {
      fire(this, 'said', 'The browser did not allow copying.');
    }
  }

  static override styles = [shared, sectionStyles, tableStyles, rankingStyles];
}
