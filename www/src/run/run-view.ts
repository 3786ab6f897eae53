/** A view of a run, and what it and the page's frame (header, menus) say to each other. */
import { html, nothing, type TemplateResult } from 'lit';
import { property, state } from 'lit/decorators.js';
import './headline.js';
import { messageOf } from '../engine/message-of.js';
import { type Download, download } from '../export/download.js';
import type { ReportSource } from '../export/exports.js';
import type { Status } from '../views/map-painter.js';
import { memoizeLast } from '../views/memoize-last.js';
import { framePalette, type Rgb } from '../views/palette.js';
import { sameSettings } from '../views/setting-fields.js';
import type { Turns } from '../views/viewport.js';
import { announcements } from '../components/announcer.js';
import { activityStyles, layoutStyles } from './run-styles.js';
import type { Measure } from './before-after.js';
import type { GivenClouds } from './given-clouds.js';
import type { ScanstitchMapPoints, ScanstitchResult } from '../components/host-events.js';
import type { MenuItem } from '../components/menu.js';
import { ResultBefore } from './run-before.js';
import { barStyles, exchangeBar } from './run-exchange.js';
import {
  COPY_LINK,
  EMPTY_LIST,
  type GivenFiles,
  type GivenRecording,
  type GivenScans,
  type Loaded,
  NO_FACTS,
  sameFacts,
  STREAM,
  type Shelf,
  type ViewFacts,
} from './run-kind.js';
import { RunSettings } from './run-settings.js';
import { activity, messages } from './run-parts.js';
import { type RunSession } from '../components/session.js';
import { emptyStyles, shared } from '../components/theme.js';
import { fire } from '../components/fire.js';

/** What all results have in common. */
interface RunSnapshot {
  result: { frames: readonly { name: string; status: Status }[] };
}

/**
 * One way to look at a run: scans in the plane, or depth images and clouds in space. It fires `facts-changed` whenever
 * the header has something new to show, `settings-refused` with sentences about settings that cannot be taken,
 * `files-wanted` ('files', 'folder' or the id of a sample) where it offers to open some, and the events for the host.
 */
export abstract class RunView<
  Settings extends object,
  Snapshot extends RunSnapshot,
  Session extends RunSession<{ dispose(): void; stop(): void }, Settings, unknown, Snapshot>,
  Overlay,
> extends RunSettings<Settings> {
  @property({ type: Boolean }) dark = false;
  /** Where recordings are exchanged. */
  @property({ attribute: false }) shelf: Shelf | null = null;

  /** The frame that was chosen last. */
  @state() private chosen: number | null = null;
  /** Number of frames shown; null: all there are. */
  @state() protected until: number | null = null;
  @state() protected hovered: number | null = null;
  @state() private isExporting = false;

  /** What the header shows. */
  facts: ViewFacts = NO_FACTS;

  /** What is open. */
  abstract override session: Session;
  private shownGeneration = 0;
  /** Changes where the view is to be fitted anew. */
  protected fitKey = 0;
  /** The result before a setting was changed. */
  private resultBefore = new ResultBefore<Settings, Overlay>(this);
  private colorsOf = memoizeLast(framePalette);
  private statusesOf = memoizeLast((frames: Snapshot['result']['frames']) => frames.map(({ status }) => status));

  get exports(): readonly MenuItem[] {
    const { address, shelf, of } = this;
    return [...of.exports, ...(shelf?.stream ? [STREAM] : []), ...(address ? [COPY_LINK] : [])];
  }

  /** Begins anew, with the same settings; the session so far is left as it is. */
  renew(): void {
    const { settings } = this.session;
    this.session = this.newSession();
    this.session.settings = settings;
    this.session.beginWith((facts) => this.settingsToBegin(facts));
    this.requestUpdate();
  }

  /** Brings back a session as it was left. */
  reopen(session: Session): void {
    this.session = session;
    this.writeAddress();
    session.announce(`${this.loaded().title} is open again.`);
    this.requestUpdate();
  }

  titleOf(session: Session): string {
    return this.loaded(session).title;
  }

  /** Whether there is something that a new recording would replace, and that cannot simply be opened again. */
  get isOwn(): boolean {
    return this.session.snapshot !== null && !this.isSample();
  }

  /** Whether there is a result of a recording that strategies can be compared on. */
  get isToCompare(): boolean {
    return this.facts.result !== null && this.session.phase !== 'reading';
  }

  abstract removeReference(): void;
  /** What strategies are compared on; null where there is nothing but a sample of scans. */
  abstract recordingToCompare(): GivenRecording | GivenScans | null;
  /**
   * A scan or frame and what it was registered to, for the ICP lab; null where there are no two. `frame`: null is the selected
   * one, and of scans the one before it.
   */
  abstract cloudsToRegister(frame: number | null): Promise<GivenClouds | null>;
  /** What the evaluation takes over from a run that is done; null before. */
  abstract filesToEvaluate(): Promise<GivenFiles | null>;

  async runExport(id: string): Promise<void> {
    const { snapshot } = this.session;
    if (!snapshot) return;
    const stream = this.shelf?.stream;
    if (id === STREAM.id && stream) return download({ name: stream.name, blob: stream });
    if (id === COPY_LINK.id) return this.session.copy(location.href, 'The link was copied.');
    this.isExporting = true;
    try {
      download(await this.makeExport(id, snapshot));
    } catch (error) {
      this.session.report(`The export failed: ${messageOf(error)}`, 'Try again');
    } finally {
      this.isExporting = false;
    }
  }

  // For the host page.

  /** What was computed; null while it is not over. */
  get outcome(): ScanstitchResult | null {
    const { snapshot, phase } = this.session;
    return snapshot && phase === 'done' ? this.outcomeOf(snapshot) : null;
  }

  /** Whether files are being read or a run is under way, or the engine is starting. */
  get isBusy(): boolean {
    return ['starting', 'reading', 'running'].includes(this.session.phase);
  }

  /** The same, but for an engine that is only starting. */
  get isUnderWay(): boolean {
    return this.isBusy && this.session.phase !== 'starting';
  }

  abstract get map_points(): ScanstitchMapPoints | null;

  /** Computes what is loaded and not computed yet; the end of it. */
  computed(): Promise<ScanstitchResult> {
    const { phase } = this.session;
    if (phase === 'stopped' || phase === 'crashed') this.session.resume();
    return this.events.end();
  }

  cancel(): void {
    const { phase } = this.session;
    if (phase === 'reading' || phase === 'running') this.session.stop();
  }

  /** Rejects the promises of callers that wait for the end of the run. */
  abandon(reason: string): void {
    this.events.abandon(reason);
  }

  // What a kind of run adds.

  protected abstract newSession(): Session;
  /** Whether a sample of the page is open: it is replaced without a trace. */
  protected abstract isSample(): boolean;
  protected abstract makeExport(id: string, snapshot: Snapshot): Promise<Download>;
  /** Paths of the files of the recording, and beside it. */
  protected abstract openedFiles(): string[];
  protected abstract loaded(session?: Session): Loaded;
  protected abstract renderMap(): TemplateResult;
  protected abstract renderEmpty(): TemplateResult;
  /** The introduction above the sample. */
  protected renderIntroduction(): TemplateResult | typeof nothing {
    return nothing;
  }
  /** What is being done, or was stopped. */
  protected renderActivity(): TemplateResult | typeof nothing {
    return activity(this.session, this.num_frames < this.loaded().num_frames);
  }
  /** A question, beside the map. */
  protected renderQuestion(): TemplateResult | typeof nothing {
    return nothing;
  }
  protected abstract outcomeOf(snapshot: Snapshot): ScanstitchResult;
  /** By what a result is compared with the one before a setting was changed. */
  protected abstract measures(snapshot: Snapshot): readonly Measure[];
  /** What the map draws of a result that another replaces. */
  protected abstract overlayOf(snapshot: Snapshot): Overlay;

  protected get num_frames(): number {
    return this.session.snapshot?.result.frames.length ?? 0;
  }

  /** The chosen frame, once it is there: a run that computes again begins with none. */
  protected get selected(): number | null {
    return this.chosen !== null && this.chosen < this.num_frames ? this.chosen : null;
  }

  protected override willUpdate(changed: Map<PropertyKey, unknown>): void {
    this.revertWhereUseless();
    const { session } = this;
    const isSet = this.hasUpdated && (changed.has('initialSettings') || changed.has('preset'));
    if (isSet && session.facts) session.configure(this.settingsToBegin(session.facts));
    this.resultBefore.follow(session.dataset);
    // The two are to be compared in one frame.
    if (!this.resultBefore.isThere) this.fitKey = session.generation;
    if (this.shownGeneration !== session.generation) {
      this.shownGeneration = session.generation;
      this.chosen = null;
      this.until = null;
    }
  }

  protected override updated(): void {
    this.events.tellProgress(this.session);
    if (!this.isBusy) this.events.settle(this.session, () => this.outcome);
    const { snapshot, phase } = this.session;
    // A map that nobody sees is not painted.
    if (phase === 'done' && (document.hidden || this.clientHeight === 0)) this.onPainted();
    const { title, count, reference } = this.loaded();
    const canExport = snapshot !== null && (phase === 'done' || phase === 'stopped') && !this.isExporting;
    const facts: ViewFacts = { title, count, reference, canExport, result: snapshot };
    if (sameFacts(facts, this.facts)) return;
    this.facts = facts;
    fire(this, 'facts-changed');
  }

  protected override render(): TemplateResult {
    const { session, layout, controls } = this;
    const { snapshot, phase } = session;
    const isEmpty = snapshot === null && (phase === 'empty' || phase === 'unavailable');
    const isNarrow = layout === 'narrow';
    // Of files that are refused, a setting may be the remedy.
    const isRefused = isEmpty && session.dataset !== null && controls === 'full';
    if (isRefused) this.loadPanels();
    const settings = (place: string): TemplateResult =>
      html`<aside class="side ${place}" part="settings" aria-label="Settings">${this.renderSettings()}</aside>`;
    return html`
      <div
        class="run ${this.of.kind} ${layout} ${this.isLow ? 'low' : ''}"
        @frame-selected=${({ detail }: CustomEvent<number | null>) => {
          this.select(detail);
          if (detail !== null) this.unfoldDetails();
        }}
        @look-inside=${({ detail }: CustomEvent<number>) => fire(this, 'look-inside', detail)}
        @frame-hovered=${({ detail }: CustomEvent<number | null>) => {
          this.hovered = detail;
        }}
      >
        ${isEmpty ? this.renderEmpty() : this.renderIntroduction()} ${isRefused ? settings('alone') : nothing}
        ${this.renderExchange()}
        ${controls === 'minimal' || (controls === 'full' && !isNarrow) ? this.renderFigures() : nothing}
        <main ?hidden=${isEmpty}>
          ${this.shows('settings') && !isRefused ? settings('left') : nothing}
          <div class="middle">
            ${this.renderBefore()} ${messages(session, true)}
            <div class="map-area" part="map">${this.renderMap()} ${this.renderQuestion()}</div>
            ${controls === 'none' ? this.renderActivity() : this.renderBar()}
            ${this.shows('table') ? this.renderTable() : nothing}
          </div>
          ${
            this.shows('details')
              ? html`<aside class="side right" part="details" aria-label=${this.of.panels.details}>
                  ${this.renderDetails()}
                </aside>`
              : nothing
          }
          ${isNarrow && controls === 'full' ? this.renderTabs() : nothing}
        </main>
        ${announcements(session.announcer)}
      </div>
    `;
  }

  /** What the report to be read says, but for the picture; `turns`: quarter turns of a planar map on the screen. */
  protected reportSource(result: ReportSource['result'], points: Float32Array, turns: Turns = 0): ReportSource {
    const { title, num_frames } = this.loaded();
    const losses = this.session.messages.map(({ file, place, text }) => [file, place, text].filter(Boolean).join(', '));
    return { result, context: { title, opened: this.openedFiles(), losses, points, num_frames, turns } };
  }

  /** What the map draws of the result before, while that is wanted. */
  protected get overlay(): Overlay | null {
    return this.resultBefore.overlay;
  }

  private renderBefore(): TemplateResult | typeof nothing {
    const { snapshot, phase, facts, settings } = this.session;
    if (!facts || !settings || this.controls !== 'full') return nothing;
    const after = snapshot && phase === 'done' ? this.measures(snapshot) : null;
    return this.resultBefore.render(settings, after, facts.descriptions, (earlier) => this.applySettings(earlier));
  }

  private renderExchange(): TemplateResult | typeof nothing {
    const { title } = this.loaded();
    const former = this.shelf?.formerOf(this.of.kind);
    return this.shelf && former && title !== '' ? exchangeBar(title, former, this.shelf) : nothing;
  }

  /** Files that are of no use do not replace what was open. */
  private revertWhereUseless(): void {
    const { phase, dataset, messages } = this.session;
    if (phase === 'empty' && dataset === null && messages.length > 0) this.shelf?.revert(this.of.kind, messages);
  }

  protected override renderSettings(): TemplateResult {
    const { facts, settings } = this.session;
    return html`<scanstitch-settings
      .descriptions=${facts?.descriptions ?? EMPTY_LIST}
      .presets=${facts?.presets ?? EMPTY_LIST}
      .values=${settings}
      @settings-changed=${({ detail }: CustomEvent<Settings>) => this.applySettings(detail)}
    ></scanstitch-settings>`;
  }

  private renderBar(): TemplateResult {
    const { num_frames, until, dark } = this;
    const statuses = this.statusesOf(this.session.snapshot?.result.frames ?? EMPTY_LIST);
    const slider = { count: num_frames, until: until ?? num_frames, statuses, colors: this.trackColors(), dark };
    return this.renderBelow(slider, this.onUntil, this.renderActivity());
  }

  /** One colour for each frame there will be, also while only some are registered. */
  protected colors(): readonly Rgb[] {
    return this.colorsOf(Math.max(this.num_frames, this.loaded().num_frames), this.dark);
  }

  /** The colours along the timeline, where they are not simply those of time. */
  protected trackColors(): readonly Rgb[] | null {
    return null;
  }

  protected onPainted(): void {
    const { snapshot, phase } = this.session;
    if (phase === 'done' && snapshot) this.events.tellDone(this.session, () => this.outcomeOf(snapshot));
  }

  private select(frame: number | null): void {
    this.chosen = frame;
    if (frame !== null && this.until !== null && frame >= this.until) this.until = frame + 1;
  }

  private onUntil = ({ detail }: CustomEvent<number>): void => {
    this.until = detail >= this.num_frames ? null : detail;
    this.chosen = detail - 1;
  };

  /** Computes again with these settings, and keeps them. */
  protected applySettings(settings: Settings): void {
    const { snapshot, phase, settings: present } = this.session;
    if (snapshot && phase === 'done' && present && !sameSettings(present, settings)) {
      this.resultBefore.keep({
        settings: present,
        measures: this.measures(snapshot),
        overlay: this.overlayOf(snapshot),
      });
    }
    this.session.configure(settings);
    this.writeAddress();
  }

  static override styles = [shared, emptyStyles, layoutStyles, activityStyles, barStyles];
}
