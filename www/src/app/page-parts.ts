/** Parts of the page that are loaded on demand, with messages when one takes long, fails or is missing on the server. */
import { START_PATIENCE_MS } from '../engine/worker-host.js';
import { isOvertaken, messageOf } from '../engine/message-of.js';

export interface PagePartsHooks {
  /** Shows a message, with a button where it can be tried again; the result takes it away. */
  report(text: string, remedy: string, retry?: () => void): () => void;
  /** Loads the whole page again; null where it is a host's. */
  reload(): (() => void) | null;
}

export class PageParts {
  readonly #hooks: PagePartsHooks;

  constructor(hooks: PagePartsHooks) {
    this.#hooks = hooks;
  }

  /** Waits for a part of the page, with a message while it takes long. */
  async loaded<T>(loading: Promise<T>): Promise<T> {
    let withdraw = (): void => undefined;
    const timer = setTimeout(() => {
      const text = `A part of the page has not loaded after ${START_PATIENCE_MS / 1000} s`;
      const remedy = 'Loading continues. If it does not finish, check the connection and reload the page';
      // A module that is being fetched is fetched by no second import: only a reload tries again.
      withdraw = this.#hooks.report(text, remedy, this.#hooks.reload() ?? undefined);
    }, START_PATIENCE_MS);
    try {
      return await loading;
    } finally {
      clearTimeout(timer);
      withdraw();
    }
  }

  /** Tells where something that was asked for fails: a part of the page that cannot be fetched, a file that is gone. */
  attend(work: () => Promise<void>): void {
    work().catch((error: unknown) => {
      if (isOvertaken(error)) return;
      const words = messageOf(error);
      if (!/import(ed|ing)? .*module|module script failed/i.test(words)) {
        this.#hooks.report(words, 'Try again, or reload the page');
        return;
      }
      const [part = ''] = /[^/]+$/.exec(words) ?? [];
      this.#hooks.report(
        `A part of the page could not be loaded (${part}): the connection was lost, or a new version was put on the server`,
        'If trying again does not help, export your results and reload the page',
        () => this.attend(work),
      );
    });
  }
}
