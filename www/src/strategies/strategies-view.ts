import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import '../drawing/figure-view.js';
import { cell, type Column, columnsOf, csvOf, markdownOf, type Row } from '../../../package/report/strategy_table.js';
import { announcements } from '../components/announcer.js';
import { tellHost } from '../components/host-events.js';
import { iconButton } from '../components/icon-button.js';
import { icon } from '../components/icons.js';
import { retryButton } from '../components/messages.js';
import { sortHead } from '../components/number-table.js';
import type { Phase } from '../components/session.js';
import { emptyStyles, shared } from '../components/theme.js';
import { pageStyles, tableStyles } from '../components/panel-theme.js';
import { makeColors } from '../views/figure-colors.js';
import { rankingStyles, sectionStyles } from '../components/section-styles.js';
import { download } from '../export/download.js';
import { plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { sorted } from '../views/sorted.js';
import { type Drawn, type FigureId, figuresOf, makePainter } from './figures.js';
import { StrategiesSession } from './session.js';
import type { GivenToCompare } from './protocol.js';
import { strategyStyles } from './styles.js';
import { fire } from '../components/fire.js';

interface Sort {
  name: string;
  isDescending: boolean;
}

/** Columns of which the smallest value is the best one. */
const SMALLER_IS_BETTER = new Set([
  'map_bytes',
  'ms_median',
  'ms_total',
  'ape_mean',
  'ape_rmse',
  'rpe_mean',
  'mean_map_entropy',
  'mean_residual',
]);

/**
 * Strategies side by side on the recording that is given: those that are chosen run, and what each one costs and gains is
 * shown as a table and as figures, which grow while they run. Fires `files-wanted` where there is no recording.
 */
@customElement('scanstitch-strategies')
export class ScanstitchStrategies extends LitElement {
  /** Another object is another recording. */
  @property({ attribute: false }) given: GivenToCompare | null = null;
  @property({ type: Boolean }) dark = false;

  @state() private selected: string | null = null;
  @state() private sort: Sort | null = null;
  @state() private logFigures: ReadonlySet<FigureId> = new Set<FigureId>(['points']);

  private session = new StrategiesSession(this, () => this.tellCompared());
  private colorsOf = memoizeLast(makeColors);

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('given')) this.session.begin(this.given);
  }

  protected override render(): TemplateResult {
    const { messages, results } = this.session;
    return html`<div class="strategies">
      ${this.renderBar()}
      ${
        messages.length > 0
          ? html`<ul class="problems" aria-label="Problems">
              ${messages.map((message) => {
                const { file, text, remedy } = message;
                return html`<li>${[file, text, remedy].filter(Boolean).join(': ')} ${retryButton(message)}</li>`;
              })}
            </ul>`
          : nothing
      }
      ${this.given ? nothing : this.renderEmpty()}
      ${results.length > 0 ? html`${this.renderTable()}${this.renderFigures()}` : nothing} ${this.renderChoice()}
      ${announcements(this.session.announcer)}
    </div>`;
  }

  private renderBar(): TemplateResult {
    const { given, session } = this;
    const { phase, done, total, compared, retired, num_frames } = session;
    const count = plural(compared.length, 'strategy', 'strategies');
    const left = plural(compared.length - retired.size, 'strategy', 'strategies');
    const noun = session.isPlanar ? 'scan' : 'frame';
    const words: Partial<Record<Phase, string>> = {
      empty: `${plural(session.chosen.size, 'strategy', 'strategies')} chosen`,
      running: session.activity || `Frame ${Math.min(done + 1, total)} of ${total}, ${left}`,
      stopped: `Stopped after ${plural(num_frames, noun)}`,
      done: `${plural(num_frames, noun)}, ${count}`,
      crashed: 'The comparison failed',
    };
    return html`<section aria-label="Comparison">
      <div class="bar">
        <h2>Compare strategies</h2>
        <span class="muted">${given?.title ?? ''}</span>
        <span class="state">${words[phase] ?? ''}</span>
        ${
          phase === 'running'
            ? html`<progress max=${total} .value=${done} aria-label=${words[phase] ?? ''}></progress
                ><button @click=${() => session.stop()}>Stop</button>`
            : html`<button class="primary" ?disabled=${!given || session.chosen.size === 0} @click=${this.compare}>
                ${session.results.length > 0 ? 'Compare again' : 'Compare'}
              </button>`
        }
      </div>
    </section>`;
  }

  private renderEmpty(): TemplateResult {
    const want = (id: string): void => {
      fire(this, 'files-wanted', id);
    };
    return html`<section class="empty" aria-label="No recording yet">
      <h2>Drop depth images, point clouds or planar scans to compare strategies on</h2>
      <p>They are opened on the map first, and are then compared here.</p>
      <p class="actions">
        <button class="primary" @click=${() => want('files')}>${icon('open')}Choose files…</button>
        <button @click=${() => want('apartment')}>Open the apartment (sample)</button>
      </p>
    </section>`;
  }

  private renderTable(): TemplateResult {
    const rows = this.rows();
    const columns = columnsOf(rows);
    const best = new Map(columns.map((column) => [column.name, this.bestOf(column)]));
    return html`<section class="ranking" aria-label="Table of strategies">
      <header>
        <h2>Table</h2>
        <span class="muted">select a column to sort by it; the best value of a column is green</span>
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
      <div class="scroll" role="region" aria-label="Table" tabindex="0">
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
    const isDescending = this.sort?.name === name ? this.sort.isDescending : null;
    return sortHead(unit ? `${label} (${unit})` : label, about, isDescending, (next) => {
      this.sort = { name, isDescending: next };
    });
  }

  private renderRow(row: Row, columns: readonly Column[], best: ReadonlyMap<string, number | null>): TemplateResult {
    const { name, label, result } = row;
    const index = this.session.compared.findIndex((preset) => preset.name === name);
    const isSelected = this.selected === name;
    const isRetired = this.session.retired.has(index);
    const select = (): void => {
      this.selected = isSelected ? null : name;
    };
    return html`<tr
      class="${isSelected ? 'selected' : ''} ${isRetired ? 'retired' : ''}"
      title=${this.session.compared[index]?.explanation ?? ''}
      @click=${select}
    >
      <td class="name">
        <button
          class="link"
          aria-pressed=${isSelected}
          @click=${(event: Event) => {
            event.stopPropagation();
            select();
          }}
        >
          <i style="background:${this.colorOf(index)}"></i>${label}
        </button>
        ${
          this.session.canRetire(index)
            ? iconButton(
                'close',
                `Stop ${label}`,
                (event: Event) => {
                  event.stopPropagation();
                  this.session.retire(index);
                },
                { hint: 'Stop this strategy; the others continue', size: 12 },
              )
            : nothing
        }
      </td>
      ${columns.map((column) => {
        const value = column.value(result);
        const isBest = value !== null && value === best.get(column.name);
        return html`<td class=${isBest ? 'best' : ''}>${cell(column, result)}</td>`;
      })}
    </tr>`;
  }

  private renderFigures(): TemplateResult {
    const colors = this.colorsOf(this.dark);
    const drawn = this.session.results.map((result, index): Drawn => ({
      result,
      map: this.session.maps[index] ?? null,
      milliseconds: this.session.milliseconds[index] ?? [],
      color: this.colorOf(index),
      isSelected: this.session.compared[index]?.name === this.selected,
    }));
    return html`<div class="figures">
      ${figuresOf(drawn).map(({ id, title, about }) => {
        const isLog = id !== 'paths' && this.logFigures.has(id);
        return html`<section class=${drawn[0]?.map && id === 'paths' ? 'wide' : ''} aria-label=${title}>
          <header>
            <h2>${title}</h2>
            <span class="muted">${about}</span>
            ${
              id === 'paths'
                ? nothing
                : html`<label
                    ><input type="checkbox" .checked=${isLog} @change=${() => this.toggleLog(id)} />Logarithmic
                    scale</label
                  >`
            }
          </header>
          <scanstitch-figure
            .painter=${makePainter(id, drawn, colors, isLog)}
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
        <span class="muted"
          >${
            this.session.isPlanar
              ? 'presets of the reconstruction, and the settings of the map where they are different'
              : 'each registers every frame against its own map by ICP; they differ in how that map is kept'
          }</span
        >
        <span class="save"
          ><button
            class="quiet"
            ?disabled=${this.session.presets.length === 0 || this.session.phase === 'running'}
            @click=${() => this.session.chooseAll()}
          >
            Choose all
          </button></span
        >
      </header>
      <div class="choice">
        <ul>
          ${this.session.presets.map(({ name, label, explanation }) => {
            const at = this.session.compared.findIndex((preset) => preset.name === name);
            return html`<li>
              <label>
                <input
                  type="checkbox"
                  .checked=${this.session.chosen.has(name)}
                  ?disabled=${this.session.phase === 'running'}
                  @change=${() => this.session.toggle(name)}
                />
                <span>${at < 0 ? nothing : html`<i style="background:${this.colorOf(at)}"></i>`}<b>${label}</b></span>
                <span class="about">${explanation}</span>
              </label>
            </li>`;
          })}
        </ul>
        <p class="muted">
          ${this.session.isPlanar ? nothing : 'Stored size: 24 bytes per point.'} Times are measured on this machine,
          one strategy after the other in one thread. To use settings of your own:
          <code>npx scanstitch strategies --help</code>
        </p>
      </div>
    </section>`;
  }

  private compare = (): void => {
    void this.session.compare();
  };

  private tellCompared(): void {
    tellHost(this, 'scanstitch-compared', this.rows());
  }

  private rows(): Row[] {
    const rows = this.session.results.map((result, index): Row => {
      const { name = '', label = '' } = this.session.compared[index] ?? {};
      return { name, label, result };
    });
    const { sort } = this;
    const column = sort && columnsOf(rows).find(({ name }) => name === sort.name);
    return column ? sorted(rows, ({ result }) => column.value(result), sort.isDescending) : rows;
  }

  private bestOf({ name, value }: Column): number | null {
    if (!SMALLER_IS_BETTER.has(name) || this.session.results.length < 2) return null;
    const known = this.session.results.flatMap((result) => value(result) ?? []);
    return known.length > 0 ? Math.min(...known) : null;
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

  private toggleLog(id: FigureId): void {
    const logs = new Set(this.logFigures);
    if (!logs.delete(id)) logs.add(id);
    this.logFigures = logs;
  }

  private copy(text: string, form: string): Promise<void> {
    return this.session.copy(text, `The table was copied as ${form}.`, 'Use Save CSV');
  }

  static override styles = [shared, sectionStyles, tableStyles, rankingStyles, pageStyles, emptyStyles, strategyStyles];
}
