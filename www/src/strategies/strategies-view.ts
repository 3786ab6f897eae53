import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import '../components/figure-view.js';
import { cell, type Column, columnsOf, csvOf, markdownOf, type Row } from '../../../npm/strategy_table.js';
import { icon } from '../components/icons.js';
import { page_styles, shared, table_styles } from '../components/theme.js';
import { makeColors } from '../views/figure-colors.js';
import { ranking_styles, section_styles } from '../components/section-styles.js';
import { download } from '../export/exports.js';
import { plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { StrategyClient } from './client.js';
import { type Drawn, FIGURES, type FigureId, makePainter } from './figures.js';
import type { StrategyPreset, StrategyResult } from './protocol.js';
import type { GivenRecording } from '../components/run-view.js';
import { strategy_styles } from './styles.js';

type Phase = 'waiting' | 'running' | 'stopped' | 'done' | 'failed';

interface Sort {
  name: string;
  is_descending: boolean;
}

/** Columns of which the smallest value is the best one. */
const SMALLER_IS_BETTER = new Set(['map_bytes', 'ms_median', 'ape_mean', 'ape_rmse', 'rpe_mean', 'mean_map_entropy']);

/**
 * Strategies side by side on the recording that is given: it starts by itself, and shows what each one costs and gains as a
 * table and as figures, which grow while it runs.
 */
@customElement('scanstitch-strategies')
export class ScanstitchStrategies extends LitElement {
  /** Another object starts another comparison. */
  @property({ attribute: false }) given: GivenRecording | null = null;
  @property({ type: Boolean }) dark = false;

  @state() private phase: Phase = 'waiting';
  @state() private presets: readonly StrategyPreset[] = [];
  @state() private chosen: ReadonlySet<string> = new Set();
  /** Those that run, or ran last. */
  @state() private compared: readonly StrategyPreset[] = [];
  @state() private results: readonly StrategyResult[] = [];
  @state() private milliseconds: readonly (readonly number[])[] = [];
  @state() private retired: ReadonlySet<number> = new Set();
  @state() private selected: string | null = null;
  @state() private sort: Sort | null = null;
  @state() private problems: readonly string[] = [];
  @state() private progress = { done: 0, total: 1 };
  @state() private logs: ReadonlySet<FigureId> = new Set<FigureId>(['points']);
  @state() private said = '';

  private client: StrategyClient | null = null;
  private colorsOf = memoizeLast(makeColors);
  private num_runs = 0;

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.client?.dispose();
    this.client = null;
    if (this.phase === 'running') this.phase = 'stopped';
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('given') && this.given) void this.compare();
  }

  protected override render(): TemplateResult {
    return html`<div class="strategies">
      ${this.renderBar()}
      ${
        this.problems.length > 0
          ? html`<ul class="problems" aria-label="Problems">
              ${this.problems.map((text) => html`<li>${text}</li>`)}
            </ul>`
          : nothing
      }
      ${this.results.length > 0 ? html`${this.renderTable()}${this.renderFigures()}` : nothing} ${this.renderChoice()}
      <div class="visually-hidden" role="status" aria-live="polite">${this.said}</div>
    </div>`;
  }

  private renderBar(): TemplateResult {
    const { phase, progress, given } = this;
    const { done, total } = progress;
    const words = {
      waiting: 'Drop depth images or clouds first',
      running: `Frame ${Math.min(done + 1, total)} of ${total}, by ${plural(this.compared.length - this.retired.size, 'strategy', 'strategies')}`,
      stopped: `Stopped after ${plural(this.numFrames(), 'frame')}`,
      done: `${plural(this.numFrames(), 'frame')} by ${plural(this.compared.length, 'strategy', 'strategies')}`,
      failed: 'It could not be computed',
    }[phase];
    return html`<section aria-label="Comparison">
      <div class="bar">
        <h2>What each strategy costs and gains</h2>
        <span class="muted">${given?.title ?? ''}</span>
        <span class="state">${words}</span>
        ${
          phase === 'running'
            ? html`<progress max=${total} .value=${done} aria-label=${words}></progress
                ><button @click=${() => this.client?.stop()}>Stop</button>`
            : html`<button class="primary" ?disabled=${!given || this.chosen.size === 0} @click=${this.compare}>
                ${this.results.length > 0 ? 'Compare again' : 'Compare'}
              </button>`
        }
      </div>
    </section>`;
  }

  private renderTable(): TemplateResult {
    const rows = this.rows();
    const columns = columnsOf(rows);
    const best = new Map(columns.map((column) => [column.name, this.bestOf(column)]));
    return html`<section class="ranking" aria-label="Table of strategies">
      <header>
        <h2>Table</h2>
        <span class="muted">a column’s name sorts by it; the best of a column is green</span>
        <span class="save">
          <button class="quiet" @click=${() => this.copy(markdownOf(this.rows()), 'Markdown')}>Copy Markdown</button>
          <button class="quiet" @click=${() => this.copy(csvOf(this.rows()), 'CSV')}>Copy CSV</button>
          <button
            class="quiet"
            @click=${() =>
              download({ name: 'strategies.csv', blob: new Blob([csvOf(this.rows())], { type: 'text/csv' }) })}
          >
            Save CSV
          </button>
        </span>
      </header>
      <div class="scroll" role="region" aria-label="The table, which may be wider than the page" tabindex="0">
        <table aria-label="Strategies">
          <thead>
            <tr>
              <th scope="col" class="name">strategy</th>
              ${columns.map((column) => this.renderHead(column))}
            </tr>
          </thead>
          <tbody>
            ${rows.map((row) => this.renderRow(row, columns, best))}
          </tbody>
        </table>
      </div>
    </section>`;
  }

  private renderHead({ name, label, unit, about }: Column): TemplateResult {
    const is_sorted = this.sort?.name === name;
    const order = is_sorted ? (this.sort?.is_descending ? 'descending' : 'ascending') : 'none';
    const arrow = { descending: ' ▾', ascending: ' ▴', none: '' }[order];
    return html`<th scope="col" aria-sort=${order}>
      <button
        class="quiet"
        title=${about}
        @click=${() => {
          this.sort = { name, is_descending: is_sorted && !this.sort?.is_descending };
        }}
      >
        ${unit ? `${label} (${unit})` : label}${arrow}
      </button>
    </th>`;
  }

  private renderRow(row: Row, columns: readonly Column[], best: ReadonlyMap<string, number | null>): TemplateResult {
    const { name, label, result } = row;
    const index = this.compared.findIndex((preset) => preset.name === name);
    const is_selected = this.selected === name;
    const is_retired = this.retired.has(index);
    const select = (): void => {
      this.selected = is_selected ? null : name;
    };
    return html`<tr
      class="${is_selected ? 'selected' : ''} ${is_retired ? 'retired' : ''}"
      title=${this.compared[index]?.explanation ?? ''}
      @click=${select}
    >
      <td class="name">
        <button
          class="link"
          aria-pressed=${is_selected}
          @click=${(event: Event) => {
            event.stopPropagation();
            select();
          }}
        >
          <i style="background:${this.colorOf(index)}"></i>${label}
        </button>
        ${
          this.phase === 'running' && !is_retired
            ? html`<button
                class="icon quiet"
                aria-label="Leave out ${label}"
                title="Leave it as it stands; the others go on"
                @click=${(event: Event) => {
                  event.stopPropagation();
                  this.client?.retire(index);
                  this.retired = new Set([...this.retired, index]);
                }}
              >
                ${icon('close', 12)}
              </button>`
            : nothing
        }
      </td>
      ${columns.map((column) => {
        const value = column.value(result);
        const is_best = value !== null && value === best.get(column.name);
        return html`<td class=${is_best ? 'best' : ''}>${cell(column, result)}</td>`;
      })}
    </tr>`;
  }

  private renderFigures(): TemplateResult {
    const colors = this.colorsOf(this.dark);
    const has_truth = this.results.some(({ comparison }) => comparison !== null);
    const drawn = this.results.map((result, index): Drawn => ({
      result,
      milliseconds: this.milliseconds[index] ?? [],
      color: this.colorOf(index),
      is_selected: this.compared[index]?.name === this.selected,
    }));
    return html`<div class="figures">
      ${FIGURES.filter(({ id }) => id !== 'error' || has_truth).map(({ id, title, about }) => {
        const is_log = id !== 'paths' && this.logs.has(id);
        return html`<section aria-label=${title}>
          <header>
            <h2>${title}</h2>
            <span class="muted">${about}</span>
            ${
              id === 'paths'
                ? nothing
                : html`<label
                    ><input type="checkbox" .checked=${is_log} @change=${() => this.toggleLog(id)} />by powers of
                    ten</label
                  >`
            }
          </header>
          <scanstitch-figure
            .painter=${makePainter(id, drawn, colors, is_log)}
            label=${title}
            description="${about} ${this.figureWords(id)}"
          ></scanstitch-figure>
        </section>`;
      })}
    </div>`;
  }

  private renderChoice(): TemplateResult {
    return html`<section class="ranking" aria-label="The strategies">
      <header>
        <h2>The strategies</h2>
        <span class="muted">each frame is matched, by ICP, with the map of all before it; they differ in the rest</span>
      </header>
      <div class="choice">
        <ul>
          ${this.presets.map(({ name, label, explanation }) => {
            const at = this.compared.findIndex((preset) => preset.name === name);
            return html`<li>
              <label>
                <input
                  type="checkbox"
                  .checked=${this.chosen.has(name)}
                  ?disabled=${this.phase === 'running'}
                  @change=${() => this.toggle(name)}
                />
                <span>${at < 0 ? nothing : html`<i style="background:${this.colorOf(at)}"></i>`}<b>${label}</b></span>
                <span class="about">${explanation}</span>
              </label>
            </li>`;
          })}
        </ul>
        <p class="muted">
          Stored: 24 bytes a point. Times are this machine’s, one strategy after the other in one thread. With settings
          of your own: <code>npx scanstitch strategies --help</code>
        </p>
      </div>
    </section>`;
  }

  private compare = async (): Promise<void> => {
    const { given } = this;
    if (!given) return;
    const run = ++this.num_runs;
    const is_current = (): boolean => run === this.num_runs;
    this.client?.stop();
    this.client?.dispose();
    const client = new StrategyClient({
      progressed: (done, total) => {
        if (is_current()) this.progress = { done, total };
      },
      results: (results, milliseconds) => {
        if (!is_current()) return;
        this.results = results;
        this.milliseconds = milliseconds;
      },
      problem: ({ file, problem, remedy }) => {
        if (is_current()) this.tell([file, problem, remedy].filter(Boolean).join(': '));
      },
    });
    this.client = client;
    this.phase = 'running';
    this.problems = [];
    this.results = [];
    this.retired = new Set();
    this.progress = { done: 0, total: given.inputs.jobs.length };
    try {
      this.presets = await client.presets();
      if (this.chosen.size === 0) this.chosen = new Set(this.presets.map(({ name }) => name));
      this.compared = this.presets.filter(({ name }) => this.chosen.has(name));
      const is_done = await client.run(given, this.compared);
      if (!is_current()) return;
      this.phase = is_done ? 'done' : 'stopped';
      if (this.numFrames() === 0) {
        this.phase = 'failed';
        this.results = [];
      }
      const notes = new Set(this.results.flatMap((result) => result.notes));
      this.problems = [...new Set([...this.problems, ...notes])];
      this.said = `${is_done ? 'Compared' : 'Stopped'}: ${plural(this.numFrames(), 'frame')}.`;
      this.dispatchEvent(
        new CustomEvent('scanstitch-compared', { detail: this.rows(), bubbles: true, composed: true }),
      );
    } catch (error) {
      if (!is_current()) return;
      this.phase = 'failed';
      this.tell(error instanceof Error ? error.message : String(error));
    }
  };

  private rows(): Row[] {
    const rows = this.results.map((result, index): Row => {
      const { name = '', label = '' } = this.compared[index] ?? {};
      return { name, label, result };
    });
    const { sort } = this;
    const column = sort && columnsOf(rows).find(({ name }) => name === sort.name);
    if (!column) return rows;
    const sign = sort.is_descending ? -1 : 1;
    const value = ({ result }: Row): number => column.value(result) ?? Number.POSITIVE_INFINITY;
    return rows.sort((a, b) => (value(a) === value(b) ? 0 : sign * (value(a) < value(b) ? -1 : 1)));
  }

  private bestOf({ name, value }: Column): number | null {
    if (!SMALLER_IS_BETTER.has(name) || this.results.length < 2) return null;
    const known = this.results.flatMap((result) => value(result) ?? []);
    return known.length > 0 ? Math.min(...known) : null;
  }

  private numFrames(): number {
    return Math.max(0, ...this.results.map(({ frames }) => frames.length));
  }

  private colorOf(index: number): string {
    const { estimates } = this.colorsOf(this.dark);
    return estimates[index % estimates.length] ?? 'currentColor';
  }

  private figureWords(id: FigureId): string {
    const name = { points: 'map_points', time: 'ms_last', error: 'ape_mean', paths: '' }[id];
    const column = columnsOf(this.rows()).find((column) => column.name === name);
    if (!column) return '';
    return this.rows()
      .map(({ label, result }) => `${label}: ${column.label} ${cell(column, result)} ${column.unit}.`)
      .join(' ');
  }

  private toggle(name: string): void {
    const chosen = new Set(this.chosen);
    if (!chosen.delete(name)) chosen.add(name);
    this.chosen = chosen;
  }

  private toggleLog(id: FigureId): void {
    const logs = new Set(this.logs);
    if (!logs.delete(id)) logs.add(id);
    this.logs = logs;
  }

  private async copy(text: string, form: string): Promise<void> {
    try {
      await navigator.clipboard.writeText(text);
      this.said = `The table was copied as ${form}.`;
    } catch {
      this.tell('The browser did not allow copying: use Save CSV.');
    }
  }

  private tell(text: string): void {
    this.problems = [...this.problems, text];
    this.said = text;
  }

  static override styles = [shared, section_styles, table_styles, ranking_styles, page_styles, strategy_styles];
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-strategies': ScanstitchStrategies;
  }
}
