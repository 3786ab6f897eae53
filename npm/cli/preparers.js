// @ts-check
/** Threads of Node that prepare frames. */
import { readFile } from 'node:fs/promises';
import { Worker } from 'node:worker_threads';
import { WorkerDied } from '../spatial_run.js';
import { prepare, readColors, readContents } from './prepare.js';

/** @typedef {import('../spatial_run.js').Prepared} Prepared */
/** @typedef {import('./inputs.js').Source} Source */
/**
 * @typedef {object} FrameJob
 * @property {number} index
 * @property {string} name
 * @property {number | null} time
 * @property {'depth_images' | 'clouds'} kind
 * @property {Source} file
 * @property {Source | null} color
 */

/** @typedef {import('../spatial_run.js').Preparer<FrameJob> & { close: () => Promise<unknown> }} ClosingPreparer */

/**
 * @param {import('./command.js').Engine} engine
 * @param {number} count threads; 0: frames are prepared in this one
 * @returns {Promise<ClosingPreparer[]>}
 */
export async function startPreparers(engine, count) {
  if (count === 0) return [new InlinePreparer(engine)];
  const module = await WebAssembly.compile(await readFile(new URL('../../pkg/scanstitch_bg.wasm', import.meta.url)));
  return Array.from({ length: count }, () => new ThreadPreparer(module));
}

/**
 * Files on the disk are read by the thread; those of an archive come unpacked.
 * @param {FrameJob} job
 * @param {string} decodeConfig
 * @returns {Promise<import('./prepare.js').Order>}
 */
async function orderOf({ index, name, time, kind, file, color }, decodeConfig) {
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

/** @implements {ClosingPreparer} */
class InlinePreparer {
  #engine;

  /** @param {import('./command.js').Engine} engine */
  constructor(engine) {
    this.#engine = engine;
  }

  /** @param {FrameJob} job @param {string} decodeConfig */
  async prepare(job, decodeConfig) {
    const order = await orderOf(job, decodeConfig);
    return prepare(this.#engine, order, await readContents(order));
  }

  replace() {}

  async close() {}
}

/** @typedef {{ resolve: (prepared: Prepared) => void, reject: (error: Error) => void }} Waiting */

/** @implements {ClosingPreparer} */
class ThreadPreparer {
  /** Registering a frame takes this thread long: with two orders the preparer need not wait for it. */
  ahead = 2;
  #module;
  #worker;
  #nextId = 0;
  /** @type {Map<number, Waiting>} */
  #waiting = new Map();
  /** Why the thread has ended. @type {string | null} */
  #end = null;

  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.#module = module;
    this.#worker = this.#start();
  }

  #start() {
    this.#end = null;
    const worker = new Worker(new URL('./prepare_worker.js', import.meta.url), {
      workerData: { module: this.#module },
    });
    worker.on(
      'message',
      (/** @type {import('./prepare_worker.js').Done | import('./prepare_worker.js').Refused} */ answer) => {
        const waiting = this.#waiting.get(answer.id);
        this.#waiting.delete(answer.id);
        if ('error' in answer) waiting?.reject(Object.assign(new Error(), answer.error, { name: 'ScanstitchError' }));
        else waiting?.resolve({ bytes: answer.bytes, milliseconds: answer.milliseconds });
      },
    );
    worker.on('error', (error) =>
      this.#die(worker, `The thread that prepared this frame broke down: ${error.message}`),
    );
    worker.on('exit', () => this.#die(worker, 'The thread that prepared this frame has ended'));
    return worker;
  }

  /** @param {Worker} worker @param {string} message */
  #die(worker, message) {
    if (worker !== this.#worker || this.#end !== null) return;
    this.#end = message;
    const [first, ...others] = this.#waiting.values();
    first?.reject(new WorkerDied(message));
    for (const { reject } of others) reject(new WorkerDied(message, true));
    this.#waiting.clear();
  }

  /** @param {FrameJob} job @param {string} decodeConfig @param {AbortSignal} signal @returns {Promise<Prepared>} */
  async prepare(job, decodeConfig, signal) {
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
      this.#worker.postMessage({ id, order }, /** @type {ArrayBuffer[]} */ (buffers));
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
