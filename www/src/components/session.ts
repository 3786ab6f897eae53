/**
 * What the sessions of all views have in common. A session holds what a view works on and what can be done with it, and no
 * markup; it asks its host to draw again when something has changed.
 */
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import { printable } from '../../../package/base/printable.js';
import type { Opened } from '../datasets/dataset.js';
import type { Problem } from '../engine/protocol.js';
import { fetchAgain } from '../engine/start.js';
import { START_PATIENCE_MS, type WorkerFaults } from '../engine/worker-host.js';
import type { SettingsFacts } from '../views/settings-link.js';
import { Announcer } from './announcer.js';
import { tellFault } from './host-events.js';
import type { Message } from './messages.js';

/** What the page is doing. */
export type Phase = 'starting' | 'empty' | 'reading' | 'running' | 'stopped' | 'done' | 'crashed' | 'unavailable';

interface Disposable {
  dispose(): void;
}

/** What is said where none of the files that were given can be used. */
export const noneUsable = (numFiles: number): string =>
  numFiles === 1 ? 'The file cannot be used' : `None of the ${numFiles} files can be used`;

/** Why there is no result. */
export const STOPPED = 'The run was stopped';

export const SLOW = `The engine has not loaded after ${START_PATIENCE_MS / 1000} s`;
const SLOW_REMEDY = 'Loading continues. If it does not finish, check the connection and try again';
const RELOAD_REMEDY =
  'If trying again does not help, reload the page. A browser version from the last two years is needed';

/** A client of the engine that lives as long as its host is on the page, with its progress, messages and announcements. */
export abstract class Session<Client extends Disposable> implements ReactiveController {
  phase: Phase = 'starting';
  /** Share of the work done, 0..1, and in words what is being worked on. */
  progress = 0;
  activity = '';
  messages: readonly Message[] = [];
  readonly announcer = new Announcer(() => this.changed());
  /** Clock time at which the present computation was asked for. */
  requestedAt = 0;
  /** Null while its host is not on the page. */
  client: Client | null = null;
  readonly #host: ReactiveControllerHost & EventTarget;
  #isAway = false;
  /** Its client is of no use any more. */
  protected isUnavailable = false;

  constructor(host: ReactiveControllerHost & EventTarget) {
    this.#host = host;
    host.addController(this);
  }

  hostConnected(): void {
    this.#isAway = false;
    this.client ??= this.createClient();
  }

  /** A host that is moved within the page is disconnected for a moment; its work continues. */
  hostDisconnected(): void {
    this.#isAway = true;
    queueMicrotask(() => {
      if (this.#isAway) this.leave();
    });
  }

  /** Its host was removed from the page. */
  protected leave(): void {
    this.client?.dispose();
    this.client = null;
    this.isUnavailable = false;
  }

  /** Restarts with another engine, and repeats the last request. */
  restart(): void {
    this.messages = this.messages.filter(({ retry }) => retry === undefined);
    fetchAgain();
    this.leave();
    this.client = this.createClient();
  }

  /** It is no longer wanted, though its host is still on the page. */
  end(): void {
    this.#host.removeController(this);
    this.leave();
  }

  protected abstract createClient(): Client;

  /** What a client is to do with the faults of its worker. */
  protected readonly faults: WorkerFaults = {
    slow: (isSlow) => this.onSlow(isSlow),
    unavailable: (message) => this.onUnavailable(message),
  };

  /** The host is to be drawn again. */
  changed(): void {
    this.#host.requestUpdate();
  }

  /** `told`: what is said when it is done; `remedy`: what else can be done where it is not. */
  async copy(
    text: string,
    told: string,
    remedy = 'Select the lines, or the address of the page, and copy them',
  ): Promise<void> {
    try {
      await navigator.clipboard.writeText(text);
      this.announce(told);
    } catch {
      this.report('The browser did not allow copying', remedy);
    }
  }

  announce(text: string): void {
    this.announcer.announce(text);
  }

  dismissMessages(): void {
    this.messages = [];
    this.changed();
  }

  /** A message of the page's own, about no file. `retry` does what failed once more, and the message goes. */
  report(text: string, remedy = '', retry?: () => void): void {
    const message = errorMessage({ file: '', place: null, problem: text, remedy });
    this.tell([retry ? this.#retriable(message, retry) : message]);
  }

  #retriable(message: Message, retry: () => void): Message {
    const act = (): void => {
      this.forget(message.text);
      retry();
    };
    return Object.assign(message, { retry: act });
  }

  /** What was said in these words no longer holds. */
  protected forget(text: string): void {
    const rest = this.messages.filter((message) => message.text !== text);
    if (rest.length === this.messages.length) return;
    this.messages = rest;
    this.changed();
  }

  /** Shows messages, errors first, and announces the errors. */
  tell(messages: readonly Message[]): void {
    const all = [...this.messages, ...messages];
    this.messages = [...all.filter(({ kind }) => kind === 'error'), ...all.filter(({ kind }) => kind === 'note')];
    const errors = messages.filter(({ kind }) => kind === 'error');
    errors.forEach((error) => this.raise(error));
    this.announce(errors.map(({ file, place, text }) => [file, place, text].filter(Boolean).join(', ')).join('. '));
    this.changed();
  }

  /** An error that is shown: the host page hears of it. */
  protected raise(error: Omit<Message, 'kind'>): void {
    tellFault(this.#host, error);
  }

  /** `message`, in a sentence: the engine cannot be started, or is not started again. */
  protected onUnavailable(message: string): void {
    this.phase = 'unavailable';
    this.isUnavailable = true;
    this.forget(SLOW);
    this.report(message, RELOAD_REMEDY, () => this.restart());
  }

  /** The engine takes long to load, or does so no longer. */
  protected onSlow(isSlow: boolean): void {
    this.forget(SLOW);
    if (isSlow) this.tell([this.#retriable({ ...noteMessage('', SLOW), remedy: SLOW_REMEDY }, () => this.restart())]);
  }

  /** `whatNow`: what happens to what the user has loaded. */
  protected tellCrash(message: string, whatNow: string, remedy: string): void {
    this.report(`The engine crashed (${message.replace(/\.$/, '')}). ${whatNow}`, remedy);
  }
}

/** Counts the data sets shown, by all sessions. */
let numGenerations = 0;
/** A change of a setting waits this long for the next one before all is computed again. */
const SETTINGS_DELAY_MS = 200;

/** A session that computes a result from files and settings: a run in the plane or in space. */
export abstract class RunSession<
  Client extends Disposable & { stop(): void },
  Settings extends object,
  Dataset,
  Snapshot,
> extends Session<Client> {
  /** What the engine reports of itself; null before it is ready. */
  facts: SettingsFacts<Settings> | null = null;
  settings: Settings | null = null;
  dataset: Dataset | null = null;
  snapshot: Snapshot | null = null;
  /** Another number for every data set shown: the view is fitted to each one once. */
  generation = 0;
  /** How the run of the last snapshot ended; one that was replaced by another order counts as stopped. */
  protected ended: 'stopped' | 'done' = 'done';
  #settingsTimer: ReturnType<typeof setTimeout> | undefined;
  #initialSettings: (facts: SettingsFacts<Settings>) => Settings | null = ({ presets }) => presets[0]?.settings ?? null;

  protected override leave(): void {
    clearTimeout(this.#settingsTimer);
    this.facts = null;
    super.leave();
  }

  /** To be called before the engine is ready: how to find the settings to begin with. */
  beginWith(initialSettings: (facts: SettingsFacts<Settings>) => Settings): void {
    this.#initialSettings = initialSettings;
  }

  override restart(): void {
    this.phase = this.dataset ? 'reading' : 'empty';
    this.activity = 'Starting the engine';
    this.progress = 0;
    super.restart();
    this.changed();
  }

  /** Computes again with these settings, soon. */
  configure(settings: Settings): void {
    this.settings = settings;
    this.changed();
    clearTimeout(this.#settingsTimer);
    this.#settingsTimer = setTimeout(() => {
      if (this.isUnavailable) this.restart();
      else this.recompute(settings);
    }, SETTINGS_DELAY_MS);
  }

  /** Takes in what was opened, asked for at clock time `requestedAt`; `joins` what is open. */
  abstract add(opened: Opened, requestedAt: number, joins?: boolean): Promise<void>;
  /** Whether this can join what is open. */
  abstract canJoin(opened: Opened): boolean;
  /** Stops; what has been computed stays. */
  abstract stop(): void;
  /** Goes on after a stop or a crash. */
  abstract resume(): void;
  /** Removes all files and what was computed from them. */
  abstract clear(): void;
  protected abstract recompute(settings: Settings): void;
  /** Does what was asked for before the engine was ready. */
  protected abstract onStarted(): void;

  /** The view is to be fitted to what comes. */
  fitAnew(): void {
    this.generation = ++numGenerations;
  }

  protected onReady(facts: SettingsFacts<Settings>): void {
    this.facts = facts;
    this.settings ??= this.#initialSettings(facts);
    this.onStarted();
    this.changed();
  }

  /** Nothing of what was given can be used: what was on the page stays. */
  refuse(text: string, remedy: string): void {
    this.keepResult();
    this.report(text, remedy);
  }

  /** What was on the page, where nothing of what was given can be used. A run that was not interrupted goes on. */
  protected keepResult(): void {
    if (this.phase === 'running') return;
    this.phase = this.snapshot ? this.ended : 'empty';
  }
}

/** Characters of a message that are shown at most. */
const TEXT_LENGTH = 2000;

export function errorMessage({ file, place, problem, remedy }: Problem): Message {
  const where = place === null ? '' : 'line' in place ? `line ${place.line}` : `byte ${place.byte}`;
  return { kind: 'error', file: printable(file), place: where, text: printable(problem, TEXT_LENGTH), remedy };
}

export function noteMessage(file: string, text: string): Message {
  return { kind: 'note', file: printable(file), place: '', text: printable(text, TEXT_LENGTH), remedy: '' };
}
