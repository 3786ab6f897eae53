import { css, html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { baseName } from '../views/format.js';
import type { Column, TableRow } from '../views/frame-columns.js';
import { cssColor, type Rgb } from '../views/palette.js';
import { statusBadge } from '../components/status-badge.js';
import { column, shared, small } from '../components/theme.js';
import { dot, statusStyles } from '../components/panel-theme.js';
import { watchSize } from '../components/watch-size.js';
import { fire } from '../components/fire.js';

/** Rows drawn beyond what is in sight, above and below. */
const OVERSCAN = 12;

/**
 * One row per frame. Arrow keys, Home and End move the selection; a click selects. Only the rows in sight are in the
 * document, so a thousand frames scroll as ten do.
 *
 * Fires `frame-selected` and `frame-hovered` with a frame number or null.
 */
@customElement('scanstitch-frame-table')
export class ScanstitchFrameTable extends LitElement {
  @property({ attribute: false }) rows: readonly TableRow[] = [];
  // The caller, who gives columns and rows, guarantees that they are of one type.
  @property({ attribute: false }) columns: readonly Column<any>[] = [];
  /** What a row is: "scan" or "frame". */
  @property() noun = 'scan';
  @property({ attribute: false }) selected: number | null = null;
  @property({ attribute: false }) colors: readonly Rgb[] = [];
  @state() private firstVisible = 0;
  @state() private num_visible = 30;
  /** Whether columns lie beyond the right edge: what is cut there fades, as a digit that is cut off reads as another number. */
  @state() private hasMore = false;
  @query('.scroller') private scroller!: HTMLElement;
  private rowHeight = 32;

  constructor() {
    super();
    watchSize(
      this,
      () => this.onScroll(),
      () => this.scroller,
    );
  }

  protected override firstUpdated(): void {
    const scale = parseFloat(getComputedStyle(this).getPropertyValue('--px')) || 1;
    this.rowHeight = Math.round((matchMedia('(pointer: coarse)').matches ? 42 : 32) * scale);
    this.style.setProperty('--row-height', `${this.rowHeight}px`);
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('selected') && this.selected !== null) this.reveal(this.selected);
  }

  protected override render(): TemplateResult {
    const { rows } = this;
    const first = Math.max(0, Math.min(this.firstVisible - OVERSCAN, rows.length - 1));
    const last = Math.min(rows.length, this.firstVisible + this.num_visible + OVERSCAN);
    return html`
      <div class="scroller ${this.hasMore ? 'more' : ''}" @scroll=${this.onScroll}>
        <table aria-rowcount=${rows.length + 1} @keydown=${this.onKey}>
          <caption class="visually-hidden">
            Results per ${this.noun}; a row selects its ${this.noun} on the map
          </caption>
          <thead>
            <tr aria-rowindex="1">
              <th scope="col" class="name">${capital(this.noun)}</th>
              <th scope="col" class="state">status</th>
              ${this.columns.map(
                ({ label, unit, title }) =>
                  html`<th scope="col">
                    ${title ? html`<abbr title=${title}>${label}</abbr>` : label}
                    ${unit ? html`<small>${unit}</small>` : nothing}
                  </th>`,
              )}
            </tr>
          </thead>
          <tbody @pointerleave=${() => fire(this, 'frame-hovered')}>
            ${spacer(first * this.rowHeight)}
            ${repeat(
              rows.slice(first, last),
              (row) => row.frame,
              (row) => this.renderRow(row),
            )}
            ${spacer((rows.length - last) * this.rowHeight)}
          </tbody>
        </table>
      </div>
    `;
  }

  private renderRow(row: TableRow): TemplateResult {
    const isSelected = row.frame === this.selected;
    const name = baseName(row.name);
    const isTabStop = isSelected || (this.selected === null && row.frame === 0);
    return html`
      <tr
        class=${isSelected ? 'selected' : ''}
        aria-rowindex=${row.frame + 2}
        @click=${() => fire(this, 'frame-selected', isSelected ? null : row.frame)}
        @pointerenter=${() => fire(this, 'frame-hovered', row.frame)}
      >
        <th scope="row" class="name">
          <button
            tabindex=${isTabStop ? 0 : -1}
            aria-pressed=${isSelected}
            data-frame=${row.frame}
            aria-label=${name.length > LONGEST_NAME ? name : nothing}
            title=${row.name}
          >
            <i style="background: ${cssColor(this.colors[row.frame] ?? [0, 0, 0])}"></i>${shortName(name)}
          </button>
        </th>
        <td class="state">${statusBadge(row.status)}</td>
        ${this.columns.map(({ cell }) => html`<td>${cell(row)}</td>`)}
      </tr>
    `;
  }

  private onScroll(): void {
    this.firstVisible = Math.floor(this.scroller.scrollTop / this.rowHeight);
    this.num_visible = Math.ceil(this.scroller.clientHeight / this.rowHeight);
    const { scrollLeft, clientWidth, scrollWidth } = this.scroller;
    this.hasMore = scrollLeft + clientWidth < scrollWidth - 1;
  }

  /** Scrolls as little as it takes to bring a row into sight below the heading. */
  private reveal(frame: number): void {
    const heading = this.scroller.querySelector('thead')?.clientHeight ?? this.rowHeight;
    const top = frame * this.rowHeight;
    const height = this.scroller.clientHeight - heading;
    if (top < this.scroller.scrollTop) this.scroller.scrollTop = top;
    else if (top + this.rowHeight > this.scroller.scrollTop + height) {
      this.scroller.scrollTop = top + this.rowHeight - height;
    }
  }

  private async onKey(event: KeyboardEvent): Promise<void> {
    const last = this.rows.length - 1;
    const from = this.selected ?? -1;
    const page = Math.max(1, this.num_visible - 2);
    const targets: Record<string, number | null> = {
      ArrowDown: Math.min(from + 1, last),
      ArrowUp: Math.max(from - 1, 0),
      PageDown: Math.min(from + page, last),
      PageUp: Math.max(from - page, 0),
      Home: 0,
      End: last,
      Escape: null,
    };
    const to = targets[event.key];
    if (to === undefined || last < 0) return;
    event.preventDefault();
    fire(this, 'frame-selected', to);
    if (to === null) return;
    // The row may only now come into the document.
    await this.updateComplete;
    this.reveal(to);
    this.onScroll();
    await this.updateComplete;
    this.renderRoot.querySelector<HTMLElement>(`[data-frame="${to}"]`)?.focus({ preventScroll: true });
  }

  static override styles = [
    shared,
    statusStyles,
    css`
      :host {
        ${column};
        min-height: 0;
        --row-height: 32px;
        container-type: inline-size;
      }
      .more {
        mask-image: linear-gradient(to right, #000 calc(100% - 40px), transparent);
      }
      @container (max-width: 760px) {
        table {
          --cell-padding: 6px;
        }
      }
      .scroller {
        min-height: 0;
        overflow: auto;
        overscroll-behavior: contain;
      }
      table {
        width: 100%;
        border-collapse: separate;
        border-spacing: 0;
        font-size: calc(13 * var(--px));
        font-variant-numeric: tabular-nums;
      }
      thead th {
        position: sticky;
        top: 0;
        z-index: 1;
        height: 32px;
        background: var(--surface);
        border-bottom: 1px solid var(--line);
        ${small};
        font-weight: 550;
      }
      th,
      td {
        padding: 0 var(--cell-padding, 10px);
        text-align: right;
        white-space: nowrap;
      }
      small {
        color: var(--muted);
        font-size: calc(11 * var(--px));
        font-weight: 400;
      }
      abbr {
        text-decoration: none;
      }
      .name {
        position: sticky;
        left: 0;
        padding-left: 12px;
        text-align: left;
        background: var(--surface);
      }
      thead .name {
        z-index: 2;
      }
      .state {
        text-align: left;
      }
      tbody tr {
        height: var(--row-height);
        cursor: pointer;
      }
      tbody tr:hover > * {
        background: var(--sunken);
      }
      tbody tr.selected > * {
        background: var(--selected-soft);
      }
      tbody tr.selected .name {
        box-shadow: inset 3px 0 var(--selected);
      }
      tbody tr.spacer {
        height: auto;
        cursor: default;
      }
      .spacer td {
        padding: 0;
        background: none !important;
      }
      .name button {
        min-height: 0;
        padding: 2px 4px;
        border: 0;
        background: none !important;
        font-weight: 500;
      }
      .name i {
        ${dot};
      }
    `,
  ];
}

/** The longest name that is written whole, and what is left of a longer one: its end, where the number stands, and some of its start. */
const LONGEST_NAME = 24;
const START = 9;

function shortName(name: string): string {
  return name.length <= LONGEST_NAME ? name : `${name.slice(0, START)}…${name.slice(START + 1 - LONGEST_NAME)}`;
}

function spacer(height: number): TemplateResult | typeof nothing {
  if (height <= 0) return nothing;
  return html`<tr class="spacer" aria-hidden="true">
    <td colspan="10" style="height: ${height}px"></td>
  </tr>`;
}

function capital(word: string): string {
  return word.charAt(0).toUpperCase() + word.slice(1);
}
