/** What the columns of a table of ranges are: guessed, shown as a scan, changed by hand. */
import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { slider, typed } from '../components/fields.js';
import { dialogStyles } from '../components/section-styles.js';
import { shared } from '../components/theme.js';
import { LastRequest } from '../engine/last-request.js';
import type { TableFacts } from '../engine/protocol.js';
import { baseName, plural, sentence } from '../views/format.js';
import { number, select } from './form-fields.js';
import { drawScan } from './scan-preview.js';
import {
  ANGLE_UNITS,
  cellWords,
  changed,
  columnsOf,
  degreesOf,
  firstGuess,
  type FormatParts,
  LENGTHS,
  partsOf,
  POSE_KINDS,
  textOf,
  TIME_UNITS,
  unitOfAngles,
  usesOf,
} from './table-format.js';
import { importStyles } from './table-import-styles.js';
import { watchSize } from '../components/watch-size.js';

/** A table that is to be imported. */
export interface TableRequest {
  name: string;
  facts: TableFacts;
  /** The same table by another format, and another one of its scans. */
  describe(format: string, scan: number): Promise<TableFacts>;
}

/** What a column of each kind is called, in the form. */
const POSE_WORDS = {
  odometry: 'wheel odometry',
  poses: 'poses, perhaps corrected',
  reference: 'ground truth',
} as const;
/** Columns that the preview shows at the beginning and at the end of a line. */
const [FIRST_COLUMNS, LAST_COLUMNS] = [10, 5];
/** A change is tried out when nothing has been typed for so long. */
const TYPING_MS = 150;

/**
 * A dialog about one table. Fires `table-chosen`, whose detail is the format as text, or `table-cancelled`.
 */
@customElement('scanstitch-table-import')
export class ScanstitchTableImport extends LitElement {
  @property({ attribute: false }) request!: TableRequest;
  @property({ type: Boolean }) dark = false;
  @state() private facts!: TableFacts;
  @state() private parts: FormatParts = new Map();
  /** Whether `facts` are those of the format as it now is. */
  @state() private isTried = true;
  @state() private scan = 0;
  @state() private isCopied = false;
  @query('dialog') private dialog!: HTMLDialogElement;
  @query('canvas') private canvas!: HTMLCanvasElement;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private readonly tries = new LastRequest();
  private trying: Promise<void> = Promise.resolve();

  constructor() {
    super();
    watchSize(
      this,
      () => this.draw(),
      () => this.canvas,
    );
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    clearTimeout(this.timer);
  }

  protected override willUpdate(given: PropertyValues<this>): void {
    if (!given.has('request')) return;
    this.facts = this.request.facts;
    const { format, num_columns } = this.facts;
    this.parts = partsOf(format || firstGuess(num_columns));
    this.isTried = format !== '';
    this.scan = 0;
    if (!this.isTried) this.tryOut();
  }

  protected override firstUpdated(): void {
    this.dialog.showModal();
  }

  protected override updated(): void {
    this.draw();
  }

  protected override render(): TemplateResult {
    const { facts, request } = this;
    const { num_rows, num_columns, problem, num_scans, doubt } = facts;
    return html`<dialog
      aria-labelledby="title"
      @cancel=${(event: Event) => {
        event.preventDefault();
        this.close('table-cancelled');
      }}
    >
      <form method="dialog" @submit=${(event: Event) => void this.submit(event)}>
        <header>
          <h2 id="title">What are the columns of ${baseName(request.name)}?</h2>
          <p class="muted">${plural(num_rows, 'line')} of ${plural(num_columns, 'column')}. ${doubt}</p>
        </header>
        <div class="body">
          <div class="fields">
            ${this.renderLayout()} ${this.renderAngles()} ${this.renderTimes()} ${this.renderPoses()}
          </div>
          <div class="seen">
            <canvas role="img" aria-label=${this.pictureWords()}></canvas>
            <label class="scan" ?hidden=${num_scans < 2}>
              Scan ${this.scan + 1} of ${num_scans}
              ${slider(this.scan, { max: Math.max(0, num_scans - 1) }, (scan) => this.showScan(scan))}
            </label>
          </div>
          ${this.renderCells()}
        </div>
        <p class="problem" role="alert">${problem === '' ? nothing : sentence(problem)}</p>
        <footer>
          <label class="command">
            <span class="muted">On the command line</span>
            <input
              readonly
              .value=${`--table ${this.text}`}
              @focus=${(event: Event) => (event.target as HTMLInputElement).select()}
            />
          </label>
          <button type="button" @click=${() => this.copy()}>${this.isCopied ? 'Copied' : 'Copy'}</button>
          <span class="gap"></span>
          <button type="button" @click=${() => this.close('table-cancelled')}>Cancel</button>
          <button class="primary" ?disabled=${problem !== ''}>Read ${plural(num_scans, 'scan')}</button>
        </footer>
      </form>
    </dialog>`;
  }

  /** The format as text: whole, as the engine understood it, or as it was typed where that is none. */
  private get text(): string {
    const { problem, format } = this.facts;
    return this.isTried && problem === '' && format !== '' ? format : textOf(this.parts);
  }

  private renderLayout(): TemplateResult {
    const isByScan = this.parts.has('ranges');
    const [first = '1', last = String(this.facts.num_columns)] = columnsOf(this.parts, 'ranges');
    const [angle = '', unit = 'deg'] = columnsOf(this.parts, 'angle');
    return html`<fieldset>
      <legend>Ranges</legend>
      ${select('Each line is', isByScan ? 'scan' : 'reading', { scan: 'a scan', reading: 'one reading' }, (value) =>
        this.setLayout(value === 'scan'),
      )}
      ${
        isByScan
          ? html`${this.column('First column', first, (value) => this.change({ ranges: `${value}:${last}` }))}
            ${this.column('Last column', last, (value) => this.change({ ranges: `${first}:${value}` }))}`
          : html`${this.column('Range column', this.parts.get('range') ?? '', (value) => this.change({ range: value }))}
            ${this.column('Angle column', angle, (value) => this.change({ angle: value && `${value}:${unit}` }), 'none')}
            ${
              angle === ''
                ? nothing
                : select('Angles are', unitOfAngles(unit), ANGLE_UNITS, (value) =>
                    this.change({ angle: `${angle}:${value}` }),
                  )
            }`
      }
      ${select('Unit', this.parts.get('unit') ?? 'm', LENGTHS, (unit) => this.change({ unit }))}
    </fieldset>`;
  }

  private renderAngles(): TemplateResult {
    const { parts, facts } = this;
    const hasAngles = parts.has('angle');
    const step = Number(degreesOf(parts, 'step'));
    const view = Math.abs(step) * Math.max(0, facts.num_readings - 1);
    return html`<fieldset>
      <legend>Angles, counter-clockwise from ahead</legend>
      ${number(hasAngles ? 'Added (°)' : 'First (°)', degreesOf(parts, 'start'), (value) => this.change({ start: value && `${value}deg` }))}
      ${
        hasAngles
          ? nothing
          : html`${number('Step (°)', degreesOf(parts, 'step'), (value) => this.change({ step: value && `${value}deg` }))}
              <p class="muted">${view > 0 ? `${facts.num_readings} readings over ${Number(view.toFixed(1))}°` : ''}</p>`
      }
    </fieldset>`;
  }

  private renderTimes(): TemplateResult {
    const [time = '', unit = 's'] = columnsOf(this.parts, 'time');
    return html`<fieldset>
      <legend>Times</legend>
      ${this.column('Time column', time, (value) => this.change({ time: value && `${value}:${unit}` }), 'none')}
      ${
        time === ''
          ? nothing
          : select('Times are in', unit, TIME_UNITS, (value) => this.change({ time: `${time}:${value}` }))
      }
    </fieldset>`;
  }

  private renderPoses(): TemplateResult {
    const kind = POSE_KINDS.find((name) => this.parts.has(name));
    const [x = '1', y = '2', heading = '3', ...units] = kind ? columnsOf(this.parts, kind) : [];
    const turn = units.includes('deg') ? 'deg' : 'rad';
    const unit = units.find((name) => name in LENGTHS) ?? '';
    const columns = [x, y, heading];
    const text = (of: readonly string[], length: string, angle: string): string =>
      [...of, ...(length === '' ? [] : [length]), ...(angle === 'deg' ? [angle] : [])].join(':');
    const without = { odometry: null, poses: null, reference: null };
    return html`<fieldset>
      <legend>The robot’s place</legend>
      ${select('Columns of', kind ?? '', { '': 'none', ...POSE_WORDS }, (name) =>
        this.change({
          ...without,
          ...(name === '' ? {} : { [name]: text(columns, unit, turn) }),
        }),
      )}
      ${
        kind
          ? html`${['x', 'y', 'Heading'].map((label, at) =>
              this.column(label, columns[at] ?? '', (value) =>
                this.change({ [kind]: text(columns.with(at, value), unit, turn) }),
              ),
            )}
            ${select('x and y in', unit, { '': 'the ranges’ unit', ...LENGTHS }, (value) =>
              this.change({ [kind]: text(columns, value, turn) }),
            )}
            ${select('Heading in', turn, { rad: 'radians', deg: 'degrees' }, (value) =>
              this.change({ [kind]: text(columns, unit, value) }),
            )}`
          : nothing
      }
    </fieldset>`;
  }

  private renderCells(): TemplateResult {
    const { num_columns, names, cells } = this.facts;
    const use = usesOf(this.parts);
    const all = Array.from({ length: num_columns }, (_, at) => at + 1);
    const isLong = num_columns > FIRST_COLUMNS + LAST_COLUMNS;
    const shown = isLong ? [...all.slice(0, FIRST_COLUMNS), 0, ...all.slice(-LAST_COLUMNS)] : all;
    const cell = (row: readonly (number | null | undefined)[], column: number): TemplateResult =>
      column === 0 ? html`<td>…</td>` : html`<td class=${use(column)}>${cellWords(row[column - 1])}</td>`;
    return html`<div class="cells" role="region" aria-label="First lines of the table" tabindex="0">
      <table>
        <thead>
          <tr>
            ${shown.map((column) =>
              column === 0
                ? html`<th></th>`
                : html`<th scope="col" class=${use(column)}>
                    ${column}<small>${use(column) || names[column - 1] || ''}</small>
                  </th>`,
            )}
          </tr>
        </thead>
        <tbody>
          ${cells.map(
            (row) =>
              html`<tr>
                ${shown.map((column) => cell(row, column))}
              </tr>`,
          )}
        </tbody>
      </table>
    </div>`;
  }

  /** A field for a column's number; `empty`: it may be left empty, and what that is called. */
  private column(label: string, value: string, take: (value: string) => void, empty = ''): TemplateResult {
    return html`<label>
      ${label}
      <input
        type="number"
        min="1"
        max=${this.facts.num_columns}
        placeholder=${empty}
        .value=${value}
        @input=${(event: Event) => take(typed(event))}
      />
    </label>`;
  }

  private setLayout(isByScan: boolean): void {
    const { num_columns } = this.facts;
    this.change(
      isByScan
        ? { ranges: `1:${num_columns}`, range: null, angle: null }
        : { ranges: null, range: String(Math.min(2, num_columns)) },
    );
  }

  /** An empty value removes its part of the format. */
  private change(changes: Readonly<Record<string, string | null>>): void {
    const values = Object.entries(changes).map(([name, value]) => [name, value === '' ? null : value]);
    this.parts = changed(this.parts, Object.fromEntries(values));
    this.isTried = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.tryOut(), TYPING_MS);
  }

  private showScan(scan: number): void {
    this.scan = scan;
    this.tryOut();
  }

  private tryOut(): void {
    clearTimeout(this.timer);
    const { parts } = this;
    const signal = this.tries.begin();
    this.isCopied = false;
    const take = (facts: TableFacts): void => {
      if (signal.aborted) return;
      this.facts = facts;
      this.isTried = parts === this.parts;
      this.scan = Math.min(this.scan, Math.max(0, facts.num_scans - 1));
    };
    this.trying = this.request
      .describe(textOf(parts), this.scan)
      .then(take, (error: unknown) => take({ ...this.facts, problem: String(error) }));
  }

  private draw(): void {
    const style = getComputedStyle(this.canvas);
    const color = (name: string): string => {
      this.canvas.style.color = `var(${name})`;
      return style.color;
    };
    drawScan(this.canvas, this.facts.points as [number, number][], {
      point: color('--accent'),
      line: color('--line'),
      text: color('--muted'),
      laser: color('--selected'),
    });
  }

  private pictureWords(): string {
    const { points, num_readings } = this.facts;
    return `Scan ${this.scan + 1}: ${points.length} of ${num_readings} readings with a return`;
  }

  private copy(): void {
    navigator.clipboard?.writeText(`--table ${this.text}`).then(
      () => (this.isCopied = true),
      () => this.shadowRoot?.querySelector<HTMLInputElement>('.command input')?.select(),
    );
  }

  /** What was changed a moment ago is tried out first. */
  private async submit(event: Event): Promise<void> {
    event.preventDefault();
    while (!this.isTried) {
      this.tryOut();
      await this.trying;
    }
    if (this.dialog.open && this.facts.problem === '') this.close('table-chosen');
  }

  private close(type: 'table-chosen' | 'table-cancelled'): void {
    this.dialog.close();
    this.dispatchEvent(new CustomEvent(type, { detail: this.text, bubbles: true, composed: true }));
  }

  static override styles = [shared, dialogStyles, importStyles];
}
