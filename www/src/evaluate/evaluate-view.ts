import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { icon } from '../components/icons.js';
import { shared, tokens } from '../components/theme.js';
import { filesOfDrop, filesOfInput, type NamedFile } from '../datasets/gather.js';
import { download } from '../export/exports.js';
import { cssColor, frameColor } from '../views/palette.js';
import { remember } from '../views/remember.js';
import type { Colors, Range } from './axes.js';
import { rangeOf } from './axes.js';
import { EvaluationClient } from './client.js';
import { evaluate_styles } from './evaluate-styles.js';
import { pngFile, svgFile } from './export.js';
import './figure-view.js';
import type { Painter, ScanstitchFigure } from './figure-view.js';
import {
  type Camera,
  drawKey,
  drawHistogram,
  drawPaths,
  drawSeries,
  type Look,
  nearestIndex,
  plotArea,
  poseAt,
  type Projection,
  projection,
  type Series,
  type ShownPath,
  type Size,
  widestLook,
} from './figures.js';
import type { Pen } from './pen.js';
import type { Answer, Comparison, EvaluationOptions, TrajectoryFile } from './protocol.js';
import { referenceAmong } from './roles.js';
import { type Column, columnsOf, csv, figure, markdown, sorted } from './table.js';

/** A run of the reconstruction, to be compared with its reference. */
export interface GivenFiles {
  reference: { name: string; bytes: ArrayBuffer } | null;
  estimate: { name: string; text: string };
}

type Abscissa = 'seconds' | 'distance' | 'number';
type FigureName = 'paths' | 'errors' | 'histogram' | 'positions' | 'angles';

const LOOKS: readonly [Look, string][] = [
  ['top', 'Top'],
  ['side', 'Side'],
  ['front', 'Front'],
  ['space', '3D'],
];
const ABSCISSAS: readonly [Abscissa, string][] = [
  ['seconds', 'time'],
  ['distance', 'distance'],
  ['number', 'number of the pose'],
];
const ABSCISSA_NAMES: Record<Abscissa, string> = {
  seconds: 'time (s)',
  distance: 'distance travelled (m)',
  number: 'pose',
};

interface Choice {
  option: keyof EvaluationOptions;
  label: string;
  choices: readonly (readonly [string, string])[];
}

const CHOICES: readonly Choice[] = [
  {
    option: 'alignment',
    label: 'Alignment',
    choices: [
      ['none', 'none'],
      ['origin', 'first poses equal'],
      ['se3', 'SE(3), Umeyama'],
      ['sim3', 'Sim(3), with scale'],
      ['scale', 'scale alone'],
    ],
  },
  {
    option: 'metric',
    label: 'Error',
    choices: [
      ['ape', 'absolute (APE)'],
      ['rpe', 'relative (RPE)'],
    ],
  },
  {
    option: 'relation',
    label: 'of the',
    choices: [
      ['translation_part', 'translation (m)'],
      ['rotation_angle_deg', 'rotation angle (deg)'],
      ['rotation_angle_rad', 'rotation angle (rad)'],
      ['rotation_part', 'rotation part'],
      ['full_transformation', 'full transformation'],
      ['point_distance', 'point distance (m)'],
    ],
  },
  {
    option: 'association',
    label: 'Poses matched by',
    choices: [
      ['auto', 'time if known'],
      ['time', 'time'],
      ['index', 'their number'],
    ],
  },
];
const DELTA_UNITS: Choice = {
  option: 'delta_unit',
  label: 'apart, in',
  choices: [
    ['frames', 'frames'],
    ['meters', 'metres'],
    ['seconds', 'seconds'],
    ['degrees', 'degrees'],
  ],
};

const START_OPTIONS: Partial<EvaluationOptions> = { alignment: 'se3' };
const START_CAMERA: Camera = { look: 'top', azimuth: 0.8, elevation: 0.5, zoom: 1, pan_x: 0, pan_y: 0 };
const RAMP_STEPS = 32;
/** The pointer takes a pose no further away than this (pixels). */
const REACH = 40;

/**
 * Trajectories against the truth: drop them, see paths, errors and a ranked table.
 *
 * Fires `evaluation-drawn` when an answer of the engine is on the screen, with its `elapsed_ms`.
 */
@customElement('scanstitch-evaluate')
export class ScanstitchEvaluate extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** Files to begin with. */
  @property({ attribute: false }) given: GivenFiles | null = null;
  @state() private files: readonly TrajectoryFile[] = [];
  @state() private reference_id = -1;
  @state() private options: Partial<EvaluationOptions> = START_OPTIONS;
  @state() private answer: Answer | null = null;
  @state() private failure = '';
  @state() private selected_id = -1;
  @state() private sort = { id: 'rmse', is_falling: false };
  @state() private abscissa: Abscissa = 'seconds';
  @state() private camera: Camera = START_CAMERA;
  /** The instant all figures mark, on the abscissa. */
  @state() private instant: number | null = null;
  @state() private is_dropping = false;
  @state() private said = '';
  @query('#pick-trajectories') private input!: HTMLInputElement;
  @query('.paths scanstitch-figure') private path_figure!: ScanstitchFigure;

  private rememberedProjection = remember(
    (width: number, height: number, camera: Camera, comparisons: readonly Comparison[]) => {
      const paths = comparisons.flatMap((c) => [c.estimate_positions, c.reference_positions]);
      return projection({ width, height }, paths, camera);
    },
  );
  private next_id = 0;
  /** The first answer chooses the view, then the user does. */
  private is_look_chosen = false;
  private colors: Colors = makeColors(false);
  private painters: Partial<Record<FigureName, Painter>> = {};
  private abscissas = new Map<number, ArrayLike<number>>();
  private client: EvaluationClient | null = null;

  override connectedCallback(): void {
    super.connectedCallback();
    this.client ??= new EvaluationClient(
      (answer) => this.onAnswer(answer),
      (message) => {
        this.failure = message;
      },
    );
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.client?.dispose();
    this.client = null;
  }

  /** Adds files; the first time, the one whose name says so is the reference, else the first. */
  async open(named: readonly NamedFile[]): Promise<void> {
    const read = await Promise.all(
      named.map(async ({ name, file }) => ({
        id: this.next_id++,
        name,
        bytes: new Uint8Array(await file.arrayBuffer()),
      })),
    );
    this.add(read);
  }

  private add(files: readonly TrajectoryFile[]): void {
    if (files.length === 0) return;
    this.files = [...this.files, ...files];
    if (!this.files.some(({ id }) => id === this.reference_id)) {
      this.reference_id = this.files[referenceAmong(this.files.map(({ name }) => name))]?.id ?? -1;
    }
    this.ask();
  }

  private clear(): void {
    this.files = [];
    this.answer = null;
    this.reference_id = -1;
    this.options = START_OPTIONS;
    this.is_look_chosen = false;
    this.instant = null;
  }

  private ask(): void {
    const reference = this.files.find(({ id }) => id === this.reference_id);
    if (!reference) {
      this.answer = null;
      return;
    }
    const estimates = this.files.filter(({ id }) => id !== this.reference_id);
    this.client?.ask({ reference, estimates, options: this.options });
  }

  private async onAnswer(answer: Answer): Promise<void> {
    this.answer = answer;
    this.failure = '';
    if (!this.is_look_chosen && answer.comparisons.length > 0) {
      const paths = answer.comparisons.map(({ reference_positions }) => reference_positions);
      this.camera = { ...START_CAMERA, look: widestLook(paths) };
      this.is_look_chosen = true;
    }
    if (!answer.comparisons.some(({ id }) => id === this.selected_id)) {
      this.selected_id = this.ranked()[0]?.id ?? -1;
    }
    const [first] = this.ranked();
    this.said = first
      ? `${answer.comparisons.length} compared. ${first.name}: rmse ${figure(first.summary.statistics.rmse)} ${first.summary.unit}`
      : '';
    await this.updateComplete;
    this.dispatchEvent(
      new CustomEvent('evaluation-drawn', { detail: { elapsed_ms: answer.elapsed_ms }, bubbles: true, composed: true }),
    );
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('given') && this.given) this.take(this.given);
    const data = ['answer', 'selected_id', 'abscissa', 'dark'] as const;
    const has = (name: string) => (changed as Map<string, unknown>).has(name);
    if (changed.has('dark')) this.colors = makeColors(this.dark);
    if (has('answer') || has('abscissa')) this.abscissas = this.makeAbscissas();
    if (data.some(has)) this.painters = {};
    if (has('camera')) delete this.painters.paths;
  }

  private take({ reference, estimate }: GivenFiles): void {
    const encoded = new TextEncoder().encode(estimate.text);
    const files: TrajectoryFile[] = [{ id: this.next_id++, name: estimate.name, bytes: encoded }];
    if (reference) {
      const bytes = new Uint8Array(reference.bytes.slice(0));
      files.unshift({ id: this.next_id++, name: reference.name, bytes });
    }
    this.clear();
    // A run's times are the numbers of its scans.
    this.options = { ...this.options, alignment: 'origin', association: 'index' };
    this.reference_id = reference ? (files[0]?.id ?? -1) : -1;
    this.add(files);
  }

  // What is shown.

  private get comparisons(): readonly Comparison[] {
    return this.answer?.comparisons ?? NO_COMPARISONS;
  }

  private get selected(): Comparison | null {
    return this.comparisons.find(({ id }) => id === this.selected_id) ?? null;
  }

  private columns(): Column[] {
    return columnsOf(this.comparisons[0]?.summary.unit ?? '');
  }

  private ranked(): Comparison[] {
    const columns = this.columns();
    const column = columns.find(({ id }) => id === this.sort.id) ?? (columns[0] as Column);
    return sorted(this.comparisons, column, this.sort.is_falling);
  }

  private colorOf(comparison: Comparison): string {
    const index = this.files.filter(({ id }) => id !== this.reference_id).findIndex(({ id }) => id === comparison.id);
    return this.colors.estimates[Math.max(index, 0) % this.colors.estimates.length] as string;
  }

  /** What is plotted to the right: time only where every estimate has it. */
  private shownAbscissa(): Abscissa {
    const is_timed = this.comparisons.every(({ stamps }) => stamps !== null);
    return this.abscissa === 'seconds' && !is_timed ? 'number' : this.abscissa;
  }

  private makeAbscissas(): Map<number, ArrayLike<number>> {
    const kind = this.shownAbscissa();
    const first = rangeOf(this.comparisons.map(({ stamps }) => stamps ?? [])).low;
    return new Map(
      this.comparisons.map(({ id, stamps, distances }) => {
        if (kind === 'seconds' && stamps) return [id, stamps.map((stamp) => stamp - first)];
        return [id, kind === 'distance' ? distances : Float64Array.from(distances, (_, i) => i)];
      }),
    );
  }

  private abscissaOf({ id }: Comparison): ArrayLike<number> {
    return this.abscissas.get(id) ?? [];
  }

  private abscissaRange(): Range {
    return rangeOf([...this.abscissas.values()].map((x) => [x[0] ?? 0, x[x.length - 1] ?? 0]));
  }

  private painter(name: FigureName): Painter {
    const makers: Record<FigureName, () => Painter> = {
      paths: () => this.pathPainter(),
      errors: () => this.errorPainter(),
      histogram: () => this.histogramPainter(),
      positions: () => this.panelPainter('positions'),
      angles: () => this.panelPainter('angles'),
    };
    this.painters[name] ??= makers[name]();
    return this.painters[name];
  }

  /** Asked for at every move of the pointer: made again only for another size, camera or answer. */
  private projectionFor({ width, height }: Size): Projection {
    return this.rememberedProjection(width, height, this.camera, this.comparisons);
  }

  private pathPainter(): Painter {
    const { selected, camera, colors } = this;
    return (pen, size) => {
      if (!selected) return;
      const view = this.projectionFor(size);
      const others = this.comparisons.filter((comparison) => comparison !== selected);
      const errors = rangeOf([selected.errors]);
      const shown: ShownPath[] = [
        { positions: longest(this.comparisons), color: colors.reference, width: 1.5, is_dashed: true },
        ...others.map((c) => ({
          positions: c.estimate_positions,
          color: this.colorOf(c),
          width: 1.25,
          is_dashed: false,
        })),
        { positions: selected.estimate_positions, color: shades(selected, errors), width: 2.5, is_dashed: false },
      ];
      drawPaths(pen, view, shown, camera.look, colors);
      drawKey(pen, view, errors, selected.summary.unit, colors);
    };
  }

  private errorPainter(): Painter {
    const { selected, colors } = this;
    const unit = selected?.summary.unit ?? '';
    const x = this.abscissaRange();
    const series = this.comparisons.map((comparison): Series => {
      const xs = this.abscissaOf(comparison);
      return {
        x: Float64Array.from(comparison.error_poses, (pose) => xs[pose] as number),
        values: comparison.errors,
        stride: 1,
        offset: 0,
        color: this.colorOf(comparison),
        width: comparison === selected ? 2 : 1,
        is_dashed: false,
      };
    });
    series.sort((a, b) => a.width - b.width);
    const names = { x: ABSCISSA_NAMES[this.shownAbscissa()], y: unit === '' ? 'error' : `error (${unit})` };
    return (pen, size) => {
      drawSeries(pen, size, series, x, names, colors, true);
    };
  }

  private histogramPainter(): Painter {
    const { selected, colors } = this;
    return (pen, size) => {
      if (!selected) return;
      const { mean, median, rmse } = selected.summary.statistics;
      const unit = selected.summary.unit;
      const marks = [
        { name: 'median', value: median },
        { name: 'mean', value: mean },
        { name: 'rmse', value: rmse },
      ];
      drawHistogram(pen, size, selected.errors, unit === '' ? 'error' : `error (${unit})`, marks, colors);
    };
  }

  /** Three plots below each other: x, y and z, or roll, pitch and yaw. */
  private panelPainter(kind: 'positions' | 'angles'): Painter {
    const { selected, colors } = this;
    const [of_reference, of_estimate] = panelData(selected, kind);
    const names = kind === 'positions' ? ['x (m)', 'y (m)', 'z (m)'] : ['roll (deg)', 'pitch (deg)', 'yaw (deg)'];
    const x = this.abscissaRange();
    const x_name = ABSCISSA_NAMES[this.shownAbscissa()];
    return (pen, size) => {
      if (!selected || !of_reference || !of_estimate) return;
      const xs = this.abscissaOf(selected);
      const rows = panelRows(size);
      names.forEach((name, offset) => {
        const line = { x: xs, stride: 3, offset };
        const series: Series[] = [
          { ...line, values: of_reference, color: colors.reference, width: 1.5, is_dashed: true },
          { ...line, values: of_estimate, color: this.colorOf(selected), width: 1.5, is_dashed: false },
        ];
        const shifted = shiftedPen(pen, rows[offset] ?? 0);
        const words = { x: offset === 2 ? x_name : '', y: name };
        drawSeries(shifted, { width: size.width, height: size.height / 3 }, series, x, words, colors, false);
      });
    };
  }

  // Marks of the instant under the pointer.

  private markInstant(count_rows: number, withDots: boolean): Painter {
    const { instant, colors, comparisons } = this;
    return (pen, size) => {
      if (instant === null) return;
      const range = this.abscissaRange();
      const row = { width: size.width, height: size.height / count_rows };
      const area = plotArea(row);
      const x = area.x + (area.width * (instant - range.low)) / (range.high - range.low);
      const end = size.height - (row.height - area.y - area.height);
      pen.line([x, area.y, x, end], { color: colors.selected, width: 1.25 });
      if (!withDots) return;
      const high = Math.max(...comparisons.map(({ summary }) => summary.statistics.max), 1e-12) * 1.05;
      for (const comparison of comparisons) {
        const found = this.errorAt(comparison, instant);
        if (found === null) continue;
        const y = area.y + area.height * (1 - found / high);
        pen.circle(x, y, comparison === this.selected ? 4 : 3, this.colorOf(comparison), colors.background);
      }
    };
  }

  private markPose(): Painter {
    const { instant, colors, selected } = this;
    return (pen, size) => {
      if (instant === null || !selected) return;
      const view = this.projectionFor(size);
      for (const comparison of this.comparisons) {
        const pose = nearestIndex(this.abscissaOf(comparison), instant);
        const at = (positions: Float64Array) =>
          view.project(...(Array.from(positions.subarray(3 * pose, 3 * pose + 3)) as [number, number, number]));
        const estimate = at(comparison.estimate_positions);
        if (comparison === selected) {
          const reference = at(comparison.reference_positions);
          pen.line([...reference, ...estimate], { color: colors.selected, width: 1.5 });
          pen.circle(...reference, 4, colors.reference, colors.background);
        }
        pen.circle(...estimate, comparison === selected ? 5 : 3.5, this.colorOf(comparison), colors.background);
      }
    };
  }

  private errorAt(comparison: Comparison, instant: number): number | null {
    const pose = nearestIndex(this.abscissaOf(comparison), instant);
    const index = nearestIndex(comparison.error_poses, pose);
    return comparison.errors[index] ?? null;
  }

  private readout(): TemplateResult | typeof nothing {
    const { instant, selected } = this;
    if (instant === null || !selected) return nothing;
    const error = this.errorAt(selected, instant);
    const pose = nearestIndex(this.abscissaOf(selected), instant);
    const x = this.abscissaOf(selected)[pose] ?? 0;
    return html`<output class="readout number"
      >${ABSCISSA_NAMES[this.shownAbscissa()].replace(/ \(.*/, '')} ${Number(x.toPrecision(6))}, error
      ${error === null ? '–' : Number(error.toPrecision(4))} ${selected.summary.unit}</output
    >`;
  }

  // The page.

  protected override render(): TemplateResult {
    const is_empty = this.files.length === 0;
    return html`<div
      class="evaluate"
      @dragenter=${this.onDrag}
      @dragover=${this.onDrag}
      @dragleave=${(event: DragEvent) => {
        event.stopPropagation();
        if (event.target === event.currentTarget) this.is_dropping = false;
      }}
      @drop=${this.onDrop}
    >
      ${is_empty ? this.renderEmpty() : html`${this.renderControls()} ${this.renderProblems()} ${this.renderFigures()}`}
      <input id="pick-trajectories" type="file" multiple hidden @change=${this.onPicked} />
      <div class="visually-hidden" role="status" aria-live="polite">${this.said}</div>
      ${this.is_dropping ? html`<div class="drop-hint" aria-hidden="true"><div>Drop trajectories here</div></div>` : nothing}
    </div>`;
  }

  private renderEmpty(): TemplateResult {
    return html`<section class="empty">
      <h2>Compare trajectories with the truth</h2>
      <p class="muted">
        Drop the true trajectory and any number of estimates: TUM, KITTI, EuRoC, NumPy, CSV or matrices. A file named
        “gt”, “truth” or “reference” is taken for the truth. Figures are those of evo. Nothing leaves this machine.
      </p>
      <button class="primary" @click=${() => this.input.click()}>${icon('open')}Choose files…</button>
      ${this.failure ? html`<p class="problem" role="alert">${this.failure}</p>` : nothing}
    </section>`;
  }

  private renderControls(): TemplateResult {
    const is_relative = this.options.metric === 'rpe';
    const reference = this.files.find(({ id }) => id === this.reference_id);
    return html`<form
      class="controls"
      aria-label="How they are compared"
      @submit=${(event: Event) => event.preventDefault()}
    >
      <label
        >Reference
        <select
          @change=${(event: Event) => {
            this.reference_id = Number((event.target as HTMLSelectElement).value);
            this.ask();
          }}
        >
          ${this.files.map(
            ({ id, name }) => html`<option value=${id} .selected=${id === reference?.id}>${name}</option>`,
          )}
        </select></label
      >
      ${CHOICES.map((choice) => this.renderChoice(choice))}
      ${
        is_relative
          ? html`${this.renderNumber('delta', 'Pairs', 1, 0)} ${this.renderChoice(DELTA_UNITS)}
              <label class="check"
                ><input
                  type="checkbox"
                  .checked=${this.options.all_pairs ?? false}
                  @change=${(event: Event) => this.set({ all_pairs: (event.target as HTMLInputElement).checked })}
                />all pairs</label
              >`
          : nothing
      }
      ${this.renderNumber('max_diff', 'Largest time difference (s)', 0.01, 0)}
      ${this.renderNumber('offset', 'Time offset (s)', 0, null)}
      ${this.renderNumber('align_first', 'Align by the first n', 0, 0)}
      <span class="actions">
        <button type="button" @click=${() => this.input.click()}>${icon('plus')}Add files…</button>
        <button
          type="button"
          class="quiet"
          @click=${() => {
            this.clear();
          }}
        >
          ${icon('trash')}Remove all
        </button>
      </span>
    </form>`;
  }

  private renderChoice({ option, label, choices }: Choice): TemplateResult {
    const present = this.options[option] ?? choices[0]?.[0];
    return html`<label
      >${label}
      <select @change=${(event: Event) => this.set({ [option]: (event.target as HTMLSelectElement).value })}>
        ${choices.map(([value, words]) => html`<option value=${value} .selected=${value === present}>${words}</option>`)}
      </select></label
    >`;
  }

  private renderNumber(
    option: 'delta' | 'max_diff' | 'offset' | 'align_first',
    label: string,
    initial: number,
    min: number | null,
  ): TemplateResult {
    return html`<label
      >${label}
      <input
        type="number"
        step="any"
        min=${min ?? nothing}
        .value=${String(this.options[option] ?? initial)}
        @change=${(event: Event) => {
          const value = (event.target as HTMLInputElement).valueAsNumber;
          if (Number.isFinite(value)) this.set({ [option]: option === 'align_first' ? Math.round(value) : value });
        }}
    /></label>`;
  }

  private set(change: Partial<EvaluationOptions>): void {
    this.options = { ...this.options, ...change };
    this.ask();
  }

  private renderProblems(): TemplateResult | typeof nothing {
    const { answer } = this;
    const reference = this.files.find(({ id }) => id === this.reference_id)?.name ?? '';
    const problems = [
      ...(this.failure ? [this.failure] : []),
      ...(answer?.reference_problem ? [`The reference cannot be used. ${answer.reference_problem}`] : []),
      ...(answer?.refusals ?? []).map(({ name, problem }) =>
        problem.startsWith(name) ? problem : `${name}: ${problem}`,
      ),
    ];
    const notes = this.selected?.summary.notes ?? [];
    if (problems.length + notes.length === 0 && this.files.length > 1) return nothing;
    return html`<ul class="problems">
      ${problems.map((problem) => html`<li class="problem" role="alert">${icon('doubtful')}${problem}</li>`)}
      ${this.files.length === 1 ? html`<li>${icon('info')}Now drop estimates to compare with ${reference}.</li>` : nothing}
      ${notes.map((note) => html`<li>${icon('info')}${this.selected?.name}: ${note}</li>`)}
    </ul>`;
  }

  private renderFigures(): TemplateResult | typeof nothing {
    const { selected } = this;
    if (!selected) return nothing;
    const { statistics, unit } = selected.summary;
    const of = `of ${selected.name}: rmse ${figure(statistics.rmse)} ${unit}, largest ${figure(statistics.max)} ${unit}`;
    return html`<div class="grid">
        <section class="paths">
          <header>
            <h2>Paths</h2>
            <div class="looks" role="group" aria-label="View">
              ${LOOKS.map(
                ([look, label]) =>
                  html`<button
                    class="quiet"
                    aria-pressed=${this.camera.look === look}
                    @click=${() => {
                      this.camera = { ...START_CAMERA, look };
                    }}
                  >
                    ${label}
                  </button>`,
              )}
            </div>
            ${this.renderSave('paths')}
          </header>
          <scanstitch-figure
            movable
            .painter=${this.painter('paths')}
            .marker=${this.markPose()}
            .description=${`Paths, coloured by the error ${of}`}
            @figure-pointer=${this.onPathPointer}
            @figure-dragged=${this.onPathDragged}
            @figure-zoomed=${({ detail }: CustomEvent<{ factor: number }>) => {
              const zoom = Math.min(Math.max(this.camera.zoom * detail.factor, 0.2), 1e4);
              this.camera = { ...this.camera, zoom };
            }}
          ></scanstitch-figure>
          ${this.readout()}
        </section>
        ${this.renderPlot('errors', 'Error', `Error over ${ABSCISSA_NAMES[this.shownAbscissa()]} ${of}`, this.markInstant(1, true))}
        ${this.renderPlot('histogram', 'Histogram', `Histogram of the errors ${of}`, null)}
        ${this.renderPlot('positions', 'Position', 'x, y and z of reference and estimate', this.markInstant(3, false))}
        ${
          selected.reference_angles && selected.estimate_angles
            ? this.renderPlot(
                'angles',
                'Orientation',
                'Roll, pitch and yaw of reference and estimate',
                this.markInstant(3, false),
              )
            : nothing
        }
      </div>
      ${this.renderTable()}`;
  }

  private renderPlot(name: FigureName, title: string, description: string, marker: Painter | null): TemplateResult {
    return html`<section class=${name}>
      <header>
        <h2>${title}</h2>
        ${
          name === 'errors'
            ? html`<label class="over"
                >over
                <select
                  @change=${(event: Event) => {
                    this.abscissa = (event.target as HTMLSelectElement).value as Abscissa;
                    this.instant = null;
                  }}
                >
                  ${ABSCISSAS.map(
                    ([id, words]) =>
                      html`<option value=${id} .selected=${id === this.shownAbscissa()}>${words}</option>`,
                  )}
                </select></label
              >`
            : nothing
        }
        ${this.renderSave(name)}
      </header>
      <scanstitch-figure
        .painter=${this.painter(name)}
        .marker=${marker ?? NO_MARKS}
        .description=${description}
        @figure-pointer=${marker ? this.onPlotPointer : nothing}
      ></scanstitch-figure>
    </section>`;
  }

  private renderSave(name: FigureName): TemplateResult {
    return html`<span class="save">
      ${(['PNG', 'SVG'] as const).map(
        (form) =>
          html`<button
            class="quiet"
            aria-label="Save ${name} as ${form}"
            @click=${(event: Event) => this.save(event, name, form)}
          >
            ${form}
          </button>`,
      )}
    </span>`;
  }

  private renderTable(): TemplateResult {
    const columns = this.columns();
    const ranked = this.ranked();
    return html`<section class="ranking">
      <header>
        <h2>${ranked.length === 1 ? 'Figures' : 'Ranking'}</h2>
        <span class="muted">${this.answer ? `compared in ${this.answer.elapsed_ms.toFixed(0)} ms` : ''}</span>
        <span class="save">
          <button class="quiet" @click=${() => this.copy(markdown(ranked, columns), 'Markdown')}>Copy Markdown</button>
          <button class="quiet" @click=${() => this.copy(csv(ranked, columns), 'CSV')}>Copy CSV</button>
        </span>
      </header>
      <div class="scroll">
        <table aria-label="Estimates, ranked">
          <thead>
            <tr>
              <th scope="col">#</th>
              <th scope="col" class="name">estimate</th>
              <th scope="col">poses</th>
              ${columns.map(
                ({ id, label, hint }) =>
                  html`<th
                    scope="col"
                    aria-sort=${this.sort.id === id ? (this.sort.is_falling ? 'descending' : 'ascending') : 'none'}
                  >
                    <button class="quiet" title=${hint} @click=${() => this.sortBy(id)}>
                      ${label}${this.sort.id === id ? (this.sort.is_falling ? ' ▾' : ' ▴') : ''}
                    </button>
                  </th>`,
              )}
              <th></th>
            </tr>
          </thead>
          <tbody>
            ${ranked.map(
              (comparison, index) =>
                html`<tr
                  class=${comparison.id === this.selected_id ? 'selected' : ''}
                  @click=${() => this.select(comparison)}
                >
                  <td>${index + 1}</td>
                  <td class="name">
                    <button
                      class="link"
                      aria-pressed=${comparison.id === this.selected_id}
                      @click=${() => this.select(comparison)}
                    >
                      <i style="background:${this.colorOf(comparison)}"></i>${comparison.name}
                    </button>
                  </td>
                  <td>${comparison.summary.num_matched}/${comparison.summary.num_estimate}</td>
                  ${columns.map((column) => html`<td>${figure(column.value(comparison))}</td>`)}
                  <td>
                    <button
                      class="icon quiet"
                      aria-label="Remove ${comparison.name}"
                      @click=${(event: Event) => {
                        event.stopPropagation();
                        this.files = this.files.filter(({ id }) => id !== comparison.id);
                        this.ask();
                      }}
                    >
                      ${icon('close', 12)}
                    </button>
                  </td>
                </tr>`,
            )}
          </tbody>
        </table>
      </div>
    </section>`;
  }

  private select({ id }: Comparison): void {
    this.selected_id = id;
  }

  private sortBy(id: string): void {
    this.sort = { id, is_falling: this.sort.id === id && !this.sort.is_falling };
  }

  private async copy(text: string, form: string): Promise<void> {
    await navigator.clipboard.writeText(text);
    this.said = `The table was copied as ${form}.`;
  }

  private async save(event: Event, name: FigureName, form: 'PNG' | 'SVG'): Promise<void> {
    const section = (event.currentTarget as HTMLElement).closest('section');
    const { size } = section?.querySelector('scanstitch-figure') ?? this.path_figure;
    // On paper, whatever the screen's colours are.
    const was = this.colors;
    this.colors = makeColors(false);
    this.painters = {};
    const painter = this.painter(name);
    try {
      const make = form === 'SVG' ? svgFile : pngFile;
      const blob = await make(painter, size, this.colors.background);
      download({ name: `${name}.${form.toLowerCase()}`, blob });
    } finally {
      this.colors = was;
      this.painters = {};
      this.requestUpdate();
    }
  }

  // The pointer.

  private onPathPointer({ detail, currentTarget }: CustomEvent<{ x: number; y: number } | null>): void {
    const { selected } = this;
    if (!detail || !selected) {
      this.instant = null;
      return;
    }
    const view = this.projectionFor((currentTarget as ScanstitchFigure).size);
    const pose = poseAt(view, selected.estimate_positions, detail.x, detail.y, REACH);
    this.instant = pose === null ? null : (this.abscissaOf(selected)[pose] ?? null);
  }

  private onPathDragged({ detail, currentTarget }: CustomEvent<{ dx: number; dy: number }>): void {
    const { camera } = this;
    if (camera.look === 'space') {
      const elevation = Math.min(Math.max(camera.elevation + detail.dy * 0.008, -1.55), 1.55);
      this.camera = { ...camera, azimuth: camera.azimuth - detail.dx * 0.008, elevation };
      return;
    }
    const { scale } = this.projectionFor((currentTarget as ScanstitchFigure).size);
    this.camera = { ...camera, pan_x: camera.pan_x + detail.dx / scale, pan_y: camera.pan_y - detail.dy / scale };
  }

  private onPlotPointer({ detail, currentTarget }: CustomEvent<{ x: number; y: number } | null>): void {
    if (!detail) {
      this.instant = null;
      return;
    }
    const area = plotArea((currentTarget as ScanstitchFigure).size);
    const { low, high } = this.abscissaRange();
    const share = (detail.x - area.x) / area.width;
    this.instant = share < 0 || share > 1 ? null : low + share * (high - low);
  }

  // Files.

  private onDrag(event: DragEvent): void {
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    event.stopPropagation();
    this.is_dropping = true;
  }

  private async onDrop(event: DragEvent): Promise<void> {
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    event.stopPropagation();
    this.is_dropping = false;
    await this.open(await filesOfDrop(event.dataTransfer));
  }

  private async onPicked(): Promise<void> {
    const files = filesOfInput(this.input);
    await this.open(files);
    this.input.value = '';
  }

  static override styles = [tokens, shared, evaluate_styles];
}

const NO_COMPARISONS: readonly Comparison[] = [];
const NO_MARKS: Painter = () => undefined;

/** Rows of a panel begin at these heights. */
function panelRows({ height }: Size): number[] {
  return [0, height / 3, (2 * height) / 3];
}

/** The same pen, further down. */
function shiftedPen(pen: Pen, down: number): Pen {
  return {
    line: (points, stroke) =>
      pen.line(
        Array.from(points, (value, i) => (i % 2 === 1 ? value + down : value)),
        stroke,
      ),
    rect: (x, y, width, height, color) => pen.rect(x, y + down, width, height, color),
    circle: (x, y, radius, color, rim) => pen.circle(x, y + down, radius, color, rim),
    text: (x, y, words, style) => pen.text(x, y + down, words, style),
    inside: (x, y, width, height, draw) => pen.inside(x, y + down, width, height, draw),
  };
}

/** x y z (m), or roll pitch yaw (deg), of reference and estimate. */
function panelData(
  comparison: Comparison | null,
  kind: 'positions' | 'angles',
): [Float64Array | null, Float64Array | null] {
  if (!comparison) return [null, null];
  if (kind === 'positions') return [comparison.reference_positions, comparison.estimate_positions];
  return [
    inDegrees(comparison.reference_angles, null),
    inDegrees(comparison.estimate_angles, comparison.reference_angles),
  ];
}

/** Angles (deg) without jumps by a whole turn; those of the estimate begin next to the reference's. */
function inDegrees(angles: Float64Array | null, beside: Float64Array | null): Float64Array | null {
  const near = (degrees: number, to: number) => degrees - 360 * Math.round((degrees - to) / 360);
  const shown = angles?.map((angle) => (angle * 180) / Math.PI) ?? null;
  shown?.forEach((degrees, i) => {
    const before = i >= 3 ? (shown[i - 3] as number) : beside ? ((beside[i] ?? 0) * 180) / Math.PI : degrees;
    shown[i] = near(degrees, before);
  });
  return shown;
}

/** For each pose the colour of its error, by the index into the ramp; poses between errors have that of the next. */
function shades({ errors, error_poses, distances }: Comparison, { low, high }: Range): Uint8Array {
  const result = new Uint8Array(distances.length);
  let pose = 0;
  errors.forEach((error, index) => {
    const shade = Math.min(Math.floor(((error - low) / (high - low)) * RAMP_STEPS), RAMP_STEPS - 1);
    for (const end = error_poses[index] ?? 0; pose <= end; pose++) result[pose] = shade;
  });
  return result.fill(result[Math.max(pose - 1, 0)] ?? 0, pose);
}

/** The reference's positions where most of them are matched. */
function longest(comparisons: readonly Comparison[]): Float64Array {
  let best = new Float64Array() as Float64Array;
  for (const { reference_positions } of comparisons) {
    if (reference_positions.length > best.length) best = reference_positions;
  }
  return best;
}

function makeColors(dark: boolean): Colors {
  return {
    text: dark ? '#e5eaf1' : '#17202c',
    muted: dark ? '#9dabbc' : '#536070',
    line: dark ? '#27303b' : '#e3e8ee',
    background: dark ? '#151b23' : '#ffffff',
    reference: dark ? '#9dabbc' : '#6b7888',
    selected: dark ? '#ff6fb1' : '#c4126a',
    // Hues apart by lightness as well: Okabe and Ito's, which colour-blind eyes tell apart.
    estimates: dark
      ? ['#56b4e9', '#e69f00', '#2fc08f', '#f0e442', '#d988b7', '#f0793d', '#8fa8ff', '#c0c8d2']
      : ['#0072b2', '#c77700', '#00845f', '#8a7400', '#a8457e', '#c24a00', '#4a5fd0', '#5b6470'],
    ramp: Array.from({ length: RAMP_STEPS }, (_, i) => cssColor(frameColor(i / (RAMP_STEPS - 1), dark))),
  };
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-evaluate': ScanstitchEvaluate;
  }
}
