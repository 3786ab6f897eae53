import { html, nothing, type TemplateResult } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import '../drawing/map-view.js';
import type { ScanstitchMap } from '../drawing/map-view.js';
import type { Measure } from '../run/before-after.js';
import type { GivenClouds } from '../run/given-clouds.js';
import type { ScanstitchMapPoints, ScanstitchResult } from '../components/host-events.js';
import { Fetched } from '../run/fetched.js';
import { emptyView } from '../run/run-parts.js';
import type { GivenFiles, GivenScans, Loaded, RunKind } from '../run/run-kind.js';
import { RunView } from '../run/run-view.js';
import { welcome, welcomeStyles } from '../run/welcome.js';
import type { FrameResult, IterationRecord, PlanarPoint, Settings, Snapshot } from '../engine/protocol.js';
import { type Download, EXPORTS, type ExportItem } from '../export/download.js';
import { baseName, formatCount, formatDuration, formatLength, plural } from '../views/format.js';
import { headlineFigures } from '../views/headline.js';
import type { BeforeMap, MapMarks, Status } from '../views/map-painter.js';
import { certainPieces, type Piece, pieceColors, uncertainLinks } from '../views/pieces.js';
import type { ShownPairs } from '../views/longest-pairs.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { Rgb } from '../views/palette.js';
import type { OccupancyPictures } from '../views/occupancy-picture.js';
import { MendSwitch } from './mend-switch.js';
import type { PlanarPanels } from './panels.js';
import { PlanarSession } from './session.js';

const PLANAR: RunKind = {
  kind: 'planar',
  noun: 'scan',
  exports: EXPORTS,
  panels: { figures: 'Result', table: 'Scans', details: 'Details', settings: 'Settings' },
  order: ['figures', 'table', 'details', 'settings'],
};

// The same empty lists every time: a new one would be a change.
const NO_FRAMES: readonly FrameResult[] = [];
const NO_REFERENCE: readonly (PlanarPoint | null)[] = [];

/**
 * A run of laser scans in the plane: the map, what came out in figures, the table, the settings, and the registration of
 * each scan in detail.
 */
@customElement('scanstitch-planar')
export class ScanstitchPlanar extends RunView<Settings, Snapshot, PlanarSession, BeforeMap> {
  @state() private pairsShown: ShownPairs = 'none';
  @state() private isWelcomeClosed = false;
  @state() private wantsOccupancy = false;
  /** Null until one is unfolded. */
  @state() private panels: PlanarPanels | null = null;
  @query('scanstitch-map') private map!: ScanstitchMap;

  override session = this.newSession();
  override readonly of = PLANAR;
  /** All pairs of the selected scan; null while they are not wanted. */
  private pairs = new Fetched<Float32Array | null>(this, null);
  /** Iterations of the selected scan. */
  private history = new Fetched<readonly IterationRecord[]>(this, []);
  private pictures = new Fetched<OccupancyPictures | null>(this, null);
  private readonly mendSwitch = new MendSwitch(this);
  private namesOf = memoizeLast((frames: readonly FrameResult[]) => frames.map(({ name }) => name));
  private figuresOf = memoizeLast(headlineFigures);
  private marksOf = memoizeLast(mapMarks);
  private piecesOf = memoizeLast(certainPieces);
  private pieceColorsOf = memoizeLast(pieceColors);

  protected override newSession(): PlanarSession {
    const session = new PlanarSession(this);
    session.address = this.address; // before the next update, which comes too late for a new session
    return session;
  }

  protected override isSample(): boolean {
    return this.session.dataset?.origin === 'sample';
  }

  override removeReference(): void {
    const reference = this.session.dataset?.reference;
    if (reference) this.session.remove(reference.name);
  }

  /** Null where nothing but the sample is open. */
  scansToLocate(): GivenScans | null {
    const { dataset, settings } = this.session;
    return dataset && !this.isSample() ? { title: dataset.title, inputs: dataset, settings: settings ?? {} } : null;
  }

  override get isToCompare(): boolean {
    return super.isToCompare && !this.isSample();
  }

  override recordingToCompare(): GivenScans | null {
    return this.session.snapshot && this.scansToLocate();
  }

  override async cloudsToRegister(frame: number | null): Promise<GivenClouds | null> {
    const { dataset, snapshot, points, settings } = this.session;
    if (!dataset || !snapshot || !settings) return null;
    const sample = this.isSample() ? 'sample' : '';
    const { clouds, cloudsAsRun, turnsOf } = await import('./clouds.js');
    const { frames } = snapshot.result;
    const given = clouds({ settings, dataset, frames, points }, frame ?? this.selected, sample);
    const pair = frame === null ? null : await this.session.ask('scan_to_map', frame);
    if (!given) return null;
    return { ...(pair ? cloudsAsRun(given, pair) : given), turns: turnsOf(given, pair, frames, this.map.turned) };
  }

  override async filesToEvaluate(): Promise<GivenFiles | null> {
    const { session } = this;
    if (!session.snapshot || session.phase !== 'done') return null;
    const { frames, comparison } = session.snapshot.result;
    const { comparedWith, placedInPlane, trajectoriesToEvaluate } = await import('../run/to-evaluate.js');
    const placed = placedInPlane(frames, comparison?.reference);
    return trajectoriesToEvaluate(placed, comparedWith(comparison), () => session.ask('map_ply'));
  }

  override get map_points(): ScanstitchMapPoints | null {
    const { snapshot, points } = this.session;
    return snapshot && { dimensions: 2, positions: points.points, colors: new Uint8Array() };
  }

  protected override outcomeOf({ result, timing }: Snapshot): ScanstitchResult {
    return { kind: 'planar', result, timing };
  }

  protected override measures({ result, timing }: Snapshot): readonly Measure[] {
    const { frames, sharpness, comparison } = result;
    const count = (wanted: Status): number => frames.filter(({ status }) => status === wanted).length;
    return [
      { label: 'Good scans', value: count('good'), format: formatCount },
      { label: 'Sharpness', value: sharpness?.mean_residual ?? null, format: formatLength },
      { label: 'Distance to ground truth', value: comparison?.mean ?? null, format: formatLength },
      { label: 'Time', value: timing.total, format: formatDuration },
    ];
  }

  protected override overlayOf({ result }: Snapshot): BeforeMap {
    const { points } = this.session;
    return { points, poses: result.frames.map(({ T_world_sensor }) => T_world_sensor) };
  }

  protected override async makeExport(id: string, { result }: Snapshot): Promise<Download> {
    const { makeExport } = await import('../export/exports.js');
    return makeExport(id as ExportItem['id'], {
      ask: (kind) => this.session.ask(kind),
      picture: () => this.map.picture(),
      frameNames: result.frames.map(({ name }) => name),
      points: this.session.points,
      opened: this.session,
      report: this.reportSource(result, this.session.points.points, this.map.turned),
    });
  }

  protected override openedFiles(): string[] {
    const { scans = [], reference, odometry } = this.session.dataset ?? {};
    return [...scans, reference, odometry].flatMap((file) => file?.name ?? []);
  }

  protected override loaded(session = this.session): Loaded {
    const { dataset } = session;
    const num_frames = Math.max(dataset?.scans.length ?? 0, session.num_scans);
    return {
      title: dataset?.title ?? '',
      count: dataset ? plural(Math.max(this.num_frames, num_frames), 'scan') : '',
      reference: dataset?.reference?.name ?? '',
      num_frames,
    };
  }

  protected override willUpdate(changed: Map<PropertyKey, unknown>): void {
    super.willUpdate(changed);
    this.session.address = this.address;
    const { session, selected, wantsOccupancy } = this;
    const { snapshot, phase } = session;
    this.mendSwitch.follow();
    const scan = phase === 'crashed' ? null : selected;
    this.history.want(selected, [snapshot], scan === null ? null : () => session.ask('history', scan));
    const hasPairs = this.pairsShown !== 'none';
    const areWanted = hasPairs && scan !== null;
    this.pairs.want(hasPairs, [snapshot, selected], areWanted ? () => session.ask('correspondences', scan) : null);
    const isOnGrid = this.mendSwitch.mending?.layer.showsGrid === true;
    const wantsGrid = wantsOccupancy || isOnGrid;
    const gridOf = wantsGrid && this.isOver ? snapshot : null;
    // While a step is taken, the grid before it is better than none.
    if (gridOf || !isOnGrid) this.pictures.want(wantsGrid, [gridOf], gridOf && (() => this.picturesOf(session)));
  }

  private async picturesOf(session: PlanarSession): Promise<OccupancyPictures> {
    const grid = await session.ask('occupancy_grid');
    return (await import('../views/occupancy-picture.js')).occupancyPictures(grid);
  }

  /** Whether there is a result that no frame will be added to. */
  private get isOver(): boolean {
    return this.session.phase === 'done' || this.session.phase === 'stopped';
  }

  /** By time where the map is one piece, else by piece. */
  protected override colors(): readonly Rgb[] {
    const pieces = this.pieces();
    return pieces.length > 0 ? this.pieceColorsOf(pieces, this.num_frames, this.dark) : super.colors();
  }

  protected override trackColors(): readonly Rgb[] | null {
    return this.pieces().length > 0 ? this.colors() : null;
  }

  private pieces(): readonly Piece[] {
    return this.piecesOf(this.session.snapshot?.result.frames ?? NO_FRAMES, this.dark);
  }

  protected override renderMap(): TemplateResult {
    const { session } = this;
    const pairs = this.pairs.value;
    const result = session.snapshot?.result;
    const frames = result?.frames ?? NO_FRAMES;
    return html`<scanstitch-map
      .points=${session.points}
      .marks=${this.marksOf(
        frames,
        session.lookDirection,
        result?.comparison?.reference ?? NO_REFERENCE,
        this.until ?? frames.length,
        this.selected,
        this.hovered,
        pairs && this.panels && this.pairsShown === 'longest' ? this.panels.longestOf(pairs).drawn : pairs,
      )}
      .names=${this.namesOf(frames)}
      .colors=${this.colors()}
      .pieces=${this.pieces()}
      .map_before=${this.overlay}
      .referenceName=${result?.comparison?.name ?? ''}
      .fitKey=${this.fitKey}
      .hasOccupancy=${this.isOver}
      .occupancy=${this.pictures.value?.(this.dark) ?? null}
      @occupancy-wanted=${({ detail }: CustomEvent<boolean>) => {
        this.wantsOccupancy = detail;
      }}
      .layer=${this.mendSwitch.mending?.layer ?? null}
      .extras=${this.mendSwitch.extras}
      ?canMend=${session.phase === 'done' || this.mendSwitch.mending !== null}
      @mending-wanted=${this.mendSwitch.toggle}
      .description=${this.mapWords()}
      ?bare=${this.controls === 'none'}
      ?dark=${this.dark}
      @map-painted=${() => this.onPainted()}
    ></scanstitch-map>`;
  }

  /** Beside the map. */
  protected override renderQuestion(): TemplateResult | typeof nothing {
    return this.mendSwitch.panel(this.selected);
  }

  /** The dialog about the columns of a table; its code is loaded with the first one. */
  private renderTableImport(): TemplateResult | typeof nothing {
    const { tables } = this.session;
    if (!tables?.request) return nothing;
    void import('./table-import.js');
    return html`<scanstitch-table-import
      .request=${tables.request}
      ?dark=${this.dark}
      @table-chosen=${({ detail }: CustomEvent<string>) => tables.answer(detail)}
      @table-cancelled=${() => tables.answer(null)}
    ></scanstitch-table-import>`;
  }

  protected override renderFigures(): TemplateResult | typeof nothing {
    const { snapshot, phase, numUnread } = this.session;
    if (!snapshot || snapshot.result.frames.length === 0) return nothing;
    const isGrowing = phase === 'running';
    const { num_frames } = this.loaded();
    const figures = this.figuresOf(snapshot.result, snapshot.timing.total, isGrowing, num_frames, numUnread);
    return html`<scanstitch-headline
      part="figures"
      .figures=${figures}
      ?compact=${this.isCompact}
    ></scanstitch-headline>`;
  }

  protected override loadPanels(): void {
    if (this.panels) return;
    void import('./panels.js').then(({ PlanarPanels }) => {
      this.panels ??= new PlanarPanels();
    });
  }

  protected override renderTable(): TemplateResult | typeof nothing {
    return this.panels?.table(this.session.snapshot, this.colors(), this.selected) ?? nothing;
  }

  protected override renderDetails(): TemplateResult | typeof nothing {
    const { session, panels, selected } = this;
    if (!panels) return nothing;
    if (selected === null) {
      return panels.overview(session.snapshot, this.colors(), () => {
        this.pairsShown = 'longest';
      });
    }
    const longest = this.pairs.value && panels.longestOf(this.pairs.value);
    return panels.why(
      session.snapshot,
      this.colors(),
      {
        selected,
        longest,
        history: this.history.value,
        pairsShown: this.pairsShown,
        isRemovable: (session.dataset?.scans.length ?? 0) > 1,
      },
      {
        showPairs: (which) => {
          this.pairsShown = which;
        },
        remove: (name) => session.remove(name),
      },
    );
  }

  /** Above the sample that the page opens first; not shown for scans that a host page gives. */
  protected override renderIntroduction(): TemplateResult | typeof nothing {
    const { tables, dataset } = this.session;
    const table = tables?.shown(dataset);
    const change = (): void => void tables?.change(dataset);
    return html`${this.renderTableImport()}${table ? tableLine(table.format, change) : this.renderWelcome()}`;
  }

  private renderWelcome(): TemplateResult | typeof nothing {
    if (this.isWelcomeClosed || this.controls !== 'full' || !this.isSample()) return nothing;
    return welcome({
      want: (id) => this.want(id),
      copy: (text) => void this.session.copy(text, 'The lines were copied.'),
      close: () => {
        this.isWelcomeClosed = true;
      },
    });
  }

  protected override renderEmpty(): TemplateResult {
    const view = emptyView(
      {
        title: 'Drop laser scans, depth images or point clouds here',
        label: 'No scans yet',
        about:
          'Scanstitch registers them and shows the path of the sensor and the map. Files, a folder, a zip or a ROS bag: ' +
          'planar scans as numbered PLY files or as a log, depth images with or without colour, clouds as ' +
          'PLY or PCD. Add a ground truth trajectory to see the error.',
        choices: [
          { id: 'files', label: 'Choose files' },
          { id: 'folder', label: 'Choose a folder' },
          { id: 'sample', label: 'Show the sample' },
        ],
      },
      this.session,
      (id) => this.want(id),
    );
    return html`${this.renderTableImport()}${view}`;
  }

  private mapWords(): string {
    const { snapshot, points } = this.session;
    if (!snapshot) return 'No scans yet.';
    const { frames } = snapshot.result;
    const shown = this.until ?? frames.length;
    const chosen = this.selected === null ? '' : ` ${baseName(frames[this.selected]?.name ?? '')} is selected.`;
    return `${shown} of ${plural(frames.length, 'scan')}, ${plural(points.points.length / 2, 'point')}.${chosen}`;
  }

  static override styles = [...RunView.styles, welcomeStyles];
}

/** How a table is read, and the way to change that. */
function tableLine(format: string, change: () => void): TemplateResult {
  return html`<section class="bar" aria-label="Table">
    <p>Read as a table: <code>${format}</code></p>
    <button @click=${change}>Change the columns</button>
  </section>`;
}

function mapMarks(
  frames: readonly FrameResult[],
  lookDirection: number,
  reference: readonly (PlanarPoint | null)[],
  until: number,
  selected: number | null,
  hovered: number | null,
  pairs: Float32Array | null,
): MapMarks {
  return {
    poses: frames.map(({ T_world_sensor }) => T_world_sensor),
    statuses: frames.map(({ status }) => status),
    uncertainLinks: uncertainLinks(frames),
    lookDirection,
    until,
    selected,
    hovered,
    reference: reference.filter((point) => point !== null),
    pairs,
    undetermined: (selected === null ? null : frames[selected]?.undetermined) ?? null,
  };
}
