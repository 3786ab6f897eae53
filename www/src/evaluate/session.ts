/** What the evaluation works on: trajectories, maps, options, and what the engine found of them. */
import { errorMessage, noteMessage, Session } from '../components/session.js';
import type { GivenFiles } from '../run/run-kind.js';
import type { Note } from '../datasets/note.js';
import type { NamedFile } from '../datasets/gather.js';
import { messageOf } from '../engine/message-of.js';
import { memoizeLast } from '../views/memoize-last.js';
import { sorted } from '../views/sorted.js';
import { WorkerClient } from './client.js';
import evaluateUrl from './evaluate-worker.ts?worker&url';
import mapUrl from './sharpness-worker.ts?worker&url';
import { skippedWords } from './notices.js';
import { type Intake, openFiles } from './open-files.js';
import type {
  Command,
  Comparison,
  EvaluationOptions,
  MapQuery,
  MapResult,
  Part,
  Query,
  Result,
  TimesFile,
  TrajectoryFile,
} from './protocol.js';
import type { Sort } from './ranking-view.js';
import { referenceAmong } from './roles.js';
import { columnsOf, formatValue } from './table.js';

type Alignment = NonNullable<EvaluationOptions['alignment']>;
const NO_COMPARISONS: readonly Comparison[] = [];

/** Whether the motions agree; of too few to tell, whether there are as many poses. */
function isOfOneRecording({ summary: { motions_agree, num_reference, num_estimate } }: Comparison): boolean {
  return motions_agree ?? num_reference === num_estimate;
}

/** A file beside the trajectories, which can be taken away. */
export type AuxiliaryId = 'times' | 'relations' | 'clouds';

/** What the user chooses. */
interface Choices {
  referenceId: number;
  /** Those that were changed; the others are as `EvaluateSession.options` has them. */
  options: Partial<EvaluationOptions>;
  loops_only: boolean;
}

type Clients = { trajectories: WorkerClient<Command, Query, Result>; dispose(): void };

export class EvaluateSession extends Session<Clients> {
  files: readonly TrajectoryFile[] = [];
  choices: Choices = { referenceId: -1, options: {}, loops_only: false };
  times: TimesFile | null = null;
  relations: Part | null = null;
  clouds: readonly Part[] = [];
  result: Result | null = null;
  mapResult: MapResult | null = null;
  isJudgingMap = false;
  selectedId = -1;
  sort: Sort = { id: 'rmse', isDescending: false };
  /** The run that was given, until all is removed. */
  run: GivenFiles | null = null;
  /** Id of the run's trajectory, which is never chosen as the reference by itself; -1 without a run. */
  runId = -1;
  /** Ids of the run's trajectory and its reference. */
  #ofRun: readonly number[] = [];
  /** Changes with every new set of files. */
  dataKey = 0;
  /** Ids of the trajectories that were dropped together beside a run, until the answer tells whether they belong to it. */
  #dropped: readonly number[] = [];
  readonly #onResult: (result: Result) => void;
  #mapClient: WorkerClient<never, MapQuery, MapResult> | null = null;
  #nextId = 0;
  readonly #hooks = {
    ...this.faults,
    failed: (message: string): void => this.#onFailed(message),
    unavailable: (message: string): void => {
      this.isJudgingMap = false;
      this.onUnavailable(message);
    },
  };
  /** What the maps were last judged with. */
  #judged = '';
  #rankedBy = memoizeLast((comparisons: readonly Comparison[], { id, isDescending }: Sort) => {
    const columns = columnsOf(comparisons[0]?.summary.unit ?? '', this.options, true);
    const column = columns.find((candidate) => candidate.id === id) ?? columns[0];
    return column ? sorted(comparisons, (one) => column.value(one), isDescending) : comparisons;
  });
  #orderOf = memoizeLast((files: readonly TrajectoryFile[], referenceId: number) =>
    files.map(({ id }) => id).filter((id) => id !== referenceId),
  );

  #optionsWith = memoizeLast((alignment: Alignment, chosen: Partial<EvaluationOptions>) => ({ alignment, ...chosen }));

  /** `onResult` is called when a result of the engine is to be drawn. */
  constructor(host: ConstructorParameters<typeof Session>[0], onResult: (result: Result) => void) {
    super(host);
    this.#onResult = onResult;
    this.phase = 'empty';
  }

  protected override createClient(): Clients {
    const trajectories = new WorkerClient<Command, Query, Result>(evaluateUrl, {
      answered: (result) => this.#onAnswered(result),
      ...this.#hooks,
      greet: () => ({ add: this.files, remove: [] }),
    });
    return {
      trajectories,
      dispose: () => {
        trajectories.dispose();
        this.#mapClient?.dispose();
        this.#mapClient = null;
      },
    };
  }

  override restart(): void {
    super.restart();
    this.#judged = '';
    this.client?.trajectories.tell({ add: this.files, remove: [] });
    this.#ask();
    if (this.files.length === 0) this.#judge();
  }

  /**
   * How the poses are compared. A run and its own reference are compared as the run itself does it: with the first poses made
   * equal, where both have orientations.
   */
  get options(): Partial<EvaluationOptions> {
    const { run } = this;
    const isRunAlone = this.files.every(({ id }) => this.#ofRun.includes(id));
    return this.#optionsWith(run && isRunAlone ? run.alignment : 'se3', this.choices.options);
  }

  get referenceName(): string {
    return this.files.find(({ id }) => id === this.choices.referenceId)?.name ?? '';
  }

  get comparisons(): readonly Comparison[] {
    return this.result?.comparisons ?? NO_COMPARISONS;
  }

  /** From the best to the worst, or as the table is sorted. */
  get ranked(): readonly Comparison[] {
    return this.#rankedBy(this.comparisons, this.sort);
  }

  /** The estimates as they were opened, by their ids. */
  get order(): readonly number[] {
    return this.#orderOf(this.files, this.choices.referenceId);
  }

  /** Adds files; the first time, the one whose name says so is the reference, else the first. `unreadable`: dropped with them. */
  async open(named: readonly NamedFile[], unreadable: readonly Note[] = []): Promise<void> {
    if (named.length + unreadable.length === 0) return;
    this.requestedAt = performance.now();
    const intake = await openFiles(named);
    const { problems, skipped } = intake;
    problems.push(...unreadable.map(({ file, reason }) => `${file}: ${reason}`));
    this.messages = [];
    this.tell([
      ...problems.map((problem) => errorMessage({ file: '', place: null, problem, remedy: '' })),
      ...skippedWords(skipped).map((text) => noteMessage('', text)),
    ]);
    this.#take(intake, problems.length > 0);
  }

  /** Restarts with a run of the reconstruction. */
  begin(run: GivenFiles): void {
    const { reference, estimate } = run;
    this.requestedAt = performance.now();
    this.clear();
    this.run = run;
    const bytes = new TextEncoder().encode(estimate.text);
    const own = { id: this.#nextId++, name: estimate.name, parts: [{ name: estimate.name, bytes }] };
    this.runId = own.id;
    this.#ofRun = [own.id];
    if (!reference) {
      this.#add([own]);
      return;
    }
    const part = { name: reference.name, bytes: new Uint8Array(reference.bytes.slice(0)) };
    const file = { id: this.#nextId++, name: reference.name, parts: [part] };
    this.choices = { ...this.choices, referenceId: file.id };
    this.#ofRun = [file.id, own.id];
    this.#add([file, own]);
  }

  /** Repeats the comparison with other choices. */
  choose(choices: Partial<Choices>): void {
    this.requestedAt = performance.now();
    this.choices = { ...this.choices, ...choices };
    this.#ask();
  }

  select(id: number): void {
    this.selectedId = id;
    this.changed();
  }

  sortBy(sort: Sort): void {
    this.sort = sort;
    this.changed();
  }

  removeEstimate(id: number): void {
    this.requestedAt = performance.now();
    this.files = this.files.filter((file) => file.id !== id);
    this.client?.trajectories.tell({ add: [], remove: [id] });
    this.#ask();
  }

  removeAuxiliary(id: AuxiliaryId): void {
    this.requestedAt = performance.now();
    if (id === 'times') this.times = null;
    else if (id === 'relations') this.relations = null;
    else {
      this.#clearMaps();
    }
    this.#ask();
  }

  clear(): void {
    this.client?.trajectories.drop();
    this.client?.trajectories.tell({ add: [], remove: this.files.map(({ id }) => id) });
    this.files = [];
    this.times = this.relations = this.result = null;
    this.#clearMaps();
    this.messages = [];
    this.#forgetRun();
    this.choices = { ...this.choices, referenceId: -1, options: {} };
    this.phase = 'empty';
    this.changed();
  }

  /** Judges the map of the run that was given. */
  async judgeRun(): Promise<void> {
    const { run } = this;
    if (!run) return;
    this.isJudgingMap = true;
    this.changed();
    try {
      const bytes = await run.readMap();
      if (run !== this.run) return;
      this.clouds = [...this.clouds, { name: `${run.estimate.name}.ply`, bytes }];
      this.#judge();
    } catch (error) {
      if (run !== this.run) return;
      this.#onFailed(messageOf(error));
    }
  }

  #take({ trajectories, times, relations, clouds }: Intake, hasProblems: boolean): void {
    this.times = times ? { ...times, id: this.#nextId++ } : this.times;
    this.relations = relations ?? this.relations;
    this.clouds = [...this.clouds, ...clouds];
    const files = trajectories.map((found) => ({ ...found, id: this.#nextId++ }));
    if (this.runId >= 0 && files.length > 1) this.#dropped = files.map(({ id }) => id);
    this.#add(files);
    const isAnything = trajectories.length + clouds.length > 0 || times !== null || relations !== null;
    if (!isAnything && !hasProblems) this.report('None of these files is a trajectory or a map.');
    if (this.files.length === 0) this.#judge();
  }

  #add(files: readonly TrajectoryFile[]): void {
    if (this.files.length === 0) this.dataKey++;
    this.files = [...this.files, ...files];
    this.client?.trajectories.tell({ add: files, remove: [] });
    if (!this.files.some(({ id }) => id === this.choices.referenceId)) {
      const candidates = this.files.filter(({ id }) => id !== this.runId);
      const referenceId = candidates[referenceAmong(candidates.map(({ name }) => name))]?.id ?? -1;
      this.choices = { ...this.choices, referenceId };
    }
    this.#ask();
  }

  /**
   * Trajectories of another recording than the run's, dropped together, are compared among themselves: the run is left out.
   * Whether this is so, and another answer is under way.
   */
  #leavesRun({ comparisons, referenceProblem }: Result): boolean {
    const dropped = referenceProblem === null ? this.#dropped : [];
    this.#dropped = [];
    const belongs = (id: number): boolean => comparisons.some((one) => one.id === id && isOfOneRecording(one));
    const isReferenceDropped = dropped.includes(this.choices.referenceId);
    if (dropped.length === 0 || (isReferenceDropped ? belongs(this.runId) : dropped.some(belongs))) return false;
    const ofRun = this.#ofRun;
    this.#forgetRun();
    this.files = this.files.filter(({ id }) => !ofRun.includes(id));
    this.client?.trajectories.tell({ add: [], remove: ofRun });
    this.tell([noteMessage('', 'The files are of another recording than the open run, which was left out.')]);
    this.dataKey++;
    this.#add([]);
    return true;
  }

  #forgetRun(): void {
    this.run = null;
    this.runId = -1;
    this.#ofRun = this.#dropped = [];
  }

  #ask(): void {
    if (this.isUnavailable) {
      this.restart();
      return;
    }
    const { referenceId: reference, loops_only } = this.choices;
    if (reference < 0) {
      this.client?.trajectories.drop();
      this.result = null;
    } else {
      this.phase = 'running';
      const { order: estimates, times, relations, options } = this;
      this.client?.trajectories.ask({ reference, estimates, options, times, relations, loops_only });
    }
    this.changed();
  }

  #onAnswered(result: Result): void {
    if (this.#leavesRun(result)) return;
    this.result = result;
    this.phase = 'done';
    if (result.realigned !== null) {
      this.choices = { ...this.choices, options: { ...this.choices.options, alignment: 'se3' } };
      const done = 'All are aligned by SE(3) instead. Other choices are under “Alignment”.';
      this.tell([noteMessage('', `${result.realigned} ${done}`)]);
    }
    const [first] = this.ranked;
    if (!result.comparisons.some(({ id }) => id === this.selectedId)) this.selectedId = first?.id ?? -1;
    if (first) {
      const { statistics, unit } = first.summary;
      this.announce(
        `${result.comparisons.length} compared. ${first.name}: rmse ${formatValue(statistics.rmse)} ${unit}`,
      );
    }
    this.#judge();
    this.changed();
    this.#onResult(result);
  }

  #onFailed(message: string): void {
    this.isJudgingMap = false;
    this.phase = 'crashed';
    this.messages = [];
    this.report(message);
  }

  /** Clouds that are as many as a trajectory's poses are its frames; others are maps. */
  #judge(): void {
    if (this.clouds.length === 0) return;
    const trajectories =
      this.clouds.length > 1 ? this.files.filter(({ id }) => this.#numPoses(id) === this.clouds.length) : [];
    const areFrames = trajectories.length > 0;
    const judged = [this.clouds.map(({ name }) => name), trajectories.map(({ id }) => id)].join('/');
    if (judged === this.#judged) return;
    this.#judged = judged;
    this.isJudgingMap = true;
    this.#mapClient ??= new WorkerClient<never, MapQuery, MapResult>(mapUrl, {
      answered: (result) => this.#onJudged(result),
      ...this.#hooks,
    });
    this.#mapClient.ask({
      maps: areFrames ? [] : this.clouds,
      frames: areFrames ? this.clouds : [],
      trajectories,
    });
    this.changed();
  }

  #clearMaps(): void {
    this.#mapClient?.drop();
    this.clouds = [];
    this.mapResult = null;
    this.isJudgingMap = false;
    this.#judged = '';
  }

  #onJudged(result: MapResult): void {
    this.mapResult = result;
    this.isJudgingMap = false;
    this.announce('The sharpness of the map has been computed.');
    this.changed();
  }

  #numPoses(id: number): number {
    const { comparisons } = this;
    if (id === this.choices.referenceId) return comparisons[0]?.summary.num_reference ?? 0;
    return comparisons.find((comparison) => comparison.id === id)?.summary.num_estimate ?? 0;
  }
}
