import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { LastRequest } from '../engine/last-request.js';
import { announcements } from '../components/announcer.js';
import { DropTarget } from '../components/drop-target.js';
import { tellHost } from '../components/host-events.js';
import { icon } from '../components/icons.js';
import { FILE } from '../components/panel-icons.js';
import { whileConnected } from '../components/while-connected.js';
import { dropStyles, shared, tokens } from '../components/theme.js';
import { fieldStyles, pageStyles } from '../components/panel-theme.js';
import { filesOfDrop, filesOfInput } from '../datasets/gather.js';
import { download } from '../export/download.js';
import { WHOLE } from '../views/address.js';
import { memoizeLast } from '../views/memoize-last.js';
import { ownerOf } from '../views/settings-link.js';
import { bevStyles } from './bev-styles.js';
import { type BevDocument, markedPixels, wholePairs } from './document.js';
import { exportFile } from './export.js';
import { fragmentOf } from './link.js';
import { frontHandles, type Mark, markOf, movedTo, tabledKind, topHandles, withMark, without } from './marks.js';
import { frontOverlay, topOverlay } from './paint.js';
import './picture.js';
import { type HandleMove, type ScanstitchBevPicture } from './picture.js';
import type { TypedPixel } from './points-table.js';
import type { BevPreset, BevRefinement, BevRole, BevScene, Pixel } from './protocol.js';
import { homographyPanel, type Pointed, readout } from './readout.js';
import { blendSlider, pointsPanel, problemList, refinementPanel, scenePanels } from './panels.js';
import type { RefinementRequest } from './refinement.js';
import { BevSession } from './session.js';
import { openItems, toolbar } from './toolbar.js';

/**
 * Bird's-eye view: points marked in a top view land in a front view.
 *
 * Fires `scanstitch-projected` when marks and projections are on the screen; `detail.elapsed_ms` is the time since the change.
 */
@customElement('scanstitch-bev')
export class ScanstitchBev extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** Address of a scene.json to begin with; the pictures that it names lie beside it. */
  @property() src = '';
  /** Where there is no `src`: begins without pictures, not with the sample. */
  @property({ type: Boolean, attribute: 'without-sample' }) withoutSample = false;
  /** Whether the page's address may be changed to that of the scene. */
  @property({ type: Boolean, attribute: 'remember-scene' }) rememberScene = false;
  @state() private selected: number | null = null;
  /** What the pointer is over. */
  @state() private pointed: Pointed | null = null;
  @state() private refined: BevRefinement | null = null;
  @query('#top') private topPicture!: ScanstitchBevPicture | null;
  @query('#front') private frontPicture!: ScanstitchBevPicture | null;
  @query('#pick') private input!: HTMLInputElement;

  private session = new BevSession(this, {
    strip: (strip) => this.frontPicture?.takeStrip(strip),
    unwarped: () => this.frontPicture?.forgetWarp(),
    answered: (since) => this.tellDrawn(since),
  });
  private dropTarget = new DropTarget(this, (transfer, event) => void this.openDropped(transfer, event));
  private pickedRole: BevRole | null = null;
  /** Whether a mark was taken hold of and has not been moved yet. */
  private dragBegins = false;
  private readonly pointing = new LastRequest();
  private topOverlayOf = memoizeLast(topOverlay);
  private frontOverlayOf = memoizeLast(frontOverlay);
  private openItemsOf = memoizeLast(openItems);
  private topHandlesOf = memoizeLast(topHandles);
  private frontHandlesOf = memoizeLast(frontHandles);

  constructor() {
    super();
    whileConnected(this, window, 'hashchange', () => {
      if (ownerOf(location.hash) === 'bev') void this.session.openLink();
    });
  }

  override connectedCallback(): void {
    super.connectedCallback();
    void this.session.begin(this.src, !this.withoutSample);
  }

  protected override updated(changed: PropertyValues<this>): void {
    const { session, src } = this;
    if (changed.get('src') !== undefined && src !== '') void session.attempt('file', () => session.openAddress(src));
  }

  private async tellDrawn(since: number): Promise<void> {
    await this.updateComplete;
    await Promise.all([this.topPicture?.updateComplete, this.frontPicture?.updateComplete]);
    const detail = { elapsed_ms: performance.now() - since };
    tellHost(this, 'scanstitch-projected', detail);
  }

  // What is shown.

  protected override render(): TemplateResult {
    const { dropTarget } = this;
    const { document } = this.session;
    return html`<div class="bev" @keydown=${this.onKey}>
      ${document ? this.renderControls(document) : nothing} ${problemList(this.session)}
      ${document ? this.renderWork(document) : nothing} ${announcements(this.session.announcer)}
      <input id="pick" type="file" multiple hidden @change=${this.onPicked} />
      ${dropTarget.hint('Drop the two views, a scene.json or a table of points')}
    </div>`;
  }

  private renderControls(document: BevDocument): TemplateResult {
    const { canUndo, canRedo, presets } = this.session;
    return toolbar(document, {
      openItems: this.openItemsOf(presets),
      canUndo,
      canRedo,
      open: (event) => this.onOpen(event),
      export: (event) => this.onExport(event),
      undo: () => this.goBack('undo'),
      redo: () => this.goBack('redo'),
      change: (wanted, keepsSelection) => this.change(wanted, keepsSelection ? this.selected : null),
    });
  }

  private renderWork(document: BevDocument): TemplateResult {
    const answer = this.session.answered?.answer;
    return html`<div class="work">
      <div class="stack">
        <div class="views">${this.renderView('top', document)} ${this.renderView('front', document)}</div>
        ${this.renderPoints(document)}
      </div>
      <div class="stack">
        ${
          document.tool === 'pairs'
            ? refinementPanel(document, this.session.answered?.answer ?? null, this.refined, (wish) =>
                this.refine(document, wish),
              )
            : nothing
        }
        ${scenePanels(document.scene, answer ?? null, this.dark, {
          set: (scene) => this.setScene(scene),
          turnAxes: (axes) => this.rewrite(this.session.client?.call('inAxes', { scene: document.scene, axes })),
          choosePoses: (kind) =>
            this.rewrite(this.session.client?.call('withPoses', { scene: document.scene, ...kind })),
        })}
        ${answer ? homographyPanel(answer.homography, (text) => this.copyHomography(text)) : nothing}
      </div>
    </div>`;
  }

  private renderView(role: BevRole, document: BevDocument): TemplateResult {
    const { session, selected, pointed } = this;
    const isTop = role === 'top';
    const { width, height } = document.scene[role];
    const { answered } = session;
    const ghost = pointed && pointed.role !== role ? pointed.point.projected : null;
    const overlay = isTop
      ? this.topOverlayOf(document, answered?.answer ?? null, selected, ghost)
      : this.frontOverlayOf(answered?.document ?? document, answered?.answer ?? null, selected, ghost);
    const title = isTop ? 'Top view' : 'Front view';
    const picture = session.pictureOf(role);
    const bitmap = session.bitmapOf(role);
    return html`<section aria-label=${title}>
      <header>
        <h2>${title}</h2>
        <span class="file" title=${picture?.name ?? ''}>${picture?.name ?? `${width} × ${height}`}</span>
        <button class="quiet" aria-label="Choose the image of the ${role} view" @click=${() => this.pick(role)}>
          ${icon(FILE, 14)}Image…
        </button>
      </header>
      <scanstitch-bev-picture
        id=${role}
        name=${title}
        .width=${width}
        .height=${height}
        .bitmap=${bitmap}
        .overlay=${overlay}
        .handles=${isTop ? this.topHandlesOf(document) : this.frontHandlesOf(answered)}
        .blend=${isTop ? 0 : session.blend}
        placeholder=${picture && !bitmap ? 'The image and its camera differ in size' : `Drop the ${role} view here`}
        @picture-pressed=${({ detail }: CustomEvent<Pixel>) => this.onPressed(role, detail)}
        @handle-moved=${({ detail }: CustomEvent<HandleMove>) => this.onMoved(role, detail)}
        @handle-removed=${({ detail }: CustomEvent<string>) => this.removeMark(markOf(detail))}
        @handle-focused=${({ detail }: CustomEvent<string>) => {
          this.selected = markOf(detail).index;
        }}
        @picture-pointed=${({ detail }: CustomEvent<Pixel | null>) => this.onPointed(role, detail)}
      ></scanstitch-bev-picture>
      <div class="readout">${isTop ? readout(this.pointed, document.tool) : blendSlider(this.session)}</div>
    </section>`;
  }

  private renderPoints(document: BevDocument): TemplateResult {
    const { width, height } = document.scene.top;
    return pointsPanel(document, this.session.answered?.answer ?? null, this.selected, {
      add: () => this.addInTop(document, [Math.floor(width / 2), Math.floor(height / 4)]),
      type: (typed) => this.onTyped(document, typed),
      remove: (index) => this.removeMark({ kind: tabledKind(document), index }),
    });
  }

  // Changes.

  private change(change: Partial<BevDocument>, selected: number | null): void {
    this.session.change(change);
    this.selected = selected;
  }

  private setScene(scene: BevScene): void {
    this.refined = null;
    this.session.setScene(scene);
  }

  private openPreset(preset: BevPreset): void {
    this.refined = null;
    this.session.openPreset(preset);
  }

  /** The engine says the same scene with other numbers. */
  private rewrite(call: Promise<BevScene> | undefined): Promise<void> {
    return this.session.attempt('scene', async () => {
      const scene = await call;
      if (scene) this.setScene(scene);
    });
  }

  private goBack(step: 'undo' | 'redo'): void {
    this.selected = null;
    this.refined = null;
    this.session[step]();
  }

  private refine(document: BevDocument, { camera, parameters }: RefinementRequest): Promise<void> {
    return this.session.attempt('refinement', async () => {
      const given = { scene: document.scene, pairs: wholePairs(document), camera, parameters };
      const result = await this.session.client?.call('refine', given);
      if (!result) return;
      this.setScene(result.scene);
      this.refined = result;
    });
  }

  // Marks.

  private onPressed(role: BevRole, at: Pixel): void {
    const { document } = this.session;
    if (!document) return;
    if (role === 'top') this.addInTop(document, at);
    else void this.addInFront(document, at);
  }

  private addInTop(document: BevDocument, at: Pixel): void {
    const { change, mark } = withMark(document, at);
    void this.mark(change, mark);
    if (mark.kind === 't') this.session.announce('Now click the same place in the front view.');
  }

  private async addInFront(document: BevDocument, at: Pixel): Promise<void> {
    if (document.tool !== 'pairs') {
      const top = await this.followFromFront(at);
      const { document: now } = this.session;
      if (top && now) this.addInTop(now, top);
      return;
    }
    const open = document.pairs.findIndex(({ front }) => front === null);
    if (open < 0) this.session.announce('Click the place in the top view first.');
    else this.change({ pairs: document.pairs.map((pair, i) => (i === open ? { ...pair, front: at } : pair)) }, open);
  }

  /** The top pixel of a front pixel; null, and announced, where there is none. */
  private async followFromFront(pixel: Pixel): Promise<Pixel | null> {
    const point = await this.session.follow('front', pixel);
    if (point?.projected) return point.projected;
    this.session.announce(
      point?.status === 'behind_camera'
        ? 'The ground at this pixel lies behind the top camera.'
        : 'This pixel of the front view is at or above the horizon: it sees no ground.',
    );
    return null;
  }

  /** Adds a mark and gives it the keyboard once it is there. */
  private async mark(change: Partial<BevDocument>, { kind, index }: Mark): Promise<void> {
    this.change(change, index);
    await this.updateComplete;
    await this.topPicture?.updateComplete;
    this.topPicture?.focusHandle(`${kind}${index}`);
  }

  private async onMoved(role: BevRole, { key, at, phase }: HandleMove): Promise<void> {
    if (phase === 'begin') {
      this.dragBegins = true;
      void this.onPointed(role, null);
      return;
    }
    const mark = markOf(key);
    // Points lie in the top view; dragged in the front view they go where it says.
    const place = role === 'front' && mark.kind === 'p' ? await this.followFromFront(at) : at;
    const { document } = this.session;
    const moved = place && document ? movedTo(document, mark, place) : null;
    if (!moved) return;
    this.session.change(moved, phase === 'drag' && !this.dragBegins);
    this.dragBegins = false;
  }

  private onTyped(document: BevDocument, { index, axis, value }: TypedPixel): void {
    const [u, v] = markedPixels(document)[index] ?? [0, 0];
    const moved = movedTo(document, { kind: tabledKind(document), index }, axis === 0 ? [value, v] : [u, value]);
    if (moved) this.change(moved, index);
  }

  private removeMark(mark: Mark): void {
    const { document } = this.session;
    if (document) this.change(without(document, mark), null);
  }

  private async onPointed(role: BevRole, pixel: Pixel | null): Promise<void> {
    const signal = this.pointing.begin();
    const point = pixel ? await this.session.follow(role, pixel) : null;
    if (!signal.aborted) this.pointed = point ? { role, point } : null;
  }

  private onKey(event: KeyboardEvent): void {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    const [target] = event.composedPath();
    const isField = target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement;
    if (isField || (key !== 'z' && key !== 'y')) return;
    event.preventDefault();
    if (key === 'y' || event.shiftKey) this.goBack('redo');
    else this.goBack('undo');
  }

  // Files.

  private onOpen({ detail }: CustomEvent<string>): void {
    const preset = this.session.presets.find(({ name }) => name === detail);
    if (preset) this.openPreset(preset);
    else if (detail === 'sample') void this.session.openSample();
    else this.pick(null);
  }

  private pick(role: BevRole | null): void {
    this.pickedRole = role;
    this.input.click();
  }

  private async onPicked(): Promise<void> {
    await this.session.open(filesOfInput(this.input), this.pickedRole);
  }

  private async openDropped(transfer: DataTransfer, event: DragEvent): Promise<void> {
    const path = event.composedPath();
    const role = (['top', 'front'] as const).find((one) => path.includes(this[`${one}Picture`] as EventTarget));
    await this.session.open(await filesOfDrop(transfer), role ?? null);
  }

  private async onExport({ detail }: CustomEvent<string>): Promise<void> {
    const { document } = this.session;
    if (!document) return;
    await this.session.attempt('export', async () => {
      if (detail === 'link') return this.copyLink(document);
      const picture = detail === 'top' ? this.topPicture : this.frontPicture;
      const file = await exportFile(detail, this.session, document, picture);
      if (file) download(file);
    });
  }

  private async copyLink(document: BevDocument): Promise<void> {
    const { blend, isSample } = this.session;
    const fragment = fragmentOf({ document, blend, isSample });
    if (this.rememberScene) WHOLE.write(fragment);
    const hasOwn = !isSample && (this.session.pictureOf('top') ?? this.session.pictureOf('front')) !== null;
    const pictures = hasOwn ? ' Your own images are not in it: they never leave this machine.' : '';
    await this.copy(new URL(fragment, location.href).href, `The link was copied.${pictures}`);
  }

  private copyHomography(text: string): Promise<void> {
    return this.session.attempt('export', () => this.copy(text, 'The homography was copied.'));
  }

  private async copy(text: string, announcement: string): Promise<void> {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      throw new Error(`The browser does not let this page copy. Here it is: ${text}`);
    }
    this.session.announce(announcement);
  }

  static override styles = [tokens, shared, pageStyles, dropStyles, fieldStyles, bevStyles];
}
