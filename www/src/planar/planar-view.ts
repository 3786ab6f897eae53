import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import '../components/frame-table.js';
import '../components/headline.js';
import '../components/map-view.js';
import '../components/overview.js';
import '../components/settings-panel.js';
import '../components/timeline.js';
import '../components/why-panel.js';
import { layout_styles } from '../components/app-styles.js';
import { icon } from '../components/icons.js';
import type { ScanstitchMap } from '../components/map-view.js';
import {
  activity,
  type Layout,
  messages,
  NO_FACTS,
  type RunView,
  sameFacts,
  tabs,
  type ViewFacts,
} from '../components/run-view.js';
import { shared } from '../components/theme.js';
import type { PlanarFiles } from '../datasets/spatial-files.js';
import { fetchDataset, fetchSample } from '../datasets/remote.js';
import type { EngineFacts, FrameResult, IterationRecord, PlanarPoint, Settings, Snapshot } from '../engine/protocol.js';
import type { GivenFiles } from '../components/run-view.js';
import { download, EXPORTS, type ExportItem, makeExport } from '../export/exports.js';
import { Session } from './session.js';
import { baseName, plural } from '../views/format.js';
import { frameColumns } from '../views/frame-columns.js';
import { frameRows } from '../views/frame-rows.js';
import { headlineFigures } from '../views/headline.js';
import type { MapMarks } from '../views/map-painter.js';
import { type OccupancyPicture, occupancyPicture } from '../views/occupancy.js';
import { framePalette, type Rgb } from '../views/palette.js';
import { memoizeLast } from '../views/memoize-last.js';
import { ownerOf, rememberSettings, settingsToBegin } from '../views/settings-link.js';

type Tab = 'why' | 'settings' | 'table' | 'figures';

const TAB_NAMES: Record<Tab, string> = { figures: 'Result', table: 'Scans', why: 'Why', settings: 'Settings' };
const TABS: Record<Layout, readonly Tab[]> = {
  wide: [],
  medium: ['why', 'settings'],
  narrow: ['figures', 'table', 'why', 'settings'],
};

// The same empty lists every time: a new one would be a change.
const NO_FRAMES: readonly FrameResult[] = [];
const NO_NUMBERS: readonly number[] = [];
const NO_WORDS: readonly string[] = [];
const NO_ROUNDS: readonly IterationRecord[] = [];
const NO_REFERENCE: readonly PlanarPoint[] = [];

/**
 * A run of laser scans in the plane: the map, what came out in figures, the table, the settings, and why each scan lies
 * where it does.
 */
@customElement('scanstitch-planar')
export class ScanstitchPlanar extends LitElement implements RunView {
  @property({ attribute: false }) src = '';
  @property({ attribute: false }) initial_settings = '';
  @property({ attribute: false }) preset = '';
  @property({ attribute: false }) remember_settings = false;
  @property({ attribute: false }) layout: Layout = 'wide';
  @property({ type: Boolean }) dark = false;

  @state() private tab: Tab = 'figures';
  @state() private selected: number | null = null;
  @state() private hovered: number | null = null;
  /** Number of scans shown; null: all there are. */
  @state() private until: number | null = null;
  @state() private pairs_shown = false;
  @state() private pairs: Float32Array | null = null;
  @state() private is_exporting = false;
  @state() private wants_occupancy = false;
  @state() private occupancy: OccupancyPicture | null = null;
  /** The result that the grid is of, and whether its colours are for the dark. */
  private occupancy_of: Snapshot | null = null;
  private occupancy_dark = false;
  @query('scanstitch-map') private map!: ScanstitchMap;

  readonly exports = EXPORTS;
  facts: ViewFacts = NO_FACTS;

  private session = new Session(this);
  private colorsOf = memoizeLast(framePalette);
  private namesOf = memoizeLast((frames: readonly FrameResult[]) => frames.map(({ name }) => name));
  private statusesOf = memoizeLast((frames: readonly FrameResult[]) => frames.map(({ status }) => status));
  private rowsOf = memoizeLast(frameRows);
  private columnsOf = memoizeLast(frameColumns);
  private figuresOf = memoizeLast(headlineFigures);
  private marksOf = memoizeLast(mapMarks);
  private shown_generation = 0;
  private announced_snapshot: unknown = null;
  private pairs_made_of: readonly unknown[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    window.addEventListener('hashchange', this.onHash);
    this.session.beginWith((facts) => this.initialSettings(facts));
    if (this.session.dataset) return;
    if (this.src === 'none') this.session.clear();
    else void this.session.openGiven(this.src === '' ? fetchSample() : fetchDataset(this.src));
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    window.removeEventListener('hashchange', this.onHash);
  }

  /** Takes in files that were dropped or picked, asked for at clock time `requested_at`. */
  add({ files, notes, num_given }: PlanarFiles, requested_at: number): Promise<void> {
    return this.session.add(files, requested_at, notes, num_given);
  }

  openSample(): void {
    void this.session.openGiven(fetchSample());
  }

  clear(): void {
    this.session.clear();
  }

  removeReference(): void {
    const reference = this.session.dataset?.reference;
    if (reference) this.session.remove(reference.name);
  }

  async filesToEvaluate(): Promise<GivenFiles | null> {
    const { session } = this;
    if (!session.snapshot || session.phase !== 'done') return null;
    return {
      reference: session.dataset?.reference ?? null,
      estimate: { name: 'this run', text: await session.ask('trajectory_tum') },
      readMap: () => session.ask('map_ply'),
    };
  }

  async runExport(id: string): Promise<void> {
    const { session } = this;
    this.is_exporting = true;
    try {
      download(
        await makeExport(id as ExportItem['id'], {
          ask: (kind) => session.ask(kind),
          picture: () => this.map.picture(),
          frame_names: session.snapshot?.result.frames.map(({ name }) => name) ?? [],
        }),
      );
    } catch (error) {
      session.report(`The export failed: ${error instanceof Error ? error.message : error}`, 'Try again');
    } finally {
      this.is_exporting = false;
    }
  }

  protected override willUpdate(_changed: PropertyValues): void {
    const { session } = this;
    const count = session.snapshot?.result.frames.length ?? 0;
    if (this.shown_generation !== session.generation || count === 0) {
      this.shown_generation = session.generation;
      this.selected = null;
      this.until = null;
    }
    if (this.selected !== null && this.selected >= count) this.selected = null;
    if (!TABS[this.layout].includes(this.tab)) this.tab = TABS[this.layout][0] ?? this.tab;
    void this.fetchPairs();
    this.fetchOccupancy();
  }

  /** The grid of the result that is shown, where it is wanted; drawn anew for light and dark. */
  private fetchOccupancy(): void {
    const { snapshot, phase } = this.session;
    const of = this.wants_occupancy && (phase === 'done' || phase === 'stopped') ? snapshot : null;
    if (of === this.occupancy_of && this.occupancy_dark === this.dark) return;
    this.occupancy_of = of;
    this.occupancy_dark = this.dark;
    if (!of) {
      this.occupancy = null;
      return;
    }
    this.session.ask('occupancy_grid').then(
      (grid) => {
        if (this.occupancy_of === of) this.occupancy = occupancyPicture(grid, this.dark);
      },
      () => undefined, // the run was stopped or begun anew: it is asked for again
    );
  }

  protected override updated(): void {
    const { dataset, snapshot, phase } = this.session;
    const facts: ViewFacts = {
      title: dataset?.title ?? '',
      count: dataset ? plural(Math.max(snapshot?.result.frames.length ?? 0, dataset.scans.length), 'scan') : '',
      reference: dataset?.reference?.name ?? '',
      can_export: snapshot !== null && (phase === 'done' || phase === 'stopped') && !this.is_exporting,
      result: snapshot,
    };
    if (sameFacts(facts, this.facts)) return;
    this.facts = facts;
    this.dispatchEvent(new CustomEvent('facts-changed'));
  }

  protected override render(): TemplateResult {
    const { session, layout } = this;
    const { snapshot, phase } = session;
    const result = snapshot?.result;
    const frames = result?.frames ?? NO_FRAMES;
    const is_empty = snapshot === null && (phase === 'empty' || phase === 'unavailable');
    return html`
      <div
        class="run ${layout}"
        @frame-selected=${({ detail }: CustomEvent<number | null>) => this.select(detail)}
        @frame-hovered=${({ detail }: CustomEvent<number | null>) => {
          this.hovered = detail;
        }}
      >
        ${is_empty ? this.renderEmpty() : nothing} ${layout === 'narrow' ? nothing : this.renderFigures()}
        <main ?hidden=${is_empty}>
          ${layout === 'wide' ? html`<aside class="side left" aria-label="Settings">${this.renderSettings()}</aside>` : nothing}
          <div class="middle">
            <div class="map-area">
              <scanstitch-map
                .points=${session.points}
                .marks=${this.marksOf(
                  frames,
                  session.look_direction,
                  result?.comparison?.reference ?? NO_REFERENCE,
                  this.until ?? frames.length,
                  this.selected,
                  this.hovered,
                  this.pairs,
                )}
                .names=${this.namesOf(frames)}
                .colors=${this.colors()}
                .reference_name=${result?.comparison?.name ?? ''}
                .fit_key=${session.generation}
                .has_occupancy=${phase === 'done' || phase === 'stopped'}
                .occupancy=${this.occupancy}
                @occupancy-wanted=${({ detail }: CustomEvent<boolean>) => {
                  this.wants_occupancy = detail;
                }}
                .description=${this.mapWords()}
                ?dark=${this.dark}
                @map-painted=${this.onPainted}
              ></scanstitch-map>
              ${activity(session)} ${messages(session)}
            </div>
            <scanstitch-timeline
              .count=${frames.length}
              .until=${this.until ?? frames.length}
              .statuses=${this.statusesOf(frames)}
              ?dark=${this.dark}
              @until-changed=${this.onUntil}
            ></scanstitch-timeline>
            ${layout === 'narrow' ? nothing : this.renderTable()}
          </div>
          ${this.renderSide()}
        </main>
        <div class="visually-hidden" role="status" aria-live="polite">${session.announcement}</div>
      </div>
    `;
  }

  private renderFigures(): TemplateResult | typeof nothing {
    const { snapshot } = this.session;
    if (!snapshot || snapshot.result.frames.length === 0) return nothing;
    const is_growing = this.session.phase === 'running';
    const figures = this.figuresOf(snapshot.result, snapshot.timing.total, is_growing);
    return html`<scanstitch-headline .figures=${figures}></scanstitch-headline>`;
  }

  private renderTable(): TemplateResult {
    const { snapshot } = this.session;
    const rows = this.rowsOf(
      snapshot?.result.frames ?? NO_FRAMES,
      snapshot?.timing.frames ?? NO_NUMBERS,
      snapshot?.result.comparison?.errors ?? NO_NUMBERS,
    );
    return html`<scanstitch-frame-table
      .rows=${rows}
      .columns=${this.columnsOf(snapshot?.result.comparison?.name ?? '')}
      .colors=${this.colors()}
      .selected=${this.selected}
    ></scanstitch-frame-table>`;
  }

  private renderSettings(): TemplateResult {
    const { facts, settings } = this.session;
    return html`<scanstitch-settings
      .descriptions=${facts?.descriptions ?? []}
      .presets=${facts?.presets ?? []}
      .values=${settings}
      @settings-changed=${this.onSettings}
    ></scanstitch-settings>`;
  }

  private renderWhy(): TemplateResult {
    const { snapshot, dataset } = this.session;
    const result = snapshot?.result;
    const frames = result?.frames ?? NO_FRAMES;
    const errors = result?.comparison?.errors ?? NO_NUMBERS;
    const reference_name = result?.comparison?.name ?? '';
    if (this.selected === null) {
      return html`<scanstitch-overview
        .frames=${frames}
        .joint_history=${result?.joint_history ?? NO_ROUNDS}
        .notes=${result?.notes ?? NO_WORDS}
        .errors=${errors}
        .reference_name=${reference_name}
        .colors=${this.colors()}
      ></scanstitch-overview>`;
    }
    return html`<scanstitch-why
      .frames=${frames}
      .index=${this.selected}
      .ms=${snapshot?.timing.frames ?? NO_NUMBERS}
      .errors=${errors}
      .reference_name=${reference_name}
      .colors=${this.colors()}
      ?removable=${(dataset?.scans.length ?? 0) > 1}
      ?pairs_shown=${this.pairs_shown}
      @pairs-toggled=${({ detail }: CustomEvent<boolean>) => {
        this.pairs_shown = detail;
      }}
      @scan-removed=${({ detail }: CustomEvent<string>) => this.session.remove(detail)}
    ></scanstitch-why>`;
  }

  /** Beside the map: the why alone where settings have their own place, else tabs. */
  private renderSide(): TemplateResult {
    if (this.layout === 'wide') return html`<aside class="side right" aria-label="Why">${this.renderWhy()}</aside>`;
    const panels: Record<Tab, () => TemplateResult | typeof nothing> = {
      figures: () => this.renderFigures(),
      table: () => this.renderTable(),
      why: () => this.renderWhy(),
      settings: () => this.renderSettings(),
    };
    const names = TABS[this.layout].map((tab) => ({ tab, label: TAB_NAMES[tab] }));
    return tabs(names, this.tab, panels[this.tab](), (tab) => {
      this.tab = tab;
    });
  }

  private renderEmpty(): TemplateResult {
    const want = (detail: string): void => {
      this.dispatchEvent(new CustomEvent('files-wanted', { detail }));
    };
    return html`<div class="empty">
      ${messages(this.session)}
      <section aria-label="No scans yet">
        ${icon('open', 32)}
        <h2>Drop laser scans or depth images here</h2>
        <p>
          Laser scans in the plane as PLY files, numbered in the order in which they were taken, or a laser log (CARMEN,
          CSM) with many; or depth images with their colour images; or clouds in space. Single files, the folder they
          lie in, or a zip of it. The true path may lie beside them.
        </p>
        <p class="actions">
          <button class="primary" @click=${() => want('files')}>Choose files</button>
          <button @click=${() => want('folder')}>Choose a folder</button>
          <button @click=${() => want('sample')}>Show the sample</button>
        </p>
        <p class="muted">Everything is computed in this tab. Nothing leaves your machine.</p>
      </section>
    </div>`;
  }

  /** One colour for each scan there will be, also while only some are aligned. */
  private colors(): readonly Rgb[] {
    const { snapshot, dataset } = this.session;
    return this.colorsOf(Math.max(snapshot?.result.frames.length ?? 0, dataset?.scans.length ?? 0), this.dark);
  }

  private mapWords(): string {
    const { snapshot, points } = this.session;
    if (!snapshot) return 'No scans yet.';
    const { frames } = snapshot.result;
    const shown = this.until ?? frames.length;
    const chosen = this.selected === null ? '' : ` ${baseName(frames[this.selected]?.name ?? '')} is selected.`;
    return `${shown} of ${plural(frames.length, 'scan')}, ${plural(points.points.length / 2, 'point')}.${chosen}`;
  }

  private initialSettings(facts: EngineFacts): Settings {
    const fragment = this.remember_settings ? location.hash : '';
    return settingsToBegin('planar', facts, this.preset, this.initial_settings, fragment);
  }

  private select(frame: number | null): void {
    this.selected = frame;
    if (frame !== null && this.until !== null && frame >= this.until) this.until = frame + 1;
  }

  /** The pairs of the selected frame are asked for once for every frame and result. */
  private async fetchPairs(): Promise<void> {
    const { session, selected, pairs_shown } = this;
    const made_of = [session.snapshot, selected, pairs_shown];
    if (made_of.every((value, i) => value === this.pairs_made_of[i])) return;
    this.pairs_made_of = made_of;
    if (!pairs_shown || selected === null || session.phase === 'crashed') {
      this.pairs = null;
      return;
    }
    try {
      const pairs = await session.ask('correspondences', selected);
      if (this.pairs_made_of === made_of) this.pairs = pairs;
    } catch {
      if (this.pairs_made_of === made_of) this.pairs = null; // the crash, if it is one, is told by the session
    }
  }

  private onUntil({ detail }: CustomEvent<number>): void {
    const count = this.session.snapshot?.result.frames.length ?? 0;
    this.until = detail >= count ? null : detail;
    this.selected = detail - 1;
  }

  private onSettings({ detail }: CustomEvent<Settings>): void {
    this.session.configure(detail);
    const { facts } = this.session;
    if (this.remember_settings && facts) rememberSettings('planar', facts, detail);
  }

  private onHash = (): void => {
    const { facts } = this.session;
    if (this.remember_settings && facts && ownerOf(location.hash) === 'planar') {
      this.session.configure(this.initialSettings(facts));
    }
  };

  private onPainted(): void {
    const { session } = this;
    if (session.phase !== 'done' || !session.snapshot || this.announced_snapshot === session.snapshot) return;
    this.announced_snapshot = session.snapshot;
    const { result, timing } = session.snapshot;
    const elapsed_ms = performance.now() - session.requested_at;
    this.dispatchEvent(
      new CustomEvent('scanstitch-stitched', { detail: { result, timing, elapsed_ms }, bubbles: true, composed: true }),
    );
  }

  static override styles = [shared, layout_styles];
}

function mapMarks(
  frames: readonly FrameResult[],
  look_direction: number,
  reference: readonly PlanarPoint[],
  until: number,
  selected: number | null,
  hovered: number | null,
  pairs: Float32Array | null,
): MapMarks {
  return {
    poses: frames.map(({ T_world_sensor }) => T_world_sensor),
    statuses: frames.map(({ status }) => status),
    look_direction,
    until,
    selected,
    hovered,
    reference,
    pairs,
    undetermined: (selected === null ? null : frames[selected]?.undetermined) ?? null,
  };
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-planar': ScanstitchPlanar;
  }
}
