import { html, LitElement, nothing, type PropertyDeclaration, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import './planar/planar-view.js';
import { messageOf } from './engine/message-of.js';
import { appHeader } from './components/app-header.js';
import { activity_styles, app_styles } from './components/app-styles.js';
import { Appearance } from './components/appearance.js';
import { DropTarget } from './components/drop-target.js';
import { FileIntake } from './components/file-intake.js';
import { Handover } from './components/handover.js';
import { fromHost, HostApi } from './components/host-api.js';
import {
  accessorsOf,
  isNothing,
  keepFormerNames,
  on_or_off,
  text,
  text_or_switch,
} from './components/host-attributes.js';
import type { ScanstitchMapPoints, ScanstitchResult } from './components/host-events.js';
import { icon } from './components/icons.js';
import { OPEN_ITEMS } from './components/open-menu.js';
import { PageParts } from './components/page-parts.js';
import { RunCrossing } from './components/run-crossing.js';
import { activityBox } from './components/run-parts.js';
import { NO_FACTS } from './components/run-kind.js';
import { drop_styles, shared, tokens } from './components/theme.js';
import type { Note } from './datasets/note.js';
import { filesOfDrop, filesOfInput, mayBeDepthImages, type NamedFile } from './datasets/gather.js';
import type { SpatialFiles } from './datasets/spatial-files.js';
import type { Run, Tool, View } from './components/tools.js';
import type { Wishes } from './components/topics-panel.js';
import type { ScanstitchPlanar } from './planar/planar-view.js';
import type { ScanstitchSpatial } from './spatial/spatial-view.js';
import { ViewHistory } from './components/view-history.js';
import { ownerOf } from './views/settings-link.js';
import type { ScanstitchElement } from '../../package/element.js';

const fetchApartment = async (): Promise<SpatialFiles> => (await import('./datasets/apartment.js')).fetchApartment();

/** Names of the views in the attribute `view`. */
const VIEWS = { map: null, bev: 'bev', icp: 'icp', evaluate: 'evaluation', strategies: 'strategies' } as const;
type ViewName = ScanstitchElement['view'];
const isViewName = (name: string): name is ViewName => Object.hasOwn(VIEWS, name);
const THEMES: readonly string[] = ['auto', 'light', 'dark'];

/** The view that the page's address is of. */
function viewOfAddress(): View {
  const owner = ownerOf(location.hash);
  return owner === 'planar' || owner === 'spatial' ? owner : VIEWS[owner];
}

const isRun = (view: View): view is Run => view === 'planar' || view === 'spatial';

/** The element whose settings and views the page's address holds: one of a page. */
let address_owner: ScanstitchApp | null = null;

/**
 * Scanstitch as one element: `<scanstitch-app></scanstitch-app>`. Drop laser scans or depth images on it; it shows the
 * path of the sensor and the stitched map, computed in the tab. Attributes, events, slots, parts and CSS variables are listed in
 * docs/embedding.md, methods in package/element.ts. An attribute that changes acts at once.
 *
 * The height is the page's choice; without one it is 760 pixels or nine tenths of the window.
 */
@customElement('scanstitch-app')
export class ScanstitchApp extends LitElement implements ScanstitchElement {
  @property(text('')) src!: string;
  @property(text('')) settings!: string;
  @property(text('')) preset!: string;
  @property(text('map')) view!: ViewName;
  @property(text('auto')) theme!: ScanstitchElement['theme'];
  @property(text_or_switch) offline!: boolean | string;
  @property({ ...on_or_off, attribute: 'remember-settings' }) rememberSettings!: boolean;

  @state() private shown: View = 'planar';
  /** The run that is shown, or lies behind a view beside it. */
  @state() private run_kind: Run = 'planar';
  /** Views that were shown once stay, hidden, with all they hold. */
  @state() private opened: ReadonlySet<View> = new Set<View>(['planar']);
  /** What was dropped on the strategies: it is compared as soon as its first frames are on the map. */
  private is_to_compare = false;
  @query('scanstitch-planar') private planar!: ScanstitchPlanar;
  @query('scanstitch-spatial') private spatial!: ScanstitchSpatial | null;
  @query('.app') private frame!: HTMLElement | null;
  @query('#pick-files') private file_input!: HTMLInputElement;
  @query('#pick-folder') private folder_input!: HTMLInputElement;

  private appearance = new Appearance(this, () => this.frame);
  private parts = new PageParts({
    report: (text, remedy, retry) => this.api.report(text, remedy, retry),
    reload: () => (this.owns_address ? () => location.reload() : null),
  });
  /** Between a planar run and one in space. */
  private crossing = new RunCrossing(this);
  private intake = new FileIntake(this, {
    present: () => this.run_kind,
    loaded: (loading) => this.parts.loaded(loading),
    show: async (files, requested_at, is_new, given) => {
      const before = this.runView();
      if (is_new) {
        const kind = 'spatial' in files ? 'spatial' : 'planar';
        this.crossing.cross(this.run_kind, kind, before?.is_own ? before.facts.title : null);
      }
      if ('spatial' in files) {
        const is_to_compare = this.comparing();
        const spatial = await this.showSpatial();
        const set = given && (await fromHost()).givenSpatial(given, files.spatial);
        const adding = set
          ? spatial?.openGiven(Promise.resolve(set), requested_at)
          : spatial?.add(files.spatial, requested_at, is_new);
        this.is_to_compare = is_to_compare();
        await adding;
        return;
      }
      const set = given && (await (await fromHost()).givenDataset(given, files.planar));
      this.showRun('planar');
      if (set) this.planar.openGiven(set.dataset, set.notes);
      else await this.planar.add(files.planar, requested_at, is_new);
    },
  });
  private api = new HostApi(this, {
    run: () => this.runView(),
    runs: () => this.runViews(),
    forget: () => {
      this.expecting?.abort();
      this.intake.forget();
    },
    take: (files, requested_at, given) => this.intake.take(files, requested_at, [], given),
    openSample: () => this.openSample(),
    openApartment: () => this.openApartment(),
  });

  private handover = new Handover(this, { run: () => this.runView(), spatial: () => this.spatial });
  /** Says that what is done in expectation of files is over. Null before any are expected. */
  private expecting: AbortController | null = null;
  /** The view that `src` is for. */
  private source_of: 'map' | 'bev' | 'icp' = 'map';

  private drop_target = new DropTarget(
    this,
    (transfer) => {
      const dropped_at = performance.now();
      const unreadable: Note[] = [];
      const dropped = filesOfDrop(transfer, unreadable);
      this.parts.attend(async () => this.take(await dropped, dropped_at, unreadable));
    },
    (transfer) => {
      if (mayBeDepthImages(transfer)) void this.expectFiles();
    },
  );
  /** The view that the page's address asked for, in place of the host's: what is opened is shown instead of it. */
  private address_view: ViewName | null = null;
  /** Views that were asked for: one that is loaded only after another was asked for is not shown. */
  private num_asked = 0;
  private view_history = new ViewHistory(this, {
    is_own_page: () => this.owns_address,
    show: (view) => {
      const named = view ? (view as View) : viewOfAddress();
      if (view === '' && !isRun(named) && !this.opened.has(named)) {
        this.view_history.mark(named); // the address was changed on the open page
        return void this.follow(named);
      }
      this.askForView();
      this.bring(this.opened.has(named) ? named : 'planar');
    },
  });

  override connectedCallback(): void {
    super.connectedCallback();
    if (this.hasUpdated) this.claimAddress();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.expecting?.abort();
    if (address_owner === this) address_owner = null;
  }

  protected static override getPropertyDescriptor(
    name: PropertyKey,
    key: string | symbol,
    options: PropertyDeclaration,
  ): PropertyDescriptor | undefined {
    return accessorsOf(name, key, options) ?? super.getPropertyDescriptor(name, key, options);
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('rememberSettings')) this.claimAddress();
    if (!this.hasUpdated && this.owns_address) {
      const owner = ownerOf(location.hash);
      if (isViewName(owner)) this.address_view = owner;
    }
    const names = ['settings', 'preset', 'theme', 'view'] as const;
    if (names.some((name) => changed.get(name) !== undefined)) this.api.forgetRefused();
    if (changed.get('view') !== undefined) this.address_view = null;
    if (changed.has('theme') && !THEMES.includes(this.theme)) {
      this.api.refuse([`“${this.theme}” is not a theme: ${THEMES.join(', ')}`]);
    }
    if (changed.has('view') && !isViewName(this.view)) {
      this.api.refuse([`“${String(this.view)}” is not a view: ${Object.keys(VIEWS).join(', ')}`]);
    }
    const { wanted_view } = this;
    if (!this.hasUpdated || changed.has('src')) {
      this.source_of = wanted_view === 'bev' || wanted_view === 'icp' ? wanted_view : 'map';
    }
  }

  protected override firstUpdated(): void {
    if (this.wanted_view !== 'map') this.openView();
    const is_in_space = this.owns_address && ownerOf(location.hash) === 'spatial';
    if (this.source_of !== 'map' || isNothing(this.src)) this.planar.clear();
    else if (this.src !== 'sample') this.openSource(this.src);
    else if (is_in_space) this.openSource('apartment');
    else this.planar.openSample();
  }

  protected override updated(changed: PropertyValues<this>): void {
    if (changed.has('offline')) void this.keep(this.offline);
    // Undefined before: it is what the element begins with.
    if (changed.get('src') !== undefined && this.source_of === 'map') this.openSource(this.src);
    if (changed.get('view') !== undefined) this.openView();
  }

  // For the host page; documented in package/element.ts.

  open(source: string | readonly string[] | Iterable<File>): Promise<void> {
    return this.api.open(source);
  }

  run(): Promise<ScanstitchResult> {
    return this.api.run();
  }

  cancel(): void {
    this.api.cancel();
  }

  get result(): ScanstitchResult | null {
    return this.runView()?.outcome ?? null;
  }

  get map_points(): ScanstitchMapPoints | null {
    return this.runView()?.map_points ?? null;
  }

  /** A value of the attribute; an error in it is shown in the element. */
  private openSource(src: string): void {
    this.api.openSource(src).catch(() => undefined);
  }

  private openSample(): void {
    this.showRun('planar');
    this.planar.openSample();
  }

  private get owns_address(): boolean {
    return this.rememberSettings && address_owner === this;
  }

  private claimAddress(): void {
    if (this.rememberSettings && this.isConnected) address_owner ??= this;
    else if (address_owner === this) address_owner = null;
  }

  /** The view to begin with, and to return to what is opened for. */
  private get wanted_view(): ViewName {
    return this.address_view ?? (isViewName(this.view) ? this.view : 'map');
  }

  /** Shows the view of the attribute `view`. */
  private openView(): void {
    const view = VIEWS[this.wanted_view];
    this.askForView();
    if (view === null) this.show(this.run_kind);
    else if (view !== this.shown) this.parts.attend(() => this.go(view));
  }

  protected override render(): TemplateResult {
    const { drop_target } = this;
    return html`
      <div
        class="app ${this.appearance.layout}"
        @dragenter=${drop_target.enter}
        @dragover=${drop_target.over}
        @dragleave=${drop_target.leave}
        @drop=${drop_target.drop}
      >
        ${this.renderHeader()}
        <scanstitch-messages
          .messages=${this.api.notices}
          @messages-dismissed=${() => this.api.dismiss()}
        ></scanstitch-messages>
        ${
          this.api.source.activity === null
            ? nothing
            : activityBox(this.api.source.activity, this.api.source.progress, 'Stop', () => this.cancel())
        }
        ${
          this.intake.bag && isRun(this.shown)
            ? html`<scanstitch-topics
                .bag=${this.intake.bag}
                @topics-chosen=${({ detail }: CustomEvent<Wishes>) => this.parts.attend(() => this.intake.choose(detail))}
                @topics-cancelled=${() => this.intake.cancel()}
              ></scanstitch-topics>`
            : nothing
        }
        ${this.renderViews()}
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
      <aside
        class="host-side ${this.appearance.layout}"
        part="side"
        aria-label="Beside the map"
        ?hidden=${this.querySelector(':scope > [slot=side]') === null}
      >
        <slot name="side" @slotchange=${() => this.requestUpdate()}></slot>
      </aside>
    `;
  }

  /** The views that were opened; all but one are hidden. */
  private renderViews(): TemplateResult {
    const onFacts = (): void => {
      this.requestUpdate();
      this.parts.attend(() => this.handover.follow());
      this.parts.attend(() => this.compareDropped());
    };
    const drawn = (view: View, template: () => TemplateResult): TemplateResult | typeof nothing =>
      this.opened.has(view) ? template() : nothing;
    return html`<div
      class="views"
      @facts-changed=${onFacts}
      @run-exchanged=${() => this.intake.exchange()}
      @files-wanted=${({ detail }: CustomEvent<string>) => this.choose(detail)}
      @look-inside=${({ detail }: CustomEvent<number>) => this.parts.attend(() => this.lookInside(detail))}
      @settings-refused=${({ detail }: CustomEvent<string[]>) => this.api.refuse(detail)}
    >
      ${drawn('evaluation', () => this.renderEvaluation())} ${drawn('strategies', () => this.renderStrategies())}
      ${drawn('icp', () => this.renderLab())} ${drawn('bev', () => this.renderBev())} ${this.renderPlanar()}
      ${drawn('spatial', () => this.renderSpatial())}
    </div>`;
  }

  private renderEvaluation(): TemplateResult {
    return html`<scanstitch-evaluate
      ?hidden=${this.shown !== 'evaluation'}
      ?dark=${this.isDark()}
      .given=${this.handover.evaluated}
    ></scanstitch-evaluate>`;
  }

  private renderStrategies(): TemplateResult {
    return html`<scanstitch-strategies
      ?hidden=${this.shown !== 'strategies'}
      ?dark=${this.isDark()}
      .given=${this.handover.compared}
    ></scanstitch-strategies>`;
  }

  private renderLab(): TemplateResult {
    return html`<scanstitch-lab
      ?hidden=${this.shown !== 'icp'}
      ?dark=${this.isDark()}
      .given=${this.handover.looked_into}
      src=${this.sourceOf('icp')}
      ?remember-link=${this.owns_address && this.shown === 'icp'}
    ></scanstitch-lab>`;
  }

  private renderBev(): TemplateResult {
    return html`<scanstitch-bev
      ?hidden=${this.shown !== 'bev'}
      ?dark=${this.isDark()}
      src=${this.sourceOf('bev')}
      ?without-sample=${this.source_of === 'bev' && this.src !== 'sample'}
      ?remember-scene=${this.owns_address}
    ></scanstitch-bev>`;
  }

  private renderPlanar(): TemplateResult {
    return html`<scanstitch-planar
      ?hidden=${this.shown !== 'planar'}
      .initial_settings=${this.settings}
      .preset=${this.preset}
      .remember_settings=${this.owns_address}
      .layout=${this.appearance.layout}
      .elsewhere=${this.crossing.elsewhere('planar')}
      ?dark=${this.isDark()}
      exportparts="figures, settings, map, table, details"
    ></scanstitch-planar>`;
  }

  private renderSpatial(): TemplateResult {
    return html`<scanstitch-spatial
      ?hidden=${this.shown !== 'spatial'}
      .initial_settings=${this.settings}
      .preset=${this.preset}
      .remember_settings=${this.owns_address}
      .layout=${this.appearance.layout}
      .elsewhere=${this.crossing.elsewhere('spatial')}
      ?dark=${this.isDark()}
      exportparts="figures, settings, map, table, details"
    ></scanstitch-spatial>`;
  }

  /** The attribute `src`, where it is for this view and no sample. */
  private sourceOf(view: 'bev' | 'icp'): string {
    return this.source_of !== view || this.src === 'sample' || isNothing(this.src) ? '' : this.src;
  }

  private renderHeader(): TemplateResult {
    const run = this.runView();
    return appHeader({
      view: this.shown,
      run: this.run_kind,
      facts: run?.facts ?? NO_FACTS,
      exports: run?.exports ?? [],
      open_items: OPEN_ITEMS,
      layout: this.appearance.layout,
      is_dark: this.isDark(),
      go: (tool) => this.parts.attend(() => this.go(tool)),
      open: (id) => this.choose(id),
      expectFiles: () => void this.expectFiles(),
      runExport: (id) => void run?.runExport(id),
      removeReference: () => run?.removeReference(),
      toggleTheme: () => {
        this.theme = this.isDark() ? 'light' : 'dark';
      },
    });
  }

  /** Opens the tool that the address names; the lab takes what it shows from the address as well. */
  private async follow(tool: Exclude<Tool, 'map'>): Promise<void> {
    if (tool !== 'icp' || location.hash === '#icp') return this.go(tool);
    const own = this.askForView();
    await this.parts.loaded(import('./lab/lab-view.js'));
    if (own === this.num_asked) this.show('icp');
  }

  private async go(tool: Tool): Promise<void> {
    if (tool === 'icp') return this.lookInside(null);
    const own = this.askForView();
    switch (tool) {
      case 'map':
        return this.goToRun();
      case 'evaluation':
        await this.parts.loaded(import('./evaluate/evaluate-view.js'));
        await this.handover.openEvaluation();
        break;
      case 'strategies':
        await this.parts.loaded(import('./strategies/strategies-view.js'));
        this.handover.openStrategies();
        break;
      case 'bev':
        await this.parts.loaded(import('./bev/bev-view.js'));
    }
    if (own === this.num_asked) this.show(tool);
  }

  /** Returns to the strategies with the files that were dropped there, unless a message about them is shown on the map. */
  private async compareDropped(): Promise<void> {
    if (!this.is_to_compare || !this.spatial?.facts.result) return;
    this.is_to_compare = false;
    const is_left_for_it = this.shown === 'spatial' && !this.spatial.has_messages;
    if (is_left_for_it || this.shown === 'strategies') await this.go('strategies');
  }

  /** Keeps the page for use offline, if the host asks for it. */
  private async keep(offline: boolean | string): Promise<void> {
    if (offline === false) return;
    try {
      const { keepForOffline } = await import('./components/offline.js');
      await keepForOffline(offline === true ? 'scanstitch-offline.js' : offline);
    } catch (error) {
      this.api.report(`The page is not kept for use offline: ${messageOf(error)}`, 'Online it works as before');
    }
  }

  private runView(): ScanstitchPlanar | ScanstitchSpatial | null {
    return this.run_kind === 'planar' ? this.planar : this.spatial;
  }

  /** Of both kinds, shown or not. */
  private runViews(): (ScanstitchPlanar | ScanstitchSpatial)[] {
    return [this.planar, this.spatial].filter((run) => run !== null);
  }

  /** Someone asks for a view: its number. What was dropped on the strategies does not bring them back any more. */
  private askForView(): number {
    this.is_to_compare = false;
    return ++this.num_asked;
  }

  /** Tells later whether the strategies, if they are shown now, were left for what is opened only. */
  private comparing(): () => boolean {
    const [is_shown, own] = [this.shown === 'strategies', this.num_asked];
    return () => is_shown && own === this.num_asked;
  }

  private show(view: View): void {
    if (view !== this.shown) this.view_history.push(view);
    this.bring(view);
  }

  /** Shows the run that has something new; a view beside it that the host has asked for stays. */
  private showRun(run: Run): void {
    const aside = this.address_view ? null : VIEWS[this.wanted_view];
    if (aside === null || this.shown !== aside) return this.show(run);
    this.opened = new Set([...this.opened, run]);
    this.run_kind = run;
  }

  private bring(view: View): void {
    this.opened = new Set([...this.opened, view]);
    this.shown = view;
    if (isRun(view)) this.run_kind = view;
    // The address names a view beside the run, or holds what that wrote there, for as long as that is shown.
    const named = viewOfAddress();
    if (!isRun(named) && named !== view) (this.runView() ?? this.planar).writeAddress();
  }

  /** The registration of a scan or frame; null: of the selected one to the one before. */
  private async lookInside(frame: number | null): Promise<void> {
    const own = this.askForView();
    await this.parts.loaded(import('./lab/lab-view.js'));
    if (this.hasUpdated) await this.handover.openLab(frame);
    if (own === this.num_asked) this.show('icp');
  }

  /** The map; where the page began with another view, that of the sample. */
  private goToRun(): void {
    this.show(this.run_kind);
    const is_due = this.src === 'sample' && this.source_of !== 'map' && !this.runView()?.facts.title;
    if (is_due) this.planar.openSample();
  }

  /** Someone is about to choose files, or drags some over the page that may be depth images. */
  private async expectFiles(): Promise<void> {
    if (this.expecting || this.opened.has('spatial')) return;
    this.expecting = new AbortController();
    const { signal } = this.expecting;
    try {
      const [{ warmUp }] = await Promise.all([import('./datasets/warm-up.js'), import('./spatial/spatial-view.js')]);
      if (!signal.aborted) await warmUp(signal);
    } catch {
      // A failure is ignored here: the part is loaded again when it is needed, with a message if that fails.
    }
  }

  private choose(id: string): void {
    if (id.startsWith('view:')) {
      this.parts.attend(() => this.go(id.slice('view:'.length) as Tool));
      return;
    }
    if (id === 'other-run') {
      this.crossBack();
      return;
    }
    if (id !== 'files' && id !== 'folder') {
      this.crossing.forget();
      this.expecting?.abort();
      this.api.source.cancel();
      this.intake.forget();
    }
    if (id === 'files') this.file_input.click();
    else if (id === 'folder') this.folder_input.click();
    else if (id === 'apartment') this.parts.attend(() => this.openApartment());
    else if (id === 'clear') this.runViews().forEach((run) => run.clear());
    else this.openSample();
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
    const is_to_compare = this.comparing();
    const spatial = await this.showSpatial();
    const opening = spatial?.openGiven(fetchApartment(), requested_at);
    this.is_to_compare = is_to_compare();
    await opening;
  }

  private async showSpatial(): Promise<ScanstitchSpatial | null> {
    await this.parts.loaded(import('./spatial/spatial-view.js'));
    this.showRun('spatial');
    await this.updateComplete;
    return this.spatial;
  }

  /** Back to the run of the other kind, and forth again. */
  private crossBack(): void {
    const run = this.crossing.crossBack(this.runView()?.facts.title ?? '');
    if (!run) return;
    this.show(run);
    this.intake.exchange();
  }

  private onPicked({ target }: Event): void {
    const input = target as HTMLInputElement;
    const files = filesOfInput(input);
    input.value = ''; // so that picking the same files again is a change
    const requested_at = performance.now();
    this.parts.attend(() => this.take(files, requested_at, []));
  }

  private isDark(): boolean {
    return this.theme === 'dark' || (this.theme === 'auto' && this.appearance.is_system_dark);
  }

  static override styles = [tokens, shared, drop_styles, app_styles, activity_styles];
}

keepFormerNames(ScanstitchApp.prototype);
