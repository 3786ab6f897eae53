import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import './planar/planar-view.js';
import { appHeader, type Run, type Tool, type View } from './components/app-header.js';
import { app_styles } from './components/app-styles.js';
import { DropTarget } from './components/drop-target.js';
import type { GivenClouds } from './components/given-clouds.js';
import { FileIntake } from './components/file-intake.js';
import { icon } from './components/icons.js';
import type { MenuItem } from './components/menu.js';
import type { Elsewhere } from './components/run-exchange.js';
import type { Layout } from './components/run-parts.js';
import { type GivenFiles, type GivenRecording, NO_FACTS } from './components/run-view.js';
import { wordsOf } from './components/session.js';
import { drop_styles, shared, tokens } from './components/theme.js';
import type { Note } from './datasets/dataset.js';
import { filesOfDrop, filesOfInput, type NamedFile } from './datasets/gather.js';
import type { SpatialFiles } from './datasets/spatial-files.js';
import type { Wishes } from './components/topics-panel.js';
import type { ScanstitchPlanar } from './planar/planar-view.js';
import type { ScanstitchSpatial } from './spatial/spatial-view.js';
import { ViewHistory } from './components/view-history.js';
import { ownerOf } from './views/settings-link.js';

type Theme = 'auto' | 'light' | 'dark';

const WIDE_FROM = 1180; // CSS pixels of the element, not of the window: it may sit in a column of a course page
const MEDIUM_FROM = 760;
const OPEN_ITEMS: readonly MenuItem[] = [
  {
    id: 'files',
    label: 'Files…',
    detail: 'scans, depth images, clouds, a ROS bag, a zip; and a trajectory to compare with',
  },
  { id: 'folder', label: 'Folder…', detail: 'including its subfolders' },
  { id: 'sample', label: 'The sample', detail: 'ten scans of a corridor, with ground truth' },
  { id: 'apartment', label: 'An apartment', detail: 'depth images of several rooms, with ground truth' },
  { id: 'clear', label: 'Remove all', detail: 'the next files start a new data set' },
];

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
 *   that ends in `#bev` does so as well. `icp` begins with the ICP lab; `src` then names two scans or clouds, the source
 *   and the target.
 * - `theme`: `light`, `dark`, or `auto` (the default: as the system has it).
 * - `offline`: the address of a service worker beside the host's page, which keeps the page for use without a network;
 *   empty: `scanstitch-offline.js` of the build.
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
  @property({ attribute: 'view' }) first_view: 'map' | 'bev' | 'icp' = 'map';
  @property({ reflect: true }) theme: Theme = 'auto';
  /** Null: nothing is kept. */
  @property() offline: string | null = null;
  @property({ type: Boolean, attribute: 'remember-settings' }) remember_settings = false;

  @state() private layout: Layout = 'wide';
  @state() private view: View = 'planar';
  /** The view of a run that is shown, or lies behind one beside it. */
  @state() private run: Run = 'planar';
  /** Views that were shown once stay, hidden, with all they hold. */
  @state() private opened: ReadonlySet<View> = new Set<View>(['planar']);
  @state() private is_system_dark = false;
  @state() private compared_recording: GivenRecording | null = null;
  /** A run that took the place of one of the other kind. */
  @state() private crossing: (Elsewhere & { shown: Run }) | null = null;
  @state() private looked_into: GivenClouds | null = null;
  @state() private evaluated_run: (GivenFiles & { of: unknown }) | null = null;
  @query('scanstitch-planar') private planar!: ScanstitchPlanar;
  @query('scanstitch-spatial') private spatial!: ScanstitchSpatial | null;
  @query('#pick-files') private file_input!: HTMLInputElement;
  @query('#pick-folder') private folder_input!: HTMLInputElement;

  private intake = new FileIntake(this, {
    present: () => this.run,
    show: async (files, requested_at, is_new) => {
      if (is_new) this.cross('spatial' in files ? 'spatial' : 'planar');
      if ('spatial' in files) return (await this.showSpatial())?.add(files.spatial, requested_at, is_new);
      this.show('planar');
      return this.planar.add(files.planar, requested_at, is_new);
    },
  });

  /** Says that what is done in expectation of files is over. Null before any are expected. */
  private expecting: AbortController | null = null;

  private drop_target = new DropTarget(
    this,
    (transfer) => {
      const dropped_at = performance.now();
      const unreadable: Note[] = [];
      const dropped = filesOfDrop(transfer, unreadable);
      this.attend(async () => this.take(await dropped, dropped_at, unreadable));
    },
    () => this.expectFiles(),
  );
  private view_history = new ViewHistory(this, {
    is_own_page: () => this.remember_settings,
    show: (view) => this.bring(this.opened.has(view as View) ? (view as View) : 'planar'),
  });
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
    const owner = ownerOf(location.hash);
    if (owner === 'bev' || owner === 'icp') this.first_view = owner;
    else if (this.src === '' && this.remember_settings && owner === 'spatial') this.src = 'apartment';
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.expecting?.abort();
    this.resize_observer.disconnect();
    this.system_dark.removeEventListener('change', this.onSystemTheme);
  }

  protected override firstUpdated(): void {
    if (this.offline !== null) void this.keep(this.offline || 'scanstitch-offline.js');
    if (this.first_view === 'bev') this.attend(() => this.go('bev'));
    else if (this.first_view === 'icp') this.attend(() => this.lookInside(null));
    else if (this.src === 'apartment') this.attend(() => this.openApartment());
  }

  protected override render(): TemplateResult {
    const { drop_target } = this;
    const onFacts = (): void => this.requestUpdate();
    const onWanted = ({ detail }: CustomEvent<string>): void => this.open(detail);
    const onLook = ({ detail }: CustomEvent<number>): void => this.attend(() => this.lookInside(detail));
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
          this.intake.bag && (this.view === 'planar' || this.view === 'spatial')
            ? html`<scanstitch-topics
                .bag=${this.intake.bag}
                @topics-chosen=${({ detail }: CustomEvent<Wishes>) => this.attend(() => this.intake.choose(detail))}
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
                @files-wanted=${onWanted}
              ></scanstitch-strategies>`
            : nothing
        }
        ${
          this.opened.has('icp')
            ? html`<scanstitch-lab
                ?hidden=${this.view !== 'icp'}
                ?dark=${this.isDark()}
                .given=${this.looked_into}
                src=${this.first_view === 'icp' && this.src !== 'none' ? this.src : ''}
                ?remember-link=${this.remember_settings}
              ></scanstitch-lab>`
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
          .src=${this.first_view !== 'map' || this.src === 'apartment' ? 'none' : this.src}
          .initial_settings=${this.initial_settings}
          .preset=${this.preset}
          .remember_settings=${this.remember_settings}
          .layout=${this.layout}
          .elsewhere=${this.elsewhere('planar')}
          ?dark=${this.isDark()}
          @run-exchanged=${() => this.intake.exchange()}
          @facts-changed=${onFacts}
          @files-wanted=${onWanted}
          @look-inside=${onLook}
        ></scanstitch-planar>
        ${
          this.opened.has('spatial')
            ? html`<scanstitch-spatial
                ?hidden=${this.view !== 'spatial'}
                .initial_settings=${this.initial_settings}
                .preset=${this.preset}
                .remember_settings=${this.remember_settings}
                .layout=${this.layout}
                .elsewhere=${this.elsewhere('spatial')}
                ?dark=${this.isDark()}
                @run-exchanged=${() => this.intake.exchange()}
                @facts-changed=${onFacts}
                @files-wanted=${onWanted}
                @look-inside=${onLook}
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
    const run = this.runView();
    return appHeader({
      view: this.view,
      run: this.run,
      facts: run?.facts ?? NO_FACTS,
      exports: run?.exports ?? [],
      open_items: OPEN_ITEMS,
      layout: this.layout,
      is_dark: this.isDark(),
      go: (tool) => this.attend(() => this.go(tool)),
      open: (id) => this.open(id),
      expectFiles: () => void this.expectFiles(),
      runExport: (id) => void run?.runExport(id),
      removeReference: () => run?.removeReference(),
      toggleTheme: () => {
        this.theme = this.isDark() ? 'light' : 'dark';
      },
    });
  }

  private async go(tool: Tool): Promise<void> {
    switch (tool) {
      case 'map':
        return this.goToRun();
      case 'evaluation':
        return this.goToEvaluation();
      case 'strategies':
        return this.goToStrategies();
      case 'icp':
        return this.lookInside(null);
      case 'bev':
        await import('./bev/bev-view.js');
        this.show('bev');
    }
  }

  /** Tells where something that was asked for fails: a part of the page that cannot be fetched, a file that is gone. */
  private attend(work: () => Promise<void>): void {
    work().catch((error: unknown) => {
      const words = wordsOf(error);
      if (!/import(ed|ing)? .*module|module script failed/i.test(words)) {
        this.runView()?.report(words, 'Try again, or reload the page');
        return;
      }
      const [part = ''] = /[^/]+$/.exec(words) ?? [];
      this.goToRun();
      this.runView()?.report(
        `A part of the page could not be loaded (${part}): the connection was lost, or a new version was put on the server`,
        'Where trying again does not help, export what is open and reload the page',
        () => this.attend(work),
      );
    });
  }

  private async keep(script: string): Promise<void> {
    try {
      const { keepForOffline } = await import('./components/offline.js');
      await keepForOffline(script);
    } catch (error) {
      this.runView()?.report(`The page is not kept for use offline: ${wordsOf(error)}`, 'Online it works as before');
    }
  }

  private runView(): ScanstitchPlanar | ScanstitchSpatial | null {
    return this.run === 'planar' ? this.planar : this.spatial;
  }

  private show(view: View): void {
    if (view !== this.view) this.view_history.push(view);
    this.bring(view);
  }

  private bring(view: View): void {
    this.opened = new Set([...this.opened, view]);
    this.view = view;
    if (view === 'planar' || view === 'spatial') this.run = view;
  }

  /** A run that is done goes along, with its reference. */
  private async goToEvaluation(): Promise<void> {
    const run = this.runView();
    await import('./evaluate/evaluate-view.js');
    if (run?.facts.result && this.evaluated_run?.of !== run.facts.result) {
      const files = await run.filesToEvaluate();
      if (files) this.evaluated_run = { ...files, of: run.facts.result };
    }
    this.show('evaluation');
  }

  /** The recording goes along; the comparison of one that has been compared stays as it is. */
  private async goToStrategies(): Promise<void> {
    await import('./strategies/strategies-view.js');
    const recording = this.spatial?.recordingToCompare() ?? null;
    const jobs = this.compared_recording?.inputs.jobs;
    const is_same =
      jobs === recording?.inputs.jobs &&
      this.compared_recording?.inputs.reference?.path === recording?.inputs.reference?.path;
    if (!is_same) this.compared_recording = recording;
    this.show('strategies');
  }

  /** The registration of a scan or frame to the one before it; null: of the selected one. */
  private async lookInside(frame: number | null): Promise<void> {
    await import('./lab/lab-view.js');
    const clouds = this.hasUpdated ? (this.runView()?.cloudsToRegister(frame) ?? null) : null;
    const before = this.looked_into;
    const is_same = clouds?.source === before?.source && clouds?.of === before?.of;
    if (clouds && (frame !== null || !is_same)) this.looked_into = clouds;
    this.show('icp');
  }

  /** The map; where the page began with another view, that of the sample. */
  private goToRun(): void {
    this.show(this.run);
    const is_empty = this.first_view !== 'map' && this.src === '' && !this.runView()?.facts.title;
    if (is_empty) this.planar.openSample();
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
    if (id.startsWith('view:')) {
      this.attend(() => this.go(id.slice('view:'.length) as Tool));
      return;
    }
    if (id === 'other-run') {
      this.crossBack();
      return;
    }
    if (id !== 'files' && id !== 'folder') {
      this.crossing = null;
      this.expecting?.abort();
      this.intake.forget();
    }
    if (id === 'files') this.file_input.click();
    else if (id === 'folder') this.folder_input.click();
    else if (id === 'apartment') this.attend(() => this.openApartment());
    else if (id === 'clear') this.runView()?.clear();
    else {
      this.show('planar');
      this.planar.openSample();
    }
  }

  /** Planar scans go to one view, depth images and clouds to the other, by themselves. */
  private async take(files: readonly NamedFile[], requested_at: number, notes: readonly Note[]): Promise<void> {
    if (files.length === 0) {
      for (const { file, reason } of notes) this.runView()?.report(`${file}: ${reason}`, 'Drop it again');
      return;
    }
    this.expecting?.abort();
    await this.intake.take(files, requested_at, notes);
  }

  private async openApartment(): Promise<void> {
    const requested_at = performance.now();
    const spatial = await this.showSpatial();
    await spatial?.openGiven(fetchApartment(), requested_at);
  }

  private async showSpatial(): Promise<ScanstitchSpatial | null> {
    await import('./spatial/spatial-view.js');
    this.show('spatial');
    await this.updateComplete;
    return this.spatial;
  }

  /** A recording is to be shown as a run of this kind; one of the other kind can be gone back to. */
  private cross(to: Run): void {
    const before = this.runView();
    const is_replaced = to !== this.run && before?.is_own;
    this.crossing = is_replaced ? { shown: to, title: before.facts.title, is_undone: false } : null;
  }

  /** Back to the run of the other kind, and forth again. */
  private crossBack(): void {
    if (!this.crossing) return;
    const { title } = this.runView()?.facts ?? NO_FACTS;
    this.show(this.run === 'planar' ? 'spatial' : 'planar');
    this.crossing = { shown: this.run, title, is_undone: !this.crossing.is_undone };
    this.intake.exchange();
  }

  private elsewhere(run: Run): Elsewhere | null {
    return this.crossing?.shown === run ? this.crossing : null;
  }

  private onPicked({ target }: Event): void {
    const input = target as HTMLInputElement;
    const files = filesOfInput(input);
    input.value = ''; // so that picking the same files again is a change
    const requested_at = performance.now();
    this.attend(() => this.take(files, requested_at, []));
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
