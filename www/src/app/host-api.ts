/** What a host page can do with the element: open files, run, cancel. Documented in package/element.ts. */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { GivenSet } from '../datasets/given.js';
import { isOvertaken, messageOf } from '../engine/message-of.js';
import { isNothing, sayOld } from './host-attributes.js';
import { type ScanstitchResult, tellFault } from '../components/host-events.js';
import type { Message } from '../components/messages.js';
import { STOPPED } from '../components/session.js';

/** The view of a run, as far as the page has to do with it. */
export interface HostedRun {
  /** Whether files are being read or a run is under way, or the engine is starting. */
  readonly isBusy: boolean;
  /** The same, but for an engine that is only starting. */
  readonly isUnderWay: boolean;
  readonly outcome: ScanstitchResult | null;
  computed(): Promise<ScanstitchResult>;
  cancel(): void;
  abandon(reason: string): void;
  readonly session: { refuse(text: string, remedy: string): void };
}

/** Where recordings are opened: the page's workspace. */
interface Opener {
  /** What is being fetched; null where nothing is. */
  readonly activity: string | null;
  begin(): AbortSignal;
  open(coming: (signal: AbortSignal) => Promise<GivenSet>, requestedAt: number): Promise<void>;
  fetch(addresses: readonly string[], signal: AbortSignal): Promise<GivenSet>;
  openSample(): Promise<void>;
  openApartment(): Promise<void>;
  clear(): void;
  cancel(reason: unknown): void;
  /** The element was removed from the page. */
  leave(): void;
}

export interface HostHooks {
  /** The run that is shown, or lies behind a view beside it; null before there is one. */
  run(): HostedRun | null;
  runs(): HostedRun[];
}

const REMOVED = 'The element was removed from the page before the run was done';

function faultMessage(text: string, remedy: string): Message {
  return { kind: 'error', file: '', place: '', text, remedy };
}

/** The module that reads what a host names is fetched when it is first needed. */
const fromHost = (): Promise<typeof import('../datasets/given.js')> => import('../datasets/given.js');

type Host = ReactiveControllerHost & HTMLElement & { readonly hasUpdated: boolean };

export class HostApi implements ReactiveController {
  /** What is wrong with the attributes. */
  #refused: readonly Message[] = [];
  /** What concerns the element and no run: it stays when another run is opened. */
  #told: readonly Message[] = [];
  readonly #opener: Opener;
  readonly #host: Host;
  readonly #hooks: HostHooks;
  /** What was asked for last. */
  #opening: Promise<void> = Promise.resolve();
  #cancelling = new AbortController();

  constructor(host: Host, opener: Opener, hooks: HostHooks) {
    this.#host = host;
    this.#opener = opener;
    this.#hooks = hooks;
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
    if (addresses.length > 0) return this.#replace((signal) => this.#opener.fetch(addresses, signal));
    const files = list.filter((one) => typeof one !== 'string');
    const named = files.map((file) => ({ name: file.webkitRelativePath || file.name, file }));
    return this.#replace(async () => (await fromHost()).givenFiles(named));
  }

  /** What the attribute `src` may hold. */
  openSource(src: string): Promise<void> {
    if (!isNothing(src) && src !== 'sample' && src !== 'apartment') {
      return this.#replace(async (signal) => this.#opener.fetch((await fromHost()).addressesOf(src), signal));
    }
    return this.#wait(this.#openOwn(src, this.#opener.begin()));
  }

  /** A sample, or nothing; an element that was put on the page just now has no views yet. */
  async #openOwn(src: string, signal: AbortSignal): Promise<void> {
    if (!this.#host.hasUpdated) await this.#host.updateComplete;
    signal.throwIfAborted();
    if (src === 'apartment') await this.#opener.openApartment();
    else if (src === 'sample') await this.#opener.openSample();
    else this.#opener.clear();
  }

  async run(): Promise<ScanstitchResult> {
    const { signal } = this.#cancelling;
    await this.#host.updateComplete;
    await this.#opening;
    const run = this.#hooks.run();
    signal.throwIfAborted();
    if (!this.#host.isConnected) throw new Error(REMOVED);
    if (!run) throw new Error('There is nothing to compute');
    return run.outcome ?? run.computed();
  }

  cancel(): void {
    this.#cancelling.abort(new Error(STOPPED));
    this.#cancelling = new AbortController();
    this.#opener.cancel(new DOMException(STOPPED, 'AbortError'));
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

  /** Keeps the page for use offline, if the host asks for it. */
  async keepOffline(offline: boolean | string): Promise<void> {
    if (offline === false) return;
    try {
      const { keepForOffline } = await import('./offline.js');
      await keepForOffline(offline === true ? 'scanstitch-offline.js' : offline);
    } catch (error) {
      this.report(`The page is not kept for use offline: ${messageOf(error)}`, 'Online it works as before');
    }
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

  /** Opens a recording in place of the current one. */
  #replace(coming: (signal: AbortSignal) => Promise<GivenSet>): Promise<void> {
    return this.#wait(this.#openGiven(coming));
  }

  /** What goes wrong is shown in the element: a host that does not wait for it need not catch it. */
  #wait(opening: Promise<void>): Promise<void> {
    opening.catch(() => undefined);
    this.#opening = opening;
    return opening;
  }

  async #openGiven(coming: (signal: AbortSignal) => Promise<GivenSet>): Promise<void> {
    try {
      await this.#opener.open(coming, performance.now());
    } catch (error) {
      if (!isOvertaken(error))
        this.#hooks.run()?.session.refuse(`Nothing was opened: ${messageOf(error)}`, 'Drop files of your own');
      throw error;
    }
    if (!this.#hooks.run()?.isBusy) throw new Error('Nothing that was given can be used');
  }

  /** Not moved, but removed: what was under way has come to its end. */
  #onRemoved(): void {
    const runs = this.#hooks.runs();
    if (this.#opener.activity !== null || runs.some((run) => run.isUnderWay)) {
      tellFault(this.#host, {
        file: '',
        place: '',
        text: REMOVED,
        remedy: 'Add the element to the page again to restart the computation',
      });
    }
    this.#opener.leave();
    runs.forEach((run) => run.abandon(REMOVED));
  }
}
