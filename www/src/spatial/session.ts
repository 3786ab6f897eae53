import type { Content } from '../../../package/recording_reader.js';
import { cameraFor, engineCamera } from '../../../package/recording/camera_file.js';
import { joinPoses, trajectoryBytes } from '../../../package/recording/pose_file.js';
import { errorMessage, noneUsable, noteMessage, RunSession } from '../components/session.js';
import type { Opened } from '../datasets/dataset.js';
import { LastRequest } from '../engine/last-request.js';
import type { Readable, SpatialJob } from '../engine/preparer.js';
import { SpatialClient, type SpatialInputs, type SpatialState } from '../engine/spatial-client.js';
import type {
  FloorGrid,
  FloorGridFiles,
  SizedMap,
  SpatialAnswers,
  SpatialSettings,
  SpatialSnapshot,
} from '../engine/spatial-protocol.js';
import { messageOf } from '../engine/message-of.js';
import { baseName, formatDuration, formatLength, plural } from '../views/format.js';
import { depthRamp } from './depth-picture.js';
import { NO_POINTS } from './leveling.js';
import { canJoin, combine, type SpatialDataset } from './take-in.js';

/** Frames may be registered many times a second; their count is reported at most this often. */
const PROGRESS_INTERVAL_MS = 250;
/** Voxels the map is measured in, m. */
const MEASURED_SIZES = [0.1, 0.05, 0.02, 0.01];

/** A run of depth images or clouds in space: files, settings, result, messages. */
export class SpatialSession extends RunSession<SpatialClient, SpatialSettings, SpatialDataset, SpatialSnapshot> {
  points = NO_POINTS;
  /** Milliseconds of registering each frame, in the order of the result's frames. */
  frameMs: readonly number[] = [];
  /** Since the run was asked for, ms; waiting for the user not counted. */
  elapsed_ms = 0;
  /** The map in voxels of other sizes; null before it was asked for. */
  sizes: readonly SizedMap[] | null = null;
  #msByIndex = new Map<number, number>();
  #startedAt = 0;
  #nextProgress = 0;
  #workedMs = 0;
  /** The frames wait for the engine to start. */
  #isWaiting = false;
  readonly #opening = new LastRequest();

  protected override createClient(): SpatialClient {
    return new SpatialClient({
      ready: (facts) => this.onReady(facts),
      registered: (index, ms, done, total) => this.#onRegistered(index, ms, done, total),
      finishing: (stage) => this.#onFinishing(stage),
      snapshot: (state, snapshot) => this.#onSnapshot(state, snapshot),
      problem: (problem) => this.tell([errorMessage(problem)]),
      replaced: (name) =>
        this.tell([noteMessage(name, 'The worker that prepared this frame crashed and was replaced')]),
      crashed: (message, restarts) => this.#onCrashed(message, restarts),
      ...this.faults,
      unavailable: (message) => this.#onEnded(message),
    });
  }

  protected override leave(): void {
    super.leave();
    // Come back to the page, it computes again what it was showing.
    if (this.dataset) this.#wait();
  }

  /** Opens files: a recording replaces the current one, or is added to it if `joins` is set; a reference is always added. */
  override async add(opening: Opened | Promise<Opened>, requestedAt: number, joins = false): Promise<void> {
    const signal = this.#opening.begin();
    this.requestedAt = requestedAt;
    if (this.phase !== 'running') this.phase = 'reading';
    this.activity = 'Inspecting the files';
    this.progress = 0;
    this.changed();
    try {
      const opened = await opening;
      const dataset = await combine(this.dataset, opened, joins);
      if (signal.aborted) return;
      this.messages = dataset.recording.notes.map(({ file, reason }) => noteMessage(file, reason));
      if (dataset.jobs.length === 0) {
        this.#tellNothing(opened.recording.opened.numGiven);
        return;
      }
      const previous = this.dataset;
      const isSameCamera = previous?.recording.intrinsics === dataset.recording.intrinsics;
      const continues =
        previous !== null && this.snapshot !== null && isSameCamera && isPrefix(previous.jobs, dataset.jobs);
      this.dataset = dataset;
      if (this.isUnavailable) this.restart();
      else if (continues && this.facts) this.#extend(previous, dataset);
      else this.#load();
    } catch (error) {
      if (signal.aborted) return;
      this.keepResult();
      this.report(messageOf(error), 'Try again, or drop other files');
    }
    this.changed();
  }

  removeReference(): void {
    if (!this.dataset) return;
    const { recording } = this.dataset;
    this.dataset = { ...this.dataset, recording: { ...recording, reference: [] }, referenceName: '' };
    this.client?.setReference(null);
  }

  override clear(): void {
    const hadFrames = this.dataset !== null;
    this.#opening.end();
    this.#isWaiting = false;
    this.client?.stop();
    this.dataset = null;
    this.snapshot = null;
    this.points = NO_POINTS;
    this.messages = [];
    this.phase = 'empty';
    if (hadFrames) this.announce('All frames removed.');
    this.changed();
  }

  protected override recompute(): void {
    if (!this.dataset) return;
    this.messages = [];
    this.requestedAt = performance.now();
    this.#load();
    this.announce('Computing again with the new settings.');
  }

  /** Stops at once; the frame that is being registered may still come in. */
  override stop(): void {
    if (this.phase === 'reading' && !this.#isWaiting) {
      // Files are being inspected.
      this.#opening.end();
      this.keepResult();
      this.tell([noteMessage('', 'Opening the files was stopped')]);
      return;
    }
    this.client?.stop();
    this.phase = 'stopped';
    this.#pause();
    this.announce(`Stopped. ${plural(this.snapshot?.result.frames.length ?? 0, 'frame')} so far.`);
  }

  override resume(): void {
    if (this.#isWaiting) this.#load();
    else {
      this.phase = 'running';
      this.#startedAt = performance.now();
      this.client?.resume();
    }
    this.announce('Computing continues.');
  }

  ask<K extends keyof SpatialAnswers>(kind: K, frame = 0): Promise<SpatialAnswers[K]> {
    return this.client?.ask(kind, frame) ?? Promise.reject(new Error('The page was closed.'));
  }

  /** Downsamples the map with voxels of several sizes, one after the other, and reports the number of points. */
  floorGrid(wanted: FloorGrid): Promise<FloorGridFiles> {
    return this.client?.floorGrid(wanted) ?? Promise.reject(new Error('The page was closed.'));
  }

  async measureSizes(): Promise<void> {
    const { snapshot } = this;
    if (this.sizes || !this.client) return;
    this.sizes = [];
    for (const voxel_size of MEASURED_SIZES) {
      try {
        const size = await this.client.mapSize(voxel_size);
        if (this.snapshot !== snapshot) return;
        this.sizes = [...this.sizes, size];
        this.changed();
      } catch {
        return; // the registrar died, which is reported elsewhere
      }
    }
  }

  depthPicture(file: Readable): ReturnType<SpatialClient['depthPicture']> {
    return this.client?.depthPicture(file, depthRamp()) ?? Promise.reject(new Error('The page was closed.'));
  }

  /** The first depth image from above; rejects where it cannot be read. */
  topView(fx: number): ReturnType<SpatialClient['topView']> {
    const file = this.dataset?.jobs[0]?.file;
    if (!file || !this.client) return Promise.reject(new Error('There is no depth image.'));
    return this.client.topView(file, fx);
  }

  /** The recording with all that lies beside it, for another look at the same frames; null before there is one. */
  get recording(): { title: string; inputs: SpatialInputs; settings: SpatialSettings | null } | null {
    return this.dataset && { title: this.dataset.title, inputs: this.#inputs(), settings: this.settings };
  }

  /** The files of a registered frame. */
  filesOf(frame: number): { depth: Content | null; color: Content | null } {
    const index = this.snapshot?.result.frames[frame]?.index;
    const job = this.dataset?.jobs.find((candidate) => candidate.index === index);
    const find = (readable: Readable | null | undefined): Content | null =>
      (readable && this.dataset?.recording.files.get(readable.path)) ?? null;
    return { depth: job && !job.isCloud ? find(job.file) : null, color: find(job?.color) };
  }

  // What is loaded.

  override canJoin(opened: Opened): boolean {
    return this.dataset !== null && canJoin(this.dataset, opened);
  }

  #inputs(): SpatialInputs {
    const { jobs = [], recording } = this.dataset ?? {};
    const file = recording?.intrinsics ? recording.files.get(recording.intrinsics) : null;
    const intrinsics = file && {
      path: file.path,
      read: async () => engineCamera(cameraFor(file.path, await file.read(), recording?.image_size ?? null).camera),
    };
    return { jobs, num_recorded: jobs.length, intrinsics: intrinsics ?? null, reference: this.#reference() };
  }

  /** The reference trajectory as one file. */
  #reference(): Readable | null {
    if (!this.dataset) return null;
    const { recording, referenceName } = this.dataset;
    const parts = recording.reference.map((path) => recording.files.get(path)).filter((file) => file !== undefined);
    const [only] = parts;
    if (!only) return null;
    if (parts.length < 2) return { path: only.path, read: async () => trajectoryBytes(only.path, await only.read()) };
    return {
      path: referenceName,
      read: async () => joinPoses(await Promise.all(parts.map((file) => file.read()))),
    };
  }

  #wait(): void {
    this.#isWaiting = true;
    this.phase = 'reading';
    this.activity = 'Starting the engine';
    this.changed();
  }

  #load(): void {
    if (!this.facts || !this.settings) {
      this.#wait();
      return;
    }
    this.#isWaiting = false;
    this.phase = 'running';
    this.progress = 0;
    this.activity = `Preparing ${plural(this.dataset?.jobs.length ?? 0, 'frame')}`;
    this.#msByIndex.clear();
    this.#workedMs = 0;
    this.#startedAt = performance.now();
    this.fitAnew();
    this.snapshot = null;
    this.points = NO_POINTS;
    this.client?.load(this.#inputs(), this.settings);
    this.changed();
  }

  #extend(previous: SpatialDataset, dataset: SpatialDataset): void {
    this.phase = 'running';
    this.#startedAt = performance.now();
    if (dataset.jobs.length > previous.jobs.length) this.activity = 'Adding frames';
    this.client?.extend(this.#inputs());
  }

  // News of the engine.

  protected override onStarted(): void {
    if (this.phase === 'starting') this.phase = 'empty';
    if (this.#isWaiting && this.phase === 'reading') this.#load();
  }

  #onRegistered(index: number, ms: number, done: number, total: number): void {
    this.#msByIndex.set(index, ms);
    const now = performance.now();
    if (this.phase !== 'running' || now < this.#nextProgress) return;
    this.#nextProgress = now + PROGRESS_INTERVAL_MS;
    this.progress = done / Math.max(total, 1);
    this.activity = `Registering frame ${Math.min(done + 1, total)} of ${total}`;
    this.changed();
  }

  #onFinishing(stage: 'retry' | 'loops'): void {
    if (this.phase !== 'running') return;
    this.progress = 1;
    this.activity = {
      retry: 'Retrying unregistered frames',
      loops: 'Optimising the pose graph',
    }[stage];
    this.changed();
  }

  #onSnapshot(state: SpatialState, snapshot: SpatialSnapshot): void {
    if (!this.dataset) return;
    this.snapshot = snapshot;
    this.ended = state === 'done' ? 'done' : 'stopped';
    this.sizes = null;
    this.points = snapshot.points;
    this.frameMs = snapshot.result.frames.map(({ index }) => this.#msByIndex.get(index) ?? 0);
    if (state !== 'running') {
      this.#pause();
      this.phase = state;
    }
    this.elapsed_ms = this.#workedMs + (this.#startedAt > 0 ? performance.now() - this.#startedAt : 0);
    if (state === 'done') this.#onDone(snapshot);
    this.changed();
  }

  #onDone({ result }: SpatialSnapshot): void {
    if (result.frames.length === 0) {
      this.snapshot = null;
      this.phase = 'empty';
      this.announce('No frame could be used.');
      return;
    }
    const distance = result.comparison
      ? ` Mean distance to the ground truth ${formatLength(result.comparison.mean)}.`
      : '';
    this.announce(
      `${plural(result.frames.length, 'frame')} registered in ${formatDuration(this.elapsed_ms)}.${distance}`,
    );
    this.#tellOfReference(result.notes, result.comparison === null);
  }

  /** A reference that fits no frame or not all must not go unnoticed; the engine's other notes are read beside the result. */
  #tellOfReference(notes: readonly string[], isUnused: boolean): void {
    const name = this.dataset?.referenceName ?? '';
    if (name === '') return;
    const isOwn = (text: string): boolean => (isUnused ? text.includes(baseName(name)) : text.startsWith(`${name}: `));
    const own = notes.filter(isOwn);
    const words = own.map((text) => text.replace(`${name}: `, ''));
    this.tell(
      isUnused
        ? words.map((problem) => errorMessage({ file: name, place: null, problem, remedy: '' }))
        : words.map((text) => noteMessage(name, text)),
    );
  }

  #onCrashed(message: string, restarts: boolean): void {
    this.#pause();
    if (restarts) {
      this.#msByIndex.clear();
      this.#startedAt = performance.now();
      this.phase = 'running';
      this.progress = 0;
    } else this.phase = 'crashed';
    if (restarts) this.tellCrash(message, 'It was started again and computes again from the first frame', '');
    else {
      const whatNow = 'It was started again and your files are still loaded';
      this.tellCrash(message, whatNow, 'Compute again, perhaps with other settings');
    }
  }

  #onEnded(message: string): void {
    this.#pause();
    this.onUnavailable(message);
  }

  #tellNothing(numFiles: number): void {
    this.keepResult();
    this.report(
      noneUsable(numFiles),
      'Drop depth images (PNG or PGM) with their colour images, or clouds (PLY or PCD), one file a frame',
    );
    if (this.snapshot) this.tell([noteMessage('', 'The result on the page stays')]);
  }

  #pause(): void {
    if (this.#startedAt > 0) this.#workedMs += performance.now() - this.#startedAt;
    this.#startedAt = 0;
  }
}

function isPrefix(before: readonly SpatialJob[], now: readonly SpatialJob[]): boolean {
  return before.length <= now.length && before.every(({ file }, i) => file === now[i]?.file);
}
