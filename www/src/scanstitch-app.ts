import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import './components/menu.js';
import './planar/planar-view.js';
import { app_styles } from './components/app-styles.js';
import { DropTarget } from './components/drop-target.js';
import { icon, logo } from './components/icons.js';
import type { MenuItem } from './components/menu.js';
import type { Layout } from './components/run-parts.js';
import { type GivenFiles, type GivenRecording, NO_FACTS } from './components/run-view.js';
import { wordsOf } from './components/session.js';
import { drop_styles, shared, tokens } from './components/theme.js';
import { filesOfDrop, filesOfInput, type NamedFile } from './datasets/gather.js';
import {
  type BagListener,
  chooseTopics,
  type OpenedFiles,
  openFiles,
  type SpatialFiles,
  tellApart,
} from './datasets/spatial-files.js';
import type { BagState, Wishes } from './components/topics-panel.js';
import type { ScanstitchPlanar } from './planar/planar-view.js';
import type { ScanstitchSpatial } from './spatial/spatial-view.js';
import { baseName } from './views/format.js';
import { ownerOf } from './views/settings-link.js';

type Theme = 'auto' | 'light' | 'dark';
/** Views of a run, and views beside it. */
type Run = 'planar' | 'spatial';
type View = Run | 'evaluation' | 'bev' | 'strategies';

const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;
/** How far a bag has been looked into is told at most this often. */
const LOOKING_INTERVAL_MS = 100;

const OPEN_ITEMS: readonly MenuItem[] = [
  {
    id: 'files',
    label: 'Files…',
    detail: 'scans, depth images, clouds, a ROS 2 bag, a zip; and a trajectory to compare with',
  },
  { id: 'folder', label: 'Folder…', detail: 'including its subfolders' },
  { id: 'sample', label: 'The sample', detail: 'ten scans of a corridor, with ground truth' },
  { id: 'apartment', label: 'An apartment', detail: 'depth images of several rooms, with ground truth' },
  { id: 'clear', label: 'Remove all', detail: 'the next files start a new data set' },
];

/** What may join the recording that is open: a reference trajectory, a camera. */
const isBeside = (path: string): boolean => /\.(npy|txt|tum|csv|log|traj|json)$/i.test(path);

const fetchApartment = async (): Promise<SpatialFiles> => (await import('./datasets/apartment.js')).fetchApartment();

/**
 * Scanstitch as one element: `<scanstitch-app></scanstitch-app>`. Drop laser scans or depth images on it; it shows the
 * path of the sensor and the stitched map, computed in the tab.
 *
 * Attributes
 * - `src`: scans to begin with instead of the built-in sample: the address of a manifest
 *   `{ "title": "...", "scans": ["0.ply", ...], "reference": "truth.tum" }`, or the addresses of scans and one
 *   trajectory, apart by spaces. `src="none"` begins empty, `src="apartment"` with the depth images of the second sample.
 * - `settings`: `name=value&name=value` in SI units, for example `strategy=scan_to_scan&max_range=20`; for laser scans and
 *   for depth images, each taking those of its names.
 * - `preset`: name of the preset to begin with.
 * - `view`: `bev` begins with the bird's-eye view; `src` then names a `scene.json`, whose pictures lie beside it. A link
 *   that ends in `#bev` does so as well.
 * - `theme`: `light`, `dark`, or `auto` (the default: as the system has it).
 * - `remember-settings`: changed settings are kept in the fragment of the page's address, so a link carries them.
 *   Those in space stand behind `#spatial`, which begins with the depth images.
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
  @property({ attribute: 'view' }) first_view: 'map' | 'bev' = 'map';
  @property({ reflect: true }) theme: Theme = 'auto';
  @property({ type: Boolean, attribute: 'remember-settings' }) remember_settings = false;

  @state() private layout: Layout = 'wide';
  @state() private view: View = 'planar';
  /** The view of a run that is shown, or lies behind one beside it. */
  @state() private run: Run = 'planar';
  /** Views that were shown once stay, hidden, with all they hold. */
  @state() private opened: ReadonlySet<View> = new Set<View>(['planar']);
  @state() private is_system_dark = false;
  @state() private compared_recording: GivenRecording | null = null;
  @state() private evaluated_run: (GivenFiles & { of: unknown }) | null = null;
  @query('scanstitch-planar') private planar!: ScanstitchPlanar;
  @query('scanstitch-spatial') private spatial!: ScanstitchSpatial | null;
  @query('#pick-files') private file_input!: HTMLInputElement;
  @query('#pick-folder') private folder_input!: HTMLInputElement;

  /** The bag that is open, and its files. */
  @state() private bag: BagState | null = null;
  private opened_files: OpenedFiles | null = null;
  /** Counts what was asked for: the last one wins. */
  private num_taken = 0;

  /** Says that what is done in expectation of files is over. Null before any are expected. */
  private expecting: AbortController | null = null;

  private drop_target = new DropTarget(
    this,
    (transfer) => {
      const dropped_at = performance.now();
      this.attend(filesOfDrop(transfer).then((files) => this.take(files, dropped_at)));
    },
    () => this.expectFiles(),
  );
  private system_dark = matchMedia('(prefers-color-scheme: dark)');
  private resize_observer = new ResizeObserver(([entry]) => {
    const width = entry?.contentRect.width ?? WIDE_FROM;
    this.layout = width >= WIDE_FROM ? 'wide' : width >= MEDIUM_FROM ? 'medium' : 'narrow';
  });

  override connectedCallback(): void {
    super.connectedCallback();
    this.resize_observer.observe(this);
    this.onSystemTheme();
    this.system_dark.addEventListener('change', this.onSystemTheme);
    if (ownerOf(location.hash) === 'bev') this.first_view = 'bev';
    else if (this.src === '' && this.remember_settings && ownerOf(location.hash) === 'spatial') this.src = 'apartment';
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.expecting?.abort();
    this.resize_observer.disconnect();
    this.system_dark.removeEventListener('change', this.onSystemTheme);
  }

  protected override firstUpdated(): void {
    if (this.first_view === 'bev') this.attend(this.toggleBev());
    else if (this.src === 'apartment') this.attend(this.openSpatial(fetchApartment(), performance.now()));
  }

  protected override render(): TemplateResult {
    const { drop_target } = this;
    const onFacts = (): void => this.requestUpdate();
    const onWanted = ({ detail }: CustomEvent<string>): void => this.open(detail);
    return html`
      <div
        class="app ${this.layout}"
        @dragenter=${drop_target.enter}
        @dragover=${drop_target.over}
        @dragleave=${drop_target.leave}
        @drop=${drop_target.drop}
      >
        ${this.renderHeader()}
        ${
          this.bag && (this.view === 'planar' || this.view === 'spatial')
            ? html`<scanstitch-topics
                .bag=${this.bag}
                @topics-chosen=${({ detail }: CustomEvent<Wishes>) => this.attend(this.choose(detail))}
              ></scanstitch-topics>`
            : nothing
        }
        ${
          this.opened.has('evaluation')
            ? html`<scanstitch-evaluate
                ?hidden=${this.view !== 'evaluation'}
                ?dark=${this.isDark()}
                .given=${this.evaluated_run}
              ></scanstitch-evaluate>`
            : nothing
        }
        ${
          this.opened.has('strategies')
            ? html`<scanstitch-strategies
                ?hidden=${this.view !== 'strategies'}
                ?dark=${this.isDark()}
                .given=${this.compared_recording}
              ></scanstitch-strategies>`
            : nothing
        }
        ${
          this.opened.has('bev')
            ? html`<scanstitch-bev
                ?hidden=${this.view !== 'bev'}
                ?dark=${this.isDark()}
                src=${this.first_view === 'bev' && this.src !== 'none' ? this.src : ''}
                ?remember-scene=${this.remember_settings}
              ></scanstitch-bev>`
            : nothing
        }
        <scanstitch-planar
          ?hidden=${this.view !== 'planar'}
          .src=${this.first_view === 'bev' || this.src === 'apartment' ? 'none' : this.src}
          .initial_settings=${this.initial_settings}
          .preset=${this.preset}
          .remember_settings=${this.remember_settings}
          .layout=${this.layout}
          ?dark=${this.isDark()}
          @facts-changed=${onFacts}
          @files-wanted=${onWanted}
        ></scanstitch-planar>
        ${
          this.opened.has('spatial')
            ? html`<scanstitch-spatial
                ?hidden=${this.view !== 'spatial'}
                .initial_settings=${this.initial_settings}
                .preset=${this.preset}
                .remember_settings=${this.remember_settings}
                .layout=${this.layout}
                ?dark=${this.isDark()}
                @facts-changed=${onFacts}
                @files-wanted=${onWanted}
              ></scanstitch-spatial>`
            : nothing
        }
        <input id="pick-files" type="file" multiple hidden @change=${this.onPicked} />
        <input id="pick-folder" type="file" webkitdirectory hidden @change=${this.onPicked} />
        ${
          drop_target.is_over
            ? html`<div class="drop-hint" aria-hidden="true">
                <div>${icon('download', 28)}Drop scans, depth images or a folder here</div>
              </div>`
            : nothing
        }
      </div>
    `;
  }

  private renderHeader(): TemplateResult {
    const is_narrow = this.layout === 'narrow';
    const is_evaluating = this.view === 'evaluation';
    const is_bev = this.view === 'bev';
    const is_comparing = this.view === 'strategies';
    const is_aside = is_evaluating || is_bev || is_comparing;
    const run = this.runView();
    const { title, count, reference, can_export } = run?.facts ?? NO_FACTS;
    return html`<header class="bar">
      <div class="brand">${logo()}<span>Scanstitch</span></div>
      <div class="dataset">
        ${
          is_aside
            ? html`<span class="title"
                >${is_bev ? "Bird's-eye view" : is_comparing ? 'Strategy comparison' : 'Trajectory evaluation'}</span
              >`
            : title
              ? html`<span class="title" title=${title}>${title}</span> <span class="muted count">${count}</span> ${
                    reference && !is_narrow
                      ? html`<span class="chip" title="Ground truth: ${reference}"
                          ><i class="dash ${this.run}"></i>${baseName(reference)}<button
                            class="quiet"
                            @click=${() => run?.removeReference()}
                            aria-label="Remove the ground truth ${baseName(reference)}"
                            title="Remove the ground truth"
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
          ?hidden=${is_evaluating || is_bev || this.run !== 'spatial' || title === ''}
          aria-pressed=${is_comparing}
          title="Compare strategies: what a map costs in memory and time, and gains in accuracy"
          @click=${() => this.attend(this.toggleStrategies())}
        >
          ${is_comparing ? 'Back to the map' : is_narrow ? 'Strategies' : 'Compare strategies'}
        </button>
        <button
          ?hidden=${is_evaluating || is_comparing}
          aria-pressed=${is_bev}
          title="Bird's-eye view: project points of a top view into a front view"
          @click=${() => this.attend(this.toggleBev())}
        >
          ${is_bev ? 'Back to the map' : is_narrow ? 'BEV' : "Bird's-eye view"}
        </button>
        <button
          ?hidden=${is_bev || is_comparing}
          aria-pressed=${is_evaluating}
          title="Compare trajectories with ground truth"
          @click=${() => this.attend(this.toggleEvaluation())}
        >
          ${is_evaluating ? 'Back to the map' : 'Evaluate'}
        </button>
        <scanstitch-menu
          ?hidden=${is_aside}
          label="Open"
          icon="open"
          .items=${OPEN_ITEMS}
          ?compact=${is_narrow}
          @menu-opened=${this.expectFiles}
          @menu-chosen=${({ detail }: CustomEvent<string>) => this.open(detail)}
        ></scanstitch-menu>
        <scanstitch-menu
          ?hidden=${is_aside}
          label="Export"
          icon="download"
          .items=${run?.exports ?? []}
          ?compact=${is_narrow}
          ?disabled=${!can_export}
          @menu-chosen=${({ detail }: CustomEvent<string>) => run?.runExport(detail)}
        ></scanstitch-menu>
        <button
          class="icon quiet"
          @click=${() => {
            this.theme = this.isDark() ? 'light' : 'dark';
          }}
          aria-label=${this.isDark() ? 'Light colours' : 'Dark colours'}
          title=${this.isDark() ? 'Light colours' : 'Dark colours'}
        >
          ${icon(this.isDark() ? 'sun' : 'moon')}
        </button>
      </nav>
    </header>`;
  }

  /** Tells where something that was asked for fails: a part of the page that cannot be fetched, a file that is gone. */
  private attend(work: Promise<void>): void {
    work.catch((error: unknown) => this.runView()?.report(wordsOf(error), 'Try again, or reload the page'));
  }

  private runView(): ScanstitchPlanar | ScanstitchSpatial | null {
    return this.run === 'planar' ? this.planar : this.spatial;
  }

  private show(view: View): void {
    this.opened = new Set([...this.opened, view]);
    this.view = view;
    if (view === 'planar' || view === 'spatial') this.run = view;
  }

  /** A run that is done goes along, with its reference. */
  private async toggleEvaluation(): Promise<void> {
    if (this.view === 'evaluation') {
      this.show(this.run);
      return;
    }
    const run = this.runView();
    await import('./evaluate/evaluate-view.js');
    if (run?.facts.result && this.evaluated_run?.of !== run.facts.result) {
      const files = await run.filesToEvaluate();
      if (files) this.evaluated_run = { ...files, of: run.facts.result };
    }
    this.show('evaluation');
  }

  /** The recording goes along; the comparison of one that has been compared stays as it is. */
  private async toggleStrategies(): Promise<void> {
    if (this.view === 'strategies') {
      this.show(this.run);
      return;
    }
    await import('./strategies/strategies-view.js');
    const recording = this.spatial?.recordingToCompare() ?? null;
    const jobs = this.compared_recording?.inputs.jobs;
    const is_same =
      jobs === recording?.inputs.jobs &&
      this.compared_recording?.inputs.reference?.path === recording?.inputs.reference?.path;
    if (!is_same) this.compared_recording = recording;
    this.show('strategies');
  }

  private async toggleBev(): Promise<void> {
    if (this.view !== 'bev') {
      await import('./bev/bev-view.js');
      this.show('bev');
      return;
    }
    this.show(this.run);
    // What the map begins with, where the page began with this view.
    if (this.first_view === 'bev' && this.src === '' && !this.runView()?.facts.title) this.planar.openSample();
  }

  /** Someone is about to choose files, or drags some over the page: most that come are depth images. */
  private async expectFiles(): Promise<void> {
    if (this.expecting || this.opened.has('spatial')) return;
    this.expecting = new AbortController();
    const { signal } = this.expecting;
    try {
      const [{ warmUp }] = await Promise.all([import('./datasets/warm-up.js'), import('./spatial/spatial-view.js')]);
      if (!signal.aborted) await warmUp(signal);
    } catch {
      // Nothing is missing: what could not be loaded now is loaded when it is wanted, or told of then.
    }
  }

  private open(id: string): void {
    if (id !== 'files' && id !== 'folder') {
      this.expecting?.abort();
      this.num_taken++;
      this.bag = null;
      this.opened_files = null;
    }
    if (id === 'files') this.file_input.click();
    else if (id === 'folder') this.folder_input.click();
    else if (id === 'apartment') this.attend(this.openSpatial(fetchApartment(), performance.now()));
    else if (id === 'clear') this.runView()?.clear();
    else {
      this.show('planar');
      this.planar.openSample();
    }
  }

  /** Planar scans go to one view, depth images and clouds to the other, by themselves. */
  private async take(files: readonly NamedFile[], requested_at: number): Promise<void> {
    if (files.length === 0) return;
    this.expecting?.abort();
    const own = ++this.num_taken;
    await this.showOpened(openFiles(files, this.bagListener(own, {})), own, {}, requested_at);
  }

  /** The bag that is open, with other topics. */
  private async choose(wishes: Wishes): Promise<void> {
    const { opened_files } = this;
    if (!opened_files) return;
    const own = ++this.num_taken;
    await this.showOpened(
      chooseTopics(opened_files, wishes, this.bagListener(own, wishes)),
      own,
      wishes,
      performance.now(),
    );
  }

  private async showOpened(
    opening: Promise<OpenedFiles>,
    own: number,
    wishes: Wishes,
    requested_at: number,
  ): Promise<void> {
    const opened = await opening;
    if (own !== this.num_taken) return;
    const told = await tellApart(opened, this.run);
    if (own !== this.num_taken) return;
    if (told.bag) {
      this.opened_files = opened;
      this.bag = { listed: told.bag.listed, choice: told.bag.choice, wishes, activity: '' };
    } else if (this.opened_files && opened.files.every(({ path }) => isBeside(path))) {
      this.opened_files = { ...this.opened_files, files: [...this.opened_files.files, ...opened.files] };
    } else {
      this.bag = null;
      this.opened_files = null;
    }
    if ('spatial' in told) {
      await this.openSpatial(Promise.resolve(told.spatial), requested_at);
    } else {
      this.show('planar');
      await this.planar.add(told.planar, requested_at);
    }
  }

  /** A bag's topics are shown as soon as they are known, before its messages are looked into. */
  private bagListener(own: number, wishes: Wishes): BagListener {
    let next_at = 0;
    return {
      listed: async ([listed]) => {
        await import('./components/topics-panel.js');
        if (own === this.num_taken && listed)
          this.bag = { listed, choice: null, wishes, activity: 'Inspecting the messages' };
      },
      looking: (done, total) => {
        if (own !== this.num_taken || !this.bag || performance.now() < next_at) return;
        next_at = performance.now() + LOOKING_INTERVAL_MS;
        this.bag = { ...this.bag, activity: `Inspecting message ${done} of ${total}` };
      },
    };
  }

  private async openSpatial(files: Promise<SpatialFiles>, requested_at: number): Promise<void> {
    await import('./spatial/spatial-view.js');
    this.show('spatial');
    await this.updateComplete;
    await this.spatial?.add(files, requested_at);
  }

  private onPicked({ target }: Event): void {
    const input = target as HTMLInputElement;
    const files = filesOfInput(input);
    input.value = ''; // so that picking the same files again is a change
    this.attend(this.take(files, performance.now()));
  }

  private isDark(): boolean {
    return this.theme === 'dark' || (this.theme === 'auto' && this.is_system_dark);
  }

  private onSystemTheme = (): void => {
    this.is_system_dark = this.system_dark.matches;
  };

  static override styles = [tokens, shared, drop_styles, app_styles];
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-app': ScanstitchApp;
  }
}
