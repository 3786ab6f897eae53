/** Strategies on planar scans: presets of the reconstruction and the settings of the map, one run after the other in the worker of planar scans. */
import { comparedPlanar } from '../../../package/report/planar_strategies.js';
import type { Compared } from '../../../package/report/strategy_table.js';
import type { GivenScans } from '../run/run-kind.js';
import { PlanarClient } from '../engine/planar-client.js';
import type { EngineFacts, Progress, RunState, Settings, Snapshot } from '../engine/protocol.js';
import type { PointSet } from '../views/point-layer.js';
import { changeWords, sameSettings } from '../views/setting-fields.js';
import type { StrategyListener, StrategyPreset, StrategyRunner } from './protocol.js';

/** Changed settings that are named in a label; of more, how many. */
const MOST_NAMED = 2;

export class PlanarRace implements StrategyRunner {
  readonly #listener: StrategyListener;
  readonly #client: PlanarClient;
  readonly #facts: Promise<EngineFacts>;
  #results: Compared[] = [];
  #maps: PointSet[] = [];
  #milliseconds: (readonly number[])[] = [];
  /** The strategy that runs, and how many there are. */
  #strategy = 0;
  #count = 0;
  #isStopped = false;
  #end: { over(state: RunState): void; fail(error: Error): void } = { over: () => undefined, fail: () => undefined };

  constructor(listener: StrategyListener) {
    this.#listener = listener;
    let ready: (facts: EngineFacts) => void;
    let fail: (error: Error) => void;
    this.#facts = new Promise((resolve, reject) => ([ready, fail] = [resolve, reject]));
    this.#facts.catch(() => undefined); // reported as `unavailable`
    this.#client = new PlanarClient({
      ready: (facts) => ready(facts),
      reading: () => undefined,
      loaded: (_, { accepted, problems }) => {
        problems.forEach((problem) => listener.problem(problem));
        if (accepted.length === 0) this.#end.over('stopped');
      },
      progress: (progress) => this.#onProgress(progress),
      snapshot: (state, snapshot) => this.#onSnapshot(state, snapshot),
      rejected: (problem) => {
        listener.problem(problem);
        // A file that is to blame is left out, and the others are read again.
        if (problem.file === '') this.#end.over('stopped');
      },
      refused: () => undefined,
      crashed: (message) => this.#end.fail(new Error(message)),
      slow: listener.slow,
      unavailable: (message) => {
        fail(new Error(message));
        this.#end.fail(new Error(message));
        listener.unavailable(message);
      },
    });
  }

  /** The engine's, and the settings of the map where they are none of those. */
  async presets(given: GivenScans | null): Promise<readonly StrategyPreset<Settings>[]> {
    const { presets, descriptions } = await this.#facts;
    const [usual] = presets;
    if (!given || !usual) return presets;
    const settings = { ...usual.settings, ...given.settings };
    if (presets.some((preset) => sameSettings(preset.settings, settings))) return presets;
    const words = changeWords(descriptions, usual.settings, settings);
    const label = words.length > MOST_NAMED ? `${words.length} settings changed` : words.join('; ');
    const explanation = `The settings of the map. Compared with ${usual.label}: ${words.join('; ')}`;
    return [...presets, { name: words.join('; '), label, explanation, settings }];
  }

  /** Runs these strategies over the scans; whether all came to their end. */
  async run({ inputs }: GivenScans, strategies: readonly StrategyPreset<Settings>[]): Promise<boolean> {
    this.#results = [];
    this.#maps = [];
    this.#milliseconds = [];
    this.#isStopped = false;
    this.#count = strategies.length;
    for (const [strategy, { settings }] of strategies.entries()) {
      this.#strategy = strategy;
      const over = new Promise<RunState>((resolve, reject) => (this.#end = { over: resolve, fail: reject }));
      if (strategy === 0) this.#client.load({ ...inputs }, settings);
      else this.#client.configure(settings);
      await over;
      if (this.#isStopped || !this.#results[strategy]) return false;
    }
    return true;
  }

  stop(): void {
    this.#isStopped = true;
    this.#client.stop();
  }

  /** The strategy that runs is left as it stands, and the next one follows. */
  retire(strategy: number): void {
    if (strategy === this.#strategy) this.#client.stop();
  }

  dispose(): void {
    this.#client.dispose();
    this.#end.fail(new Error('The comparison was ended'));
  }

  #onProgress({ stage, done, total }: Progress): void {
    const share = stage === 'register' ? done / Math.max(total, 1) : 1;
    const words = `Strategy ${this.#strategy + 1} of ${this.#count}, ${Math.round(100 * share)} % of the scans`;
    this.#listener.progressed(this.#strategy + share, this.#count, words);
  }

  #onSnapshot(state: RunState, { result, mapOffsets, map_points, timing }: Snapshot): void {
    if (result.frames.length > 0) {
      const sizes = result.frames.map((_, at) => (mapOffsets[at + 1] ?? 0) - (mapOffsets[at] ?? 0));
      this.#results[this.#strategy] = comparedPlanar(result, sizes, timing.frames, timing.total - timing.load);
      this.#maps[this.#strategy] = { points: map_points, offsets: mapOffsets };
      this.#milliseconds[this.#strategy] = timing.frames;
      this.#listener.results([...this.#results], [...this.#milliseconds], [...this.#maps]);
    }
    if (state !== 'running') this.#end.over(state);
  }
}
