/**
 * Handles files that were dropped or picked: they are opened, classified, and passed to their view. The topics of a bag can be
 * chosen again.
 */
import type { ReactiveControllerHost } from 'lit';
import type { Note } from '../datasets/note.js';
import type { NamedFile } from '../datasets/gather.js';
import type { GivenSet } from '../datasets/given.js';
import type { ListedBag } from '../../../package/bag/bag_recordings.js';
import type { BagListener, OpenedFiles, tellApart } from '../datasets/spatial-files.js';
import type { BagState, Wishes } from './topics-panel.js';

/** The module that opens files is fetched when the first files are opened. */
const reader = (): Promise<typeof import('../datasets/spatial-files.js')> => import('../datasets/spatial-files.js');

type Recognised = Awaited<ReturnType<typeof tellApart>>;

export interface IntakeHooks {
  /** The kind of run on the page: what a trajectory alone belongs to. */
  present(): Parameters<typeof tellApart>[1];
  /** Waits for a part of the page that is being loaded. */
  loaded<T>(loading: Promise<T>): Promise<T>;
  /**
   * Hands the files to the view that they are for. `is_new`: they are a recording that was not open; `given`: they are what
   * the host page names.
   */
  show(files: Recognised, requested_at: number, is_new: boolean, given: GivenSet | null): Promise<void>;
}

/** What is open of a bag. */
interface Open {
  bag: BagState | null;
  opened: OpenedFiles | null;
}

/** How files were asked for. */
interface OpeningRequest {
  own: number;
  wishes: Wishes;
  requested_at: number;
  /** What was open when they were. */
  before: Open;
  /** Whether they are other topics of the bag that is open. */
  is_choice: boolean;
  given: GivenSet | null;
}

/** How far a bag has been inspected is reported at most this often. */
const PROGRESS_INTERVAL_MS = 100;

export class FileIntake {
  /** The bag that is open, or being opened; null where the files are none. */
  bag: BagState | null = null;
  #open: Open = { bag: null, opened: null };
  /** The bag of the recording that stepped aside. */
  #other: Open = { bag: null, opened: null };
  /** Counts what was asked for: the last one wins. */
  #num_taken = 0;
  readonly #host: ReactiveControllerHost;
  readonly #hooks: IntakeHooks;

  constructor(host: ReactiveControllerHost, hooks: IntakeHooks) {
    this.#host = host;
    this.#hooks = hooks;
  }

  /** Shows the recording that was replaced by the current one. */
  exchange(): void {
    this.#num_taken++;
    [this.#open, this.#other] = [this.#other, this.#open];
    this.#setBag(this.#open.bag);
  }

  /** What is being opened is no longer wanted; what is open stays. */
  cancel(): void {
    this.#num_taken++;
    this.#setBag(this.#open.bag);
  }

  /** Something else was opened: what is being opened is no longer wanted, and the bag is closed. */
  forget(): void {
    this.#num_taken++;
    this.#other = this.#open;
    this.#open = { bag: null, opened: null };
    this.#setBag(null);
  }

  /** Opens files that were requested at clock time `requested_at`; `notes` are about other files of the same drop. */
  async take(
    files: readonly NamedFile[],
    requested_at: number,
    notes: readonly Note[] = [],
    given: GivenSet | null = null,
  ): Promise<void> {
    const own = ++this.#num_taken;
    const asked = { own, wishes: {}, requested_at, before: this.#open, is_choice: false, given };
    const opening = this.#hooks.loaded(reader()).then(({ openFiles }) => openFiles(files, this.#listener(own, {})));
    await this.#show(
      opening.then((opened) => ({ ...opened, notes: [...notes, ...opened.notes] })),
      asked,
    );
  }

  /** Opens other topics of the bag. */
  async choose(wishes: Wishes): Promise<void> {
    const { opened } = this.#open;
    if (!opened) return;
    const own = ++this.#num_taken;
    const { chooseTopics } = await this.#hooks.loaded(reader());
    const opening = chooseTopics(opened, wishes, this.#listener(own, wishes));
    await this.#show(opening, {
      own,
      wishes,
      requested_at: performance.now(),
      before: this.#open,
      is_choice: true,
      given: null,
    });
  }

  async #show(opening: Promise<OpenedFiles>, asked: OpeningRequest): Promise<void> {
    const { own, wishes, requested_at, before, is_choice, given } = asked;
    const opened = await opening.catch((error: unknown) => {
      if (own !== this.#num_taken) return;
      this.#setBag(this.#open.bag);
      throw error;
    });
    if (!opened || own !== this.#num_taken) return;
    const recognised = await (await reader()).tellApart(opened, this.#hooks.present());
    if (own !== this.#num_taken) return;
    const is_new = recognised.is_recording && !is_choice;
    if (is_new) this.#other = before;
    if (recognised.bag) {
      const { listed, choice } = recognised.bag;
      this.#open = { bag: { listed, choice, wishes, activity: '' }, opened };
    } else if (this.#open.opened && !recognised.is_recording) {
      // A reference trajectory or a camera, for the recording that is open.
      const files = [...this.#open.opened.files, ...opened.files];
      this.#open = { ...this.#open, opened: { ...this.#open.opened, files } };
    } else {
      this.#open = { bag: null, opened: null };
    }
    this.#setBag(this.#open.bag);
    await this.#hooks.show(recognised, requested_at, is_new, given);
  }

  /** A bag's topics are shown as soon as they are known, before its messages are inspected. */
  #listener(own: number, wishes: Wishes): BagListener {
    let next_at = 0;
    const report = (change: () => BagState): void => {
      if (own !== this.#num_taken) throw new Error('The bag is no longer wanted.');
      if (performance.now() < next_at) return;
      next_at = performance.now() + PROGRESS_INTERVAL_MS;
      this.#setBag(change());
    };
    let listed: ListedBag | null = null;
    return {
      walking: (done, total) => {
        report(() => {
          void import('./topics-panel.js');
          const activity = `The bag has no index: reading all of it, ${Math.floor((100 * done) / total)} %`;
          return { listed, choice: null, wishes, activity };
        });
      },
      listed: async ([first]) => {
        await import('./topics-panel.js');
        if (own !== this.#num_taken || !first) return;
        listed = first;
        this.#setBag({ listed, choice: null, wishes, activity: 'Inspecting the messages' });
      },
      looking: (done, total) => {
        report(() => ({ listed, choice: null, wishes, activity: `Inspecting message ${done} of ${total}` }));
      },
    };
  }

  #setBag(bag: BagState | null): void {
    this.bag = bag;
    this.#host.requestUpdate();
  }
}
