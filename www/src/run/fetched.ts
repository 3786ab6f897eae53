/** What is computed elsewhere on request, for what is shown. */
import type { ReactiveControllerHost } from 'lit';

/** An answer that a view shows; requested once for each subject and version, and the last request wins. */
export class Fetched<T> {
  value: T;
  readonly #host: ReactiveControllerHost;
  readonly #none: T;
  #subject: unknown;
  #version: readonly unknown[] | null = null;

  /** `none`: the value while there is no answer. */
  constructor(host: ReactiveControllerHost, none: T) {
    this.#host = host;
    this.#none = none;
    this.value = none;
  }

  /** `ask` null: nothing is wanted. Until the answer to another version of the same subject comes, the earlier one stays. */
  want(subject: unknown, version: readonly unknown[], ask: (() => Promise<T>) | null): void {
    const isOther = subject !== this.#subject;
    if (!isOther && this.#version && version.every((value, i) => value === this.#version?.[i])) return;
    if (isOther || !ask) this.value = this.#none;
    [this.#subject, this.#version] = [subject, version];
    const show = (value: T): void => {
      if (this.#version !== version) return;
      this.value = value;
      this.#host.requestUpdate();
    };
    ask?.().then(show, () => show(this.#none)); // what went wrong is reported by the session that was asked
  }
}
