/**
 * What becomes of files that were dropped or picked: they are opened, told apart, and handed to the view that they are for.
 * Of a bag, the topics can be chosen anew.
 */
import type { ReactiveControllerHost } from 'lit';
import type { NamedFile } from '../datasets/gather.js';
import type { GivenSet } from '../datasets/given.js';
import { type BagListener, chooseTopics, type OpenedFiles, openFiles, tellApart } from '../datasets/spatial-files.js';
import type { BagState, Wishes } from './topics-panel.js';

type Recognised = Awaited<ReturnType<typeof tellApart>>;

export interface IntakeHooks {
  /** The kind of run on the page: what a trajectory alone belongs to. */
  present(): Parameters<typeof tellApart>[1];
  /** Hands the files to the view that they are for. */
  /** `given`: they are what the page that the element stands on names. */
  show(files: Recognised, requested_at: number, given: GivenSet | null): Promise<void>;
}

/** What may join the recording that is open: a reference trajectory, a camera. */
const isBeside = (path: string): boolean => /\.(npy|txt|tum|csv|log|traj|json)$/i.test(path);
/** How far a bag has been inspected is reported at most this often. */
const PROGRESS_INTERVAL_MS = 100;

export class FileIntake {
  /** The bag that is open; null where the files are none. */
  bag: BagState | null = null;
  #opened: OpenedFiles | null = null;
  /** Counts what was asked for: the last one wins. */
  #num_taken = 0;
  readonly #host: ReactiveControllerHost;
  readonly #hooks: IntakeHooks;

  constructor(host: ReactiveControllerHost, hooks: IntakeHooks) {
    this.#host = host;
    this.#hooks = hooks;
  }

  /** Something else was opened: what is being opened is no longer wanted, and the bag is closed. */
  forget(): void {
    this.#num_taken++;
    this.#setBag(null);
    this.#opened = null;
  }

  /** Opens files that were asked for at clock time `requested_at`. */
  async take(files: readonly NamedFile[], requested_at: number, given: GivenSet | null = null): Promise<void> {
    const own = ++this.#num_taken;
    await this.#show(openFiles(files, this.#listener(own, {})), own, {}, requested_at, given);
  }

  /** Opens other topics of the bag. */
  async choose(wishes: Wishes): Promise<void> {
    if (!this.#opened) return;
    const own = ++this.#num_taken;
    const opening = chooseTopics(this.#opened, wishes, this.#listener(own, wishes));
    await this.#show(opening, own, wishes, performance.now());
  }

  async #show(
    opening: Promise<OpenedFiles>,
    own: number,
    wishes: Wishes,
    requested_at: number,
    given: GivenSet | null = null,
  ): Promise<void> {
    const opened = await opening;
    if (own !== this.#num_taken) return;
    const recognised = await tellApart(opened, this.#hooks.present());
    if (own !== this.#num_taken) return;
    if (recognised.bag) {
      const { listed, choice } = recognised.bag;
      this.#opened = opened;
      this.#setBag({ listed, choice, wishes, activity: '' });
    } else if (this.#opened && opened.files.every(({ path }) => isBeside(path))) {
      this.#opened = { ...this.#opened, files: [...this.#opened.files, ...opened.files] };
    } else {
      this.#opened = null;
      this.#setBag(null);
    }
    await this.#hooks.show(recognised, requested_at, given);
  }

  /** A bag's topics are shown as soon as they are known, before its messages are inspected. */
  #listener(own: number, wishes: Wishes): BagListener {
    let next_at = 0;
    return {
      listed: async ([listed]) => {
        await import('./topics-panel.js');
        if (own !== this.#num_taken || !listed) return;
        this.#setBag({ listed, choice: null, wishes, activity: 'Inspecting the messages' });
      },
      looking: (done, total) => {
        if (own !== this.#num_taken || !this.bag || performance.now() < next_at) return;
        next_at = performance.now() + PROGRESS_INTERVAL_MS;
        this.#setBag({ ...this.bag, activity: `Inspecting message ${done} of ${total}` });
      },
    };
  }

  #setBag(bag: BagState | null): void {
    this.bag = bag;
    this.#host.requestUpdate();
  }
}
