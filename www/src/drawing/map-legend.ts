import { css, html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { plural } from '../views/format.js';
import { cssColor } from '../views/palette.js';
import type { Piece } from '../views/pieces.js';
import { row, shared } from '../components/theme.js';
import { dot } from '../components/panel-theme.js';
import { fire } from '../components/fire.js';

/**
 * What the colours, dashes and crosses of a map mean that is not certain in every place; nothing where it is.
 *
 * Fires `piece-wanted` with a piece that alone is to be shown, or null for all of the map.
 */
@customElement('scanstitch-map-legend')
export class ScanstitchMapLegend extends LitElement {
  /** Empty where the map is one piece. */
  @property({ attribute: false }) pieces: readonly Piece[] = [];
  /** Links of the path that are drawn dashed, and frames that are drawn as crosses. */
  @property({ attribute: false }) numUncertain = 0;
  @property({ attribute: false }) num_lost = 0;
  /** The piece that alone is shown; null: all are. */
  @property({ attribute: false }) shown: Piece | null = null;
  /** Closed until it is asked for. */
  @property({ type: Boolean }) compact = false;

  protected override render(): TemplateResult | typeof nothing {
    const { pieces, numUncertain } = this;
    if (pieces.length === 0 && numUncertain === 0) return nothing;
    if (pieces.length === 0) return html`<div class="lists">${this.renderSigns()}</div>`;
    const numPieces = pieces.reduce((sum, piece) => sum + piece.numPieces, 0);
    return html`<details ?open=${!this.compact}>
      <summary>
        Map in ${plural(numPieces, 'piece')}<span
          >Poses within a piece are certain. How the pieces lie relative to each other is not.</span
        >
      </summary>
      <div class="lists">
        <ul aria-label="Pieces">
          ${pieces.map((piece) => this.renderPiece(piece))}
        </ul>
        ${this.renderSigns()}
      </div>
    </details>`;
  }

  private renderSigns(): TemplateResult {
    const { numUncertain, num_lost } = this;
    return html`<ul class="signs">
      ${
        numUncertain > 0
          ? html`<li><i class="dashes"></i>uncertain link<span class="number">${numUncertain}</span></li>`
          : nothing
      }
      ${
        num_lost > 0
          ? html`<li><i class="cross">×</i>lost scan, not in the map<span class="number">${num_lost}</span></li>`
          : nothing
      }
    </ul>`;
  }

  private renderPiece(piece: Piece): TemplateResult {
    const isShown = this.shown === piece;
    return html`<li>
      <button
        aria-pressed=${isShown}
        title=${isShown ? 'Show all pieces' : `Show this piece alone${piece.exported ? `; in exports ${piece.exported}` : ''}`}
        @click=${() => fire(this, 'piece-wanted', isShown ? null : piece)}
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
        grid-area: legend;
        max-height: 30cqh;
        overflow: auto;
        background: var(--surface);
        font-size: calc(12.5 * var(--px));
      }
      :host > * {
        border-top: 1px solid var(--line);
      }
      summary {
        padding: 5px 12px;
        font-weight: 600;
      }
      summary span {
        padding-left: 10px;
        color: var(--muted);
        font-weight: 400;
      }
      /* Both in one flow: each line that is saved is the map's. */
      .lists {
        display: flex;
        flex-wrap: wrap;
        gap: 0 10px;
        padding: 0 5px 4px;
      }
      ul {
        display: contents;
      }
      li,
      button {
        ${row};
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
      button[aria-pressed='true'] {
        background: var(--accent-soft);
        color: var(--accent);
        font-weight: 600;
      }
      i {
        ${dot};
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
        color: var(--muted);
        white-space: nowrap;
      }
    `,
  ];
}
