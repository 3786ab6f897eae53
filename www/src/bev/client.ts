/** The page's side of the worker of the bird's-eye view. */
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { WorkerHost } from '../engine/worker-host.js';
import type { About, BevApi, BevScene, Projection, Query, Strip } from './protocol.js';
import worker_url from './bev-worker.ts?worker&url';

export interface BevHooks {
  strip(strip: Strip): void;
  /** The worker died; the one that takes its place has no picture and has been asked nothing. */
  crashed(message: string): void;
  slow(is_slow: boolean): void;
  unavailable(message: string): void;
}

/** What can be asked at any time. */
type Calls = Omit<BevApi, 'start' | 'project' | 'warp' | 'keep_image'>;

export class BevClient {
  #host: WorkerHost<BevApi, Strip>;
  #generation = 0;
  #is_projecting = false;
  #next: { query: Query; answered: (result: Projection | EngineProblem) => void } | null = null;

  constructor(hooks: BevHooks) {
    this.#host = new WorkerHost<BevApi, Strip>(worker_url, {
      event: (strip) => {
        if (strip.generation !== this.#generation) return;
        if (strip.is_last) this.#host.succeeded();
        hooks.strip(strip);
      },
      crashed: hooks.crashed,
      slow: hooks.slow,
      unavailable: hooks.unavailable,
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
    return this.#host.give('keep_image', [rgba.buffer], rgba);
  }

  /** Projects; while a query is being answered only the latest one after it waits. */
  project(query: Query, answered: (result: Projection | EngineProblem) => void): void {
    this.#next = { query, answered };
    if (!this.#is_projecting) void this.#projectAll();
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
    this.#next = null;
    this.#host.dispose();
  }

  async #projectAll(): Promise<void> {
    this.#is_projecting = true;
    while (this.#next) {
      const { query, answered } = this.#next;
      this.#next = null;
      try {
        answered(await this.#host.call('project', query));
      } catch (error) {
        if (error instanceof EngineProblem) answered(error);
        else if (!(error instanceof WorkerDied)) throw error; // the crash of a worker is reported elsewhere
      } finally {
        this.#is_projecting = this.#next !== null;
      }
    }
  }
}
