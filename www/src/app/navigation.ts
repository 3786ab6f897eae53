/** Which view is shown: the map of a run, or a view beside it. A view that was shown once stays, hidden, with all it holds. */
import type { ReactiveControllerHost } from 'lit';
import type { Handover } from './handover.js';
import type { PageParts } from './page-parts.js';
import type { Run, Tool, View } from '../components/tools.js';
import { ViewHistory } from './view-history.js';
import type { NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import { LastRequest } from '../engine/last-request.js';
import { ownerOf } from '../views/settings-link.js';
import type { Workspace } from './workspace.js';

/** Names of the views in the attribute `view`. */
export const VIEWS = {
  map: null,
  bev: 'bev',
  icp: 'icp',
  evaluate: 'evaluation',
  strategies: 'strategies',
  localize: 'localize',
  live: 'live',
} as const;
export type ViewName = keyof typeof VIEWS;
/** Those that `src` may be for. */
export type SourceView = Exclude<ViewName, 'evaluate' | 'strategies' | 'live'>;
export const isViewName = (name: string): name is ViewName => Object.hasOwn(VIEWS, name);
export const isRun = (view: View): view is Run => view === 'planar' || view === 'spatial';

/** The view that the page's address is of. */
function viewOfAddress(): View {
  const owner = ownerOf(location.hash);
  return owner === 'planar' || owner === 'spatial' ? owner : VIEWS[owner];
}

export interface NavigationHooks {
  workspace: Workspace;
  handover: Handover;
  parts: PageParts;
  /** Whether the page's address is the element's own. */
  ownsAddress(): boolean;
  /** The view of the attribute. */
  wanted(): ViewName;
  /** Whether the page's sample belongs to the map and has not been opened, for it began with another view. */
  isSampleDue(): boolean;
  /** The run of what was dropped on the strategies, once its first frames are on the map, or its scans are read. */
  dropped(): { session: { messages: readonly unknown[] } } | null;
  /** Writes the settings of the run into the page's address. */
  writeAddress(): void;
}

type Host = ReactiveControllerHost & { readonly hasUpdated: boolean };

export class Navigation {
  shown: View = 'planar';
  opened: ReadonlySet<View> = new Set<View>(['planar']);
  /** The view that the page's address asked for, in place of the host's: what is opened is shown instead of it. */
  addressView: ViewName | null = null;
  /** What was dropped on the strategies: it is compared as soon as its first frames are on the map. */
  #isToCompare = false;
  /** A view that is loaded only after another was asked for is not shown. */
  readonly #request = new LastRequest();
  readonly #host: Host;
  readonly #hooks: NavigationHooks;
  readonly #history: ViewHistory;

  constructor(host: Host, hooks: NavigationHooks) {
    this.#host = host;
    this.#hooks = hooks;
    this.#history = new ViewHistory(host, {
      isOwnPage: () => hooks.ownsAddress(),
      show: (view) => this.#goBack(view),
    });
  }

  /** The view to begin with, and to return to what is opened for. */
  get wanted(): ViewName {
    return this.addressView ?? this.#hooks.wanted();
  }

  /** The view that the attribute `src` is for. */
  get sourceView(): SourceView {
    const { wanted } = this;
    return wanted === 'evaluate' || wanted === 'strategies' || wanted === 'live' ? 'map' : wanted;
  }

  /** What the page's address asks for counts before the attribute, while that stays as it is. */
  readAddress(): void {
    const owner = ownerOf(location.hash);
    if (isViewName(owner)) this.addressView = owner;
  }

  /** Shows the view of the attribute `view`. */
  openWanted(): void {
    const view = VIEWS[this.wanted];
    this.#ask();
    if (view === null) this.show(this.#hooks.workspace.run);
    else if (view !== this.shown) this.#hooks.parts.attend(() => this.go(view));
  }

  async go(tool: Tool): Promise<void> {
    const { handover, parts, workspace } = this.#hooks;
    if (tool === 'icp') return this.lookInside(null);
    const signal = this.#ask();
    switch (tool) {
      case 'map':
        // Where the page began with another view, that of the sample.
        this.show(workspace.run);
        if (this.#hooks.isSampleDue()) await workspace.openSample();
        return;
      case 'evaluation':
        await parts.loaded(import('../evaluate/evaluate-view.js'));
        await handover.openEvaluation();
        break;
      case 'strategies':
        await parts.loaded(import('../strategies/strategies-view.js'));
        handover.openStrategies();
        break;
      case 'localize':
        await parts.loaded(import('../localize/localize-view.js'));
        handover.openLocalization();
        break;
      case 'live':
        await parts.loaded(import('../live/live-view.js'));
        break;
      case 'bev':
        await parts.loaded(import('../bev/bev-view.js'));
    }
    if (!signal.aborted) this.show(tool);
  }

  /** Opens the map among files that were dropped, and the scans beside it; whether there is a map. */
  async locate(files: readonly NamedFile[], notes: readonly Note[]): Promise<boolean> {
    const { handover, parts } = this.#hooks;
    const signal = this.#ask();
    const { dropWithMap } = await parts.loaded(import('../localize/opening.js'));
    const dropped = await dropWithMap(files, { isForMap: files.length === 1, notes, signal });
    if (!dropped) return false;
    await parts.loaded(import('../localize/localize-view.js'));
    if (signal.aborted) return true;
    handover.openLocalization(dropped);
    this.show('localize');
    return true;
  }

  /** The registration of a scan or frame; null: of the selected one to the one before. */
  async lookInside(frame: number | null): Promise<void> {
    const signal = this.#ask();
    await this.#hooks.parts.loaded(import('../lab/lab-view.js'));
    if (this.#host.hasUpdated) await this.#hooks.handover.openLab(frame);
    if (!signal.aborted) this.show('icp');
  }

  show(view: View): void {
    if (view !== this.shown) this.#history.push(view);
    this.#bring(view);
  }

  /** Shows the run that has something new; a view beside it that the host has asked for stays. */
  showRun(run: Run): void {
    // What is dropped on the strategies leaves them for the map, until it has its first frames there.
    this.#isToCompare = this.shown === 'strategies';
    const aside = this.addressView ? null : VIEWS[this.wanted];
    if (aside === null || aside === 'live' || this.shown !== aside) return this.show(run);
    this.opened = new Set([...this.opened, run]);
    this.#hooks.workspace.run = run;
    this.#host.requestUpdate();
  }

  /** Returns to the strategies with the files that were dropped there, unless a message about them is shown on the map. */
  async compareDropped(): Promise<void> {
    const dropped = this.#isToCompare ? this.#hooks.dropped() : null;
    if (!dropped) return;
    this.#isToCompare = false;
    const isLeftForIt = isRun(this.shown) && dropped.session.messages.length === 0;
    if (isLeftForIt || this.shown === 'strategies') await this.go('strategies');
  }

  #bring(view: View): void {
    this.opened = new Set([...this.opened, view]);
    this.shown = view;
    if (isRun(view)) this.#hooks.workspace.run = view;
    // The address names a view beside the run, or holds what that wrote there, for as long as that is shown.
    const named = viewOfAddress();
    if (!isRun(named) && named !== view) this.#hooks.writeAddress();
    this.#host.requestUpdate();
  }

  /** Someone asks for a view. What was dropped on the strategies does not bring them back any more. */
  #ask(): AbortSignal {
    this.#isToCompare = false;
    return this.#request.begin();
  }

  /** Back or forward in the browser's history; empty: to where the page began, or what its address names now. */
  #goBack(view: string): void {
    const named = view ? (view as View) : viewOfAddress();
    if (view === '' && !isRun(named) && !this.opened.has(named)) {
      this.#history.mark(named); // the address was changed on the open page
      this.#hooks.parts.attend(() => this.#follow(named));
      return;
    }
    this.#ask();
    this.#bring(this.opened.has(named) ? named : 'planar');
  }

  /** Opens the tool that the address names; the lab takes what it shows from the address as well. */
  async #follow(tool: Exclude<Tool, 'map'>): Promise<void> {
    if (tool !== 'icp' || location.hash === '#icp') return this.go(tool);
    const signal = this.#ask();
    await this.#hooks.parts.loaded(import('../lab/lab-view.js'));
    if (!signal.aborted) this.show('icp');
  }
}
