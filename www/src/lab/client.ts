/**
 * The page's side of the lab's workers: one that steps, so that it always answers at once, and two that work through the
 * rows of a landscape or a basin. Each receives the clouds and a method when it first needs them.
 */
import type { CloudData } from '../run/given-clouds.js';
import { LatestQuery } from '../engine/latest-query.js';
import { type Arguments, EngineProblem, type Result, WorkerDied } from '../engine/remote.js';
import { type WorkerFaults, WorkerHost } from '../engine/worker-host.js';
import type { LabApi, LabFacts, LabIteration, LocalMinimum, Options, Pose } from './protocol.js';
import workerUrl from './lab-worker.ts?worker&url';

/** Workers that share a landscape or a basin: the second core is worth it, more are rarely there. */
const NUM_SURVEY_WORKERS = 2;

export interface LabHooks extends WorkerFaults {
  crashed(message: string): void;
}

type Question = 'trace' | 'traced_iteration' | 'iteration' | 'landscape' | 'search_path' | 'basin' | 'label' | 'own';
type Given<K extends Question> = Arguments<LabApi[K]> extends [number, ...infer Rest] ? Rest : never;

/** A pose that follows the hand. */
interface Following {
  method: number;
  T: Pose;
  stride: number;
  answered(iteration: LabIteration): void;
}

interface Pair {
  source: CloudData;
  target: CloudData;
}

/** One worker, and the data that it has received. */
class LabWorker {
  readonly #host: WorkerHost<LabApi>;
  #pair: Pair | null = null;
  /** Rejects where the clouds are refused. */
  #opened: Promise<void> = Promise.resolve();
  #prepared = new Map<number, { options: Options; facts: Promise<LabFacts> }>();

  constructor({ crashed, slow, unavailable }: LabHooks) {
    this.#host = new WorkerHost<LabApi>(workerUrl, {
      crashed: (message) => {
        this.#pair = null;
        crashed(message);
      },
      slow,
      unavailable,
    });
  }

  start(): Promise<string> {
    return this.#host.start();
  }

  prepare(pair: Pair, method: number, options: Options): Promise<LabFacts> {
    if (this.#pair !== pair) {
      this.#pair = pair;
      this.#prepared.clear();
      this.#opened = this.#host.call('open', pair.source, pair.target);
    }
    const known = this.#prepared.get(method);
    if (known?.options === options) return known.facts;
    // The worker keeps the order, so that an error in the clouds is reported before its consequences.
    const facts = Promise.all([this.#opened, this.#host.call('prepare', method, options)]).then(([, found]) => found);
    this.#prepared.set(method, { options, facts });
    return facts;
  }

  async ask<K extends Question>(
    pair: Pair,
    method: number,
    options: Options,
    question: K,
    ...given: Given<K>
  ): Promise<Result<LabApi[K]>> {
    await this.prepare(pair, method, options);
    const answer = await this.#host.call(question, ...([method, ...given] as unknown as Arguments<LabApi[K]>));
    this.#host.succeeded();
    return answer;
  }

  minima(costs: Float64Array, width: number): Promise<LocalMinimum[]> {
    return this.#host.call('minima', costs, width);
  }

  forget(method: number): void {
    if (this.#prepared.delete(method)) this.#host.call('forget', method).catch(() => undefined);
  }

  dispose(): void {
    this.#host.dispose();
  }
}

export class LabClient {
  readonly #hooks: LabHooks;
  readonly #stepper: LabWorker;
  #surveyWorkers: LabWorker[] = [];
  #pair: Pair | null = null;
  #methods = new Map<number, Options>();
  readonly #following = new LatestQuery<Following, LabIteration>({
    compute: ({ method, T, stride }) => this.ask('iteration', method, T, stride),
    answered: ({ answered }, iteration) => answered(iteration),
    failed: (_, error) => {
      // The crash of a worker is reported elsewhere; for a pose that the engine refuses there is nothing to draw.
      if (!(error instanceof WorkerDied || error instanceof EngineProblem)) throw error;
    },
  });

  constructor(hooks: LabHooks) {
    this.#hooks = hooks;
    this.#stepper = new LabWorker(hooks);
  }

  start(): Promise<string> {
    return this.#stepper.start();
  }

  /** Two other clouds; what is known of methods stays. */
  open(source: CloudData, target: CloudData): void {
    this.#pair = { source, target };
    this.#following.drop();
  }

  /** Rejects with an EngineProblem where the clouds or the options are refused. */
  prepare(method: number, options: Options): Promise<LabFacts> {
    this.#methods.set(method, options);
    return this.#stepper.prepare(this.#opened(), method, options);
  }

  forget(method: number): void {
    this.#methods.delete(method);
    for (const worker of [this.#stepper, ...this.#surveyWorkers]) worker.forget(method);
  }

  /** Asks the worker that steps; what each question means is told in `LabApi`. */
  ask<K extends Question>(question: K, method: number, ...given: Given<K>): Promise<Result<LabApi[K]>> {
    return this.#stepper.ask(this.#opened(), method, this.#options(method), question, ...given);
  }

  /** The minima of a landscape, the most prominent first. */
  minima(costs: Float64Array, width: number): Promise<LocalMinimum[]> {
    return this.#stepper.minima(costs, width);
  }

  /** As `ask` for an iteration, for poses that follow the hand: while one is being answered only the latest one after it waits. */
  follow(method: number, T: Pose, stride: number, answered: (iteration: LabIteration) => void): void {
    this.#following.ask({ method, T, stride, answered });
  }

  /** A drag has ended: what it asked is no longer answered. */
  unfollow(): void {
    this.#following.drop();
  }

  /** Starts the workers of surveys and prepares the method in them: what is timed afterwards is computing alone. */
  async prepareWorkers(method: number): Promise<void> {
    const pair = this.#opened();
    while (this.#surveyWorkers.length < NUM_SURVEY_WORKERS) this.#surveyWorkers.push(new LabWorker(this.#hooks));
    await Promise.all(this.#surveyWorkers.map((worker) => worker.prepare(pair, method, this.#options(method))));
  }

  /**
   * Works through `parts` with all workers of surveys; `done` gets each answer as it comes. Ends early, without an error, when
   * `signal` says so.
   */
  async share<K extends 'landscape' | 'basin'>(
    method: number,
    question: K,
    parts: readonly Given<K>[0][],
    done: (part: Given<K>[0], answer: Result<LabApi[K]>) => void,
    signal: AbortSignal,
  ): Promise<void> {
    const pair = this.#opened();
    const options = this.#options(method);
    await this.prepareWorkers(method);
    const waiting = [...parts];
    const work = async (worker: LabWorker): Promise<void> => {
      for (let part = waiting.shift(); part !== undefined && !signal.aborted; part = waiting.shift()) {
        const given = [part] as unknown as Given<K>;
        const answer = await worker.ask(pair, method, options, question, ...given);
        if (!signal.aborted) done(part, answer);
      }
    };
    await Promise.all(this.#surveyWorkers.map(work));
  }

  dispose(): void {
    this.#following.drop();
    for (const worker of [this.#stepper, ...this.#surveyWorkers]) worker.dispose();
  }

  #opened(): Pair {
    if (!this.#pair) throw new Error('No clouds are open.');
    return this.#pair;
  }

  #options(method: number): Options {
    return this.#methods.get(method) ?? {};
  }
}
