import { html, LitElement, nothing, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import '../components/frame-table.js';
import '../components/headline.js';
import '../components/settings-panel.js';
import '../components/timeline.js';
import './frame-panel.js';
import './map3d.js';
import { layout_styles } from '../components/app-styles.js';
import { icon } from '../components/icons.js';
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
import type { SpatialFiles } from '../datasets/spatial-files.js';
import type { SpatialFacts, SpatialFrameResult, SpatialResult, SpatialSettings } from '../engine/spatial-protocol.js';
import type { GivenFiles } from '../components/run-view.js';
import { download } from '../export/exports.js';
import { baseName, formatLength, plural } from '../views/format.js';
import { framePalette, type Rgb } from '../views/palette.js';
import { memoizeLast } from '../views/memoize-last.js';
import { ownerOf, rememberSettings, settingsToBegin } from '../views/settings-link.js';
import { makeSpatialExport, SPATIAL_EXPORTS } from './exports.js';
import { FrameImageLoader } from './frame-images.js';
import { spatialFigures } from './headline.js';
import type { GivenRecording } from '../components/run-view.js';
import type { ScanstitchMap3d, SpatialMarks } from './map3d.js';
import { trajectoriesToEvaluate } from './to-evaluate.js';
import { errorCsv, spatialColumns, spatialRows } from './rows.js';
import { SpatialSession } from './session.js';

type Tab = 'frame' | 'settings' | 'table' | 'figures';

const TAB_NAMES: Record<Tab, string> = { figures: 'Result', table: 'Frames', frame: 'Frame', settings: 'Settings' };
const TABS: Record<Layout, readonly Tab[]> = {
  wide: [],
  medium: ['frame', 'settings'],
  narrow: ['figures', 'frame', 'table', 'settings'],
};

const NO_FRAMES: readonly SpatialFrameResult[] = [];
/** Raw values to a metre, before the engine has said. */
const DEPTH_SCALE = 1000;

/**
 * A run of depth images or clouds in space: the map in 3D, each frame's images and result, the figures of the whole.
 */
@customElement('scanstitch-spatial')
export class ScanstitchSpatial extends LitElement implements RunView {
  @property({ attribute: false }) initial_settings = '';
  @property({ attribute: false }) preset = '';
  @property({ attribute: false }) remember_settings = false;
  @property({ attribute: false }) layout: Layout = 'wide';
  @property({ type: Boolean }) dark = false;

  @state() private tab: Tab = 'figures';
  @state() private selected: number | null = null;
  /** Number of frames shown; null: all there are. */
  @state() private until: number | null = null;
  @state() private is_exporting = false;
  @state() private graphics_words = '';
  @query('scanstitch-map3d') private map!: ScanstitchMap3d;

  readonly exports = SPATIAL_EXPORTS;
  facts: ViewFacts = NO_FACTS;

  private session = new SpatialSession(this);
  private loader = new FrameImageLoader(this, (file) => this.session.depthPicture(file));
  private colorsOf = memoizeLast(framePalette);
  private namesOf = memoizeLast((frames: readonly SpatialFrameResult[]) => frames.map(({ name }) => name));
  private statusesOf = memoizeLast((frames: readonly SpatialFrameResult[]) => frames.map(({ status }) => status));
  private posesOf = memoizeLast((frames: readonly SpatialFrameResult[]) =>
    frames.map(({ T_world_sensor }) => T_world_sensor),
  );
  private rowsOf = memoizeLast(spatialRows);
  private columnsOf = memoizeLast(spatialColumns);
  private figuresOf = memoizeLast(spatialFigures);
  private timingOf = memoizeLast((frames: readonly number[], elapsed: number) => ({ frames, elapsed }));
  private marksOf = memoizeLast(
    (
      poses: SpatialMarks['poses'],
      reference: SpatialMarks['reference'],
      camera: SpatialMarks['camera'],
      until: number,
      selected: number | null,
    ): SpatialMarks => ({ poses, reference, camera, until, selected }),
  );
  private shown_generation = 0;
  private announced: unknown = null;

  override connectedCallback(): void {
    super.connectedCallback();
    window.addEventListener('hashchange', this.onHash);
    this.session.beginWith((facts) => this.initialSettings(facts));
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    window.removeEventListener('hashchange', this.onHash);
  }

  /** Takes files in, asked for at clock time `requested_at`. */
  add(files: Promise<SpatialFiles>, requested_at: number): Promise<void> {
    return this.session.add(files, requested_at);
  }

  clear(): void {
    this.session.clear();
  }

  removeReference(): void {
    this.session.removeReference();
  }

  /** What strategies are compared on. A run that is under way stops: they are to have the machine to themselves. */
  recordingToCompare(): GivenRecording | null {
    const { recording, phase } = this.session;
    if (!recording) return null;
    if (phase === 'running') this.session.stop();
    const { title, inputs, settings } = recording;
    return { title, inputs, settings: readingOf(settings) };
  }

  async filesToEvaluate(): Promise<GivenFiles | null> {
    const { session } = this;
    if (!session.snapshot || session.phase !== 'done') return null;
    return trajectoriesToEvaluate(session.snapshot.result, () => session.ask('map_ply'));
  }

  async runExport(id: string): Promise<void> {
    const { session } = this;
    const result = session.snapshot?.result;
    if (!result) return;
    this.is_exporting = true;
    try {
      download(
        await makeSpatialExport(id, {
          ask: (kind) => session.ask(kind),
          picture: () => this.map.picture(),
          errors: () => errorCsv(result, session.frame_ms),
          frame_names: result.frames.map(({ name }) => name),
        }),
      );
    } catch (error) {
      session.report(`The export failed: ${error instanceof Error ? error.message : error}`, 'Try again');
    } finally {
      this.is_exporting = false;
    }
  }

  protected override willUpdate(): void {
    const { session } = this;
    const frames = session.snapshot?.result.frames ?? NO_FRAMES;
    if (this.shown_generation !== session.generation) {
      this.shown_generation = session.generation;
      this.selected = null;
      this.until = null;
    }
    if (this.selected !== null && this.selected >= frames.length) this.selected = null;
    if (!TABS[this.layout].includes(this.tab)) this.tab = TABS[this.layout][0] ?? this.tab;
    // Without a selection the images are the first frame's, so that they stand still while the run goes on.
    const pictured = this.selected ?? (frames.length > 0 ? 0 : null);
    const { depth, color } = pictured === null ? { depth: null, color: null } : session.filesOf(pictured);
    this.loader.want(pictured, depth, color, session.snapshot?.result.depth_scale ?? DEPTH_SCALE);
  }

  protected override updated(): void {
    const { dataset, snapshot, phase } = this.session;
    const facts: ViewFacts = {
      title: dataset?.title ?? '',
      count: dataset ? plural(dataset.jobs.length, dataset.recording.kind === 'clouds' ? 'cloud' : 'frame') : '',
      reference: dataset?.reference_name ?? '',
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
    const result = snapshot?.result ?? null;
    const frames = result?.frames ?? NO_FRAMES;
    const is_empty = snapshot === null && (phase === 'empty' || phase === 'unavailable');
    const until = this.until ?? frames.length;
    return html`
      <div
        class="run spatial ${layout}"
        @frame-selected=${({ detail }: CustomEvent<number | null>) => this.select(detail)}
      >
        ${is_empty ? this.renderEmpty() : nothing} ${layout === 'narrow' ? nothing : this.renderFigures()}
        <main ?hidden=${is_empty}>
          ${layout === 'wide' ? html`<aside class="side left" aria-label="Settings">${this.renderSettings()}</aside>` : nothing}
          <div class="middle">
            <div class="map-area">
              <scanstitch-map3d
                .points=${session.points}
                .marks=${this.marksOf(
                  this.posesOf(frames),
                  result?.comparison?.reference ?? NO_REFERENCE,
                  result?.camera ?? null,
                  until,
                  this.selected,
                )}
                .names=${this.namesOf(frames)}
                .reference_name=${result?.comparison?.name ?? ''}
                .voxel_size=${result?.settings.map_voxel_size || 0.05}
                .has_colors=${session.points.colors.length > 0}
                .fit_key=${session.generation}
                .description=${this.mapWords(result)}
                .image=${this.selected !== null && this.loader.frame === this.selected ? this.loader.images.color : null}
                ?growing=${phase === 'running'}
                ?dark=${this.dark}
                @map-painted=${this.onPainted}
                @graphics-changed=${this.onGraphics}
              ></scanstitch-map3d>
              ${activity(session)} ${messages(session)}
            </div>
            <scanstitch-timeline
              .count=${frames.length}
              .until=${until}
              .statuses=${this.statusesOf(frames)}
              noun="frame"
              ?dark=${this.dark}
              @until-changed=${this.onUntil}
            ></scanstitch-timeline>
            ${layout === 'narrow' ? nothing : this.renderTable()}
          </div>
          ${this.renderSide()}
        </main>
        <div class="visually-hidden" role="status" aria-live="polite">
          ${session.announcement} ${this.graphics_words}
        </div>
      </div>
    `;
  }

  private renderFigures(): TemplateResult | typeof nothing {
    const { snapshot, points, frame_ms, elapsed_ms } = this.session;
    if (!snapshot || snapshot.result.frames.length === 0) return nothing;
    const timing = this.timingOf(frame_ms, elapsed_ms);
    const figures = this.figuresOf(snapshot.result, timing, points.positions.length / 3);
    return html`<scanstitch-headline .figures=${figures}></scanstitch-headline>`;
  }

  private renderTable(): TemplateResult {
    const result = this.session.snapshot?.result ?? null;
    return html`<scanstitch-frame-table
      .rows=${this.rowsOf(result, this.session.frame_ms)}
      .columns=${this.columnsOf(result?.comparison?.name ?? '', result?.camera !== null)}
      .colors=${this.colors()}
      .selected=${this.selected}
      noun="frame"
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

  private renderFrame(): TemplateResult {
    return html`<scanstitch-frame-panel
      .result=${this.session.snapshot?.result ?? null}
      .ms=${this.session.frame_ms}
      .colors=${this.colors()}
      .selected=${this.selected}
      .images=${this.loader.images}
      .pictured=${this.loader.frame}
      .sizes=${this.session.sizes}
      ?measurable=${this.session.phase === 'done' || this.session.phase === 'stopped'}
      @sizes-wanted=${() => this.session.measureSizes()}
    ></scanstitch-frame-panel>`;
  }

  private renderSide(): TemplateResult {
    if (this.layout === 'wide') return html`<aside class="side right" aria-label="Frame">${this.renderFrame()}</aside>`;
    const panels: Record<Tab, () => TemplateResult | typeof nothing> = {
      figures: () => this.renderFigures(),
      table: () => this.renderTable(),
      frame: () => this.renderFrame(),
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
      <section aria-label="No frames yet">
        ${icon('open', 32)}
        <h2>Drop depth images here</h2>
        <p>
          A folder or a zip with numbered depth images, their colour images beside them, or clouds as PLY or PCD. The
          true path and the camera may lie there too.
        </p>
        <p class="actions">
          <button class="primary" @click=${() => want('folder')}>Choose a folder</button>
          <button @click=${() => want('files')}>Choose files</button>
          <button @click=${() => want('apartment')}>Show the apartment</button>
        </p>
        <p class="muted">Everything is computed in this tab. Nothing leaves your machine.</p>
      </section>
    </div>`;
  }

  /** One colour for each frame there will be, also while only some are placed. */
  private colors(): readonly Rgb[] {
    const { snapshot, dataset } = this.session;
    return this.colorsOf(Math.max(snapshot?.result.frames.length ?? 0, dataset?.jobs.length ?? 0), this.dark);
  }

  private mapWords(result: SpatialResult | null): string {
    const { points } = this.session;
    if (!result || result.frames.length === 0) return 'The map in space: nothing yet.';
    const { frames, comparison } = result;
    const truth = comparison ? ` Mean distance to the true path ${formatLength(comparison.mean)}.` : '';
    const chosen = this.selected === null ? '' : ` ${baseName(frames[this.selected]?.name ?? '')} is selected.`;
    const length = frames.reduce((sum, { T_world_sensor: { x, y, z } }, i) => {
      const before = frames[i - 1]?.T_world_sensor;
      return before ? sum + Math.hypot(x - before.x, y - before.y, z - before.z) : sum;
    }, 0);
    return `The map in space: ${plural(points.positions.length / 3, 'point')} from ${this.until ?? frames.length} of ${plural(frames.length, 'frame')} along a path of ${formatLength(length)}.${truth}${chosen}`;
  }

  private select(frame: number | null): void {
    this.selected = frame;
    if (frame !== null && this.until !== null && frame >= this.until) this.until = frame + 1;
  }

  private initialSettings(facts: SpatialFacts): SpatialSettings {
    const fragment = this.remember_settings ? location.hash : '';
    return settingsToBegin('spatial', facts, this.preset, this.initial_settings, fragment);
  }

  private onSettings({ detail }: CustomEvent<SpatialSettings>): void {
    this.session.configure(detail);
    const { facts } = this.session;
    if (this.remember_settings && facts) rememberSettings('spatial', facts, detail);
  }

  private onHash = (): void => {
    const { facts } = this.session;
    if (this.remember_settings && facts && ownerOf(location.hash) === 'spatial') {
      this.session.configure(this.initialSettings(facts));
    }
  };

  private onUntil({ detail }: CustomEvent<number>): void {
    const count = this.session.snapshot?.result.frames.length ?? 0;
    this.until = detail >= count ? null : detail;
    this.selected = detail - 1;
  }

  private onGraphics({ detail }: CustomEvent<'lost' | 'restored' | 'unavailable'>): void {
    this.graphics_words = {
      lost: 'The graphics card dropped the map; it is drawn again.',
      restored: 'The map is drawn again.',
      unavailable: 'This browser gives no 3D graphics.',
    }[detail];
  }

  private onPainted(): void {
    const { session } = this;
    const { snapshot } = session;
    if (session.phase !== 'done' || !snapshot || this.announced === snapshot) return;
    this.announced = snapshot;
    const timing = { total: session.frame_ms.reduce((a, b) => a + b, 0), frames: [...session.frame_ms] };
    const elapsed_ms = performance.now() - session.requested_at;
    const detail = { result: snapshot.result, timing, elapsed_ms };
    this.dispatchEvent(new CustomEvent('scanstitch-stitched', { detail, bubbles: true, composed: true }));
  }

  static override styles = [shared, layout_styles];
}

/** How frames are read, without what is only of a run's own registration. */
function readingOf(settings: SpatialSettings | null): Partial<SpatialSettings> {
  if (!settings) return {};
  const { fx, fy, cx, cy, field_of_view, depth_scale, quantisation, min_range, max_range } = settings;
  const { reference_quaternions, reference_axes, reference_direction } = settings;
  const reading = { fx, fy, cx, cy, field_of_view, depth_scale, quantisation, min_range, max_range };
  return { ...reading, reference_quaternions, reference_axes, reference_direction };
}

// The same empty list every time: a new one would be a change.
const NO_REFERENCE: SpatialMarks['reference'] = [];

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-spatial': ScanstitchSpatial;
  }
}
