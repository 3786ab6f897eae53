import { html, LitElement, nothing, type PropertyValues, type TemplateResult } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { icon } from '../components/icons.js';
import type { GivenFiles } from '../components/run-view.js';
import { drop_styles, page_styles, shared, tokens } from '../components/theme.js';
import { filesOfDrop, filesOfInput, type NamedFile } from '../datasets/gather.js';
import { plural } from '../views/format.js';
import { memoizeLast } from '../views/memoize-last.js';
import { WorkerClient } from './client.js';
import { makeColors } from '../views/figure-colors.js';
import './controls.js';
import type { BesideFile } from './controls.js';
import { evaluate_styles } from './evaluate-styles.js';
import './figures-view.js';
import type { ScanstitchEvaluationFigures } from './figures-view.js';
import { type Intake, sortOut } from './intake.js';
import './map-panel.js';
import map_worker_url from './map-quality-worker.ts?worker&url';
import { asideWords, noticesOf } from './notices.js';
import { readAll } from './open-files.js';
import type {
  Result,
  Comparison,
  EvaluationOptions,
  MapResult,
  MapQuery,
  Part,
  Query,
  Command,
  TrajectoryFile,
} from './protocol.js';
import './ranking-view.js';
import type { Sort } from './ranking-view.js';
import { referenceAmong } from './roles.js';
import { columnsOf, figure, sorted } from './table.js';
import worker_url from './evaluate-worker.ts?worker&url';

const START_OPTIONS: Partial<EvaluationOptions> = { alignment: 'se3' };
/** A run's poses are those of the reference one by one, in a world of their own. */
const RUN_OPTIONS: Partial<EvaluationOptions> = { alignment: 'origin', association: 'index' };
const NO_COMPARISONS: readonly Comparison[] = [];

/**
 * Trajectories against the truth: drop them, see paths, errors and a ranked table.
 *
 * Fires `evaluation-drawn` when an answer of the engine is on the screen, with the `elapsed_ms` of the worker and the
 * `total_ms` since the files were dropped or an option was changed.
 */
@customElement('scanstitch-evaluate')
export class ScanstitchEvaluate extends LitElement {
  @property({ type: Boolean, reflect: true }) dark = false;
  /** A run to begin with. */
  @property({ attribute: false }) given: GivenFiles | null = null;
  @state() private files: readonly TrajectoryFile[] = [];
  @state() private reference_id = -1;
  @state() private times: Part | null = null;
  @state() private relations: Part | null = null;
  @state() private loops_only = false;
  @state() private clouds: readonly Part[] = [];
  @state() private options: Partial<EvaluationOptions> = START_OPTIONS;
  @state() private answer: Result | null = null;
  @state() private map_answer: MapResult | null = null;
  @state() private is_judging = false;
  /** What became of files that cannot be used. */
  @state() private problems: readonly string[] = [];
  @state() private remarks: readonly string[] = [];
  @state() private selected_id = -1;
  @state() private sort: Sort = { id: 'rmse', is_descending: false };
  @state() private is_dropping = false;
  @state() private said = '';
  @query('#pick-trajectories') private input!: HTMLInputElement;
  @query('scanstitch-evaluation-figures') private figures!: ScanstitchEvaluationFigures | null;

  /** The run that was given, until all is removed. */
  @state() private run: GivenFiles | null = null;

  private next_id = 0;
  /** Of a run without a truth: never taken for the truth. */
  private run_id = -1;
  /** Another one for every set of files that begins anew. */
  private data_key = 0;
  private asked_at = 0;
  private judged = '';
  private client: WorkerClient<Command, Query, Result> | null = null;
  private map_client: WorkerClient<never, MapQuery, MapResult> | null = null;
  private rankedBy = memoizeLast((comparisons: readonly Comparison[], { id, is_descending }: Sort) => {
    const columns = columnsOf(comparisons[0]?.summary.unit ?? '', true);
    const column = columns.find((candidate) => candidate.id === id) ?? columns[0];
    return column ? sorted(comparisons, column, is_descending) : comparisons;
  });
  private columnsFor = memoizeLast(columnsOf);
  private orderOf = memoizeLast((files: readonly TrajectoryFile[], reference_id: number) =>
    files.map(({ id }) => id).filter((id) => id !== reference_id),
  );
  private colorsOf = memoizeLast((order: readonly number[], dark: boolean) => {
    const { estimates } = makeColors(dark);
    return new Map(order.map((id, index) => [id, estimates[index % estimates.length] as string]));
  });

  override connectedCallback(): void {
    super.connectedCallback();
    this.client ??= new WorkerClient(worker_url, {
      answered: (answer) => this.onAnswer(answer),
      failed: (message) => this.onFailure(message),
      greet: () => ({ add: this.files, remove: [] }),
    });
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    this.client?.dispose();
    this.map_client?.dispose();
    this.client = this.map_client = null;
  }

  /** Adds files; the first time, the one whose name says so is the reference, else the first. */
  async open(named: readonly NamedFile[]): Promise<void> {
    if (named.length === 0) return;
    this.asked_at = performance.now();
    const { parts, problems, set_aside } = await readAll(named);
    this.problems = problems;
    this.remarks = asideWords(set_aside);
    this.take(sortOut(parts));
  }

  private take({ trajectories, times, relations, clouds }: Intake): void {
    this.times = times ?? this.times;
    this.relations = relations ?? this.relations;
    this.clouds = [...this.clouds, ...clouds];
    this.add(trajectories.map((found) => ({ ...found, id: this.next_id++ })));
    const is_anything = trajectories.length + clouds.length > 0 || times !== null || relations !== null;
    if (!is_anything && this.problems.length === 0) this.problems = ['None of these files is a trajectory or a map.'];
    if (this.files.length === 0) this.judge();
  }

  private add(files: readonly TrajectoryFile[]): void {
    if (this.files.length === 0) this.data_key++;
    this.files = [...this.files, ...files];
    this.client?.tell({ add: files, remove: [] });
    if (!this.files.some(({ id }) => id === this.reference_id)) {
      const candidates = this.files.filter(({ id }) => id !== this.run_id);
      this.reference_id = candidates[referenceAmong(candidates.map(({ name }) => name))]?.id ?? -1;
    }
    this.ask();
  }

  private removeFile(id: number): void {
    this.files = this.files.filter((file) => file.id !== id);
    this.client?.tell({ add: [], remove: [id] });
  }

  private clear(): void {
    this.client?.tell({ add: [], remove: this.files.map(({ id }) => id) });
    this.files = [];
    this.times = this.relations = this.answer = this.map_answer = null;
    this.clouds = [];
    this.problems = this.remarks = [];
    this.reference_id = this.run_id = -1;
    this.run = null;
    this.options = START_OPTIONS;
    this.judged = '';
  }

  private ask(): void {
    if (this.reference_id < 0) {
      this.answer = null;
      return;
    }
    const { reference_id: reference, options, times, relations, loops_only } = this;
    const estimates = this.orderOf(this.files, reference);
    this.client?.ask({ reference, estimates, options, times, relations, loops_only });
  }

  private change(change: () => void): void {
    this.asked_at = performance.now();
    change();
    this.ask();
  }

  private async onAnswer(answer: Result): Promise<void> {
    this.answer = answer;
    if (!answer.comparisons.some(({ id }) => id === this.selected_id)) {
      this.selected_id = this.ranked()[0]?.id ?? -1;
    }
    const [first] = this.ranked();
    this.said = first
      ? `${answer.comparisons.length} compared. ${first.name}: rmse ${figure(first.summary.statistics.rmse)} ${first.summary.unit}`
      : '';
    this.judge();
    await this.updateComplete;
    await this.figures?.isDrawn();
    const detail = { elapsed_ms: answer.elapsed_ms, total_ms: performance.now() - this.asked_at };
    this.dispatchEvent(new CustomEvent('evaluation-drawn', { detail, bubbles: true, composed: true }));
  }

  private onFailure(message: string): void {
    this.problems = [message];
    this.is_judging = false;
  }

  // Maps.

  /** Clouds that are as many as a trajectory's poses are its frames; others are maps. */
  private judge(): void {
    if (this.clouds.length === 0) return;
    const trajectories =
      this.clouds.length > 1 ? this.files.filter(({ id }) => this.numPoses(id) === this.clouds.length) : [];
    const are_frames = trajectories.length > 0;
    const judged = [this.clouds.map(({ name }) => name), trajectories.map(({ id }) => id)].join('/');
    if (judged === this.judged) return;
    this.judged = judged;
    this.is_judging = true;
    this.map_client ??= new WorkerClient(map_worker_url, {
      answered: (answer) => {
        this.map_answer = answer;
        this.is_judging = false;
        this.said = 'The crispness of the map is known.';
      },
      failed: (message) => this.onFailure(message),
    });
    this.map_client.ask({
      maps: are_frames ? [] : this.clouds,
      frames: are_frames ? this.clouds : [],
      trajectories,
    });
  }

  private numPoses(id: number): number {
    const { comparisons = [] } = this.answer ?? {};
    if (id === this.reference_id) return comparisons[0]?.summary.num_reference ?? 0;
    return comparisons.find((comparison) => comparison.id === id)?.summary.num_estimate ?? 0;
  }

  private async judgeRun(): Promise<void> {
    const { run } = this;
    if (!run) return;
    this.is_judging = true;
    const bytes = await run.readMap();
    this.clouds = [...this.clouds, { name: `${run.estimate.name}.ply`, bytes }];
    this.judge();
  }

  protected override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has('given') && this.given) this.begin(this.given);
  }

  private begin(run: GivenFiles): void {
    const { reference, estimate } = run;
    this.asked_at = performance.now();
    this.clear();
    this.run = run;
    this.options = { ...START_OPTIONS, ...RUN_OPTIONS };
    const bytes = new TextEncoder().encode(estimate.text);
    const own = { id: this.next_id++, name: estimate.name, parts: [{ name: estimate.name, bytes }] };
    this.run_id = own.id;
    if (!reference) return this.add([own]);
    const part = { name: reference.name, bytes: new Uint8Array(reference.bytes.slice(0)) };
    const truth = { id: this.next_id++, name: reference.name, parts: [part] };
    this.reference_id = truth.id;
    this.add([truth, own]);
  }

  // What is shown.

  private get comparisons(): readonly Comparison[] {
    return this.answer?.comparisons ?? NO_COMPARISONS;
  }

  private ranked(): readonly Comparison[] {
    return this.rankedBy(this.comparisons, this.sort);
  }

  protected override render(): TemplateResult {
    const is_empty = this.files.length + this.clouds.length === 0;
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
      ${is_empty ? this.renderEmpty() : html`${this.renderControls()} ${this.renderNotices()} ${this.renderAnswer()}`}
      <input id="pick-trajectories" type="file" multiple hidden @change=${this.onPicked} />
      <div class="visually-hidden" role="status" aria-live="polite">${this.said}</div>
      ${this.is_dropping ? html`<div class="drop-hint" aria-hidden="true"><div>Drop trajectories here</div></div>` : nothing}
    </div>`;
  }

  private renderEmpty(): TemplateResult {
    return html`<section class="empty" aria-label="No trajectories yet">
      <h2>Compare trajectories with the truth</h2>
      <p>
        Drop the true trajectory and any number of estimates: TUM, KITTI, EuRoC, NumPy, CSV, or a folder with one pose
        file a frame. A file named “gt”, “truth” or “reference” is taken for the truth. Figures are those of evo.
      </p>
      <p class="muted">
        <b>Hand-ins:</b> drop the truth with everyone’s files, as a folder or a zip: they are ranked, and what cannot be
        compared says why. <b>No truth?</b> Drop maps as PLY or PCD to see which is crispest.
      </p>
      <button class="primary" @click=${() => this.input.click()}>${icon('open')}Choose files…</button>
      ${this.problems.map((problem) => html`<p class="problem" role="alert">${problem}</p>`)}
      <p class="muted">Nothing leaves this machine.</p>
    </section>`;
  }

  private renderControls(): TemplateResult {
    const { clouds, times, relations } = this;
    const beside: BesideFile[] = [
      ...(times ? [{ id: 'times', label: 'times', name: times.name } as const] : []),
      ...(relations ? [{ id: 'relations', label: 'relations', name: relations.name } as const] : []),
      ...(clouds.length > 0 ? [{ id: 'clouds', label: '', name: plural(clouds.length, 'cloud') } as const] : []),
    ];
    return html`<scanstitch-evaluation-controls
      .files=${this.files}
      .reference_id=${this.reference_id}
      .options=${this.options}
      .beside=${beside}
      .loops_only=${this.loops_only}
      @reference-chosen=${({ detail }: CustomEvent<number>) => this.change(() => (this.reference_id = detail))}
      @options-changed=${({ detail }: CustomEvent<Partial<EvaluationOptions>>) =>
        this.change(() => (this.options = { ...this.options, ...detail }))}
      @loops-only-changed=${({ detail }: CustomEvent<boolean>) => this.change(() => (this.loops_only = detail))}
      @beside-removed=${({ detail }: CustomEvent<BesideFile['id']>) => this.change(() => this.removeBeside(detail))}
      @files-wanted=${() => this.input.click()}
      @all-removed=${() => this.clear()}
    ></scanstitch-evaluation-controls>`;
  }

  private removeBeside(id: BesideFile['id']): void {
    if (id === 'times') this.times = null;
    else if (id === 'relations') this.relations = null;
    else {
      this.clouds = [];
      this.map_answer = null;
      this.judged = '';
    }
  }

  private renderNotices(): TemplateResult | typeof nothing {
    const { problems, remarks } = noticesOf({
      num_files: this.files.length,
      reference: this.files.find(({ id }) => id === this.reference_id)?.name ?? '',
      answer: this.answer,
      selected: this.comparisons.find(({ id }) => id === this.selected_id) ?? null,
      problems: this.problems,
      remarks: this.remarks,
    });
    if (problems.length + remarks.length === 0) return nothing;
    return html`<ul class="problems">
      ${problems.map((problem) => html`<li class="problem" role="alert">${icon('doubtful')}${problem}</li>`)}
      ${remarks.map((remark) => html`<li>${icon('info')}${remark}</li>`)}
    </ul>`;
  }

  private renderAnswer(): TemplateResult {
    const { comparisons, answer } = this;
    const order = this.orderOf(this.files, this.reference_id);
    const has_relations = comparisons.some(({ relations }) => relations !== null);
    const has_maps = this.clouds.length > 0 || this.run !== null;
    return html`${
      answer && comparisons.length + answer.refusals.length > 0
        ? html`<scanstitch-ranking
            .ranked=${this.ranked()}
            .refusals=${answer.refusals}
            .columns=${this.columnsFor(comparisons[0]?.summary.unit ?? '', has_relations)}
            .sort=${this.sort}
            .selected_id=${this.selected_id}
            .elapsed_ms=${answer.elapsed_ms}
            .colors=${this.colorsOf(order, this.dark)}
            @estimate-selected=${({ detail }: CustomEvent<number>) => (this.selected_id = detail)}
            @estimate-removed=${({ detail }: CustomEvent<number>) => this.change(() => this.removeFile(detail))}
            @sort-changed=${({ detail }: CustomEvent<Sort>) => (this.sort = detail)}
            @said=${({ detail }: CustomEvent<string>) => (this.said = detail)}
          ></scanstitch-ranking>`
        : nothing
    }
    ${
      comparisons.length > 0
        ? html`<scanstitch-evaluation-figures
            .comparisons=${comparisons}
            .selected_id=${this.selected_id}
            .order=${order}
            .data_key=${this.data_key}
            .first_abscissa=${this.run_id < 0 ? 'seconds' : 'number'}
            ?dark=${this.dark}
          ></scanstitch-evaluation-figures>`
        : nothing
    }
    ${
      has_maps
        ? html`<scanstitch-map-panel
            .answer=${this.map_answer}
            ?busy=${this.is_judging}
            ?has_run=${this.run !== null && this.clouds.length === 0}
            @run-map-wanted=${() => this.judgeRun()}
          ></scanstitch-map-panel>`
        : nothing
    }`;
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

  static override styles = [tokens, shared, page_styles, drop_styles, evaluate_styles];
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-evaluate': ScanstitchEvaluate;
  }
}
