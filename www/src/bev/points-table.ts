import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { iconButton } from '../components/icon-button.js';
import { shared, small } from '../components/theme.js';
import { tableStyles } from '../components/panel-theme.js';
import { type BevDocument, markedPixels, STATUS_WORDS } from './document.js';
import { letter } from './paint.js';
import { shortNumber } from './picture.js';
import type { BevPoint } from './protocol.js';
import { fire } from '../components/fire.js';

const NO_POINTS: readonly BevPoint[] = [];

/** A number of a mark, typed in. */
export interface TypedPixel {
  index: number;
  axis: 0 | 1;
  value: number;
}

/**
 * Every mark with its pixel, its place on the ground and its projection.
 *
 * Fires `pixel-typed` (TypedPixel) and `row-removed` with the index.
 */
@customElement('scanstitch-bev-points')
export class ScanstitchBevPoints extends LitElement {
  @property({ attribute: false }) document: BevDocument | null = null;
  /** The points, in whole pixels where these are wanted. */
  @property({ attribute: false }) points: readonly BevPoint[] = NO_POINTS;
  @property({ attribute: false }) selected: number | null = null;

  protected override render(): TemplateResult | typeof nothing {
    const { document } = this;
    if (!document) return nothing;
    const columns = ['#', 'top u', 'top v', 'x (m)', 'y (m)', 'z (m)', 'front u', 'front v'];
    return html`<table aria-label="Points and their projections">
      <thead>
        <tr>
          ${columns.map((column) => html`<th scope="col">${column}</th>`)}
          <th></th>
          <th></th>
        </tr>
      </thead>
      <tbody>
        ${markedPixels(document).map((_, index) => this.renderRow(document, index))}
      </tbody>
    </table>`;
  }

  private renderRow(document: BevDocument, index: number): TemplateResult {
    // Points of a grid follow from its corners.
    const isEditable = document.tool !== 'grid';
    const name = document.tool === 'pairs' ? letter(index) : String(index + 1);
    const pixel = markedPixels(document)[index] ?? [0, 0];
    const point = this.points[index];
    const status = point?.status ?? 'visible';
    return html`<tr class=${index === this.selected && isEditable ? 'selected' : ''}>
      <td>${name}</td>
      ${([0, 1] as const).map((axis) =>
        isEditable
          ? html`<td>
              <input
                type="number"
                step="any"
                aria-label="Point ${name}, top ${axis === 0 ? 'u' : 'v'}"
                .value=${String(Number(pixel[axis].toFixed(4)))}
                @change=${(event: Event) => this.type(index, axis, event)}
              />
            </td>`
          : html`<td>${shortNumber(pixel[axis])}</td>`,
      )}
      ${[0, 1, 2].map((axis) => html`<td>${point?.ground?.[axis]?.toFixed(3) ?? '–'}</td>`)}
      ${[0, 1].map((axis) => {
        const value = point?.projected?.[axis];
        return html`<td class="front">${value === undefined ? '–' : shortNumber(value)}</td>`;
      })}
      <td class="status ${status === 'visible' ? '' : 'unseen'}">${STATUS_WORDS[status]}</td>
      <td>
        ${
          isEditable
            ? iconButton('close', `Remove point ${name}`, () => fire(this, 'row-removed', index), { size: 12 })
            : nothing
        }
      </td>
    </tr>`;
  }

  private type(index: number, axis: 0 | 1, event: Event): void {
    const { value: text } = event.target as HTMLInputElement;
    const value = Number(text);
    if (text.trim() === '' || !Number.isFinite(value)) return;
    fire(this, 'pixel-typed', { index, axis, value });
  }

  static override styles = [
    shared,
    tableStyles,
    css`
      :host {
        max-height: 340px;
        overflow: auto;
      }
      th,
      td {
        white-space: nowrap;
      }
      th {
        position: sticky;
        top: 0;
        border-top: 0;
        background: var(--surface);
        ${small};
        font-weight: 600;
      }
      .status {
        text-align: left;
      }
      .unseen {
        color: var(--doubtful);
      }
      input {
        width: 74px;
        min-height: 28px;
        padding: 0 4px;
        font-size: calc(13 * var(--px));
        text-align: right;
      }
      button.icon {
        width: 28px;
        min-height: 28px;
      }
      .selected td {
        background: var(--selected-soft);
      }
    `,
  ];
}
