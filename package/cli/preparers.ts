/** Threads of Node that prepare frames. */
import { readFile } from 'node:fs/promises';
import { Worker } from 'node:worker_threads';
import type { Content as Source } from '../files/content.js';
import type { Prepared } from '../run/frame_queue.js';
import { type Preparer, WorkerDied } from '../run/spatial_run.js';
import type { Engine } from './command.js';
import { type Order, prepare, readColors, readContents } from './prepare.js';
import type { Done, Refused } from './prepare_worker.js';

export interface FrameJob {
  index: number;
  name: string;
  time: number | null;
  kind: 'depth_images' | 'clouds';
  file: Source;
  color: Source | null;
}

type ClosingPreparer = Preparer<FrameJob> & { close: () => Promise<unknown> };

/** @param count threads; 0: frames are prepared in this one */
export async function startPreparers(engine: Engine, count: number): Promise<ClosingPreparer[]> {
  if (count === 0) return [new InlinePreparer(engine)];
  const module = await WebAssembly.compile(await readFile(new URL('../../pkg/scanstitch_bg.wasm', import.meta.url)));
  return Array.from({ length: count }, () => new ThreadPreparer(module));
}

/** Files on the disk are read by the thread; those of an archive come unpacked. */
async function orderOf({ index, name, time, kind, file, color }: FrameJob, decodeConfig: string): Promise<Order> {
  const contents = file.disk ?? (await file.read());
  const isUnpacked = color !== null && color.disk === undefined;
  const colors = isUnpacked ? await readColors(() => color.read(), color.path) : { color: color?.disk ?? null };
  return {
    decodeConfig,
    kind,
    name,
    index,
    time,
    file: contents,
    color_problem: undefined,
    ...colors,
    color_name: color?.path,
  };
}

class InlinePreparer implements ClosingPreparer {
  #engine;

  constructor(engine: Engine) {
    this.#engine = engine;
  }

  async prepare(job: FrameJob, decodeConfig: string) {
    const order = await orderOf(job, decodeConfig);
    return prepare(this.#engine, order, await readContents(order));
  }

  replace() {}

  async close() {}
}

type Waiting = { resolve: (prepared: Prepared) => void; reject: (error: Error) => void };

class ThreadPreparer implements ClosingPreparer {
  /** Registering a frame takes this thread long: with two orders the preparer need not wait for it. */
  ahead = 2;
  #module;
  #worker;
  #nextId = 0;
  #waiting: Map<number, Waiting> = new Map();
  /** Why the thread has ended. */
  #end: string | null = null;

  constructor(module: WebAssembly.Module) {
    this.#module = module;
    this.#worker = this.#start();
  }

  #start() {
    this.#end = null;
    const worker = new Worker(new URL('./prepare_worker.js', import.meta.url), {
      workerData: { module: this.#module },
    });
    worker.on('message', (answer: Done | Refused) => {
      const waiting = this.#waiting.get(answer.id);
      this.#waiting.delete(answer.id);
      if ('error' in answer) waiting?.reject(Object.assign(new Error(), answer.error, { name: 'ScanstitchError' }));
      else waiting?.resolve({ bytes: answer.bytes, milliseconds: answer.milliseconds });
    });
    worker.on('error', (error) =>
      this.#die(worker, `The thread that prepared this frame broke down: ${error.message}`),
    );
    worker.on('exit', () => this.#die(worker, 'The thread that prepared this frame has ended'));
    return worker;
  }

  #die(worker: Worker, message: string) {
    if (worker !== this.#worker || this.#end !== null) return;
    this.#end = message;
    const [first, ...others] = this.#waiting.values();
    first?.reject(new WorkerDied(message));
    for (const { reject } of others) reject(new WorkerDied(message, true));
    this.#waiting.clear();
  }

  async prepare(job: FrameJob, decodeConfig: string, signal: AbortSignal): Promise<Prepared> {
    const order = await orderOf(job, decodeConfig);
    // For a run that has ended meanwhile no thread is started, which would keep the program from ending.
    signal.throwIfAborted();
    if (this.#end !== null) throw new WorkerDied(this.#end);
    const id = this.#nextId;
    this.#nextId += 1;
    return new Promise((resolve, reject) => {
      const stop = () => reject(new Error('Stopped'));
      const settled = () => signal.removeEventListener('abort', stop);
      this.#waiting.set(id, {
        resolve: (prepared) => {
          settled();
          resolve(prepared);
        },
        reject: (error) => {
          settled();
          reject(error);
        },
      });
      signal.addEventListener('abort', stop, { once: true });
      const buffers = [order.file, order.color].flatMap((bytes) => (bytes instanceof Uint8Array ? [bytes.buffer] : []));
      this.#worker.postMessage({ id, order }, buffers as ArrayBuffer[]);
    });
  }

  /** Is called for every frame that the thread had, and replaces it once. */
  replace() {
    if (this.#end === null) return;
    const old = this.#worker;
    this.#worker = this.#start();
    void old.terminate();
  }

  close() {
    return this.#worker.terminate();
  }
}
