import { html, LitElement, nothing, type PropertyDeclaration, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import './planar/planar-view.js';
import { viewsBeside } from './app/beside.js';
import { isRun, isViewName, Navigation, type SourceView, type ViewName, VIEWS } from './app/navigation.js';
import { Workspace } from './app/workspace.js';
import { appHeader } from './app/app-header.js';
import { type Controls, CONTROLS } from './run/controls.js';
import { changedFolds, type FoldChange, NONE_OPEN, rememberedFolds, rememberFolds } from './run/folds.js';
import { appStyles } from './app/app-styles.js';
import { activityStyles } from './run/run-styles.js';
import { Appearance } from './app/appearance.js';
import { DropTarget } from './components/drop-target.js';
import { Handover } from './app/handover.js';
import { HostApi } from './app/host-api.js';
import { accessorsOf, isNothing, keepFormerNames, onOrOff, text, asTextOrSwitch } from './app/host-attributes.js';
import type { ScanstitchMapPoints, ScanstitchResult } from './components/host-events.js';
import { openItems } from './app/open-menu.js';
import { PageParts } from './app/page-parts.js';
import { NO_FACTS } from './run/run-kind.js';
import { activityBox } from './run/run-parts.js';
import { dropStyles, shared, tokens } from './components/theme.js';
import type { Run, Tool } from './components/tools.js';
import type { Wishes } from './app/topics-panel.js';
import { filesOfDrop, filesOfInput, mayBeDepthImages, mayHoldMap, type NamedFile } from './datasets/gather.js';
import type { Note } from './datasets/note.js';
import { fetchSample } from './datasets/remote.js';
import type { ScanstitchPlanar } from './planar/planar-view.js';
import type { ScanstitchSpatial } from './spatial/spatial-view.js';
import { Address, WHOLE } from './views/address.js';
import { ownerOf } from './views/settings-link.js';
import type { ScanstitchElement } from '../../package/element.js';

const THEMES: readonly string[] = ['auto', 'light', 'dark'];

/** Parts of the runs' views that a host can style. */
const PARTS = 'figures, settings, map, table, details';

/** The element whose settings and views the page's address holds: one of a page. */
let addressOwner: ScanstitchApp | null = null;

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
  @property(text('full')) controls!: Controls;
  @property(text('')) map!: string;
  @property(text('')) scene!: string;
  @property(text('')) live!: string;
  @property(asTextOrSwitch) offline!: boolean | string;
  @property({ ...onOrOff, attribute: 'remember-settings' }) rememberSettings!: boolean;

  @query('scanstitch-planar') private planar!: ScanstitchPlanar;
  @query('scanstitch-spatial') private spatial!: ScanstitchSpatial | null;
  @query('.app') private frame!: HTMLElement | null;
  @query('#pick-files') private fileInput!: HTMLInputElement;
  @query('#pick-folder') private folderInput!: HTMLInputElement;

  /** The panels around the map that are unfolded. */
  @state() private folds = NONE_OPEN;
  private appearance = new Appearance(this, () => this.frame);
  private parts = new PageParts({
    report: (text, remedy, retry) => this.api.report(text, remedy, retry),
    reload: () => (this.ownsAddress ? () => location.reload() : null),
  });
  private workspace = new Workspace(this, {
    view: (run) => this.runOf(run),
    show: (run) => this.showRun(run),
    bring: (run) => this.navigation.show(run),
    loaded: (loading) => this.parts.loaded(loading),
  });
  private api = new HostApi(this, this.workspace, {
    run: () => this.runView(),
    runs: () => this.runs,
  });
  private handover = new Handover(this, {
    run: () => this.runView(),
    planar: () => this.planar,
  });
  private navigation = new Navigation(this, {
    workspace: this.workspace,
    handover: this.handover,
    parts: this.parts,
    ownsAddress: () => this.ownsAddress,
    wanted: () => (this.live && this.view === 'map' ? 'live' : isViewName(this.view) ? this.view : 'map'),
    isSampleDue: () => this.src === 'sample' && this.sourceView !== 'map' && !this.runView()?.facts.title,
    dropped: () => (this.runView()?.isToCompare ? this.runView() : null),
    writeAddress: () => (this.runView() ?? this.planar).writeAddress(),
  });
  private sourceView: SourceView = 'map';
  /** Where settings are kept; null: nowhere. */
  private address: Address | null = null;

  private dropTarget = new DropTarget(
    this,
    (transfer) => {
      const droppedAt = performance.now();
      const unreadable: Note[] = [];
      const dropped = filesOfDrop(transfer, unreadable);
      this.parts.attend(async () => this.take(await dropped, droppedAt, unreadable));
    },
    (transfer) => {
      if (mayBeDepthImages(transfer)) void this.workspace.expectFiles();
    },
  );

  override connectedCallback(): void {
    super.connectedCallback();
    if (this.hasUpdated) this.claimAddress();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    if (addressOwner === this) addressOwner = null;
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
    if (!this.hasUpdated && this.rememberSettings) this.folds = rememberedFolds();
    if (!this.hasUpdated && this.ownsAddress) this.navigation.readAddress();
    const names = ['settings', 'preset', 'theme', 'view', 'controls'] as const;
    if (names.some((name) => changed.get(name) !== undefined)) this.api.forgetRefused();
    if (changed.get('view') !== undefined) this.navigation.addressView = null;
    for (const [name, value, what, known] of [
      ['theme', this.theme, 'a theme', THEMES],
      ['controls', this.controls, 'a value of controls', CONTROLS],
      ['view', this.view, 'a view', Object.keys(VIEWS)],
    ] as const) {
      if (changed.has(name) && !known.some((one) => one === value))
        this.api.refuse([`“${value}” is not ${what}: ${known.join(', ')}`]);
    }
    if (!this.hasUpdated || changed.has('src')) this.sourceView = this.navigation.sourceView;
  }

  protected override firstUpdated(): void {
    if (this.navigation.wanted !== 'map') this.navigation.openWanted();
    const isInSpace = this.ownsAddress && ownerOf(location.hash) === 'spatial';
    if (this.sourceView !== 'map' || isNothing(this.src)) this.planar.session.clear();
    else if (this.src !== 'sample') this.openSource(this.src);
    else if (isInSpace) this.openSource('apartment');
    else void this.planar.session.openGiven(fetchSample());
  }

  protected override updated(changed: PropertyValues<this>): void {
    this.tellRuns();
    if (changed.has('offline')) void this.api.keepOffline(this.offline);
    // Undefined before: it is what the element begins with.
    if (changed.get('src') !== undefined && this.sourceView === 'map') this.openSource(this.src);
    if (['view', 'live'].some((name) => changed.get(name as 'view') !== undefined)) this.navigation.openWanted();
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

  private get ownsAddress(): boolean {
    return this.rememberSettings && addressOwner === this;
  }

  private claimAddress(): void {
    if (this.rememberSettings && this.isConnected) addressOwner ??= this;
    else if (addressOwner === this) addressOwner = null;
    this.address = this.ownsAddress ? WHOLE : this.rememberSettings && this.id !== '' ? new Address(this.id) : null;
  }

  protected override render(): TemplateResult {
    const { dropTarget, workspace } = this;
    const { layout, isLow, typeScale } = this.appearance;
    return html`
      <div
        class="app ${layout} ${isLow ? 'low' : ''} ${isRun(this.navigation.shown) ? '' : 'beside'}"
        style="--px: ${typeScale}px"
      >
        ${this.controlsShown === 'full' ? this.renderHeader() : nothing}
        <scanstitch-messages
          strip
          .messages=${this.api.notices}
          @messages-dismissed=${() => this.api.dismiss()}
        ></scanstitch-messages>
        ${
          workspace.activity === null
            ? nothing
            : activityBox(workspace.activity, workspace.progress, 'Stop', () => this.cancel())
        }
        ${
          workspace.bag && isRun(this.navigation.shown)
            ? html`<scanstitch-topics
                .bag=${workspace.bag}
                @topics-chosen=${({ detail }: CustomEvent<Wishes>) => this.parts.attend(() => workspace.choose(detail))}
                @topics-cancelled=${() => workspace.cancel()}
              ></scanstitch-topics>`
            : nothing
        }
        ${this.renderViews()}
        <input id="pick-files" type="file" multiple hidden @change=${this.onPicked} />
        <input id="pick-folder" type="file" webkitdirectory hidden @change=${this.onPicked} />
        ${dropTarget.hint('Drop scans, depth images or a folder here')}
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
    const { shown, opened } = this.navigation;
    const onFacts = (): void => {
      this.requestUpdate();
      this.parts.attend(() => this.handover.follow());
      this.parts.attend(() => this.navigation.compareDropped());
    };
    return html`<div
      class="views"
      @facts-changed=${onFacts}
      @files-wanted=${({ detail }: CustomEvent<string>) => this.choose(detail)}
      @look-inside=${({ detail }: CustomEvent<number>) => this.parts.attend(() => this.navigation.lookInside(detail))}
      @stream-kept=${({ detail }: CustomEvent<File>) => this.parts.attend(() => this.workspace.takeStream(detail))}
      @panel-folded=${({ detail }: CustomEvent<FoldChange>) => this.fold(detail)}
      @settings-refused=${({ detail }: CustomEvent<string[]>) => this.api.refuse(detail)}
    >
      ${viewsBeside(this.navigation, this.handover, {
        isDark: this.isDark(),
        ownsAddress: this.ownsAddress,
        sourceOf: (view) => this.sourceOf(view),
        host: this,
        isBevEmpty: this.sourceView === 'bev' && this.src !== 'sample',
      })}
      <scanstitch-planar ?hidden=${shown !== 'planar'} exportparts=${PARTS}></scanstitch-planar>
      ${
        opened.has('spatial')
          ? html`<scanstitch-spatial ?hidden=${shown !== 'spatial'} exportparts=${PARTS}></scanstitch-spatial>`
          : nothing
      }
    </div>`;
  }

  /** Tells the views of runs what stands around them. */
  private tellRuns(): void {
    const { preset, address, folds, controlsShown: controls } = this;
    const { layout, isLow, fullScreen } = this.appearance;
    const told = {
      ...{ initialSettings: this.settings, preset, address, shelf: this.workspace, dark: this.isDark() },
      ...{ layout, isLow, controls, folds, fullScreen: controls === 'minimal' ? fullScreen : null },
    };
    for (const run of this.runs) Object.assign(run, told);
  }

  /** The attribute `src`, where it is for this view and no sample. */
  private sourceOf(view: SourceView): string {
    return this.sourceView !== view || this.src === 'sample' || isNothing(this.src) ? '' : this.src;
  }

  private renderHeader(): TemplateResult {
    const run = this.runView();
    return appHeader({
      view: this.navigation.shown,
      run: this.workspace.run,
      facts: run?.facts ?? NO_FACTS,
      exports: run?.exports ?? [],
      openItems: openItems(isNothing(this.src) || this.sourceView !== 'map' ? '' : this.src),
      layout: this.appearance.layout,
      isDark: this.isDark(),
      fullScreen: this.appearance.fullScreen,
      go: (tool) => this.parts.attend(() => this.navigation.go(tool)),
      open: (id) => this.choose(id),
      expectFiles: () => void this.workspace.expectFiles(),
      runExport: (id) => void run?.runExport(id),
      removeReference: () => run?.removeReference(),
      toggleFullScreen: () => this.choose('full-screen'),
      toggleTheme: () => {
        this.theme = this.isDark() ? 'light' : 'dark';
      },
    });
  }

  private get runs(): (ScanstitchPlanar | ScanstitchSpatial)[] {
    return [this.planar, this.spatial].filter((run) => run !== null);
  }

  private runOf(run: Run): ScanstitchPlanar | ScanstitchSpatial | null {
    return run === 'planar' ? this.planar : this.spatial;
  }

  private runView(): ScanstitchPlanar | ScanstitchSpatial | null {
    return this.runOf(this.workspace.run);
  }

  private async showRun(run: Run): Promise<ScanstitchPlanar | ScanstitchSpatial | null> {
    if (run === 'spatial') await this.parts.loaded(import('./spatial/spatial-view.js'));
    this.navigation.showRun(run);
    await this.updateComplete;
    return this.runOf(run);
  }

  private choose(id: string): void {
    const { parts, workspace } = this;
    if (id.startsWith('view:')) parts.attend(() => this.navigation.go(id.slice('view:'.length) as Tool));
    else if (id === 'full-screen') parts.attend(() => this.appearance.toggleFullScreen());
    else if (id === 'page') this.openSource(this.src);
    else if (id === 'files') this.fileInput.click();
    else if (id === 'folder') this.folderInput.click();
    else if (id === 'clear') workspace.clear();
    else parts.attend(() => (id === 'apartment' ? workspace.openApartment() : workspace.openSample()));
  }

  private async take(files: readonly NamedFile[], requestedAt: number, notes: readonly Note[]): Promise<void> {
    if (mayHoldMap(files) && (await this.navigation.locate(files, notes))) return;
    if (files.length > 0) return this.workspace.take(files, { requestedAt, notes });
    for (const { file, reason } of notes) this.runView()?.session.report(`${file}: ${reason}`, 'Drop it again');
  }

  private onPicked({ target }: Event): void {
    const files = filesOfInput(target as HTMLInputElement);
    const pickedAt = performance.now();
    this.parts.attend(() => this.take(files, pickedAt, []));
  }

  /** What stands around the map; a value that is none is refused, and all of it is there. */
  private get controlsShown(): Controls {
    return CONTROLS.includes(this.controls) ? this.controls : 'full';
  }

  private fold(change: FoldChange): void {
    this.folds = changedFolds(this.folds, change);
    if (change.isLasting && this.rememberSettings) rememberFolds(this.folds);
  }

  private isDark(): boolean {
    return this.theme === 'dark' || (this.theme === 'auto' && this.appearance.isSystemDark);
  }

  static override styles = [tokens, shared, dropStyles, appStyles, activityStyles];
}

keepFormerNames(ScanstitchApp.prototype);
