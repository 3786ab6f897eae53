/** The ICP lab: two clouds, one or several methods that register them from the same start, and the selected iteration. */
import type { ReactiveControllerHost } from 'lit';
import type { GivenClouds } from '../run/given-clouds.js';
import { Session } from '../components/session.js';
import { LastRequest } from '../engine/last-request.js';
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { messageOf } from '../engine/message-of.js';
import { LabClient } from './client.js';
import { readPair, withChoice } from './clouds.js';
import { DEFAULTS } from './defaults.js';
import { KeptIterations } from './kept-iterations.js';
import { Player } from './player.js';
import { between, IDENTITY } from './poses.js';
import type { LabFacts, LabIteration, LabTrace, Options, Pose } from './protocol.js';
import { type LabRun, newRun, startProblem, traceOfPoses, withStart } from './runs.js';
import { followedStride, isTooLarge, tooLarge, voxelToThin } from './thinning.js';
import { numPoses, poseAt } from './trace.js';
import { stateWords } from './words.js';

/** Methods that are compared at most. */
export const MAX_RUNS = 4;
/** Time without movement after which all points are paired during a drag (ms). */
const RESTING_MS = 200;

export class LabSession extends Session<LabClient> {
  given: GivenClouds | null = null;
  runs: readonly LabRun[] = [];
  active = 0;
  /** Before the first iteration; null is what the method's options say. */
  start: Pose | null = null;
  /** Where the source is drawn. */
  pose: Pose = IDENTITY;
  /** The step from the pose, or from the one that the source has just left; null while it is unknown. */
  iteration: LabIteration | null = null;
  /** Steps done before `iteration`: those before `at` while the pairs there are searched; null where the source was dragged to. */
  iterationIndex: number | null = null;
  /** The source follows the hand. */
  isDragged = false;
  /** The clouds are in the frame of a camera: x right, y down, z forward. */
  isOfCamera = false;
  /** Changes with the clouds, so that views are fitted again. */
  generation = 0;
  readonly player: Player;
  #iterations = new KeptIterations();
  #nextId = 1;
  readonly #opening = new LastRequest();
  readonly #looking = new LastRequest();
  #isToBeTold = false;
  /** What was said of the start before. */
  #startProblem = '';
  #resting: ReturnType<typeof setTimeout> | undefined;

  constructor(host: ReactiveControllerHost & EventTarget) {
    super(host);
    this.phase = 'empty';
    this.player = new Player(
      () => this.#onMove(),
      () => this.#onArrived(),
    );
  }

  get run(): LabRun | null {
    return this.runs.find(({ id }) => id === this.active) ?? null;
  }

  get facts(): LabFacts | null {
    return this.run?.facts ?? null;
  }

  get trace(): LabTrace | null {
    return this.run?.trace ?? null;
  }

  /** The selected iteration, as the number of steps before it. */
  get at(): number {
    return Math.floor(this.player.at + 1e-9);
  }

  /** The step from where the player is; null while it is computed, and where the source follows the hand. */
  get present(): LabIteration | null {
    return this.iterationIndex === this.at ? this.iteration : null;
  }

  protected override leave(): void {
    clearTimeout(this.#resting);
    this.player.stop();
    super.leave();
    this.#iterations.clear();
  }

  protected override createClient(): LabClient {
    return new LabClient({
      crashed: (message) =>
        this.tellCrash(message, 'The clouds are still there.', 'Change the method or the start, and it runs again'),
      ...this.faults,
    });
  }

  override restart(): void {
    super.restart();
    if (this.given) void this.open(this.given, this.run?.options ?? null, this.start);
  }

  /** Takes two clouds and registers them. `options` and `start`: null keeps what is set. */
  async open(given: GivenClouds, options: Options | null = null, start: Pose | null = null): Promise<void> {
    const signal = this.#opening.begin();
    this.#looking.end();
    this.given = given;
    this.phase = 'reading';
    this.activity = 'Reading the clouds';
    this.messages = [];
    this.start = start ?? given.init_T_target_source;
    this.requestedAt = performance.now();
    const known = options ?? (given.options as Options | null) ?? this.run?.options ?? {};
    this.#reset([newRun(this.#nextId++, known)]);
    this.changed();
    try {
      const [source, target] = await readPair(given);
      if (signal.aborted || !this.client) return;
      this.client.open(source, target);
      this.isOfCamera = target.kind === 'depth' || (target.kind === 'positions' && target.isOfCamera === true);
      this.generation++;
      if (options === null && given.options === null) await this.#dropUnfit(known);
      await this.#runAll();
    } catch (error) {
      if (!signal.aborted) this.#onProblem(error);
    }
  }

  /** The metric of the clouds before may not be one of these: then it is the engine's choice. */
  async #dropUnfit(options: Options): Promise<void> {
    const { client, active } = this;
    if (!client || options.metric === undefined) return;
    const { metric: _, ...others } = options;
    await client.prepare(active, options).catch(() => this.#change(active, { options: others }));
  }

  /** Another cloud of the same list as source or target. */
  choose(role: 'source' | 'target', name: string): void {
    if (!this.given) return;
    void this.open(withChoice(this.given, role, name), this.run?.options ?? null);
  }

  /** Sets the options of the selected method. */
  configure(options: Options): void {
    this.iteration = null;
    this.#change(this.active, { options, trace: null, problem: '' });
    this.#iterations.forget(this.active);
    void this.#runOne(this.active);
  }

  /** Adds a method and selects it. */
  async addRun(options: Options): Promise<void> {
    if (this.runs.length >= MAX_RUNS) return;
    // Until it is prepared, the clouds are shown as they are known.
    const run = { ...newRun(this.#nextId++, options), facts: this.facts };
    this.runs = [...this.runs, run];
    this.active = run.id;
    this.iteration = null;
    await this.#runOne(run.id);
  }

  /** Poses of somebody else's program, beside the engine's: one an iteration, with or without the start before them. */
  async addOwn(name: string, given: readonly (readonly number[])[]): Promise<void> {
    const { client, run, trace } = this;
    if (!client || !run || !trace || given.length === 0) return;
    const all = withStart(given, Array.from(poseAt(trace, 0)));
    const own = { ...newRun(this.#nextId++, run.options, name), trace: traceOfPoses(all) };
    const others = this.runs.filter((one) => one.own === '').slice(0, MAX_RUNS - 1);
    for (const { id } of this.runs.filter((one) => !others.includes(one))) {
      client.forget(id);
      this.#iterations.forget(id);
    }
    this.runs = [...others, own];
    try {
      const facts = await client.prepare(own.id, run.options);
      this.#change(own.id, { facts, comparison: await client.ask('own', own.id, all) });
      this.selectRun(own.id);
    } catch (error) {
      this.#onProblem(error);
    }
  }

  removeRun(id: number): void {
    if (this.runs.length < 2) return;
    this.runs = this.runs.filter((run) => run.id !== id);
    this.client?.forget(id);
    this.#iterations.forget(id);
    if (this.active === id) this.selectRun(this.runs[0]?.id ?? 0);
    this.changed();
  }

  /** Selects another one of the methods, at the same iteration. */
  selectRun(id: number): void {
    const { at } = this;
    this.active = id;
    this.iteration = null;
    this.#startPlayer();
    this.player.seek(Math.min(at, this.player.count));
  }

  // The start.

  /** The source follows the hand: to this pose. */
  drag(T: Pose): void {
    this.player.stop();
    this.isDragged = true;
    this.iterationIndex = null;
    this.pose = T;
    const stride = followedStride(this.facts);
    clearTimeout(this.#resting);
    this.#follow(T, stride);
    // All of them once the hand rests.
    if (stride > 1) this.#resting = setTimeout(() => this.#follow(T, 1), RESTING_MS);
    this.changed();
  }

  #follow(T: Pose, stride: number): void {
    if (!this.isDragged) return;
    this.client?.follow(this.active, T, stride, (iteration) => {
      if (!this.isDragged) return;
      this.iteration = iteration;
      this.changed();
    });
  }

  /** A drag has ended: all methods run from the pose that it has left. */
  async release(plays = true): Promise<void> {
    if (!this.isDragged) return;
    this.#endDrag();
    await this.startFrom(this.pose, plays);
  }

  #endDrag(): void {
    clearTimeout(this.#resting);
    this.client?.unfollow();
    this.isDragged = false;
  }

  /** From this start on; null is where the clouds lie as they are given. */
  async startFrom(T: Pose | null, plays = true): Promise<void> {
    this.start = T ?? this.given?.init_T_target_source ?? null;
    await this.#runAll();
    if (plays) this.player.play();
  }

  /** The iteration of the run at a whole number of steps. */
  async iterationAt(run: LabRun, at: number): Promise<LabIteration | null> {
    const known = this.#iterations.get(run.id, at);
    if (known) return known;
    const { trace } = run;
    if (!trace || !this.client) return null;
    const iteration = await (run.own
      ? this.client.ask('iteration', run.id, poseAt(trace, at), 1)
      : this.client.ask('traced_iteration', run.id, at));
    if (this.runs.find(({ id }) => id === run.id)?.trace === trace) this.#iterations.keep(run.id, at, iteration);
    return iteration;
  }

  /** Selects the next or the previous iteration, and announces it to screen readers. */
  stepBy(direction: 1 | -1): void {
    this.#isToBeTold = true;
    this.player.step(direction);
  }

  // Running.

  async #runAll(): Promise<void> {
    this.player.stop();
    this.#iterations.clear();
    this.runs = this.runs.map((run) => (run.own ? run : { ...run, trace: null, problem: '' }));
    await Promise.all(this.runs.map(({ id, own }) => (own ? this.#prepareOwn(id) : this.#runOne(id))));
  }

  async #prepareOwn(id: number): Promise<void> {
    const run = this.runs.find((one) => one.id === id);
    try {
      if (run && this.client) this.#change(id, { facts: await this.client.prepare(id, run.options) });
    } catch (error) {
      this.#onProblem(error);
    }
  }

  async #runOne(id: number): Promise<void> {
    const { client, start } = this;
    const options = this.runs.find((run) => run.id === id)?.options;
    if (!client || !options || !this.given) return;
    if (id === this.active) this.phase = 'running';
    this.activity = 'Registering';
    this.changed();
    try {
      const facts = await client.prepare(id, options);
      if (options.voxel_size === undefined && isTooLarge(facts)) {
        const voxel_size = await voxelToThin(facts, (size) => client.prepare(id, { ...options, voxel_size: size }));
        this.tell([tooLarge(facts, voxel_size)]);
        this.#change(id, { options: { ...options, voxel_size } });
        return this.#runOne(id);
      }
      const trace = await client.ask('trace', id, start);
      const run = this.runs.find((one) => one.id === id);
      // Overtaken by another change.
      if (run?.options !== options || this.start !== start) return;
      // Indices of the pairs count other points now.
      if (id === this.active && facts !== run.facts) this.iteration = null;
      this.#change(id, { facts, trace, problem: '' });
      if (id === this.active) this.#onTrace(trace);
    } catch (error) {
      this.#change(id, { problem: messageOf(error) });
      if (id === this.active) this.#onProblem(error);
    }
  }

  #onTrace(trace: LabTrace): void {
    this.phase = 'done';
    const reach = this.run?.options.max_correspondence_distance ?? DEFAULTS.max_correspondence_distance;
    this.forget(this.#startProblem);
    const problem = startProblem(trace, reach);
    this.#startProblem = problem?.[0] ?? '';
    if (problem) this.report(...problem);
    this.#startPlayer();
    const start = Array.from(poseAt(trace, 0));
    // What was computed at another pose is not shown as that of this start.
    if (start.some((value, i) => value !== this.pose[i])) this.iteration = null;
    this.pose = start;
    this.#isToBeTold = true;
    this.player.seek(0);
  }

  #onProblem(error: unknown): void {
    this.iteration = null;
    this.phase = this.facts ? 'done' : 'empty';
    if (error instanceof WorkerDied) return; // reported as a crash
    const { problem, remedy } =
      error instanceof EngineProblem ? error.problem : { problem: messageOf(error), remedy: '' };
    this.report(problem, remedy);
  }

  // The selected iteration.

  #startPlayer(): void {
    this.player.reset(Math.max(numPoses(this.trace) - 1, 0));
  }

  #onMove(): void {
    const { trace, player } = this;
    if (!trace || this.isDragged) return;
    const before = Math.min(this.at, player.count);
    const share = player.at - before;
    const from = poseAt(trace, before);
    this.pose = share > 0 ? between(from, poseAt(trace, before + 1), share) : from;
    this.changed();
  }

  /** At an iteration of the run: a pose that the source was dragged to is left. */
  #onArrived(): void {
    this.#endDrag();
    this.#onMove();
    void this.#lookAt(this.at);
  }

  async #lookAt(at: number): Promise<void> {
    const { run } = this;
    if (!run) return;
    const signal = this.#looking.begin();
    try {
      const iteration = await this.iterationAt(run, at);
      if (signal.aborted || this.isDragged || !iteration) return;
      this.iteration = iteration;
      this.iterationIndex = at;
      if (this.#isToBeTold && !this.player.isMoving) {
        this.announce(stateWords(run, at, iteration));
        this.#isToBeTold = false;
      }
      this.changed();
      // The next one is there when it is asked for.
      if (at < this.player.count) await this.iterationAt(run, at + 1);
    } catch (error) {
      if (!signal.aborted && !(error instanceof WorkerDied)) this.#onProblem(error);
    }
  }

  #reset(runs: readonly LabRun[]): void {
    for (const { id } of this.runs) this.client?.forget(id);
    this.player.reset(0);
    this.#iterations.clear();
    this.runs = runs;
    this.active = runs[0]?.id ?? 0;
    this.iteration = null;
    this.isDragged = false;
  }

  #change(id: number, change: Partial<LabRun>): void {
    this.runs = this.runs.map((run) => (run.id === id ? { ...run, ...change } : run));
    this.changed();
  }
}
