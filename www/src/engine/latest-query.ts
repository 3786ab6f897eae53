/** Queries of which the latest counts: while one is answered, only the last one after it waits. */

export interface LatestHooks<Query, Result> {
  compute(query: Query): Promise<Result>;
  /** `is_latest`: none waits that was asked after it. */
  answered(query: Query, result: Result, is_latest: boolean): void;
  failed(query: Query, error: unknown): void;
}

export class LatestQuery<Query, Result> {
  readonly #hooks: LatestHooks<Query, Result>;
  #next: { query: Query } | null = null;
  #is_busy = false;

  constructor(hooks: LatestHooks<Query, Result>) {
    this.#hooks = hooks;
  }

  /** Asks; an older query that has not been begun is dropped. */
  ask(query: Query): void {
    this.#next = { query };
    if (!this.#is_busy) void this.#answerAll();
  }

  /** The query that waits is dropped; one that is being answered is not. */
  drop(): void {
    this.#next = null;
  }

  async #answerAll(): Promise<void> {
    this.#is_busy = true;
    try {
      while (this.#next) {
        const { query } = this.#next;
        this.#next = null;
        await this.#answer(query);
      }
    } finally {
      this.#is_busy = false;
    }
  }

  async #answer(query: Query): Promise<void> {
    try {
      const result = await this.#hooks.compute(query);
      this.#hooks.answered(query, result, this.#next === null);
    } catch (error) {
      this.#hooks.failed(query, error);
    }
  }
}
