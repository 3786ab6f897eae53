import { html, nothing, type TemplateResult } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import '../components/map-view.js';
import type { ScanstitchMap } from '../components/map-view.js';
import type { Measure } from '../components/before-after.js';
import type { GivenClouds } from '../components/given-clouds.js';
import type { ScanstitchMapPoints, ScanstitchResult } from '../components/host-events.js';
import { emptyView } from '../components/run-parts.js';
import type { GivenFiles, Loaded, RunKind } from '../components/run-kind.js';
import { RunView } from '../components/run-view.js';
import { comparedWith, trajectoriesToEvaluate } from '../components/to-evaluate.js';
import { welcome, welcomeStyles } from '../components/welcome.js';
import type { FrameResult, IterationRecord, PlanarPoint, PlanarPose, Settings, Snapshot } from '../engine/protocol.js';
import type { SpatialPose } from '../engine/spatial-protocol.js';
import { type Download, EXPORTS, type ExportItem } from '../export/download.js';
import { baseName, formatCount, formatDuration, formatLength, plural } from '../views/format.js';
import { frameColumns } from '../views/frame-columns.js';
import { frameRows } from '../views/frame-rows.js';
import { headlineFigures } from '../views/headline.js';
import type { BeforeMap, MapMarks, Status } from '../views/map-painter.js';
import { certainPieces, type Piece, pieceColors, uncertainLinks } from '../views/pieces.js';
import { longestPairs, type ShownPairs } from '../views/longest-pairs.js';
import { memoizeLast } from '../views/memoize-last.js';
import type { Rgb } from '../views/palette.js';
import { type OccupancyPicture, occupancyPicture } from '../views/occupancy.js';
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
const NO_NUMBERS: readonly number[] = [];
const NO_WORDS: readonly string[] = [];
const NO_ROUNDS: readonly IterationRecord[] = [];
const NO_REFERENCE: readonly (PlanarPoint | null)[] = [];

/**
 * A run of laser scans in the plane: the map, what came out in figures, the table, the settings, and the registration of
 * each scan in detail.
 */
@customElement('scanstitch-planar')
export class ScanstitchPlanar extends RunView<Settings, Snapshot, PlanarSession, BeforeMap> {
  @state() private pairsShown: ShownPairs = 'none';
  @state() private isWelcomeClosed = false;
  /** All pairs of the selected scan; null while they are not wanted. */
  @state() private pairs: Float32Array | null = null;
  @state() private wantsOccupancy = false;
  @state() private occupancy: OccupancyPicture | null = null;
  /** The result that the grid is of, and whether its colours are for the dark. */
  private occupancyOf: Snapshot | null = null;
  private occupancyDark = false;
  @query('scanstitch-map') private map!: ScanstitchMap;

  override session = this.newSession();
  override readonly of = PLANAR;
  private namesOf = memoizeLast((frames: readonly FrameResult[]) => frames.map(({ name }) => name));
  private rowsOf = memoizeLast(frameRows);
  private columnsOf = memoizeLast(frameColumns);
  private figuresOf = memoizeLast(headlineFigures);
  private marksOf = memoizeLast(mapMarks);
  private piecesOf = memoizeLast(certainPieces);
  private longestOf = memoizeLast(longestPairs);
  private pieceColorsOf = memoizeLast(pieceColors);
  private pairsMadeOf: readonly unknown[] = [];
  /** Iterations of the selected scan. */
  @state() private history: readonly IterationRecord[] = NO_ROUNDS;
  private historyOf: readonly unknown[] = [];

  protected override newSession(): PlanarSession {
    const session = new PlanarSession(this);
    session.hasLink = this.rememberSettings; // before the next update, which comes too late for a new session
    return session;
  }

  protected override isSample(): boolean {
    return this.session.dataset?.origin === 'sample';
  }

  override removeReference(): void {
    const reference = this.session.dataset?.reference;
    if (reference) this.session.remove(reference.name);
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
    const placed = frames.flatMap(({ index, time, status, T_world_sensor }, at) => {
      if (status === 'lost') return [];
      const reference = comparison?.reference[at] ?? null;
      const { x = 0, y = 0, heading = null } = reference ?? {};
      return [
        { index, time, pose: inSpace(T_world_sensor), reference: reference && inSpace({ x, y, theta: heading ?? 0 }) },
      ];
    });
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
    this.session.hasLink = this.rememberSettings;
    void this.fetchPairs();
    this.fetchHistory();
    this.fetchOccupancy();
  }

  /** The occupancy grid of the result, if it is selected; drawn again when the theme changes. */
  private fetchOccupancy(): void {
    const { snapshot, phase } = this.session;
    const of = this.wantsOccupancy && (phase === 'done' || phase === 'stopped') ? snapshot : null;
    if (of === this.occupancyOf && this.occupancyDark === this.dark) return;
    this.occupancyOf = of;
    this.occupancyDark = this.dark;
    if (!of) {
      this.occupancy = null;
      return;
    }
    this.session.ask('occupancy_grid').then(
      (grid) => {
        if (this.occupancyOf === of) this.occupancy = occupancyPicture(grid, this.dark);
      },
      () => undefined, // the run was stopped or restarted: it is requested again
    );
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
    const { phase } = session;
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
        this.pairs && this.pairsShown === 'longest' ? this.longestOf(this.pairs).drawn : this.pairs,
      )}
      .names=${this.namesOf(frames)}
      .colors=${this.colors()}
      .pieces=${this.pieces()}
      .map_before=${this.overlay}
      .referenceName=${result?.comparison?.name ?? ''}
      .fitKey=${this.fitKey}
      .hasOccupancy=${phase === 'done' || phase === 'stopped'}
      .occupancy=${this.occupancy}
      @occupancy-wanted=${({ detail }: CustomEvent<boolean>) => {
        this.wantsOccupancy = detail;
      }}
      .description=${this.mapWords()}
      ?bare=${this.controls === 'none'}
      ?dark=${this.dark}
      @map-painted=${() => this.onPainted()}
    ></scanstitch-map>`;
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

  protected override renderTable(): TemplateResult {
    const { snapshot } = this.session;
    const rows = this.rowsOf(
      snapshot?.result.frames ?? NO_FRAMES,
      snapshot?.timing.frames ?? NO_NUMBERS,
      snapshot?.result.comparison?.errors ?? NO_NUMBERS,
    );
    return html`<scanstitch-frame-table
      part="table"
      .rows=${rows}
      .columns=${this.columnsOf(snapshot?.result.comparison?.name ?? '')}
      .colors=${this.colors()}
      .selected=${this.selected}
    ></scanstitch-frame-table>`;
  }

  /** Of the selected scan, whose panel is loaded with the first one that is selected; of all scans while there is none. */
  protected override renderDetails(): TemplateResult {
    const { snapshot, dataset } = this.session;
    const result = snapshot?.result;
    const frames = result?.frames ?? NO_FRAMES;
    const errors = result?.comparison?.errors ?? NO_NUMBERS;
    const referenceName = result?.comparison?.name ?? '';
    if (this.selected === null) {
      return html`<scanstitch-overview
        .frames=${frames}
        .joint_history=${result?.joint_history ?? NO_ROUNDS}
        .notes=${result?.notes ?? NO_WORDS}
        .errors=${errors}
        .referenceName=${referenceName}
        .colors=${this.colors()}
        @why-wanted=${() => {
          this.pairsShown = 'longest';
        }}
      ></scanstitch-overview>`;
    }
    void import('../components/why-panel.js');
    return html`<scanstitch-why
      .frames=${frames}
      .index=${this.selected}
      .history=${this.history}
      .ms=${snapshot?.timing.frames ?? NO_NUMBERS}
      .errors=${errors}
      .referenceName=${referenceName}
      .colors=${this.colors()}
      ?removable=${(dataset?.scans.length ?? 0) > 1}
      .pairsShown=${this.pairsShown}
      .longest=${this.pairs && this.longestOf(this.pairs)}
      @pairs-wanted=${({ detail }: CustomEvent<ShownPairs>) => {
        this.pairsShown = detail;
      }}
      @scan-removed=${({ detail }: CustomEvent<string>) => this.session.remove(detail)}
    ></scanstitch-why>`;
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
      copy: (text) => void this.copy(text, 'The lines were copied.'),
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

  /** The iterations of the selected frame are asked for once for every frame and result. */
  private fetchHistory(): void {
    const { session, selected } = this;
    const of = [session.snapshot, selected];
    if (of.every((value, i) => value === this.historyOf[i])) return;
    if (of[1] !== this.historyOf[1]) this.history = NO_ROUNDS;
    this.historyOf = of;
    if (selected === null || session.phase === 'crashed') return;
    session.ask('history', selected).then(
      (history) => {
        if (this.historyOf === of) this.history = history;
      },
      () => undefined, // a crash is reported by the session
    );
  }

  /** The pairs of the selected frame are asked for once for every frame and result. */
  private async fetchPairs(): Promise<void> {
    const { session, selected, pairsShown } = this;
    const madeOf = [session.snapshot, selected, pairsShown === 'none'];
    if (madeOf.every((value, i) => value === this.pairsMadeOf[i])) return;
    this.pairsMadeOf = madeOf;
    if (pairsShown === 'none' || selected === null || session.phase === 'crashed') {
      this.pairs = null;
      return;
    }
    try {
      const pairs = await session.ask('correspondences', selected);
      if (this.pairsMadeOf === madeOf) this.pairs = pairs;
    } catch {
      if (this.pairsMadeOf === madeOf) this.pairs = null; // a crash is reported by the session
    }
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

/** A pose of the plane as one of space. */
function inSpace({ x, y, theta }: PlanarPose): SpatialPose {
  return { x, y, z: 0, qx: 0, qy: 0, qz: Math.sin(theta / 2), qw: Math.cos(theta / 2) };
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-planar': ScanstitchPlanar;
  }
}
