import { html, nothing, type TemplateResult } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import './frame-panel.js';
import './map3d.js';
import './reading-card.js';
import './reading-dialog.js';
import type { Measure } from '../run/before-after.js';
import { Fetched } from '../run/fetched.js';
import type { GivenClouds } from '../run/given-clouds.js';
import type { MenuItem } from '../components/menu.js';
import type { ScanstitchMapPoints, ScanstitchResult } from '../components/host-events.js';
import { activityBox, emptyView } from '../run/run-parts.js';
import { comparedWith, trajectoriesToEvaluate } from '../run/to-evaluate.js';
import type { GivenFiles, GivenRecording, Loaded, RunKind } from '../run/run-kind.js';
import { RunView } from '../run/run-view.js';
import type {
  Assumption,
  SpatialFrameResult,
  SpatialResult,
  SpatialSettings,
  SpatialSnapshot,
  Suggestion,
  TopView,
} from '../engine/spatial-protocol.js';
import type { Download } from '../export/download.js';
import { baseName, formatCount, formatDuration, formatLength, plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { clouds } from './clouds.js';
import { makeSpatialExport, SPATIAL_EXPORTS, surfaceFormat, withSurface } from './exports.js';
import { FrameImageLoader } from './frame-images.js';
import { spatialFigures } from './headline.js';
import type { ScanstitchMap3d } from './map3d.js';
import type { BeforePath, SpatialMarks } from './path-marks.js';
import { openAssumption } from './reading.js';
import type { ReadingChoice } from './reading-card.js';
import type { Readings, ScanstitchReadingDialog } from './reading-dialog.js';
import { errorCsv, spatialColumns, spatialRows } from './rows.js';
import { SpatialSession } from './session.js';
import { RunSurface } from './surface.js';
import { type SurfaceChange, surfaceWords } from './surface-bar.js';

const SPATIAL: RunKind = {
  kind: 'spatial',
  noun: 'frame',
  exports: SPATIAL_EXPORTS,
  panels: { figures: 'Result', table: 'Frames', details: 'Frame', settings: 'Settings' },
  order: ['figures', 'details', 'table', 'settings'],
};

const NO_FRAMES: readonly SpatialFrameResult[] = [];
/** Raw values to a metre, before the engine has said. */
const DEPTH_SCALE = 1000;

/**
 * A run of depth images or clouds in space: the map in 3D, each frame's images and result, the figures of the whole.
 */
@customElement('scanstitch-spatial')
export class ScanstitchSpatial extends RunView<SpatialSettings, SpatialSnapshot, SpatialSession, BeforePath> {
  @query('scanstitch-map3d') private map!: ScanstitchMap3d;
  @query('scanstitch-reading-dialog') private dialog!: ScanstitchReadingDialog;
  /** The question that was answered or dismissed. */
  @state() private dismissed = '';

  override session = this.newSession();
  override readonly of = SPATIAL;
  /** The first depth image from above. */
  private topView = new Fetched<TopView | null>(this, null);
  private loader = new FrameImageLoader(this, (file) => this.session.depthPicture(file));
  private runSurface = new RunSurface(this);
  private namesOf = memoizeLast((frames: readonly SpatialFrameResult[]) => frames.map(({ name }) => name));
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

  protected override newSession(): SpatialSession {
    return new SpatialSession(this);
  }

  protected override isSample(): boolean {
    return this.session.dataset?.origin === 'sample';
  }

  override removeReference(): void {
    this.session.removeReference();
  }

  /** What strategies are compared on. A run that is under way stops: they are to have the machine to themselves. */
  override recordingToCompare(): GivenRecording | null {
    const { recording, phase } = this.session;
    if (!recording) return null;
    if (phase === 'running') this.session.stop();
    const { title, inputs, settings } = recording;
    return { title, inputs, settings: readingOf(settings) };
  }

  override async cloudsToRegister(frame: number | null): Promise<GivenClouds | null> {
    const { dataset, snapshot, points } = this.session;
    const mapBefore = (before: number): Promise<Float64Array> => this.session.ask('map_before', before);
    return dataset && snapshot && clouds(dataset, snapshot.result, points, frame ?? this.selected, mapBefore);
  }

  override async filesToEvaluate(): Promise<GivenFiles | null> {
    const { session } = this;
    if (!session.snapshot || session.phase !== 'done') return null;
    const { frames, comparison } = session.snapshot.result;
    const placed = frames.flatMap(({ index, time, status, T_world_sensor: pose }, at) =>
      status === 'lost' ? [] : [{ index, time, pose, reference: comparison?.reference[at] ?? null }],
    );
    return trajectoriesToEvaluate(placed, comparedWith(comparison), () => session.ask('map_ply'));
  }

  override get map_points(): ScanstitchMapPoints | null {
    const { snapshot, points } = this.session;
    return snapshot && { dimensions: 3, positions: points.positions, colors: points.colors };
  }

  protected override outcomeOf({ result }: SpatialSnapshot): ScanstitchResult {
    const { frameMs } = this.session;
    return { kind: 'spatial', result, timing: { total: frameMs.reduce((a, b) => a + b, 0), frames: [...frameMs] } };
  }

  protected override measures({ result }: SpatialSnapshot): readonly Measure[] {
    const { frames, comparison } = result;
    const { points, frameMs } = this.session;
    const total = frameMs.reduce((sum, ms) => sum + ms, 0);
    return [
      { label: 'Good frames', value: frames.filter(({ status }) => status === 'good').length, format: formatCount },
      { label: 'Distance to ground truth', value: comparison?.mean ?? null, format: formatLength },
      { label: 'Points of the map', value: points.positions.length / 3, format: formatCount },
      { label: 'Time a frame', value: total / Math.max(frameMs.length, 1), format: formatDuration },
    ];
  }

  protected override overlayOf({ result }: SpatialSnapshot): BeforePath {
    return { poses: this.posesOf(result.frames) };
  }

  override get exports(): readonly MenuItem[] {
    const { snapshot, points } = this.session;
    return withSurface(super.exports, Boolean(snapshot?.result.camera) && points.colors.length > 0);
  }

  /** What of the surface is stopped or fails has been told. */
  override async runExport(id: string): Promise<void> {
    if (surfaceFormat(id) && !(await this.runSurface.make(this.session))) return;
    return super.runExport(id);
  }

  protected override makeExport(id: string, { result }: SpatialSnapshot): Promise<Download> {
    const { session } = this;
    return makeSpatialExport(id, {
      ask: (kind) => session.ask(kind),
      surface: (format) => this.runSurface.file(session, format),
      picture: () => this.map.picture(),
      turntable: () => this.map.turntable(),
      floorGrid: async () => session.floorGrid(await this.map.floorGridWanted()),
      splats: async () => (await import('./splats.js')).splatsOf(session, result),
      errors: () => errorCsv(result, session.frameMs),
      frameNames: result.frames.map(({ name }) => name),
      report: this.reportSource(result, session.points.positions),
    });
  }

  protected override openedFiles(): string[] {
    return [...(this.session.dataset?.recording.files.keys() ?? [])];
  }

  protected override loaded({ dataset } = this.session): Loaded {
    const num_frames = dataset?.jobs.length ?? 0;
    return {
      title: dataset?.title ?? '',
      count: dataset ? plural(num_frames, dataset.recording.kind === 'clouds' ? 'cloud' : 'frame') : '',
      reference: dataset?.referenceName ?? '',
      num_frames,
    };
  }

  private readonly floorGrid: ScanstitchMap3d['floorGrid'] = (wanted) => this.session.floorGrid(wanted);

  protected override willUpdate(changed: Map<PropertyKey, unknown>): void {
    super.willUpdate(changed);
    const { session, num_frames } = this;
    this.runSurface.follow(session);
    // Without a selection the images are those of the first frame, so that they do not change during the run.
    const pictured = this.selected ?? (num_frames > 0 ? 0 : null);
    const { depth, color } = pictured === null ? { depth: null, color: null } : session.filesOf(pictured);
    this.loader.want(pictured, depth, color, session.snapshot?.result.depth_scale ?? DEPTH_SCALE);
    this.wantTopView();
  }

  protected override renderMap(): TemplateResult {
    const { session } = this;
    const { snapshot, phase } = session;
    const result = snapshot?.result ?? null;
    const frames = result?.frames ?? NO_FRAMES;
    return html`<scanstitch-map3d
      .points=${session.points}
      .marks=${this.marksOf(
        this.posesOf(frames),
        result?.comparison?.reference ?? NO_REFERENCE,
        result?.camera ?? null,
        this.until ?? frames.length,
        this.selected,
      )}
      .runSurface=${this.runSurface.stateOf(session)}
      .names=${this.namesOf(frames)}
      .referenceName=${result?.comparison?.name ?? ''}
      .voxel_size=${result?.settings.map_voxel_size || 0.05}
      .hasColors=${session.points.colors.length > 0}
      .pathBefore=${this.overlay}
      .fitKey=${this.fitKey}
      .floorGrid=${this.floorGrid}
      .description=${this.mapWords(result)}
      .image=${this.selected !== null && this.loader.frame === this.selected ? this.loader.images.color : null}
      ?growing=${phase === 'running'}
      ?bare=${this.controls === 'none'}
      ?dark=${this.dark}
      @surface-wanted=${({ detail }: CustomEvent<number | undefined>) => this.runSurface.make(session, detail ?? undefined)}
      @surface-changed=${({ detail }: CustomEvent<SurfaceChange>) => this.runSurface.change(detail)}
      @map-painted=${() => this.onPainted()}
      @graphics-changed=${this.onGraphics}
    ></scanstitch-map3d>`;
  }

  protected override renderActivity(): TemplateResult | typeof nothing {
    const { progress, activity } = this.runSurface;
    if (progress === null) return super.renderActivity();
    return activityBox(activity, progress, 'Stop', () => this.runSurface.stop());
  }

  protected override renderFigures(): TemplateResult | typeof nothing {
    const { snapshot, points, frameMs, elapsed_ms } = this.session;
    if (!snapshot || snapshot.result.frames.length === 0) return nothing;
    const timing = this.timingOf(frameMs, elapsed_ms);
    const figures = this.figuresOf(snapshot.result, timing, points.positions.length / 3, this.loaded().num_frames);
    return html`<scanstitch-headline
      part="figures"
      .figures=${figures}
      ?compact=${this.isCompact}
      @figure-action=${() => this.dialog.show()}
    ></scanstitch-headline>`;
  }

  /** What the ground truth suggests, or else what the data leave open; null where that has been answered. */
  private question(): { suggestion: Suggestion | null; open: Assumption | null; key: string } | null {
    const { snapshot, dataset, phase } = this.session;
    if (!snapshot || !dataset || snapshot.result.frames.length === 0) return null;
    const suggestion = phase === 'done' ? (snapshot.result.suggestion ?? null) : null;
    const open = suggestion ? null : openAssumption(snapshot.result.assumptions);
    const key = `${dataset.title}, ${suggestion?.text ?? ''}, ${open?.likely.join() ?? ''}`;
    return (suggestion || open) && key !== this.dismissed ? { suggestion, open, key } : null;
  }

  protected override renderQuestion(): TemplateResult {
    const asked = this.question();
    const { result } = this.session.snapshot ?? {};
    const card = asked
      ? html`<scanstitch-reading-card
          .suggestion=${asked.suggestion}
          .question=${asked.open}
          .view=${this.topView.value}
          ?dark=${this.dark}
          @reading-chosen=${({ detail }: CustomEvent<ReadingChoice>) => this.onReading(detail, asked.key)}
        ></scanstitch-reading-card>`
      : nothing;
    return html`${card}<scanstitch-reading-dialog
        .assumptions=${result?.assumptions ?? NO_ASSUMPTIONS}
        .camera=${result?.camera ?? null}
        @readings-chosen=${({ detail }: CustomEvent<Readings>) => this.useReadings(detail.values)}
      ></scanstitch-reading-dialog>`;
  }

  private onReading(chosen: ReadingChoice, key: string): void {
    if (chosen.choice === 'more') {
      this.dialog.show();
      return;
    }
    this.dismissed = key;
    if (chosen.choice === 'value') this.useReadings([chosen]);
  }

  private useReadings(values: Readings['values']): void {
    const { settings } = this.session;
    if (!settings) return;
    const chosen = Object.fromEntries(values.map(({ setting, value }) => [setting, value]));
    this.applySettings({ ...settings, ...chosen });
  }

  /** Fetches the picture for a question, once for a recording. */
  private wantTopView(): void {
    const camera = this.session.snapshot?.result.camera;
    const key = this.session.dataset?.jobs[0]?.file ?? null;
    if (camera && this.question()?.open) this.topView.want(key, [], () => this.session.topView(camera.fx));
  }

  protected override renderTable(): TemplateResult {
    const result = this.session.snapshot?.result ?? null;
    return html`<scanstitch-frame-table
      part="table"
      .rows=${this.rowsOf(result, this.session.frameMs)}
      .columns=${this.columnsOf(result?.comparison?.name ?? '', result?.camera !== null)}
      .colors=${this.colors()}
      .selected=${this.selected}
      noun="frame"
    ></scanstitch-frame-table>`;
  }

  protected override renderDetails(): TemplateResult {
    return html`<scanstitch-frame-panel
      .result=${this.session.snapshot?.result ?? null}
      .ms=${this.session.frameMs}
      .colors=${this.colors()}
      .selected=${this.selected}
      .images=${this.loader.images}
      .pictured=${this.loader.frame}
      .sizes=${this.session.sizes}
      ?measurable=${this.session.phase === 'done' || this.session.phase === 'stopped'}
      @sizes-wanted=${() => this.session.measureSizes()}
    ></scanstitch-frame-panel>`;
  }

  protected override renderEmpty(): TemplateResult {
    return emptyView(
      {
        title: 'Drop depth images here',
        label: 'No frames yet',
        about:
          'A folder or a zip with numbered depth images and their colour images, or point clouds as PLY or PCD. A ground ' +
          'truth trajectory and a camera file may lie beside them.',
        choices: [
          { id: 'folder', label: 'Choose a folder' },
          { id: 'files', label: 'Choose files' },
          { id: 'apartment', label: 'Show the apartment' },
        ],
      },
      this.session,
      (id) => this.want(id),
    );
  }

  private mapWords(result: SpatialResult | null): string {
    const { points } = this.session;
    if (!result || result.frames.length === 0) return 'The map in space: nothing yet.';
    const { frames, comparison } = result;
    const distance = comparison ? ` Mean distance to the ground truth ${formatLength(comparison.mean)}.` : '';
    const chosen = this.selected === null ? '' : ` ${baseName(frames[this.selected]?.name ?? '')} is selected.`;
    const surface = surfaceWords(this.runSurface.stateOf(this.session));
    const length = frames.reduce((sum, { T_world_sensor: { x, y, z } }, i) => {
      const before = frames[i - 1]?.T_world_sensor;
      return before ? sum + Math.hypot(x - before.x, y - before.y, z - before.z) : sum;
    }, 0);
    return `The map in space: ${plural(points.positions.length / 3, 'point')} from ${this.until ?? frames.length} of ${plural(frames.length, 'frame')} along a path of ${formatLength(length)}.${distance}${chosen}${surface && ` Its surface: ${surface}.`}`;
  }

  private onGraphics({ detail }: CustomEvent<'lost' | 'restored' | 'unavailable'>): void {
    this.session.announce(
      {
        lost: 'The graphics context was lost; the map is being redrawn.',
        restored: 'The map has been redrawn.',
        unavailable: 'This browser does not support 3D graphics (WebGL 2).',
      }[detail],
    );
  }
}

/** How frames are read, without what is only of a run's own registration. */
function readingOf(settings: SpatialSettings | null): Partial<SpatialSettings> {
  if (!settings) return {};
  const { fx, fy, cx, cy, field_of_view, depth_scale, depth_values, quantisation, min_range, max_range } = settings;
  const { reference_quaternions, reference_axes, reference_direction } = settings;
  const reading = { fx, fy, cx, cy, field_of_view, depth_scale, depth_values, quantisation, min_range, max_range };
  return { ...reading, reference_quaternions, reference_axes, reference_direction };
}

// The same empty list every time: a new one would be a change.
const NO_REFERENCE: SpatialMarks['reference'] = [];
const NO_ASSUMPTIONS: readonly Assumption[] = [];
