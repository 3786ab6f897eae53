import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { plural } from '../views/format.js';
import { cssColor } from '../views/palette.js';
import type { Piece } from '../views/pieces.js';
import { shared } from './theme.js';

/**
 * What the colours, dashes and crosses of a map mean that is not certain in every place; nothing where it is.
 *
 * Fires `piece-wanted` with a piece that is to be shown.
 */
@customElement('scanstitch-map-legend')
export class ScanstitchMapLegend extends LitElement {
  /** Empty where the map is one piece. */
  @property({ attribute: false }) pieces: readonly Piece[] = [];
  /** Links of the path that are drawn dashed, and frames that are drawn as crosses. */
  @property({ attribute: false }) num_uncertain = 0;
  @property({ attribute: false }) num_lost = 0;
  /** Closed until it is asked for. */
  @property({ type: Boolean }) compact = false;

  protected override render(): TemplateResult | typeof nothing {
    const { pieces, num_uncertain, num_lost } = this;
    if (pieces.length === 0 && num_uncertain === 0) return nothing;
    const num_pieces = pieces.reduce((sum, piece) => sum + piece.num_pieces, 0);
    return html`<details ?open=${!this.compact}>
      <summary>${pieces.length > 0 ? `Map in ${plural(num_pieces, 'piece')}` : 'Uncertain links'}</summary>
      ${
        pieces.length > 0
          ? html`<p>Poses within a piece are certain. How the pieces lie relative to each other is not.</p>
              <ul>
                ${pieces.map((piece) => this.renderPiece(piece))}
              </ul>`
          : nothing
      }
      <ul class="signs">
        ${
          num_uncertain > 0
            ? html`<li><i class="dashes"></i>uncertain link<span class="number">${num_uncertain}</span></li>`
            : nothing
        }
        ${
          num_lost > 0
            ? html`<li><i class="cross">×</i>lost scan, not in the map<span class="number">${num_lost}</span></li>`
            : nothing
        }
      </ul>
    </details>`;
  }

  private renderPiece(piece: Piece): TemplateResult {
    return html`<li>
      <button
        title="Show this piece"
        @click=${() => this.dispatchEvent(new CustomEvent('piece-wanted', { detail: piece }))}
      >
        <i style="background: ${cssColor(piece.color)}"></i>${piece.label}<span class="number"
          >${plural(piece.frames.length, 'scan')}</span
        >
      </button>
    </li>`;
  }

  static override styles = [
    shared,
    css`
      :host {
        position: absolute;
        top: 10px;
        left: 10px;
        max-width: min(250px, calc(100% - 70px));
      }
      details {
        border: 1px solid var(--line);
        border-radius: var(--radius);
        background: color-mix(in srgb, var(--surface) 92%, transparent);
        font-size: 12.5px;
      }
      summary {
        padding: 6px 11px;
        font-weight: 600;
        cursor: pointer;
      }
      p {
        padding: 0 11px 5px;
        color: var(--muted);
        font-size: 12px;
      }
      ul {
        padding: 0 4px 4px;
      }
      li,
      button {
        display: flex;
        flex: 1;
        align-items: center;
        justify-content: flex-start;
        gap: 8px;
        min-height: 24px;
        text-align: left;
      }
      .signs li {
        padding: 0 7px;
      }
      button {
        padding: 0 7px;
        border: 0;
        background: none;
        font-size: inherit;
        font-weight: 400;
      }
      button:hover {
        background: var(--sunken);
      }
      i {
        flex: none;
        width: 10px;
        height: 10px;
        border-radius: 50%;
      }
      i.dashes,
      i.cross {
        width: 18px;
        height: 0;
        border-radius: 0;
        border-top: 2px dashed var(--muted);
      }
      i.cross {
        height: auto;
        border: 0;
        color: var(--lost);
        font-style: normal;
        font-weight: 700;
        text-align: center;
      }
      .number {
        margin-left: auto;
        padding-left: 8px;
        color: var(--muted);
        white-space: nowrap;
      }
    `,
  ];
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-map-legend': ScanstitchMapLegend;
  }
}
