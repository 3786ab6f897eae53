/** The page's side of a comparison: the worker that places frames, those that prepare them, and what is known so far. */
import { SpatialRun } from '../../../package/run/spatial_run.js';
import { StrategyRace } from '../../../package/run/strategy_race.js';
import {
  addPreparers,
  AHEAD,
  NUM_CORES,
  problemOf,
  type SpatialJob,
  type ThreadPreparer,
  tolerate,
} from '../engine/preparer.js';
import { WorkerHost } from '../engine/worker-host.js';
import type {
  ComparerApi,
  StrategyListener,
  StrategyPreset,
  StrategyResult,
  StrategyRunner,
  VoxelOdometrySettings,
} from './protocol.js';
import type { GivenRecording } from '../run/run-kind.js';
import workerUrl from './strategies-worker.ts?worker&url';

/** Results are asked for at most this often while frames come in, ... */
const RESULT_INTERVAL_MS = 1500;
/** ... and take at most this share of the time: they cost more with every frame. */
const RESULT_SHARE = 0.1;

/** Strategies on depth images and clouds. */
export class StrategyClient implements StrategyRunner {
  #listener: StrategyListener;
  #host: WorkerHost<ComparerApi>;
  #preparers: ThreadPreparer[] = [];
  #stopping: AbortController | null = null;
  #race: StrategyRace | null = null;
  #nextResults = 0;

  constructor(listener: StrategyListener) {
    this.#listener = listener;
    // The running comparison fails, and reports it.
    this.#host = new WorkerHost<ComparerApi>(workerUrl, {
      crashed: () => this.stop(),
      slow: listener.slow,
      unavailable: (message) => {
        this.stop();
        listener.unavailable(message);
      },
    });
  }

  presets(): Promise<readonly StrategyPreset<VoxelOdometrySettings>[]> {
    return this.#host.start();
  }

  async run(given: GivenRecording, strategies: readonly StrategyPreset<VoxelOdometrySettings>[]): Promise<boolean> {
    const stopping = new AbortController();
    this.#stopping = stopping;
    const remote = this.#host;
    const { jobs, intrinsics, reference, num_recorded } = given.inputs;
    await remote.call(
      'create',
      strategies.map(({ settings }) => settings),
      given.settings,
    );
    if (intrinsics) {
      await tolerate(this.#listener, intrinsics.path, async () =>
        remote.call('setIntrinsics', intrinsics.path, await intrinsics.read()),
      );
    }
    if (reference) {
      await tolerate(this.#listener, reference.path, async () =>
        remote.call('setReference', reference.path, await reference.read(), num_recorded),
      );
    }
    const race = new StrategyRace(
      {
        offer: (bytes) => remote.give('offer', [bytes.buffer], bytes),
        place: (strategy) => remote.call('place', strategy),
      },
      strategies.length,
      { isOver: () => stopping.signal.aborted },
    );
    this.#race = race;
    this.#nextResults = performance.now() + RESULT_INTERVAL_MS;
    const run = this.#makeRun(race, jobs.length);
    // Colours say nothing here, and take time to read.
    run.add(jobs.map((job) => ({ ...job, color: null })));
    const { state } = await run.run(stopping.signal);
    if (race !== this.#race) return false;
    await this.#tellResults(race);
    if (state === 'done') remote.succeeded();
    return state === 'done';
  }

  stop(): void {
    this.#stopping?.abort();
  }

  retire(strategy: number): void {
    this.#race?.retire(strategy);
  }

  dispose(): void {
    this.stop();
    this.#host.dispose();
    for (const preparer of this.#preparers.splice(0)) preparer.end();
  }

  #makeRun(race: StrategyRace, total: number): SpatialRun<SpatialJob> {
    // One core is left to the strategies, which are being timed.
    addPreparers(this.#preparers, NUM_CORES - 1);
    let done = 0;
    return new SpatialRun<SpatialJob>({
      preparers: this.#preparers,
      ...AHEAD,
      registrar: {
        begin: async ({ name, file }) => this.#host.call('begin', name, await file.read()),
        place: async (bytes) => {
          const progress = await race.place(bytes);
          if (performance.now() >= this.#nextResults) await this.#tellResults(race);
          return progress;
        },
        finish: () => race.finish(),
      },
      onEvent: (event) => {
        if (race !== this.#race) return;
        if (event.type === 'problem') this.#listener.problem(problemOf(event.error, event.name));
        if (event.type === 'problem' || event.type === 'registered') this.#listener.progressed(++done, total);
      },
    });
  }

  async #tellResults(race: StrategyRace): Promise<void> {
    const start = performance.now();
    const results: StrategyResult[] = [];
    for (const [strategy, times] of race.milliseconds.entries()) {
      if (race !== this.#race) return;
      results.push(await this.#host.call('result', strategy, times));
    }
    const cost = performance.now() - start;
    this.#nextResults = performance.now() + Math.max(RESULT_INTERVAL_MS, cost / RESULT_SHARE);
    if (race !== this.#race) return;
    this.#listener.results(
      results,
      race.milliseconds.map((times) => [...times]),
    );
  }
}
