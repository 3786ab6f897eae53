/** Requests of which the last one counts: the next one, or an end, aborts the one before. */
export class LastRequest {
  #current: AbortController | null = null;

  begin(): AbortSignal {
    this.end();
    this.#current = new AbortController();
    return this.#current.signal;
  }

  /** What was begun last is no longer wanted. */
  end(reason?: unknown): void {
    this.#current?.abort(reason);
    this.#current = null;
  }
}
