import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import '../drawing/figure-view.js';
import { figureStyles } from '../components/number-table.js';
import '../run/settings-panel.js';
import './basin-panel.js';
import './landscape-panel.js';
import './search-panel.js';
import { layoutStyles } from '../run/run-styles.js';
import type { ScanstitchFigure } from '../drawing/figure-view.js';
import { tabs } from '../run/run-parts.js';
import type { SettingValues } from '../run/settings-panel.js';
import { shared } from '../components/theme.js';
import { makeColors } from '../views/figure-colors.js';
import { memoizeLast } from '../views/memoize-last.js';
import { comparePanel } from './compare-panel.js';
import { degeneracyPanel, directionsOf, slid } from './degeneracy.js';
import { labStyles } from './lab-styles.js';
import { sideStyles } from './side-styles.js';
import { methodFields, methodPresets, methodValues, optionsOf } from './method-fields.js';
import type { LabFacts, LabIteration, Pose } from './protocol.js';
import { type LabRun, runColor } from './runs.js';
import { type LabSession } from './session.js';
import { ownPanel } from './own-panel.js';
import { costPainter, stepPanel } from './step-panel.js';
import { BasinSurvey, LandscapeSurvey, shareHome } from './survey.js';
import { surveyStride } from './thinning.js';
import { lastPose, numPoses } from './trace.js';
import { metricOf, runName } from './words.js';
import { fire } from '../components/fire.js';

export type Tab = 'step' | 'landscape' | 'basin' | 'search' | 'degeneracy' | 'method';

export const TABS: readonly { tab: Tab; label: string }[] = [
  { tab: 'step', label: 'Step' },
  { tab: 'landscape', label: 'Cost' },
  { tab: 'basin', label: 'Basin' },
  { tab: 'search', label: 'Search' },
  { tab: 'degeneracy', label: 'Degeneracy' },
  { tab: 'method', label: 'Methods' },
];
/** Starts by which the basins of methods are compared. */
const COMPARED = {
  plane: { axes: [1, 2, 0], half_widths: [1.5, 1.5, (40 * Math.PI) / 180], size: [15, 15, 5] },
  space: { axes: [3, 4], half_widths: [1.5, 1.5], size: [7, 7] },
};

/**
 * Beside the stage: what the iteration solves, the cost around it, where other starts end, what the pairs determine, and other
 * methods.
 *
 * Fires `tab-chosen` with a tab, and `ghost-shown` with a pose that is to be drawn, or null.
 */
@customElement('scanstitch-lab-side')
export class ScanstitchLabSide extends LitElement {
  @property({ attribute: false }) session!: LabSession;
  @property({ attribute: false }) tab: Tab = 'step';
  @property({ type: Boolean }) dark = false;
  /** Another value whenever the session has changed. */
  @property({ attribute: false }) tick: unknown = null;
  /** Where the source has been slid to along the weakest direction of a step, m. */
  @state() private slide: { iteration: LabIteration; from: Pose; metres: number } | null = null;
  @state() private basins: ReadonlyMap<number, number | null> = new Map();
  @query('#panel') private panel!: HTMLElement;

  private landscape = new LandscapeSurvey(() => this.requestUpdate());
  private basin = new BasinSurvey(() => this.requestUpdate());
  private colorsOf = memoizeLast(makeColors);
  private fieldsOf = memoizeLast(methodFields);
  private presetsOf = memoizeLast(methodPresets);

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.landscape.stop();
    this.basin.stop();
  }

  /** The figure that is shown; null where there is none. */
  get figure(): ScanstitchFigure | null {
    const within =
      this.panel?.querySelector('scanstitch-lab-landscape, scanstitch-lab-basin, scanstitch-lab-search')?.shadowRoot ??
      this.panel;
    return within?.querySelector('scanstitch-figure') ?? null;
  }

  protected override willUpdate(): void {
    if (!this.session.isDragged) this.slide = null;
  }

  protected override render(): TemplateResult {
    const is_planar = this.session.facts?.is_planar ?? true;
    const shown = TABS.filter(({ tab }) => is_planar || tab !== 'search');
    return tabs(shown, this.tab, this.renderPanel(), (tab) => {
      fire(this, 'tab-chosen', tab);
    });
  }

  private renderPanel(): TemplateResult {
    const { session, tab, dark } = this;
    const { facts, run, trace, iteration } = session;
    if (!facts || !run) return html``;
    if (tab === 'method') return this.renderMethods(run, facts);
    if (!trace) return html`<div class="panel"><p class="muted">${run.problem || 'Registering…'}</p></div>`;
    if (tab === 'landscape') {
      return html`<scanstitch-lab-landscape
        .session=${session}
        .survey=${this.landscape}
        .tick=${{}}
        ?dark=${dark}
      ></scanstitch-lab-landscape>`;
    }
    if (tab === 'basin') {
      return html`<scanstitch-lab-basin
        .session=${session}
        .survey=${this.basin}
        .tick=${{}}
        ?dark=${dark}
      ></scanstitch-lab-basin>`;
    }
    if (tab === 'search' && facts.is_planar) {
      return html`<scanstitch-lab-search .session=${session} .tick=${{}} ?dark=${dark}></scanstitch-lab-search>`;
    }
    if (tab === 'degeneracy') return this.renderDegeneracy(facts);
    const metric = metricOf(run.options, facts);
    const shownAt = iteration ? session.iterationIndex : session.at;
    const at = session.isDragged ? null : shownAt;
    return html`<div class="panel">
      ${stepPanel({ trace, iteration, metric, at, num_source: facts.source_points.length / 3 }, this.renderCost(facts))}
    </div>`;
  }

  private renderDegeneracy({ is_planar }: LabFacts): TemplateResult {
    const { iteration, pose } = this.session;
    if (!iteration) return html`<div class="panel"><p class="muted">The pairs are being searched…</p></div>`;
    return html`<div class="panel">
      ${degeneracyPanel({
        iteration,
        is_planar,
        dark: this.dark,
        slide: this.slide?.metres ?? 0,
        slideTo: (metres) => {
          const { iteration: of, from } = this.slide ?? { iteration, from: pose };
          const [weakest] = directionsOf(of);
          if (!weakest) return;
          this.slide = { iteration: of, from, metres };
          this.session.drag(slid(from, of, weakest, metres));
        },
      })}
    </div>`;
  }

  private renderCost(facts: LabFacts): TemplateResult {
    const { session } = this;
    const { runs, active, at } = session;
    const drawn = runs.map((run) => ({
      costs: run.trace?.costs ?? [],
      color: this.colorOf(run),
      isActive: run.id === active,
    }));
    const count = Math.max(...runs.map(({ trace }) => numPoses(trace) - 1));
    const known = session.trace?.costs ?? [];
    const words =
      known.length > 1 ? `From ${known[0]?.toPrecision(3)} to ${known.at(-1)?.toPrecision(3)} square metres.` : '';
    return html`<h3>Cost by iteration</h3>
      ${
        runs.length > 1
          ? html`<ul class="key" aria-label="Lines">
              ${runs.map(
                (run) =>
                  html`<li class=${run.id === active ? 'active' : ''}>
                    <i style="background: ${this.colorOf(run)}"></i>${runName(run, facts)}
                  </li>`,
              )}
            </ul>`
          : nothing
      }
      <scanstitch-figure
        class="cost"
        steppable
        label="Cost by iteration"
        .description=${words}
        .painter=${costPainter(drawn, count, at, this.colorsOf(this.dark))}
        @figure-stepped=${({ detail }: CustomEvent<{ direction: number }>) => session.player.seek(at + detail.direction)}
      ></scanstitch-figure>`;
  }

  private renderMethods(run: LabRun, facts: LabFacts): TemplateResult {
    const { session } = this;
    const presets = this.presetsOf(facts.is_planar);
    return html`<div class="panel">
        ${comparePanel({
          runs: session.runs,
          active: session.active,
          facts,
          presets,
          basins: this.basins,
          colorOf: (of) => this.colorOf(of),
          selectRun: (id) => session.selectRun(id),
          removeRun: (id) => session.removeRun(id),
          add: ({ settings }) => void session.addRun(optionsOf(settings)),
          measureBasins: () => void this.measureBasins(),
        })}
      </div>
      ${
        run.own
          ? html`<div class="panel">
              ${run.comparison ? ownPanel(run.comparison, (at) => session.player.seek(at)) : nothing}
            </div>`
          : html`<scanstitch-settings
              .descriptions=${this.fieldsOf(facts.is_planar)}
              .presets=${presets}
              .values=${methodValues(run.options, facts.is_planar, metricOf(run.options, facts))}
              @settings-changed=${({ detail }: CustomEvent<SettingValues>) => session.configure(optionsOf(detail))}
            ></scanstitch-settings>`
      }`;
  }

  /** The same starts for every method, around the end of the first one. */
  private async measureBasins(): Promise<void> {
    const { client, runs, facts } = this.session;
    const [first] = runs;
    if (!client || !first?.trace || !facts) return;
    const T_center = lastPose(first.trace);
    const grid = { ...COMPARED[facts.is_planar ? 'plane' : 'space'], T_center, stride: surveyStride(facts) };
    this.basins = new Map(runs.filter(({ own }) => !own).map(({ id }) => [id, null]));
    for (const id of this.basins.keys()) {
      const share = await shareHome(client, id, grid, first.id).catch(() => null);
      this.basins = new Map([...this.basins, [id, share]]);
    }
  }

  private colorOf(run: LabRun): string {
    return runColor(this.session, run, this.colorsOf(this.dark));
  }

  static override styles = [shared, layoutStyles, labStyles, sideStyles, figureStyles];
}
