/**
 * The recordings of the page: the one that is open, the one before it, and what is being fetched or opened, which one signal aborts.
 * Views read it and ask it.
 */
import type { ReactiveControllerHost } from 'lit';
import type { ListedBag, OpenedRecording, OpenProgress } from '../../../package/recording_reader.js';
import { tellHost } from '../components/host-events.js';
import type { Message } from '../components/messages.js';
import type { Former, Shelf } from '../run/run-kind.js';
import type { RunSession } from '../components/session.js';
import type { Run } from '../components/tools.js';
import type { BagState, Wishes } from './topics-panel.js';
import type { Opened } from '../datasets/dataset.js';
import type { NamedFile } from '../datasets/gather.js';
import type { GivenSet } from '../datasets/given.js';
import type { Note } from '../datasets/note.js';
import { fetchSample } from '../datasets/remote.js';
import { LastRequest } from '../engine/last-request.js';
import type { ScanstitchPlanar } from '../planar/planar-view.js';
import type { ScanstitchSpatial } from '../spatial/spatial-view.js';

/** A session of a run, as far as it is exchanged. */
type Session = Pick<
  RunSession<{ dispose(): void; stop(): void }, object, unknown, unknown>,
  'phase' | 'add' | 'canJoin' | 'stop' | 'clear' | 'end' | 'tell'
>;

/** A view of a run, as far as recordings are exchanged in it. */
interface RunView {
  readonly of: { kind: Run };
  readonly isOwn: boolean;
  readonly session: Session;
  requestUpdate(): void;
  renew(): void;
  reopen(session: Session): void;
  titleOf(session: Session): string;
}

export interface WorkspaceHooks {
  /** The view of a run; null before it is needed. */
  view(run: Run): RunView | null;
  /** Loads and shows the view of a run that is about to have something new. */
  show(run: Run): Promise<RunView | null>;
  /** Shows a run that was open before. */
  bring(run: Run): void;
  /** Waits for a part of the page that is being loaded. */
  loaded<T>(loading: Promise<T>): Promise<T>;
}

/** What was opened last of files, its bag, and the file where it is a stream's; nulls where it is a sample, or no bag. */
interface Files {
  opened: Opened | null;
  bag: BagState | null;
  stream: File | null;
}

/** A recording that can be brought back as it was left. */
interface Aside extends Files {
  view: RunView;
  session: Session;
  isUndone: boolean;
}

/** How files were asked for. */
export interface Asked {
  /** Clock time. */
  requestedAt: number;
  /** About other files of the same drop. */
  notes?: readonly Note[];
  /** What the host page says of them. */
  given?: GivenSet;
  /** The file of a robot's stream, which is on no disk yet. */
  stream?: File | null;
}

/** How far a bag has been inspected is reported at most this often. */
const PROGRESS_INTERVAL_MS = 100;
const NO_FILES: Files = { opened: null, bag: null, stream: null };

export class Workspace implements Shelf {
  /** The kind of run that is shown, or lies behind a view beside it. */
  run: Run = 'planar';
  /** In words, what is being fetched; null where nothing is. */
  activity: string | null = null;
  progress = 0;
  #request = new LastRequest();
  #files = NO_FILES;
  /** The bag that is being opened. */
  #coming: BagState | null = null;
  #former: Aside | null = null;
  /** Ends what is done in expectation of files. Null before any are expected. */
  #expecting: AbortController | null = null;
  readonly #host: ReactiveControllerHost & HTMLElement;
  readonly #hooks: WorkspaceHooks;

  constructor(host: ReactiveControllerHost & HTMLElement, hooks: WorkspaceHooks) {
    this.#host = host;
    this.#hooks = hooks;
  }

  /** The element was removed from the page. */
  leave(): void {
    this.#expecting?.abort();
    this.cancel();
    this.forgetFormer();
  }

  /** The bag that is open, or being opened; null where the files are none. */
  get bag(): BagState | null {
    return this.#coming ?? this.#files.bag;
  }

  // Opening.

  /** Something is asked for: what was being opened before is no longer wanted. */
  begin(): AbortSignal {
    this.cancel();
    this.#expecting?.abort();
    return this.#request.begin();
  }

  /** What is being fetched or opened is no longer wanted; what is open stays. */
  cancel(reason?: unknown): void {
    this.#request.end(reason);
    this.#tell(null, null);
  }

  /** Opens files that were dropped or picked. */
  take(files: readonly NamedFile[], asked: Asked): Promise<void> {
    return this.#open(files, asked, this.begin());
  }

  /** Opens the recording of a robot's stream. */
  takeStream(stream: File): Promise<void> {
    return this.take([{ name: stream.name, file: stream }], { requestedAt: performance.now(), stream });
  }

  get stream(): File | null {
    return this.#files.stream;
  }

  /** Opens what the host page names, in place of what is open. Rejects with an AbortError where something else is opened meanwhile. */
  async open(coming: (signal: AbortSignal) => Promise<GivenSet>, requestedAt: number): Promise<void> {
    const signal = this.begin();
    try {
      const given = await coming(signal);
      signal.throwIfAborted();
      this.#tell(null, null);
      await this.#open(given.files, { requestedAt, given }, signal);
    } catch (error) {
      if (!signal.aborted) this.cancel(); // the others that are on their way are of no use
      throw error;
    }
  }

  /** Fetches what these addresses name. */
  async fetch(addresses: readonly string[], signal: AbortSignal): Promise<GivenSet> {
    const { fetchGiven } = await import('../datasets/given.js');
    return fetchGiven(addresses, {
      signal,
      fetched: (done, total) => {
        if (signal.aborted) return;
        this.progress = done / Math.max(total, 1);
        this.#tell(`Fetching file ${Math.min(done + 1, total)} of ${total}`, null);
        const { progress, activity } = this;
        tellHost(this.#host, 'scanstitch-progress', { stage: 'fetching', progress, activity: activity ?? '' });
      },
    });
  }

  /** Opens other topics of the bag. */
  async choose(wishes: Wishes): Promise<void> {
    const { opened } = this.#files;
    if (!opened) return;
    const signal = this.begin();
    const onProgress = this.#listener(signal, wishes);
    const recording = await this.#reading(signal, opened.recording.choose(wishes, { signal, onProgress }));
    const asked = { requestedAt: performance.now(), stream: this.stream };
    await this.#show({ ...opened, recording }, asked, signal, wishes);
  }

  async openSample(): Promise<void> {
    const signal = this.begin();
    const view = await this.#beginAnew('planar', signal);
    void (view as ScanstitchPlanar | null)?.session.openGiven(fetchSample());
  }

  async openApartment(): Promise<void> {
    const requestedAt = performance.now();
    const signal = this.begin();
    const view = await this.#beginAnew('spatial', signal);
    const { fetchApartment } = await import('../datasets/apartment.js');
    await (view as ScanstitchSpatial | null)?.session.add(fetchApartment(), requestedAt);
    signal.throwIfAborted();
  }

  /** Removes all. */
  clear(): void {
    this.begin();
    this.forgetFormer();
    this.#files = NO_FILES;
    for (const run of ['planar', 'spatial'] as const) this.#hooks.view(run)?.session.clear();
  }

  /** Someone is about to choose files, or drags some over the page that may be depth images. */
  async expectFiles(): Promise<void> {
    if (this.#expecting || this.#hooks.view('spatial')) return;
    this.#expecting = new AbortController();
    const { signal } = this.#expecting;
    try {
      const [{ warmUp }] = await Promise.all([import('./warm-up.js'), import('../spatial/spatial-view.js')]);
      if (!signal.aborted) await warmUp(signal);
    } catch {
      // A failure is ignored here: the part is loaded again when it is needed, with a message if that fails.
    }
  }

  async #open(files: readonly NamedFile[], asked: Asked, signal: AbortSignal): Promise<void> {
    const { openRecording } = await this.#hooks.loaded(import('../../../package/recording_reader.js'));
    const { given, notes = [] } = asked;
    const sources = files.map(({ name: path, file: blob }) => ({ path, blob }));
    const opening = openRecording(sources, { signal, notes, onProgress: this.#listener(signal, {}) });
    const recording = await this.#reading(signal, opening);
    if (!given) return this.#show({ title: '', origin: 'user', recording }, asked, signal);
    const { asTold } = await import('../datasets/given.js');
    await this.#show(asTold(recording, given, runOf(recording, this.run) === 'planar'), asked, signal);
  }

  /** While it is being opened, a bag is shown. */
  async #reading(signal: AbortSignal, opening: Promise<OpenedRecording>): Promise<OpenedRecording> {
    try {
      return await opening;
    } finally {
      if (!signal.aborted) this.#tell(null, null);
    }
  }

  /** `wishes`: topics of the bag that is open were chosen; without, what was opened is a recording of its own or lies beside one. */
  async #show(
    opened: Opened,
    { requestedAt, stream = null }: Asked,
    signal: AbortSignal,
    wishes?: Wishes,
  ): Promise<void> {
    const { recording } = opened;
    const run = runOf(recording, this.run);
    const isRecording = recording.kind !== 'nothing';
    const view =
      isRecording && !wishes ? await this.#beginAnew(run, signal) : await this.#hooks.loaded(this.#hooks.show(run));
    signal.throwIfAborted();
    this.run = run;
    if (isRecording || recording.bags.length > 0) this.#files = { opened, bag: bagOf(recording, wishes ?? {}), stream };
    else if (this.#files.opened && this.#files.bag) {
      // A reference trajectory or a camera, for the bag that is open.
      const together = await this.#files.opened.recording.with(recording);
      this.#files = { ...this.#files, opened: { ...this.#files.opened, recording: together } };
    }
    this.#host.requestUpdate();
    await view?.session.add(opened, requestedAt);
    signal.throwIfAborted();
  }

  /** Topics are shown as soon as they are known, before messages are inspected. */
  #listener(signal: AbortSignal, wishes: Wishes): (progress: OpenProgress) => void {
    let nextAt = 0;
    let listed: ListedBag | null = null;
    return (progress) => {
      if (signal.aborted) return;
      void import('./topics-panel.js');
      if (progress.stage === 'topics') listed = progress.bags[0] ?? null;
      else if (performance.now() < nextAt) return;
      else nextAt = performance.now() + PROGRESS_INTERVAL_MS;
      if (progress.stage !== 'topics' || listed)
        this.#tell(null, { listed, choice: null, wishes, activity: bagActivity(progress) });
    };
  }

  #tell(activity: string | null, coming: BagState | null): void {
    this.activity = activity;
    this.#coming = coming;
    this.#host.requestUpdate();
  }

  // The recording before.

  /** Shows the view of a run for another recording; what is open there, or in the other view, steps aside and can be brought back. */
  async #beginAnew(run: Run, signal: AbortSignal): Promise<RunView | null> {
    const from = this.#hooks.view(this.run);
    const aside = from?.isOwn ? { ...this.#files, view: from, session: from.session, isUndone: false } : null;
    const to = await this.#hooks.show(run);
    signal.throwIfAborted();
    this.run = run;
    this.forgetFormer();
    if (aside) halt(aside.session);
    if (aside?.view === to) to?.renew();
    this.#former = aside;
    this.#files = NO_FILES;
    return to;
  }

  formerOf(run: Run): Former | null {
    const former = this.#former;
    if (!former || run !== this.run) return null;
    const { view, session, isUndone } = former;
    const { opened } = this.#files;
    const canJoin = !isUndone && opened !== null && view === this.#hooks.view(run) && session.canJoin(opened);
    return { title: view.titleOf(session), isUndone, canJoin };
  }

  exchange(): void {
    const former = this.#former;
    const view = this.#hooks.view(this.run);
    if (!former || !view) return;
    this.cancel();
    halt(view.session);
    this.#former = { ...this.#files, view, session: view.session, isUndone: !former.isUndone };
    this.#reopen(former);
  }

  /** The files join the recording that had stepped aside for them. */
  addInstead(): void {
    const { opened } = this.#files;
    const view = this.#giveBack();
    if (opened) void view?.session.add(opened, performance.now(), true);
  }

  revert(run: Run, messages: readonly Message[]): boolean {
    const view = this.#former && run === this.run ? this.#giveBack() : null;
    view?.session.tell(messages);
    return view !== null;
  }

  forgetFormer(): void {
    const former = this.#former;
    if (!former) return;
    this.#former = null;
    if (former.view.session === former.session) former.view.renew();
    former.session.end();
    this.#hooks.view(this.run)?.requestUpdate();
  }

  /** The former recording, for good: the one that is open ends. */
  #giveBack(): RunView | null {
    const former = this.#former;
    const view = this.#hooks.view(this.run);
    if (!former || !view) return null;
    const { session } = view;
    this.#former = null;
    this.#reopen(former);
    if (view.session === session) view.renew();
    session.end();
    return former.view;
  }

  #reopen(former: Aside): void {
    const { opened, bag, stream } = former;
    this.#files = { opened, bag, stream };
    former.view.reopen(former.session);
    this.run = former.view.of.kind;
    this.#hooks.bring(this.run);
  }
}

/** Planar scans have a view, depth images and clouds another; what is neither, as a trajectory alone, is for the run that is shown. */
function runOf({ kind }: OpenedRecording, shown: Run): Run {
  if (kind === 'nothing') return shown;
  return kind === 'planar_scans' ? 'planar' : 'spatial';
}

function bagOf({ bags, root }: OpenedRecording, wishes: Wishes): BagState | null {
  const bag = bags.find(({ listed }) => listed.bag.path === root) ?? bags[0];
  return bag ? { ...bag, wishes, activity: '' } : null;
}

function bagActivity(progress: OpenProgress): string {
  if (progress.stage === 'topics') return 'Inspecting the messages';
  const { stage, done, total } = progress;
  if (stage === 'messages') return `Inspecting message ${done} of ${total}`;
  return `The bag has no index: reading all of it, ${Math.floor((100 * done) / total)} %`;
}

function halt(session: Session): void {
  if (session.phase === 'running' || session.phase === 'reading') session.stop();
}
