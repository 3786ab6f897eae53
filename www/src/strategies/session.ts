/** A comparison of strategies on one recording: which ones, how far it is, what each has cost and gained. */
import type { ReactiveControllerHost } from 'lit';
import { errorMessage, noteMessage, Session } from '../components/session.js';
import type { GivenRecording } from '../components/run-kind.js';
import { LastRequest } from '../engine/last-request.js';
import { messageOf } from '../engine/message-of.js';
import { plural } from '../views/format.js';
import { StrategyClient } from './client.js';
import type { StrategyPreset, StrategyResult } from './protocol.js';

/** Number of strategies, from the first, that are selected initially. */
const NUM_CHOSEN = 3;

export class StrategiesSession extends Session<StrategyClient> {
  presets: readonly StrategyPreset[] = [];
  /** Names of those that run at the next comparison. */
  chosen: ReadonlySet<string> = new Set();
  /** Those that run, or ran last. */
  compared: readonly StrategyPreset[] = [];
  results: readonly StrategyResult[] = [];
  milliseconds: readonly (readonly number[])[] = [];
  /** Indices of those that were left out while it ran. */
  retired: ReadonlySet<number> = new Set();
  /** Frames that went through all strategies, and frames in all. */
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

  protected override createClient(): StrategyClient {
    return new StrategyClient({
      progressed: (done, total) => {
        this.done = done;
        this.total = total;
        this.changed();
      },
      results: (results, milliseconds) => {
        this.results = results;
        this.milliseconds = milliseconds;
        this.changed();
      },
      problem: (problem) => this.tell([errorMessage(problem)]),
      ...this.faults,
    });
  }

  get num_frames(): number {
    return Math.max(0, ...this.results.map(({ frames }) => frames.length));
  }

  async compare(given: GivenRecording): Promise<void> {
    const { client } = this;
    if (!client) return;
    const signal = this.#running.begin();
    client.stop();
    this.phase = 'running';
    this.messages = [];
    this.results = [];
    this.retired = new Set();
    this.done = 0;
    this.total = given.inputs.jobs.length;
    this.changed();
    try {
      await this.#list();
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

  /** Another recording: what was found of the one before is gone. */
  begin(): void {
    this.#running.end();
    this.client?.stop();
    this.phase = 'empty';
    this.messages = [];
    this.results = [];
    this.compared = [];
    this.changed();
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
    if (this.presets.length > 0 || !this.client) return;
    this.presets = await this.client.presets();
    this.chosen = new Set(this.presets.slice(0, NUM_CHOSEN).map(({ name }) => name));
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
