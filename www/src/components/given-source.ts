/** Fetches what the host page names: one set of files at a time, the one named last. */
import type { ReactiveControllerHost } from 'lit';
import type { GivenSet } from '../datasets/given.js';
import { tellHost } from './host-events.js';

export class GivenSource {
  /** In words, what is being fetched; null where nothing is. */
  activity: string | null = null;
  progress = 0;
  #aborter: AbortController | null = null;
  readonly #host: ReactiveControllerHost & EventTarget;

  constructor(host: ReactiveControllerHost & EventTarget) {
    this.#host = host;
  }

  /** Null: something else was asked for meanwhile. */
  async fetch(addresses: readonly string[]): Promise<GivenSet | null> {
    this.cancel();
    const aborter = new AbortController();
    this.#aborter = aborter;
    const { signal } = aborter;
    try {
      const { fetchGiven } = await import('../datasets/given.js');
      const given = await fetchGiven(addresses, { signal, fetched: (done, total) => this.#tell(signal, done, total) });
      return signal.aborted ? null : given;
    } catch (error) {
      if (signal.aborted) return null;
      aborter.abort(); // the others that are on their way are of no use
      throw error;
    } finally {
      if (this.#aborter === aborter) this.cancel();
    }
  }

  cancel(): void {
    this.#aborter?.abort();
    this.#aborter = null;
    this.activity = null;
    this.#host.requestUpdate();
  }

  #tell(signal: AbortSignal, done: number, total: number): void {
    if (signal.aborted) return;
    this.progress = done / Math.max(total, 1);
    this.activity = `Fetching file ${Math.min(done + 1, total)} of ${total}`;
    this.#host.requestUpdate();
    tellHost(this.#host, 'scanstitch-progress', {
      stage: 'fetching',
      progress: this.progress,
      activity: this.activity,
    });
  }
}
