/** The view's side of a worker of the evaluation: one query at a time, the latest wins. */
import { WorkerDied } from '../engine/remote.js';
import { WorkerHost } from '../engine/worker-host.js';
import type { QueryApi } from './protocol.js';

export interface ClientHooks<Command, Result> {
  answered(result: Result): void;
  failed(message: string): void;
  slow(is_slow: boolean): void;
  unavailable(message: string): void;
  /** The data that a worker must receive before its first query, also after a crash. */
  greet?(): Command;
}

export class WorkerClient<Command, Query, Result> {
  #host: WorkerHost<QueryApi<Command, Query, Result>>;
  #hooks: ClientHooks<Command, Result>;
  #is_busy = false;
  #next_query: { query: Query } | null = null;

  constructor(worker_url: string, hooks: ClientHooks<Command, Result>) {
    this.#hooks = hooks;
    this.#host = new WorkerHost<QueryApi<Command, Query, Result>>(worker_url, {
      crashed: (message) => this.#onCrash(message),
      slow: (is_slow) => hooks.slow(is_slow),
      unavailable: (message) => hooks.unavailable(message),
    });
  }

  /** Told before all queries that follow. */
  tell(command: Command): void {
    this.#host.call('tell', command).catch((error: unknown) => this.#onFailure(error));
  }

  /** Asks; an older query that has not been begun is dropped, and the answer to it never comes. */
  ask(query: Query): void {
    this.#next_query = { query };
    if (!this.#is_busy) void this.#answerNext();
  }

  dispose(): void {
    this.#next_query = null;
    this.#host.dispose();
  }

  async #answerNext(): Promise<void> {
    this.#is_busy = true;
    while (this.#next_query) {
      const { query } = this.#next_query;
      this.#next_query = null;
      try {
        const result = await this.#host.call('ask', query);
        this.#host.succeeded();
        if (this.#next_query === null) this.#hooks.answered(result as Result);
      } catch (error) {
        this.#onFailure(error);
      }
    }
    this.#is_busy = false;
  }

  #onCrash(message: string): void {
    this.#next_query = null;
    this.#hooks.failed(`The evaluation crashed: ${message}. It was started anew; please report this.`);
    const command = this.#hooks.greet?.();
    if (command !== undefined) this.tell(command);
  }

  /** The crash of a worker is reported elsewhere. */
  #onFailure(error: unknown): void {
    if (error instanceof WorkerDied || this.#host.has_ended) return;
    this.#hooks.failed(error instanceof Error ? error.message : String(error));
  }
}
