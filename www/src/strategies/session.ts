/** A comparison of strategies on one recording: which ones, how far it is, what each has cost and gained. */
import type { ReactiveControllerHost } from 'lit';
import type { Compared } from '../../../package/report/strategy_table.js';
import { errorMessage, noteMessage, Session } from '../components/session.js';
import { LastRequest } from '../engine/last-request.js';
import { messageOf } from '../engine/message-of.js';
import type { PointSet } from '../views/point-layer.js';
import { plural } from '../views/format.js';
import { StrategyClient } from './client.js';
import { PlanarRace } from './planar-race.js';
import {
  type GivenToCompare,
  isPlanar,
  sameRecording,
  type StrategyListener,
  type StrategyPreset,
  type StrategyRunner,
} from './protocol.js';

/** Number of strategies, from the first, that are selected initially. */
const NUM_CHOSEN = 3;

export class StrategiesSession extends Session<StrategyRunner> {
  given: GivenToCompare | null = null;
  presets: readonly StrategyPreset[] = [];
  /** Names of those that run at the next comparison. */
  chosen: ReadonlySet<string> = new Set();
  /** Those that run, or ran last. */
  compared: readonly StrategyPreset[] = [];
  results: readonly Compared[] = [];
  milliseconds: readonly (readonly number[])[] = [];
  /** Those of planar scans. */
  maps: readonly PointSet[] = [];
  /** Indices of those that were left out while it ran. */
  retired: ReadonlySet<number> = new Set();
  /** Frames that went through all strategies, and frames in all; of planar scans the strategies. */
  done = 0;
  total = 1;
  readonly #onOver: () => void;
  readonly #running = new LastRequest();

  /** `onOver` is called when a comparison is done or was stopped. */
  constructor(host: ReactiveControllerHost & EventTarget, onOver: () => void) {
    super(host);
    this.#onOver = onOver;
    this.phase = 'empty';
  }

  override hostConnected(): void {
    super.hostConnected();
    this.#list().catch(() => undefined); // reported as `unavailable`
  }

  override restart(): void {
    this.phase = 'empty';
    super.restart();
    this.#list().catch(() => undefined);
  }

  protected override leave(): void {
    super.leave();
    this.#running.end();
    if (this.phase === 'running') this.phase = 'stopped';
  }

  protected override createClient(): StrategyRunner {
    const listener: StrategyListener = {
      progressed: (done, total, words = '') => {
        Object.assign(this, { done, total, activity: words });
        this.changed();
      },
      results: (results, milliseconds, maps = []) => {
        Object.assign(this, { results, milliseconds, maps });
        this.changed();
      },
      problem: (problem) => this.tell([errorMessage(problem)]),
      ...this.faults,
    };
    return this.isPlanar ? new PlanarRace(listener) : new StrategyClient(listener);
  }

  get isPlanar(): boolean {
    return isPlanar(this.given);
  }

  get num_frames(): number {
    return Math.max(0, ...this.results.map(({ frames }) => frames.length));
  }

  async compare(): Promise<void> {
    const { client, given } = this;
    if (!client || !given) return;
    const signal = this.#running.begin();
    client.stop();
    this.phase = 'running';
    this.messages = [];
    this.results = [];
    this.retired = new Set();
    this.done = 0;
    this.activity = '';
    this.total = isPlanar(given) ? this.chosen.size : given.inputs.jobs.length;
    this.changed();
    try {
      if (this.presets.length === 0) await this.#list();
      if (signal.aborted) return;
      this.compared = this.presets.filter(({ name }) => this.chosen.has(name));
      const isDone = await client.run(given, this.compared);
      if (!signal.aborted) this.#onEnd(isDone);
    } catch (error) {
      if (signal.aborted || this.isUnavailable) return;
      this.phase = 'crashed';
      this.report(messageOf(error));
    }
  }

  /** Of another recording, what was found of the one before is gone; other settings of its map are one more strategy. */
  begin(given: GivenToCompare | null): void {
    const before = this.given;
    this.given = given;
    if (this.client && isPlanar(before) !== this.isPlanar) {
      this.presets = [];
      this.leave();
      this.client = this.createClient();
    }
    this.#list().catch(() => undefined); // reported as `unavailable`
    if (given && before && sameRecording(given, before)) return;
    this.#running.end();
    this.client?.stop();
    this.phase = 'empty';
    this.messages = [];
    this.results = [];
    this.compared = [];
    this.maps = [];
    this.changed();
  }

  /** Strategies on planar scans run one after the other, so that all but the last one are over. */
  canRetire(index: number): boolean {
    return (
      this.phase === 'running' && !this.retired.has(index) && (!this.isPlanar || index === this.results.length - 1)
    );
  }

  stop(): void {
    this.client?.stop();
  }

  /** Leaves a strategy as it stands; the others go on. */
  retire(index: number): void {
    this.client?.retire(index);
    this.retired = new Set([...this.retired, index]);
    this.changed();
  }

  chooseAll(): void {
    this.chosen = new Set(this.presets.map(({ name }) => name));
    this.changed();
  }

  toggle(name: string): void {
    const chosen = new Set(this.chosen);
    if (!chosen.delete(name)) chosen.add(name);
    this.chosen = chosen;
    this.changed();
  }

  /** What can be chosen. */
  async #list(): Promise<void> {
    const { client } = this;
    if (!client) return;
    const [presets, known] = [await client.presets(this.given), new Set(this.presets.map(({ name }) => name))];
    if (client !== this.client) return;
    const isChosen = (name: string, at: number): boolean =>
      this.chosen.has(name) || (!known.has(name) && (at < NUM_CHOSEN || this.isPlanar));
    this.chosen = new Set(presets.flatMap(({ name }, at) => (isChosen(name, at) ? name : [])));
    this.presets = presets;
    this.changed();
  }

  #onEnd(isDone: boolean): void {
    this.phase = isDone ? 'done' : 'stopped';
    const notes = new Set(this.results.flatMap((result) => result.notes));
    this.tell([...notes].map((text) => noteMessage('', text)));
    this.announce(`${isDone ? 'Compared' : 'Stopped'}: ${plural(this.num_frames, 'frame')}.`);
    if (this.num_frames === 0) {
      this.results = [];
      if (isDone) this.phase = 'crashed';
    }
    this.changed();
    this.#onOver();
  }
}
