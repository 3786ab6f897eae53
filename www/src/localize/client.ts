/** The page's side of the localisation's worker: what it is given, and what it tells of the run that was asked for last. */
import { LatestQuery } from '../engine/latest-query.js';
import type { Inputs, Settings } from '../engine/protocol.js';
import { WorkerDied } from '../engine/remote.js';
import { type WorkerFaults, WorkerHost } from '../engine/worker-host.js';
import type {
  Files,
  GridPicture,
  LocalizeApi,
  LocalizeEvent,
  MapSource,
  ParticleOptions,
  ParticleState,
  ScanDetails,
  ScansRead,
} from './protocol.js';
import workerUrl from './localize-worker.ts?worker&url';

export interface LocalizeListener extends WorkerFaults {
  located(event: LocalizeEvent): void;
  details(details: ScanDetails): void;
  /** The worker died, and with it what it had been given. */
  crashed(message: string): void;
}

/** Time after a stop at which a worker that has not responded is replaced (ms): one search of a large map takes a second or two. */
const STOP_PATIENCE_MS = 4000;

export class LocalizeClient {
  readonly #host: WorkerHost<LocalizeApi, LocalizeEvent>;
  readonly #details: LatestQuery<number, ScanDetails>;
  #run = 0;
  #stopTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(listener: LocalizeListener) {
    this.#host = new WorkerHost<LocalizeApi, LocalizeEvent>(workerUrl, {
      ...listener,
      event: (event) => {
        if (event.run !== this.#run) return;
        if (event.state === 'done') this.#host.succeeded();
        listener.located(event);
      },
      crashed: (message) => {
        clearTimeout(this.#stopTimer);
        listener.crashed(message);
      },
    });
    this.#details = new LatestQuery<number, ScanDetails>({
      compute: (index) => this.#host.call('scan', index),
      answered: (_, details, isLatest) => {
        if (isLatest) listener.details(details);
      },
      failed: () => undefined, // a crash is told by itself; a scan of a run that is over is no longer wanted
    });
  }

  openMap(source: MapSource): Promise<GridPicture> {
    this.#forget();
    return this.#host.call('openMap', source);
  }

  openScans(inputs: Pick<Inputs, 'scans' | 'odometry'>, settings: Partial<Settings>): Promise<ScansRead> {
    this.#forget();
    return this.#host.call('openScans', { scans: inputs.scans, odometry: inputs.odometry }, settings);
  }

  /** Locates the scans; the number of scans. */
  locate(): Promise<number> {
    this.#forget();
    return this.#host.call('locate', this.#run);
  }

  /** Resolves when the worker has come to an end, or was replaced. */
  async stop(): Promise<void> {
    clearTimeout(this.#stopTimer);
    this.#stopTimer = setTimeout(() => this.#host.kill('It did not react to the stop.'), STOP_PATIENCE_MS);
    try {
      await this.#host.call('stop');
    } catch (error) {
      if (!(error instanceof WorkerDied)) throw error;
    } finally {
      clearTimeout(this.#stopTimer);
    }
  }

  /** Asks for a scan's places and returns. */
  look(index: number): void {
    this.#details.ask(index);
  }

  file<K extends keyof Files>(kind: K): Promise<Files[K]> {
    return this.#host.call('file', kind) as Promise<Files[K]>;
  }

  particles(options: Partial<ParticleOptions>, scan: number): Promise<ParticleState> {
    return this.#host.call('particles', options, scan);
  }

  likelihoodField(): Promise<Uint8Array> {
    return this.#host.call('likelihoodField');
  }

  dispose(): void {
    clearTimeout(this.#stopTimer);
    this.#details.drop();
    this.#host.dispose();
  }

  /** What the run before still tells is of no use. */
  #forget(): void {
    this.#run++;
    this.#details.drop();
  }
}
