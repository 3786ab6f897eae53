import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import './components/frame-table.js';
import './components/headline.js';
import './components/map-view.js';
import './components/menu.js';
import './components/messages.js';
import './components/overview.js';
import './components/settings-panel.js';
import './components/timeline.js';
import './components/why-panel.js';
import { app_styles } from './components/app-styles.js';
import { icon, logo } from './components/icons.js';
import type { ScanstitchMap } from './components/map-view.js';
import type { MenuItem } from './components/menu.js';
import { shared, tokens } from './components/theme.js';
import { filesOfDrop, filesOfInput } from './datasets/gather.js';
import { fetchDataset, fetchSample } from './datasets/remote.js';
import type { EngineFacts, FrameResult, IterationRecord, PlanarPoint, Settings } from './engine/protocol.js';
import { download, EXPORTS, type ExportItem, makeExport } from './export/exports.js';
import type { GivenFiles } from './evaluate/evaluate-view.js';
import { Session } from './session.js';
import { baseName, plural } from './views/format.js';
import { frameRows } from './views/frame-rows.js';
import { headlineFigures } from './views/headline.js';
import type { MapMarks } from './views/map-painter.js';
import { framePalette, type Rgb } from './views/palette.js';
import { remember } from './views/remember.js';
import { parseSettings, writeSettings } from './views/setting-fields.js';

type Theme = 'auto' | 'light' | 'dark';
type Layout = 'wide' | 'medium' | 'narrow';
type Tab = 'why' | 'settings' | 'table' | 'figures';

const TAB_NAMES: Record<Tab, string> = { figures: 'Result', table: 'Scans', why: 'Why', settings: 'Settings' };
const TABS: Record<Layout, readonly Tab[]> = {
  wide: [],
  medium: ['why', 'settings'],
  narrow: ['figures', 'table', 'why', 'settings'],
};
const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;

// The same empty lists every time: a new one would be a change.
const NO_FRAMES: readonly FrameResult[] = [];
const NO_NUMBERS: readonly number[] = [];
const NO_WORDS: readonly string[] = [];
const NO_ROUNDS: readonly IterationRecord[] = [];
const NO_REFERENCE: readonly PlanarPoint[] = [];

const OPEN_ITEMS: readonly MenuItem[] = [
  { id: 'files', label: 'Files…', detail: 'PLY scans, and a trajectory to compare with' },
  { id: 'folder', label: 'Folder…', detail: 'with all that lies in it' },
  { id: 'sample', label: 'The sample', detail: 'ten scans of a corridor, with the true path' },
  { id: 'clear', label: 'Remove all scans', detail: 'the next ones start afresh' },
];

/**
 * Scanstitch as one element: `<scanstitch-app></scanstitch-app>`. Drop laser scans on it; it shows the path of the
 * scanner and the stitched map, computed in the tab.
 *
 * Attributes
 * - `src`: scans to begin with instead of the built-in sample: the address of a manifest
 *   `{ "title": "...", "scans": ["0.ply", ...], "reference": "truth.tum" }`, or the addresses of scans and one
 *   trajectory, apart by spaces. `src="none"` begins empty.
 * - `settings`: `name=value&name=value` in SI units, for example `strategy=scan_to_scan&max_range=20`.
 * - `preset`: name of the preset to begin with.
 * - `view`: `bev` begins with the bird's-eye view; `src` then names a `scene.json`, whose pictures lie beside it. A link
 *   that ends in `#bev` does so as well.
 * - `theme`: `light`, `dark`, or `auto` (the default: as the system has it).
 * - `remember-settings`: changed settings are kept in the fragment of the page's address, so a link carries them.
 *
 * The height is the page's choice; without one it is 760 pixels or nine tenths of the window.
 *
 * Fires `scanstitch-stitched` when a computation is over and its map is on the screen; `detail` holds the engine's
 * `result`, the `timing`, and `elapsed_ms` since the files were dropped or the setting was changed.
 */
@customElement('scanstitch-app')
export class ScanstitchApp extends LitElement {
  @property() src = '';
  @property({ attribute: 'settings' }) initial_settings = '';
  @property() preset = '';
  @property() view: 'map' | 'bev' = 'map';
  @property({ reflect: true }) theme: Theme = 'auto';
  @property({ type: Boolean, attribute: 'remember-settings' }) remember_settings = false;

  @state() private layout: Layout = 'wide';
  @state() private tab: Tab = 'figures';
  @state() private is_dropping = false;
  @state() private selected: number | null = null;
  @state() private hovered: number | null = null;
  /** Number of scans shown; null: all there are. */
  @state() private until: number | null = null;
  @state() private pairs_shown = false;
  @state() private pairs: Float32Array | null = null;
  @state() private is_system_dark = false;
  @state() private is_exporting = false;
  @state() private is_evaluating = false;
  @state() private was_evaluating = false;
  @state() private is_bev = false;
  @state() private was_bev = false;
  @state() private evaluated_run: (GivenFiles & { of: unknown }) | null = null;
  @query('scanstitch-map') private map!: ScanstitchMap;
  @query('#pick-files') private file_input!: HTMLInputElement;
  @query('#pick-folder') private folder_input!: HTMLInputElement;

  private session = new Session(this);
  private colorsOf = remember(framePalette);
  private namesOf = remember((frames: readonly FrameResult[]) => frames.map(({ name }) => name));
  private statusesOf = remember((frames: readonly FrameResult[]) => frames.map(({ status }) => status));
  private rowsOf = remember(frameRows);
  private figuresOf = remember(headlineFigures);
  private marksOf = remember(mapMarks);
  private shown_generation = 0;
  private announced_snapshot: unknown = null;
  private pairs_made_of: readonly unknown[] = [];
  private system_dark = matchMedia('(prefers-color-scheme: dark)');
  private resize_observer = new ResizeObserver(([entry]) => {
    const width = entry?.contentRect.width ?? WIDE_FROM;
    this.layout = width >= WIDE_FROM ? 'wide' : width >= MEDIUM_FROM ? 'medium' : 'narrow';
  });
  private drag_depth = 0;

  override connectedCallback(): void {
    super.connectedCallback();
    this.resize_observer.observe(this);
    this.onSystemTheme();
    this.system_dark.addEventListener('change', this.onSystemTheme);
    window.addEventListener('hashchange', this.onHash);
    this.session.beginWith((facts) => this.initialSettings(facts));
    if (/^#bev\b/.test(location.hash)) this.view = 'bev';
    if (this.view === 'bev') this.toggleBev();
    else this.openFirst();
  }

  /** What the map begins with. */
  private openFirst(): void {
    if (this.session.dataset) return;
    if (this.src === 'none') this.session.clear();
    else this.session.openGiven(this.src === '' ? fetchSample() : fetchDataset(this.src));
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.resize_observer.disconnect();
    this.system_dark.removeEventListener('change', this.onSystemTheme);
    window.removeEventListener('hashchange', this.onHash);
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
    this.fetchPairs();
  }

  protected override render(): TemplateResult {
    const { session, layout } = this;
    const { snapshot, phase } = session;
    const result = snapshot?.result;
    const frames = result?.frames ?? NO_FRAMES;
    const is_aside = this.is_evaluating || this.is_bev;
    const is_empty = snapshot === null && (phase === 'empty' || phase === 'unavailable');
    return html`
      <div
        class="app ${layout}"
        @dragenter=${this.onDragEnter}
        @dragover=${this.onDragOver}
        @dragleave=${this.onDragLeave}
        @drop=${this.onDrop}
        @frame-selected=${({ detail }: CustomEvent<number | null>) => this.select(detail)}
        @frame-hovered=${({ detail }: CustomEvent<number | null>) => {
          this.hovered = detail;
        }}
      >
        ${this.renderHeader()} ${this.renderEvaluation()} ${this.renderBev()}
        ${is_empty && !is_aside ? this.renderEmpty() : nothing}
        ${layout === 'narrow' || is_aside ? nothing : this.renderFigures()}
        <main ?hidden=${is_empty || is_aside}>
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
                .description=${this.mapWords()}
                ?dark=${this.isDark()}
                @map-painted=${this.onPainted}
              ></scanstitch-map>
              ${this.renderActivity()} ${this.renderMessages()}
            </div>
            <scanstitch-timeline
              .count=${frames.length}
              .until=${this.until ?? frames.length}
              .statuses=${this.statusesOf(frames)}
              ?dark=${this.isDark()}
              @until-changed=${this.onUntil}
            ></scanstitch-timeline>
            ${layout === 'narrow' ? nothing : this.renderTable()}
          </div>
          ${this.renderSide()}
        </main>
        <div class="visually-hidden" role="status" aria-live="polite">${session.announcement}</div>
        <input id="pick-files" type="file" multiple hidden @change=${this.onPicked} />
        <input id="pick-folder" type="file" webkitdirectory hidden @change=${this.onPicked} />
        ${
          this.is_dropping
            ? html`<div class="drop-hint" aria-hidden="true">
                <div>${icon('download', 28)}Drop scans or a folder here</div>
              </div>`
            : nothing
        }
      </div>
    `;
  }

  private renderHeader(): TemplateResult {
    const { dataset, snapshot, phase } = this.session;
    const is_narrow = this.layout === 'narrow';
    const reference = dataset?.reference;
    const can_export = snapshot !== null && (phase === 'done' || phase === 'stopped') && !this.is_exporting;
    return html`<header class="bar">
      <div class="brand">${logo()}<span>Scanstitch</span></div>
      <div class="dataset">
        ${
          this.is_evaluating || this.is_bev
            ? html`<span class="title">${this.is_bev ? "Bird's-eye view" : 'Trajectories against the truth'}</span>`
            : dataset
              ? html`<span class="title" title=${dataset.title}>${dataset.title}</span>
                  <span class="muted count">${plural(dataset.scans.length, 'scan')}</span>
                  ${
                    reference && !is_narrow
                      ? html`<span class="chip" title="Reference trajectory: ${reference.name}"
                          ><i class="dash"></i>${baseName(reference.name)}<button
                            class="quiet"
                            @click=${() => this.session.remove(reference.name)}
                            aria-label="Remove the reference ${baseName(reference.name)}"
                            title="Remove the reference"
                          >
                            ${icon('close', 12)}
                          </button></span
                        >`
                      : nothing
                  }`
              : nothing
        }
      </div>
      <nav aria-label="Actions">
        <button
          ?hidden=${this.is_evaluating}
          aria-pressed=${this.is_bev}
          title="Points of a top view, found in a front view"
          @click=${this.toggleBev}
        >
          ${this.is_bev ? 'Back to the map' : 'BEV'}
        </button>
        <button
          ?hidden=${this.is_bev}
          aria-pressed=${this.is_evaluating}
          title="Compare trajectories with the truth"
          @click=${this.toggleEvaluation}
        >
          ${this.is_evaluating ? 'Back to the map' : 'Evaluate'}
        </button>
        <scanstitch-menu
          ?hidden=${this.is_evaluating || this.is_bev}
          label="Open"
          icon="open"
          .items=${OPEN_ITEMS}
          ?compact=${is_narrow}
          @menu-chosen=${this.onOpen}
        ></scanstitch-menu>
        <scanstitch-menu
          ?hidden=${this.is_evaluating || this.is_bev}
          label="Export"
          icon="download"
          .items=${EXPORTS}
          ?compact=${is_narrow}
          ?disabled=${!can_export}
          @menu-chosen=${this.onExport}
        ></scanstitch-menu>
        <button
          class="icon quiet"
          @click=${this.toggleTheme}
          aria-label=${this.isDark() ? 'Light colours' : 'Dark colours'}
          title=${this.isDark() ? 'Light colours' : 'Dark colours'}
        >
          ${icon(this.isDark() ? 'sun' : 'moon')}
        </button>
      </nav>
    </header>`;
  }

  /** The second view, loaded when it is first asked for; hidden, it keeps its files. */
  private renderEvaluation(): TemplateResult | typeof nothing {
    if (!this.was_evaluating) return nothing;
    return html`<scanstitch-evaluate
      ?hidden=${!this.is_evaluating}
      ?dark=${this.isDark()}
      .given=${this.evaluated_run}
    ></scanstitch-evaluate>`;
  }

  /** A run that is done goes along, with its reference. */
  private async toggleEvaluation(): Promise<void> {
    const { session } = this;
    if (!this.is_evaluating) {
      await import('./evaluate/evaluate-view.js');
      const is_new = session.snapshot !== null && this.evaluated_run?.of !== session.snapshot;
      if (is_new && session.dataset?.reference && session.phase === 'done') {
        const text = await session.ask('trajectory_tum');
        const { reference } = session.dataset;
        this.evaluated_run = { of: session.snapshot, reference, estimate: { name: 'this run', text } };
      }
      this.was_evaluating = true;
    }
    this.is_evaluating = !this.is_evaluating;
  }

  /** The third view, loaded when it is first asked for. */
  private renderBev(): TemplateResult | typeof nothing {
    if (!this.was_bev) return nothing;
    return html`<scanstitch-bev
      ?hidden=${!this.is_bev}
      ?dark=${this.isDark()}
      src=${this.view === 'bev' && this.src !== 'none' ? this.src : ''}
      ?remember-scene=${this.remember_settings}
    ></scanstitch-bev>`;
  }

  private async toggleBev(): Promise<void> {
    if (!this.is_bev) await import('./bev/bev-view.js');
    else if (this.view === 'bev' && this.src === '') this.openFirst();
    this.is_bev = !this.is_bev;
    this.was_bev = true;
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
      .colors=${this.colors()}
      .selected=${this.selected}
      .reference_name=${snapshot?.result.comparison?.name ?? ''}
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
    return html`<aside class="side tabs" aria-label="Details">
      <div role="tablist" aria-label="Details" @keydown=${this.onTabKey}>
        ${TABS[this.layout].map(
          (tab) =>
            html`<button
              role="tab"
              id="tab-${tab}"
              aria-controls="panel"
              aria-selected=${tab === this.tab}
              tabindex=${tab === this.tab ? 0 : -1}
              @click=${() => {
                this.tab = tab;
              }}
            >
              ${TAB_NAMES[tab]}
            </button>`,
        )}
      </div>
      <div id="panel" role="tabpanel" aria-labelledby="tab-${this.tab}">${panels[this.tab]()}</div>
    </aside>`;
  }

  private renderActivity(): TemplateResult | typeof nothing {
    const { phase, activity, progress } = this.session;
    if (phase === 'running' || phase === 'reading') {
      return html`<div class="activity">
        <div class="activity-words">
          <span>${activity}</span><button @click=${() => this.session.stop()}>Stop</button>
        </div>
        <progress max="1" .value=${progress} aria-label=${activity}></progress>
      </div>`;
    }
    if (phase === 'stopped' || phase === 'crashed') {
      const words = phase === 'stopped' ? 'Stopped: the map so far' : 'Not computed since the crash';
      return html`<div class="activity">
        <div class="activity-words">
          <span>${words}</span>
          <button class="primary" @click=${() => this.session.resume()}>
            ${phase === 'stopped' ? 'Go on' : 'Compute again'}
          </button>
        </div>
      </div>`;
    }
    return nothing;
  }

  private renderMessages(): TemplateResult {
    const { session } = this;
    return html`<scanstitch-messages
      .messages=${session.messages}
      @messages-dismissed=${() => session.dismissMessages()}
    ></scanstitch-messages>`;
  }

  private renderEmpty(): TemplateResult {
    return html`<div class="empty">
      ${this.renderMessages()}
      <section aria-label="No scans yet">
        ${icon('open', 32)}
        <h2>Drop laser scans here</h2>
        <p>
          PLY files, one for each scan, numbered in the order in which they were taken; or the folder they lie in. A
          trajectory to compare with (TUM, or lines of x y z) may lie beside them.
        </p>
        <p class="actions">
          <button class="primary" @click=${() => this.file_input.click()}>Choose files</button>
          <button @click=${() => this.folder_input.click()}>Choose a folder</button>
          <button @click=${() => this.session.openGiven(fetchSample())}>Show the sample</button>
        </p>
        <p class="muted">Everything is computed in this tab. Nothing leaves your machine.</p>
      </section>
    </div>`;
  }

  /** One colour for each scan there will be, also while only some are aligned. */
  private colors(): readonly Rgb[] {
    const { snapshot, dataset } = this.session;
    return this.colorsOf(Math.max(snapshot?.result.frames.length ?? 0, dataset?.scans.length ?? 0), this.isDark());
  }

  private mapWords(): string {
    const { snapshot, points } = this.session;
    if (!snapshot) return 'No scans yet.';
    const { frames } = snapshot.result;
    const shown = this.until ?? frames.length;
    const chosen = this.selected === null ? '' : ` ${baseName(frames[this.selected]?.name ?? '')} is selected.`;
    return `${shown} of ${plural(frames.length, 'scan')}, ${plural(points.points.length / 2, 'point')}.${chosen}`;
  }

  private isDark(): boolean {
    return this.theme === 'dark' || (this.theme === 'auto' && this.is_system_dark);
  }

  private initialSettings({ presets, descriptions }: EngineFacts): Settings {
    const base = presets.find(({ name }) => name === this.preset)?.settings ?? presets[0]?.settings;
    if (!base) throw new Error('The engine names no preset.');
    const given = parseSettings(this.initial_settings, base, descriptions);
    return this.remember_settings ? parseSettings(location.hash.slice(1), given, descriptions) : given;
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
    const base = this.session.facts?.presets[0]?.settings;
    if (!this.remember_settings || !base) return;
    const text = writeSettings(detail, base);
    history.replaceState(history.state, '', text === '' ? location.pathname + location.search : `#${text}`);
  }

  private onHash = (): void => {
    const { facts } = this.session;
    if (this.remember_settings && facts) this.session.configure(this.initialSettings(facts));
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

  private onOpen({ detail }: CustomEvent<string>): void {
    if (detail === 'files') this.file_input.click();
    else if (detail === 'folder') this.folder_input.click();
    else if (detail === 'sample') this.session.openGiven(fetchSample());
    else this.session.clear();
  }

  private async onPicked({ target }: Event): Promise<void> {
    const input = target as HTMLInputElement;
    const files = filesOfInput(input);
    input.value = ''; // so that picking the same files again is a change
    await this.session.add(files, performance.now());
  }

  private async onExport({ detail }: CustomEvent<ExportItem['id']>): Promise<void> {
    const { session } = this;
    this.is_exporting = true;
    try {
      download(
        await makeExport(detail, {
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

  private toggleTheme(): void {
    this.theme = this.isDark() ? 'light' : 'dark';
  }

  private onSystemTheme = (): void => {
    this.is_system_dark = this.system_dark.matches;
  };

  private onTabKey(event: KeyboardEvent): void {
    const tabs = TABS[this.layout];
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    this.tab = tabs.at((tabs.indexOf(this.tab) + step) % tabs.length) ?? this.tab;
    this.updateComplete.then(() => this.renderRoot.querySelector<HTMLElement>(`#tab-${this.tab}`)?.focus());
  }

  // Dropping. The depth tells leaving the element from entering one of its children.

  private onDragEnter(event: DragEvent): void {
    if (!hasFiles(event)) return;
    event.preventDefault();
    this.drag_depth++;
    this.is_dropping = true;
  }

  private onDragOver(event: DragEvent): void {
    if (!hasFiles(event) || !event.dataTransfer) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
  }

  private onDragLeave(event: DragEvent): void {
    if (!hasFiles(event)) return;
    this.drag_depth = Math.max(0, this.drag_depth - 1);
    this.is_dropping = this.drag_depth > 0;
  }

  private async onDrop(event: DragEvent): Promise<void> {
    if (!event.dataTransfer || !hasFiles(event)) return;
    event.preventDefault();
    this.drag_depth = 0;
    this.is_dropping = false;
    const dropped_at = performance.now();
    await this.session.add(await filesOfDrop(event.dataTransfer), dropped_at);
  }

  static override styles = [tokens, shared, app_styles];
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

function hasFiles(event: DragEvent): boolean {
  return event.dataTransfer?.types.includes('Files') ?? false;
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-app': ScanstitchApp;
  }
}
