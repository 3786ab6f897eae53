/** The page's side of the worker of the bird's-eye view. */
import { LatestQuery } from '../engine/latest-query.js';
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { type WorkerFaults, WorkerHost } from '../engine/worker-host.js';
import type { About, BevApi, BevScene, Projection, Query, Strip } from './protocol.js';
import workerUrl from './bev-worker.ts?worker&url';

export interface BevHooks extends WorkerFaults {
  strip(strip: Strip): void;
  /** The worker died; the one that takes its place has no picture and has been asked nothing. */
  crashed(message: string): void;
}

interface Projecting {
  query: Query;
  answered(result: Projection | EngineProblem): void;
}

/** What can be asked at any time. */
type Calls = Omit<BevApi, 'start' | 'project' | 'warp' | 'keepImage'>;

export class BevClient {
  #host: WorkerHost<BevApi, Strip>;
  #generation = 0;
  readonly #projecting = new LatestQuery<Projecting, Projection>({
    compute: ({ query }) => this.#host.call('project', query),
    answered: ({ answered }, projection) => answered(projection),
    failed: ({ answered }, error) => {
      if (error instanceof EngineProblem) answered(error);
      else if (!(error instanceof WorkerDied)) throw error; // the crash of a worker is reported elsewhere
    },
  });

  constructor(hooks: BevHooks) {
    this.#host = new WorkerHost<BevApi, Strip>(workerUrl, {
      event: (strip) => {
        if (strip.generation !== this.#generation) return;
        if (strip.isLast) this.#host.succeeded();
        hooks.strip(strip);
      },
      ...hooks,
    });
  }

  start(): Promise<About> {
    return this.#host.start();
  }

  /** Asks the engine; rejects with an EngineProblem where the input is bad. */
  call<K extends keyof Calls>(method: K, given: Parameters<Calls[K]>[0]): Promise<ReturnType<Calls[K]>> {
    return this.#host.call(method, ...([given] as never)) as Promise<ReturnType<Calls[K]>>;
  }

  /** Keeps the picture of the top view, RGBA. */
  keepImage(rgba: Uint8Array<ArrayBuffer>): Promise<void> {
    return this.#host.give('keepImage', [rgba.buffer], rgba);
  }

  /** Projects; while a query is being answered only the latest one after it waits. */
  project(query: Query, answered: (result: Projection | EngineProblem) => void): void {
    this.#projecting.ask({ query, answered });
  }

  /** Warps the kept picture again; strips of an older scene are dropped. */
  warp(scene: BevScene): void {
    this.#host.call('warp', ++this.#generation, scene).catch(() => undefined); // the crash of a worker is reported elsewhere
  }

  /** Strips of a scene before no longer come. */
  unwarp(): void {
    this.#generation++;
  }

  dispose(): void {
    this.#projecting.drop();
    this.#host.dispose();
  }
}
