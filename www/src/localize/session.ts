/** A localisation: the map, the recording, how far it is, and where the scans are. */
import type { OpenedRecording } from '../../../package/recording_reader.js';
import type { GivenScans } from '../run/run-kind.js';
import { errorMessage, noneUsable, noteMessage, Session } from '../components/session.js';
import type { NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import { takeIn, titleOf } from '../datasets/take-in.js';
import { LastRequest } from '../engine/last-request.js';
import { isOvertaken, messageOf } from '../engine/message-of.js';
import type { Settings } from '../engine/protocol.js';
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { download } from '../export/download.js';
import { baseName, formatFixed, plural } from '../views/format.js';
import { pngOf } from '../views/canvas.js';
import { LocalizeClient } from './client.js';
import { type MapFiles, readMapFiles } from './map-files.js';
import type { Dropped } from './opening.js';
import { Particles } from './particles.js';
import type {
  Files,
  GridPicture,
  Located,
  LocalizeEvent,
  MapSource,
  ParticleOptions,
  ScanDetails,
} from './protocol.js';

const NO_SCANS = 'Drop a laser log, a ROS bag with laser scans, or planar scans as PLY files, one file a scan';

/** A map and the files that it is read from, which a worker that takes another one's place is given again. */
interface OpenMap {
  name: string;
  source: MapSource;
  picture: GridPicture;
}

export class LocalizeSession extends Session<LocalizeClient> {
  map: OpenMap | null = null;
  recording: GivenScans | null = null;
  located: Located | null = null;
  /** Of the selected scan, or of one before it while that is asked for. */
  details: ScanDetails | null = null;
  selected = 0;
  /** A picture of which the side of a pixel has to be told. */
  unscaled: MapFiles | null = null;
  odometry: Settings['odometry'] = 'auto';
  /** While they are looked at. */
  particles: Particles | null = null;
  /** How likely a return in each cell of the map is, 0 to 255; known while particles are looked at. */
  likelihoods: Uint8Array | null = null;
  readonly #request = new LastRequest();
  readonly #onOver: () => void;
  /** What the worker holds. */
  #held: { map: MapSource | null; scans: GivenScans | null; odometry: string } = {
    map: null,
    scans: null,
    odometry: '',
  };
  #incomplete: readonly NamedFile[] = [];
  #isRunning = false;
  /** Whether the scan that was located last is the selected one. */
  #follows = true;

  /** `onOver` is called when all scans are located. */
  constructor(host: ConstructorParameters<typeof Session>[0], onOver: () => void) {
    super(host);
    this.#onOver = onOver;
    this.phase = 'empty';
  }

  protected override createClient(): LocalizeClient {
    return new LocalizeClient({
      located: (event) => this.#onLocated(event),
      details: (details) => {
        this.details = details;
        this.changed();
      },
      crashed: (message) => this.#onCrashed(message),
      ...this.faults,
    });
  }

  protected override leave(): void {
    super.leave();
    this.#letGo();
    this.#rest();
  }

  override restart(): void {
    super.restart();
    this.attempt((signal) => this.#locate(signal));
  }

  /** Whether something can be exported or looked at: the worker holds what is shown. */
  get isHeld(): boolean {
    return this.located !== null && this.#held.map !== null;
  }

  /** Files of a map that lacked something: those that are dropped next may complete it. */
  get incomplete(): readonly NamedFile[] {
    return this.#incomplete;
  }

  /** What is being opened gives way; errors are told. */
  attempt(work: (signal: AbortSignal) => Promise<void>): void {
    const signal = this.#request.begin();
    work(signal).catch((error: unknown) => {
      if (signal.aborted || isOvertaken(error) || error instanceof WorkerDied) return;
      this.#rest();
      if (error instanceof EngineProblem) this.tell([errorMessage(error.problem)]);
      else this.report(messageOf(error), 'Try again, or drop other files');
    });
  }

  /** Takes in what is dropped or fetched. */
  open(coming: (signal: AbortSignal) => Promise<Dropped>, activity: string): void {
    this.attempt(async (signal) => {
      this.messages = [];
      this.#work(activity);
      const dropped = await coming(signal);
      signal.throwIfAborted();
      await this.#take(dropped, signal);
    });
  }

  /** The recording that is open on the page's map. */
  openScans(given: GivenScans): void {
    if (given.inputs.scans === this.recording?.inputs.scans) return;
    this.recording = given;
    this.attempt((signal) => this.#locate(signal));
  }

  /** Opens the picture of which the side of a pixel (m) is known now. */
  setScale(resolution: number): void {
    const { unscaled } = this;
    if (!unscaled) return;
    this.attempt(async (signal) => {
      this.messages = [];
      await this.#openMap(unscaled, resolution, signal);
      await this.#locate(signal);
    });
  }

  setOdometry(odometry: Settings['odometry']): void {
    this.odometry = odometry;
    this.locateAgain();
  }

  locateAgain(): void {
    this.attempt(async (signal) => {
      this.messages = [];
      await this.#locate(signal);
    });
  }

  async stop(): Promise<void> {
    this.#request.end();
    const wasRunning = this.#isRunning;
    this.#isRunning = false;
    this.#rest();
    this.announce('Stopped.');
    if (wasRunning) await this.client?.stop();
  }

  /** Shows a scan. */
  select(scan: number | null): void {
    const last = this.numLocated - 1;
    this.selected = Math.min(Math.max(scan ?? last, 0), Math.max(last, 0));
    this.#follows = this.selected === last;
    if (this.isHeld) this.client?.look(this.selected);
    this.#followParticles();
    this.changed();
  }

  /** Looks at particles beside the places, or no more. */
  toggleParticles(): void {
    this.particles?.forget();
    this.particles = this.particles ? null : this.#newParticles();
    this.#followParticles();
    this.changed();
  }

  chooseParticles(options: Partial<ParticleOptions>): void {
    this.particles?.choose(options, this.selected);
    this.changed();
  }

  get numLocated(): number {
    return (this.located?.track.length ?? 0) / 4;
  }

  clear(): void {
    this.#request.end();
    if (this.#isRunning) void this.client?.stop();
    [this.map, this.recording, this.unscaled, this.messages, this.#incomplete] = [null, null, null, [], []];
    this.#letGo();
    this.#forgetResult();
    this.phase = 'empty';
    this.changed();
  }

  export(kind: keyof Files): void {
    const save = async (): Promise<void> => {
      if (!this.client) return;
      if (kind === 'picture') {
        const { width, height, rgba } = await this.client.file('picture');
        const canvas = Object.assign(document.createElement('canvas'), { width, height });
        canvas.getContext('2d')?.putImageData(new ImageData(rgba, width, height), 0, 0);
        download({ name: 'localization.png', blob: await pngOf(canvas) });
        return;
      }
      const name = kind === 'trajectory' ? 'trajectory.tum' : 'report.json';
      download({ name, blob: new Blob([await this.client.file(kind)], { type: 'text/plain' }) });
    };
    save().catch((error: unknown) => this.report(`The file could not be made: ${messageOf(error)}`));
  }

  // Opening.

  async #take({ map, problem, incomplete, recording, notes }: Dropped, signal: AbortSignal): Promise<void> {
    this.#incomplete = incomplete;
    this.unscaled = map?.kind === 'picture' ? map : null;
    const isWhole = map !== null && map.kind !== 'picture';
    if (problem) this.tell([errorMessage(problem)]);
    this.#tellNotes(notes);
    const isRead = recording === null || (await this.#takeRecording(recording));
    signal.throwIfAborted();
    if (isWhole) await this.#openMap(map, 0, signal);
    if (isRead && !problem && !this.unscaled) await this.#locate(signal);
    else this.#rest();
  }

  async #openMap(files: MapFiles, resolution: number, signal: AbortSignal): Promise<void> {
    this.#work('Reading the map');
    const source = await readMapFiles(files, resolution);
    signal.throwIfAborted();
    const picture = await this.client?.openMap(source);
    if (!picture || signal.aborted) return;
    const name = baseName(
      'yaml' in source ? source.yaml.name : 'table' in source ? source.table.name : source.picture.name,
    );
    this.map = { name, source, picture };
    [this.unscaled, this.#incomplete] = [null, []];
    [this.#held.map, this.likelihoods] = [source, null];
    this.#forgetResult();
    if (picture.remark) this.tell([noteMessage(name, picture.remark)]);
    const [width, height] = [picture.width, picture.height].map((cells) => formatFixed(cells * picture.resolution, 0));
    this.announce(`The map ${name} is open, ${width} by ${height} metres.`);
  }

  /** Whether there is anything of use among the files. */
  async #takeRecording(recording: OpenedRecording): Promise<boolean> {
    this.#work('Reading the scans');
    const { scans, odometry, notes } = await takeIn(recording);
    this.#tellNotes(notes);
    const { inputs, title, settings } = this.recording ?? {};
    if (scans.length > 0) {
      this.recording = { title: titleOf(scans), inputs: { scans, odometry, reference: null }, settings: {} };
    } else if (odometry && inputs) {
      this.recording = { title: title ?? '', inputs: { ...inputs, odometry }, settings: settings ?? {} };
    } else {
      const { kind, opened } = recording;
      const inSpace = kind === 'depth_images' ? 'depth images' : 'clouds in space';
      if (kind === 'nothing') this.report(noneUsable(opened.numGiven), NO_SCANS);
      else this.report(`These are ${inSpace}: planar scans alone are located`, NO_SCANS);
      return false;
    }
    this.#forgetResult();
    return true;
  }

  #tellNotes(notes: readonly Note[]): void {
    this.tell(notes.map(({ file, reason }) => noteMessage(file, reason)));
  }

  // Locating.

  async #locate(signal: AbortSignal): Promise<void> {
    const { client } = this;
    const isReady = client !== null && (await this.#bring(client, signal));
    if (!isReady) return this.#rest();
    this.#forgetResult();
    this.requestedAt = performance.now();
    this.#work('Preparing the map');
    [this.phase, this.#isRunning] = ['running', true];
    await client.locate();
  }

  /** Gives the worker what it does not hold; whether there is all that is needed. */
  async #bring(client: LocalizeClient, signal: AbortSignal): Promise<boolean> {
    const { map, recording, odometry } = this;
    if (!map || !recording) return false;
    if (this.#held.map !== map.source) {
      await client.openMap(map.source);
      signal.throwIfAborted();
      this.#held.map = map.source;
    }
    if (this.#held.scans === recording && this.#held.odometry === odometry) return true;
    this.#work(`Reading ${recording.title}`);
    const settings = odometry === 'auto' ? recording.settings : { ...recording.settings, odometry };
    const { num_scans, problems, notes } = await client.openScans(recording.inputs, settings);
    signal.throwIfAborted();
    this.tell([...problems.map(errorMessage), ...notes.map(({ file, text }) => noteMessage(file, text))]);
    if (num_scans === 0) {
      this.recording = null;
      return false;
    }
    this.#held = { map: map.source, scans: recording, odometry };
    return true;
  }

  #onLocated({ state, located, details }: LocalizeEvent): void {
    if (!this.#isRunning) return;
    this.located = located;
    if (this.phase === 'running') {
      this.progress = this.numLocated / Math.max(located.num_scans, 1);
      this.activity = `Locating scan ${Math.min(this.numLocated + 1, located.num_scans)} of ${located.num_scans}`;
    }
    if (this.#follows && details) [this.selected, this.details] = [details.index, details];
    // Later scans have told where this one was.
    else if (this.details) this.client?.look(this.selected);
    if (state === 'done') this.#onDone(located);
    this.changed();
  }

  #onDone({ outcome }: Located): void {
    this.#isRunning = false;
    if (this.phase === 'running') this.phase = 'done';
    this.announce(outcome.summary);
    this.#followParticles();
    this.#onOver();
  }

  #onCrashed(message: string): void {
    const wasRunning = this.#isRunning || this.phase === 'reading';
    this.#letGo();
    this.#rest();
    if (wasRunning)
      this.tellCrash(message, 'It was started again; the map and the scans are still there', 'Locate again');
  }

  // Particles.

  #newParticles(): Particles {
    return new Particles({
      compute: (options, scan) => {
        if (!this.client) throw new WorkerDied('');
        return this.client.particles(options, scan);
      },
      changed: () => this.changed(),
      failed: (error) => {
        if (error instanceof EngineProblem) this.tell([errorMessage(error.problem)]);
      },
    });
  }

  /** To the selected scan: only those that are located are followed. */
  #followParticles(): void {
    if (!this.particles || this.#isRunning || !this.isHeld) return;
    this.particles.show(this.selected);
    if (!this.likelihoods) void this.#fetchLikelihoods();
  }

  async #fetchLikelihoods(): Promise<void> {
    const { map, client } = this;
    const likelihoods = await client?.likelihoodField().catch(() => undefined);
    if (!likelihoods || this.map !== map) return;
    this.likelihoods = likelihoods;
    this.changed();
  }

  // What is shown.

  #work(activity: string): void {
    this.phase = 'reading';
    this.activity = activity;
    this.progress = 0;
    this.changed();
  }

  /** Nothing is under way any more. */
  #rest(): void {
    const isWhole = this.located !== null && this.numLocated === this.located.num_scans;
    this.phase = this.#isRunning ? 'running' : this.located === null ? 'empty' : isWhole ? 'done' : 'stopped';
    this.changed();
  }

  #forgetResult(): void {
    this.#isRunning = false;
    this.particles?.forget();
    [this.located, this.details, this.selected, this.#follows] = [null, null, 0, true];
  }

  /** The worker is gone. */
  #letGo(): void {
    this.#isRunning = false;
    this.#held = { map: null, scans: null, odometry: '' };
  }

  /** What the recording is, in words. */
  get recordingWords(): string {
    if (!this.recording) return '';
    const { title } = this.recording;
    return this.located ? `${title}, ${plural(this.located.num_scans, 'scan')}` : title;
  }
}
