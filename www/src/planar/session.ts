import type { Message } from '../components/messages.js';
import { errorMessage, noneUsable, noteMessage, RunSession } from '../components/session.js';
import { type Dataset, hasLog, type Opened } from '../datasets/dataset.js';
import type { Intake } from '../datasets/take-in.js';
import { LastRequest } from '../engine/last-request.js';
import { PlanarClient } from '../engine/planar-client.js';
import type {
  Answers,
  InputFile,
  Inputs,
  ReadOutcome,
  RefusedEdit,
  Progress,
  RunState,
  Settings,
  Snapshot,
} from '../engine/protocol.js';
import type { Pictures } from '../../../package/files/recording.js';
import { messageOf } from '../engine/message-of.js';
import type { Address } from '../views/address.js';
import { baseName, formatLength, plural } from '../views/format.js';
import { sameSettings } from '../views/setting-fields.js';
import { lookDirection } from '../views/look-direction.js';
import { NO_POINTS, type PointSet } from '../views/point-layer.js';
import type { TableImports } from './table-imports.js';

/** A thousand files are read in a second: their names are shown at most this often. */
const READING_INTERVAL_MS = 50;
/** How the engine's note on a table begins. The page has a line of its own for it, with a button. */
const NOTE_ON_TABLE = 'A table of ranges, read as ';

/** Of a message about a step of mending that the map or the engine does not take. */
const NOT_TAKEN = 'The step was not taken';

function refusal({ index, reason }: RefusedEdit): Message {
  const problem = `Step ${index + 1} was not taken: ${reason}`;
  return { ...errorMessage({ file: '', place: null, problem, remedy: '' }), title: NOT_TAKEN };
}

/** A run of laser scans in the plane: inputs, settings, result, messages. */
export class PlanarSession extends RunSession<PlanarClient, Settings, Dataset, Snapshot> {
  points: PointSet = NO_POINTS;
  /** Number of scans of the run, registered or not; that of a log is known when the run begins. */
  num_scans = 0;
  /** Number of files opened with them that could not be read. */
  numUnread = 0;
  /** Which way the scanner looks in its own frame, rad. */
  lookDirection = 0;
  /** Tables of ranges, and what their columns are; null before files are taken in. */
  tables: TableImports | null = null;
  /** Of building plans that steps lay, by the names that these call them. */
  pictures: Pictures = {};
  /** Whether the page's address is the page's own, to read formats of tables from and to write them into. */
  address: Address | null = null;
  /** What the engine is to be given, or is reading. */
  #candidate: Dataset | null = null;
  #isNewDataset = false;
  #nextReading = 0;
  /** What is still being fetched gives way to what was opened after it. */
  readonly #fetching = new LastRequest();
  /** Files are taken in one drop after the other. */
  #adding: Promise<void> = Promise.resolve();

  protected override createClient(): PlanarClient {
    return new PlanarClient({
      ready: (facts) => this.onReady(facts),
      reading: (file, done, total) => this.#onReading(file, done, total),
      loaded: (inputs, told) => this.#onLoaded(inputs, told),
      progress: (progress) => this.#onProgress(progress),
      snapshot: (state, snapshot) => this.#onSnapshot(state, snapshot),
      rejected: (problem, isStep) => this.tell([{ ...errorMessage(problem), ...(isStep && { title: NOT_TAKEN }) }]),
      refused: (steps) => steps.length > 0 && this.tell(steps.map(refusal)),
      crashed: (message) => this.#onCrashed(message),
      ...this.faults,
    });
  }

  /** Shows a data set that comes from a server. One that fails to come becomes a message. */
  async openGiven(fetching: Promise<Dataset>): Promise<void> {
    const signal = this.#fetching.begin();
    this.phase = 'reading';
    this.activity = 'Fetching the scans';
    this.progress = 0;
    this.changed();
    try {
      const dataset = await fetching;
      if (!signal.aborted) this.#open(dataset);
    } catch (error) {
      if (signal.aborted) return;
      this.keepResult();
      this.report(`The scans could not be fetched: ${messageOf(error)}`, 'Drop scans of your own, or reload the page');
    }
  }

  #open(dataset: Dataset): void {
    this.messages = [];
    this.requestedAt = performance.now();
    this.#load(dataset);
  }

  /** Takes in what was opened, asked for at clock time `requestedAt`; `joins` what is open. */
  override add(opened: Opened, requestedAt: number, joins = false): Promise<void> {
    this.#fetching.end();
    const add = (): Promise<void> => this.#add(opened, requestedAt, joins);
    this.#adding = this.#adding.then(add, add);
    return this.#adding;
  }

  async #add({ title, origin, recording }: Opened, requestedAt: number, joins: boolean): Promise<void> {
    const { combine, takeIn } = await import('../datasets/take-in.js');
    const intake = await takeIn(recording);
    this.requestedAt = requestedAt;
    this.messages = intake.notes.map(({ file, reason }) => noteMessage(file, reason));
    if (origin === 'host' && intake.scans.length > 0) {
      const { scans, reference, odometry } = intake;
      this.#load({ title, origin, scans, reference, odometry });
      return;
    }
    const numGiven = recording.opened.numGiven;
    const mayBeScans = !joins && (this.dataset === null || this.dataset.origin !== 'user');
    this.tables ??= await this.#newTables();
    await this.tables.ask(intake, mayBeScans, (known) => {
      if (this.#isOfUse(known, numGiven)) this.#load(combine(this.dataset, known, joins));
    });
  }

  async #newTables(): Promise<TableImports> {
    const { TableImports } = await import('./table-imports.js');
    return new TableImports({
      address: () => this.address,
      describe: async (file, format, scan) => (await this.client?.describeTable(file, format, scan)) ?? null,
      reload: (format) => this.#readTablesAs(format),
      changed: () => this.changed(),
    });
  }

  /** Loose scans join loose scans; a log joins logs of other names, where no file is of one of them alone: odometry, or steps. */
  override canJoin({ recording: { logs, odometry, mended } }: Opened): boolean {
    const { dataset } = this;
    if (dataset?.origin !== 'user' || !logs.length === hasLog(dataset.scans)) return false;
    const ofOne = odometry ?? mended ?? dataset.odometry ?? dataset.scans.find(({ name }) => logs.includes(name));
    return !logs.length || !ofOne;
  }

  /** Whether there is something to show; reports why not. */
  #isOfUse(intake: Intake, numGiven: number): boolean {
    const trajectory = intake.reference ?? intake.odometry;
    if (intake.scans.length === 0 && !trajectory) {
      this.report(
        noneUsable(numGiven),
        'Drop laser scans as PLY files, one file a scan, or a laser log, or depth images, or a folder of them',
      );
      return false;
    }
    if (intake.scans.length === 0 && trajectory && !this.dataset) {
      const problem = 'This is a trajectory, but there are no scans to compare with it yet';
      this.tell([
        errorMessage({ file: trajectory.name, place: null, problem, remedy: 'Drop the scans together with it' }),
      ]);
      return false;
    }
    return true;
  }

  /** Reads the tables that are loaded by another format. */
  #readTablesAs(format: string): void {
    const { dataset, tables } = this;
    if (!dataset || !tables) return;
    this.messages = [];
    this.requestedAt = performance.now();
    const scans = dataset.scans.map((file) => (tables.isTable(file) ? { ...file, table: format } : file));
    this.#load({ ...dataset, scans });
  }

  /** Leaves one scan out, or the reference. */
  remove(name: string): void {
    const { dataset } = this;
    if (!dataset) return;
    const scans = dataset.scans.filter((scan) => scan.name !== name);
    if (scans.length === 0) {
      this.clear();
      return;
    }
    this.messages = [];
    this.requestedAt = performance.now();
    const unless = (file: InputFile | null): InputFile | null => (file?.name === name ? null : file);
    this.#load({ ...dataset, scans, reference: unless(dataset.reference), odometry: unless(dataset.odometry) });
  }

  override clear(): void {
    const hadScans = this.dataset !== null;
    this.#fetching.end();
    if (this.facts && (this.phase === 'running' || this.phase === 'reading')) this.client?.stop();
    this.#candidate = null;
    this.dataset = null;
    this.snapshot = null;
    this.points = NO_POINTS;
    this.num_scans = 0;
    this.numUnread = 0;
    this.messages = [];
    this.phase = 'empty';
    if (hadScans) this.announce('All scans removed.');
    this.changed();
  }

  /** Come back to the page, it computes again what it was showing. */
  protected override leave(): void {
    super.leave();
    this.#candidate ??= this.dataset;
    if (this.#candidate) this.phase = 'reading';
  }

  protected override recompute(settings: Settings): void {
    if (this.#candidate && this.phase !== 'crashed') {
      this.#load(this.#candidate); // read with the new settings
      return;
    }
    if (!this.dataset) return;
    this.messages = [];
    this.requestedAt = performance.now();
    this.phase = 'running';
    this.activity = 'Computing again';
    this.progress = 0;
    // A preset may make quite another map.
    this.#isNewDataset ||= this.facts?.presets.some((preset) => sameSettings(preset.settings, settings)) ?? false;
    this.client?.configure(settings);
    this.announce('Computing again with the new settings.');
  }

  override stop(): void {
    if (this.phase === 'reading' && (!this.#candidate || !this.facts)) {
      // Scans are being fetched, or wait for the engine to start.
      this.#fetching.end();
      this.#candidate = this.facts ? null : this.dataset;
      this.keepResult();
      this.tell([noteMessage('', 'Opening the scans was stopped')]);
      return;
    }
    this.activity = 'Stopping';
    this.client?.stop();
    this.changed();
  }

  /** Goes on after a stop or a crash. */
  override resume(): void {
    this.messages = [];
    this.requestedAt = performance.now();
    if (this.#candidate && this.phase === 'stopped') this.#load(this.#candidate);
    else {
      this.phase = 'running';
      this.client?.resume();
    }
    this.announce('Computing continues.');
  }

  ask<K extends keyof Answers>(kind: K, frame = 0): Promise<Answers[K]> {
    if (!this.client) return Promise.reject(new Error('The page was closed.'));
    return this.client.ask(kind, frame);
  }

  #load(dataset: Dataset): void {
    this.#candidate = dataset;
    if (this.isUnavailable) {
      this.restart();
      return;
    }
    this.phase = 'reading';
    this.progress = 0;
    this.activity = `Reading ${plural(dataset.scans.length, 'scan')}`;
    const { mended } = dataset;
    if (mended?.pictures) this.pictures = mended.pictures;
    if (mended && this.facts) this.settings = { ...this.facts.presets[0]?.settings, ...mended.settings } as Settings;
    if (this.facts && this.settings)
      this.client?.load(
        { scans: dataset.scans, reference: dataset.reference, odometry: dataset.odometry },
        this.settings,
        mended?.steps,
      );
    this.changed();
  }

  protected override onStarted(): void {
    // After a crash the client reads the inputs again itself; here is the first start.
    if (this.#candidate && this.phase === 'reading') this.#load(this.#candidate);
  }

  #onReading(file: string, done: number, total: number): void {
    if (!this.#candidate) return;
    const now = performance.now();
    if (this.phase === 'crashed' || (this.phase === 'reading' && now < this.#nextReading)) return;
    this.#nextReading = now + READING_INTERVAL_MS;
    this.phase = 'reading';
    this.progress = done / Math.max(total, 1);
    this.activity = `Reading ${baseName(file)}, ${done + 1} of ${total}`;
    this.changed();
  }

  #onLoaded(inputs: Inputs, { accepted, problems, notes, isStopped }: ReadOutcome): void {
    const candidate = this.#candidate;
    this.#candidate = null;
    if (!candidate) return;
    const told = notes.filter(({ text }) => !text.startsWith(NOTE_ON_TABLE));
    const messages = [...problems.map(errorMessage), ...told.map(({ file, text }) => noteMessage(file, text))];
    if (accepted.length === 0) {
      this.keepResult();
      if (this.snapshot && !isStopped)
        messages.push(noteMessage('', 'No scan could be read, so the result on the page stays'));
    } else {
      this.phase = 'running';
      this.#isNewDataset = this.dataset?.title !== candidate.title || this.dataset.scans.length !== accepted.length;
      this.dataset = { ...candidate, ...inputs, mended: undefined };
      this.numUnread = candidate.scans.length - inputs.scans.length;
      this.num_scans = accepted.length;
    }
    this.tell(messages);
  }

  #onProgress({ stage, done, total }: Progress): void {
    if (!this.dataset) return;
    this.phase = 'running';
    if (stage === 'register') this.num_scans = total;
    this.progress = total > 0 ? done / total : 0;
    this.activity = {
      register: `Registering scan ${Math.min(done + 1, total)} of ${total}`,
      retry: 'Retrying unregistered scans',
      loops: `Searching for loop closures, ${done} of ${total}`,
      joint: 'Optimising all poses',
      evaluate: 'Measuring the sharpness of the map',
      done: 'Done',
    }[stage];
    this.changed();
  }

  #onSnapshot(state: RunState, snapshot: Snapshot): void {
    if (!this.dataset) return;
    this.snapshot = snapshot;
    this.ended = state === 'done' ? 'done' : 'stopped';
    this.points = { points: snapshot.map_points, offsets: snapshot.mapOffsets };
    this.lookDirection = lookDirection(
      this.points,
      snapshot.result.frames.map(({ T_world_sensor }) => T_world_sensor),
    );
    if (this.#isNewDataset) {
      this.#isNewDataset = false;
      this.fitAnew();
    }
    this.phase = state;
    if (state === 'done') {
      this.announce(this.#summary(snapshot));
      this.#tellOfReference(snapshot);
      this.#tellOfOdometry(snapshot);
    } else if (state === 'stopped')
      this.announce(`Stopped. ${snapshot.result.frames.length} of ${plural(this.num_scans, 'scan')} registered.`);
    this.changed();
  }

  /** A reference that fits no scan must not go unnoticed; the engine's other notes are read beside the result. */
  #tellOfReference({ result }: Snapshot): void {
    const reference = this.dataset?.reference;
    if (!reference || result.comparison) return;
    const start = `${reference.name}: `;
    const notes = result.notes.filter((text) => text.startsWith(start)).map((text) => text.slice(start.length));
    this.tell(notes.map((problem) => errorMessage({ file: reference.name, place: null, problem, remedy: '' })));
  }

  /** Odometry that was not used: everything was placed without it. */
  #tellOfOdometry({ result: { odometry_refusal } }: Snapshot): void {
    if (odometry_refusal === null) return;
    // Odometry in a log is told under the log's name.
    const file = this.dataset?.odometry?.name ?? this.dataset?.scans[0]?.name ?? '';
    const start = `${file}: `;
    const problem = odometry_refusal.startsWith(start) ? odometry_refusal.slice(start.length) : odometry_refusal;
    this.tell([errorMessage({ file, place: null, problem, remedy: '' })]);
  }

  #onCrashed(message: string): void {
    this.phase = 'crashed';
    this.tellCrash(
      message,
      'It was started again and your scans are still loaded',
      'Compute again, perhaps with other settings',
    );
  }

  #summary({ result }: Snapshot): string {
    const sharpness = result.sharpness ? ` Sharpness ${formatLength(result.sharpness.mean_residual)}.` : '';
    const comparison = result.comparison
      ? ` Mean distance to the ground truth ${formatLength(result.comparison.mean)}.`
      : '';
    return `${plural(result.frames.length, 'scan')} stitched.${sharpness}${comparison}`;
  }
}
