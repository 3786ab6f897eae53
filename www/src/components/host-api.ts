/** What a host page can do with the element: open files, run, cancel. Documented in package/element.ts. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { NamedFile } from '../datasets/gather.js';
import type { GivenSet } from '../datasets/given.js';
import { messageOf } from '../engine/message-of.js';
import { GivenSource } from './given-source.js';
import { isNothing, sayOld } from './host-attributes.js';
import { type ScanstitchResult, tellFault } from './host-events.js';
import type { Message } from './messages.js';
import { STOPPED } from './session.js';

/** The view of a run, as far as the page has to do with it. */
export interface HostedRun {
  /** Whether files are being read or a run is under way, or the engine is starting. */
  readonly is_busy: boolean;
  /** The same, but for an engine that is only starting. */
  readonly is_under_way: boolean;
  readonly outcome: ScanstitchResult | null;
  computed(): Promise<ScanstitchResult>;
  cancel(): void;
  clear(): void;
  abandon(reason: string): void;
  refuse(text: string, remedy: string): void;
}

export interface HostHooks {
  /** The run that is shown, or lies behind a view beside it; null before there is one. */
  run(): HostedRun | null;
  runs(): HostedRun[];
  /** Forgets what is being opened for another reason. */
  forget(): void;
  take(files: readonly NamedFile[], requested_at: number, given: GivenSet): Promise<void>;
  openSample(): void;
  openApartment(): Promise<void>;
}

const REMOVED = 'The element was removed from the page before the run was done';

function faultMessage(text: string, remedy: string): Message {
  return { kind: 'error', file: '', place: '', text, remedy };
}

/** The module that reads what a host names is fetched when it is first needed. */
export const fromHost = (): Promise<FromHost> => import('../datasets/given.js');
type FromHost = typeof import('../datasets/given.js');

type Host = ReactiveControllerHost & HTMLElement & { readonly hasUpdated: boolean };

export class HostApi implements ReactiveController {
  /** What is wrong with the attributes. */
  #refused: readonly Message[] = [];
  /** What concerns the element and no run: it stays when another run is opened. */
  #told: readonly Message[] = [];
  readonly source: GivenSource;
  readonly #host: Host;
  readonly #hooks: HostHooks;
  /** What was asked for last. */
  #opening: Promise<void> = Promise.resolve();
  #num_cancelled = 0;
  /** Counts what was asked for or cancelled: what was asked for before that is no longer wanted. */
  #num_begun = 0;

  constructor(host: Host, hooks: HostHooks) {
    this.#host = host;
    this.#hooks = hooks;
    this.source = new GivenSource(host);
    host.addController(this);
  }

  hostDisconnected(): void {
    queueMicrotask(() => {
      if (!this.#host.isConnected) this.#onRemoved();
    });
  }

  open(source: string | readonly string[] | Iterable<File>): Promise<void> {
    if (source === '') sayOld("open('')", "open('sample')");
    if (typeof source === 'string') return this.openSource(source || 'sample');
    const list: readonly (string | File)[] = [...source];
    const addresses = list.filter((one) => typeof one === 'string');
    if (addresses.length > 0) return this.#replace(() => this.source.fetch(addresses));
    const files = list.filter((one) => typeof one !== 'string');
    const named = files.map((file) => ({ name: file.webkitRelativePath || file.name, file }));
    return this.#replace(async ({ givenFiles }) => givenFiles(named));
  }

  /** What the attribute `src` may hold. */
  openSource(src: string): Promise<void> {
    if (!isNothing(src) && src !== 'sample' && src !== 'apartment') {
      return this.#replace(async ({ addressesOf }) => this.source.fetch(addressesOf(src)));
    }
    this.#begin();
    this.#opening = this.#openOwn(src);
    return this.#opening;
  }

  /** A sample, or nothing; an element that was put on the page just now has no views yet. */
  async #openOwn(src: string): Promise<void> {
    if (!this.#host.hasUpdated) await this.#host.updateComplete;
    if (src === 'apartment') await this.#hooks.openApartment();
    else if (src === 'sample') this.#hooks.openSample();
    else this.#hooks.run()?.clear();
  }

  async run(): Promise<ScanstitchResult> {
    const num_cancelled = this.#num_cancelled;
    await this.#host.updateComplete;
    await this.#opening;
    const run = this.#hooks.run();
    if (num_cancelled !== this.#num_cancelled) throw new Error(STOPPED);
    if (!this.#host.isConnected) throw new Error(REMOVED);
    if (!run) throw new Error('There is nothing to compute');
    return run.outcome ?? run.computed();
  }

  cancel(): void {
    this.#num_cancelled++;
    this.#stopFetching();
    this.#hooks.run()?.cancel();
  }

  get notices(): readonly Message[] {
    return [...this.#refused, ...this.#told];
  }

  /** Says in the element what is wrong with what the page asks of it. */
  refuse(texts: readonly string[]): void {
    const refused = texts.map((text) => faultMessage(text, ''));
    this.#refused = [...this.#refused, ...refused];
    this.#raise(refused);
  }

  /** The attributes have changed: what was wrong with them is past. */
  forgetRefused(): void {
    this.#refused = [];
  }

  /** Shown above every view; `retry` does what failed once more, and the message goes. What takes the message away is returned. */
  report(text: string, remedy: string, retry?: () => void): () => void {
    const message = faultMessage(text, remedy);
    const withdraw = (): void => {
      this.#told = this.#told.filter((other) => other !== message);
      this.#host.requestUpdate();
    };
    if (retry)
      message.retry = () => {
        withdraw();
        retry();
      };
    this.#told = [...this.#told, message];
    this.#raise([message]);
    return withdraw;
  }

  dismiss(): void {
    this.#refused = [];
    this.#told = [];
    this.#host.requestUpdate();
  }

  #raise(messages: readonly Message[]): void {
    this.#host.requestUpdate();
    messages.forEach((message) => tellFault(this.#host, message));
  }

  #stopFetching(): void {
    this.#num_begun++;
    this.source.cancel();
  }

  #begin(): void {
    this.#stopFetching();
    this.#hooks.forget();
    this.#opening = Promise.resolve();
  }

  /** Opens a recording in place of the current one. */
  #replace(coming: (host: FromHost) => Promise<GivenSet | null>): Promise<void> {
    this.#begin();
    this.#opening = this.#openGiven(coming, performance.now());
    return this.#opening;
  }

  async #openGiven(coming: (host: FromHost) => Promise<GivenSet | null>, requested_at: number): Promise<void> {
    const own = this.#num_begun;
    try {
      const host = await fromHost();
      const given = own === this.#num_begun ? await coming(host) : null;
      if (!given) throw new DOMException('Something else was asked for meanwhile', 'AbortError');
      await this.#hooks.take(given.files, requested_at, given);
    } catch (error) {
      const is_overtaken = error instanceof DOMException && error.name === 'AbortError';
      if (!is_overtaken) this.#hooks.run()?.refuse(`Nothing was opened: ${messageOf(error)}`, 'Drop files of your own');
      throw error;
    }
    if (!this.#hooks.run()?.is_busy) throw new Error('Nothing that was given can be used');
  }

  /** Not moved, but removed: what was under way has come to its end. */
  #onRemoved(): void {
    const runs = this.#hooks.runs();
    if (this.source.activity !== null || runs.some((run) => run.is_under_way)) {
      tellFault(this.#host, {
        file: '',
        place: '',
        text: REMOVED,
        remedy: 'Add the element to the page again to restart the computation',
      });
    }
    this.#stopFetching();
    runs.forEach((run) => run.abandon(REMOVED));
  }
}
