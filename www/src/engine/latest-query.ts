/** Queries of which the latest counts: while one is answered, only the last one after it waits. */

export interface LatestHooks<Query, Result> {
  compute(query: Query): Promise<Result>;
  /** `isLatest`: none waits that was asked after it. */
  answered(query: Query, result: Result, isLatest: boolean): void;
  failed(query: Query, error: unknown): void;
}

export class LatestQuery<Query, Result> {
  readonly #hooks: LatestHooks<Query, Result>;
  #next: { query: Query } | null = null;
  /** The query that is being answered, while its answer is awaited. */
  #current: { query: Query } | null = null;
  #isBusy = false;

  constructor(hooks: LatestHooks<Query, Result>) {
    this.#hooks = hooks;
  }

  /** Asks; an older query that has not been begun is dropped. */
  ask(query: Query): void {
    this.#next = { query };
    if (!this.#isBusy) void this.#answerAll();
  }

  /** What was asked so far is dropped: no answer to it comes any more, nor a failure. */
  drop(): void {
    this.#next = null;
    this.#current = null;
  }

  async #answerAll(): Promise<void> {
    this.#isBusy = true;
    try {
      while (this.#next) {
        const current = this.#next;
        this.#next = null;
        await this.#answer(current);
      }
    } finally {
      this.#isBusy = false;
    }
  }

  async #answer(asked: { query: Query }): Promise<void> {
    this.#current = asked;
    const { query } = asked;
    try {
      const result = await this.#hooks.compute(query);
      if (this.#current === asked) this.#hooks.answered(query, result, this.#next === null);
    } catch (error) {
      if (this.#current === asked) this.#hooks.failed(query, error);
    }
  }
}
