import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { Message } from '../components/messages.js';
import { combine, type Dataset, type Note, takeIn } from '../datasets/dataset.js';
import type { NamedFile } from '../datasets/gather.js';
import { PlanarClient } from '../engine/planar-client.js';
import type {
  Answers,
  EngineFacts,
  InputFile,
  Inputs,
  Problem,
  Progress,
  RunState,
  Settings,
  Snapshot,
} from '../engine/protocol.js';
import { formatLength, plural } from '../views/format.js';
import { lookDirection } from '../views/look-direction.js';
import { groupByFrame, NO_POINTS, type PointSet } from '../views/point-layer.js';

/** What the page is doing. */
export type Phase = 'starting' | 'empty' | 'reading' | 'running' | 'stopped' | 'done' | 'crashed' | 'unavailable';

/** A change of a setting waits this long for the next one before all is computed again. */
const SETTINGS_DELAY_MS = 200;
/** A thousand files are read in a second: their names are shown at most this often. */
const READING_INTERVAL_MS = 50;

/**
 * All that the page knows, and what can be done with it: inputs, settings, result, messages. It holds no markup and
 * asks its host to draw again when something changed.
 */
export class Session implements ReactiveController {
  phase: Phase = 'starting';
  facts: EngineFacts | null = null;
  dataset: Dataset | null = null;
  settings: Settings | null = null;
  snapshot: Snapshot | null = null;
  points: PointSet = NO_POINTS;
  /** Which way the scanner looks in its own frame, rad. */
  look_direction = 0;
  /** Counts the data sets shown: the view is fitted to each one once. */
  generation = 0;
  /** Share of the work done, 0..1, and in words what is being worked on. */
  progress = 0;
  activity = '';
  messages: readonly Message[] = [];
  /** For those who listen: said once at each turn of events. */
  announcement = '';
  /** Clock time at which the present computation was asked for. */
  requested_at = 0;

  #host: ReactiveControllerHost;
  #client: PlanarClient | null = null;
  /** Settings as text, applied once the engine has told which settings there are. */
  #initial_settings: (facts: EngineFacts) => Settings = ({ presets }) => firstSettings(presets);
  #candidate: Dataset | null = null;
  #settings_timer: ReturnType<typeof setTimeout> | undefined;
  #is_new_dataset = false;
  #next_reading = 0;

  constructor(host: ReactiveControllerHost) {
    this.#host = host;
    host.addController(this);
  }

  hostConnected(): void {
    this.#client ??= new PlanarClient({
      ready: (facts) => this.#onReady(facts),
      reading: (file, done, total) => this.#onReading(file, done, total),
      loaded: (inputs, accepted, problems) => this.#onLoaded(inputs, accepted, problems),
      progress: (progress) => this.#onProgress(progress),
      snapshot: (state, snapshot) => this.#onSnapshot(state, snapshot),
      rejected: (problem) => this.#tell([messageOf(problem)]),
      crashed: (message) => this.#onCrashed(message),
      unavailable: (message) => this.#onUnavailable(message),
    });
  }

  hostDisconnected(): void {
    clearTimeout(this.#settings_timer);
    this.#client?.dispose();
    this.#client = null;
  }

  /** To be called before the engine is ready: how to find the settings to begin with. */
  beginWith(initial_settings: (facts: EngineFacts) => Settings): void {
    this.#initial_settings = initial_settings;
  }

  /** Shows a data set that comes from a server. One that fails to come becomes a message. */
  async openGiven(fetching: Promise<Dataset>): Promise<void> {
    try {
      this.open(await fetching);
    } catch (error) {
      this.phase = this.snapshot ? this.phase : 'empty';
      const reason = error instanceof Error ? error.message : String(error);
      this.#tell([
        {
          kind: 'error',
          file: '',
          place: '',
          text: `The scans could not be fetched: ${reason}`,
          remedy: 'Drop scans of your own, or reload the page',
        },
      ]);
    }
  }

  open(dataset: Dataset): void {
    if (this.phase === 'unavailable') return;
    this.messages = [];
    this.requested_at = performance.now();
    this.#load(dataset);
  }

  /**
   * Takes in files that were dropped or picked, asked for at clock time `requested_at`. `notes` tell of others of the
   * `num_given` that were left aside before.
   */
  async add(
    files: readonly NamedFile[],
    requested_at: number,
    notes: readonly Note[] = [],
    num_given = files.length,
  ): Promise<void> {
    if (files.length + notes.length === 0) return;
    const intake = await takeIn(files);
    this.requested_at = requested_at;
    this.messages = [...notes, ...intake.notes].map(noteMessage);
    if (intake.scans.length === 0 && !intake.reference && !intake.odometry) {
      this.#tell([
        {
          kind: 'error',
          file: '',
          place: '',
          text: `Nothing to use among ${plural(num_given, 'file')}`,
          remedy:
            'Drop laser scans as PLY files, one file a scan, or a laser log, or depth images, or a folder of them',
        },
      ]);
      return;
    }
    if (intake.scans.length === 0 && !this.dataset) {
      this.#tell([
        {
          kind: 'error',
          file: (intake.reference ?? intake.odometry)?.name ?? '',
          place: '',
          text: 'This is a trajectory, but there are no scans to compare with it yet',
          remedy: 'Drop the scans together with it',
        },
      ]);
      return;
    }
    this.#load(combine(this.dataset, intake));
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
    this.requested_at = performance.now();
    const unless = (file: InputFile | null): InputFile | null => (file?.name === name ? null : file);
    this.#load({ ...dataset, scans, reference: unless(dataset.reference), odometry: unless(dataset.odometry) });
  }

  clear(): void {
    if (this.phase === 'running') this.#client?.stop();
    this.dataset = null;
    this.snapshot = null;
    this.points = NO_POINTS;
    this.messages = [];
    this.phase = 'empty';
    this.#announce('All scans removed.');
  }

  /** Computes again with these settings, soon. */
  configure(settings: Settings): void {
    this.settings = settings;
    this.#host.requestUpdate();
    clearTimeout(this.#settings_timer);
    this.#settings_timer = setTimeout(() => {
      if (this.phase === 'reading' && this.#candidate) {
        this.#load(this.#candidate); // read with the new settings
        return;
      }
      if (!this.dataset) return;
      this.messages = [];
      this.requested_at = performance.now();
      this.phase = 'running';
      this.progress = 0;
      this.#client?.configure(settings);
      this.#announce('Computing again with the new settings.');
    }, SETTINGS_DELAY_MS);
  }

  stop(): void {
    this.activity = 'Stopping';
    this.#client?.stop();
    this.#host.requestUpdate();
  }

  /** Goes on after a stop or a crash. */
  resume(): void {
    this.phase = 'running';
    this.messages = [];
    this.requested_at = performance.now();
    this.#client?.resume();
    this.#announce('Computing goes on.');
  }

  dismissMessages(): void {
    this.messages = [];
    this.#host.requestUpdate();
  }

  ask<K extends keyof Answers>(kind: K, frame = 0): Promise<Answers[K]> {
    if (!this.#client) return Promise.reject(new Error('The page was closed.'));
    return this.#client.ask(kind, frame);
  }

  /** A message of the page's own, about no file. */
  report(text: string, remedy = ''): void {
    this.#tell([{ kind: 'error', file: '', place: '', text, remedy }]);
  }

  #load(dataset: Dataset): void {
    if (this.phase === 'unavailable') return;
    this.#candidate = dataset;
    this.phase = 'reading';
    this.progress = 0;
    this.activity = `Reading ${plural(dataset.scans.length, 'scan')}`;
    if (this.facts && this.settings)
      this.#client?.load(
        { scans: dataset.scans, reference: dataset.reference, odometry: dataset.odometry },
        this.settings,
      );
    this.#host.requestUpdate();
  }

  #onReady(facts: EngineFacts): void {
    this.facts = facts;
    this.settings ??= this.#initial_settings(facts);
    // After a crash the client reads the inputs again itself; here is the first start.
    if (this.#candidate && this.phase === 'reading') this.#load(this.#candidate);
    this.#host.requestUpdate();
  }

  #onReading(file: string, done: number, total: number): void {
    const now = performance.now();
    if (this.phase === 'crashed' || (this.phase === 'reading' && now < this.#next_reading)) return;
    this.#next_reading = now + READING_INTERVAL_MS;
    this.phase = 'reading';
    this.progress = done / Math.max(total, 1);
    this.activity = `Reading ${file.slice(file.lastIndexOf('/') + 1)}, ${done + 1} of ${total}`;
    this.#host.requestUpdate();
  }

  #onLoaded(inputs: Inputs, accepted: readonly string[], problems: readonly Problem[]): void {
    const candidate = this.#candidate;
    this.#candidate = null;
    if (!candidate) return;
    const messages = problems.map(messageOf);
    if (accepted.length === 0) {
      this.phase = this.snapshot ? 'done' : 'empty';
      if (this.snapshot) {
        messages.push({
          kind: 'note',
          file: '',
          place: '',
          text: 'No scan could be read, so what was on the page stays',
          remedy: '',
        });
      }
    } else {
      this.phase = 'running';
      this.#is_new_dataset = this.dataset?.title !== candidate.title || this.dataset.scans.length !== accepted.length;
      this.dataset = { ...candidate, ...inputs };
    }
    this.#tell(messages);
  }

  #onProgress({ stage, done, total }: Progress): void {
    this.phase = 'running';
    this.progress = total > 0 ? done / total : 0;
    this.activity = {
      register: `Aligning scan ${Math.min(done + 1, total)} of ${total}`,
      retry: 'Trying the scans again that were left out',
      loops: `Looking for places that come into view again, ${done} of ${total}`,
      joint: 'Solving all scans together',
      evaluate: 'Measuring the map',
      done: 'Done',
    }[stage];
    this.#host.requestUpdate();
  }

  #onSnapshot(state: RunState, snapshot: Snapshot): void {
    this.snapshot = snapshot;
    this.points = groupByFrame(snapshot.map_points, snapshot.map_frames, snapshot.result.frames.length);
    this.look_direction = lookDirection(
      this.points,
      snapshot.result.frames.map(({ T_world_sensor }) => T_world_sensor),
    );
    if (this.#is_new_dataset) {
      this.#is_new_dataset = false;
      this.generation++;
    }
    this.phase = state;
    if (state === 'done') {
      this.#announce(this.#summary(snapshot));
      this.#tellOfReference(snapshot);
    } else if (state === 'stopped')
      this.#announce(`Stopped. ${plural(snapshot.result.frames.length, 'scan')} aligned so far.`);
    this.#host.requestUpdate();
  }

  /** A reference that fits no scan must not go unnoticed; the engine's other notes are read beside the result. */
  #tellOfReference({ result }: Snapshot): void {
    const reference = this.dataset?.reference;
    if (!reference || result.comparison) return;
    const start = `${reference.name}: `;
    const notes = result.notes.filter((text) => text.startsWith(start)).map((text) => text.slice(start.length));
    this.#tell(notes.map((text) => ({ kind: 'error', file: reference.name, place: '', text, remedy: '' })));
  }

  #onCrashed(message: string): void {
    this.phase = 'crashed';
    this.#tell([
      {
        kind: 'error',
        file: '',
        place: '',
        text: `The computation crashed (${message.replace(/\.$/, '')}). A fresh one has been started and your scans are still loaded`,
        remedy: 'Compute again, perhaps with other settings',
      },
    ]);
  }

  #onUnavailable(message: string): void {
    this.phase = 'unavailable';
    this.#tell([
      {
        kind: 'error',
        file: '',
        place: '',
        text: `The engine could not be started: ${message}`,
        remedy: 'Reload the page; a browser of the last two years is needed',
      },
    ]);
  }

  #summary({ result }: Snapshot): string {
    const sharpness = result.sharpness ? ` Sharpness ${formatLength(result.sharpness.mean_residual)}.` : '';
    const comparison = result.comparison
      ? ` Mean distance to the reference ${formatLength(result.comparison.mean)}.`
      : '';
    return `${plural(result.frames.length, 'scan')} stitched.${sharpness}${comparison}`;
  }

  #tell(messages: readonly Message[]): void {
    const all = [...this.messages, ...messages];
    this.messages = [...all.filter(({ kind }) => kind === 'error'), ...all.filter(({ kind }) => kind === 'note')];
    const errors = messages.filter(({ kind }) => kind === 'error');
    if (errors.length > 0) {
      this.#announce(errors.map(({ file, place, text }) => [file, place, text].filter(Boolean).join(', ')).join('. '));
    }
    this.#host.requestUpdate();
  }

  #announce(text: string): void {
    this.announcement = text;
    this.#host.requestUpdate();
  }
}

function firstSettings(presets: EngineFacts['presets']): Settings {
  const [first] = presets;
  if (!first) throw new Error('The engine names no preset.');
  return first.settings;
}

function messageOf({ file, place, problem, remedy }: Problem): Message {
  const words = place === null ? '' : 'line' in place ? `line ${place.line}` : `byte ${place.byte}`;
  return { kind: 'error', file, place: words, text: problem, remedy };
}

function noteMessage({ file, reason }: Note): Message {
  return { kind: 'note', file, place: '', text: reason, remedy: '' };
}
