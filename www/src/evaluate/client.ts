/** The view's side of a worker of the evaluation: one query at a time, the latest wins. */
import { LatestQuery } from '../engine/latest-query.js';
import { WorkerDied } from '../engine/remote.js';
import { type WorkerFaults, WorkerHost } from '../engine/worker-host.js';
import { messageOf } from '../engine/message-of.js';
import type { QueryApi } from './protocol.js';

export interface ClientHooks<Command, Result> extends WorkerFaults {
  answered(result: Result): void;
  failed(message: string): void;
  /** The data that a worker must receive before its first query, also after a crash. */
  greet?(): Command;
}

export class WorkerClient<Command, Query, Result> {
  #host: WorkerHost<QueryApi<Command, Query, Result>>;
  #hooks: ClientHooks<Command, Result>;
  readonly #queries = new LatestQuery<Query, Result>({
    compute: (query) => this.#ask(query),
    answered: (_, result, isLatest) => {
      if (isLatest) this.#hooks.answered(result);
    },
    failed: (_, error) => this.#onFailure(error),
  });

  constructor(workerUrl: string, hooks: ClientHooks<Command, Result>) {
    this.#hooks = hooks;
    this.#host = new WorkerHost<QueryApi<Command, Query, Result>>(workerUrl, {
      ...hooks,
      crashed: (message) => this.#onCrash(message),
    });
  }

  /** Told before all queries that follow. */
  tell(command: Command): void {
    this.#host.call('tell', command).catch((error: unknown) => this.#onFailure(error));
  }

  /** Asks; an older query that has not been begun is dropped, and the answer to it never comes. */
  ask(query: Query): void {
    this.#queries.ask(query);
  }

  /** What was asked so far is no longer answered. */
  drop(): void {
    this.#queries.drop();
  }

  dispose(): void {
    this.#queries.drop();
    this.#host.dispose();
  }

  async #ask(query: Query): Promise<Result> {
    const result = await this.#host.call('ask', query);
    this.#host.succeeded();
    return result as Result;
  }

  #onCrash(message: string): void {
    this.#queries.drop();
    this.#hooks.failed(`The evaluation crashed: ${message}. It was started anew; please report this.`);
    const command = this.#hooks.greet?.();
    if (command !== undefined) this.tell(command);
  }

  /** The crash of a worker is reported elsewhere. */
  #onFailure(error: unknown): void {
    if (error instanceof WorkerDied || this.#host.hasEnded) return;
    this.#hooks.failed(messageOf(error));
  }
}
