/** One frame of a recording in space, and the threads that decode and prepare such frames. */
import { giveBack, owned } from '../../../package/base/buffers.js';
import preparerUrl from './preparer-worker.ts?worker&url';
import type { Problem } from './protocol.js';
import { EngineProblem, WorkerDied } from './remote.js';
import type { ColorFile, DepthColors, PreparerApi, TopView } from './spatial-protocol.js';
import { WorkerHost } from './worker-host.js';
import { messageOf } from './message-of.js';

/** A file that can be read whenever it is needed, and is not held in memory meanwhile. */
export interface Readable {
  path: string;
  read(): Promise<Uint8Array>;
}

/** One frame of the recording. */
export interface SpatialJob {
  index: number;
  name: string;
  time: number | null;
  /** Depth image or cloud. */
  file: Readable;
  color: Readable | null;
  isCloud: boolean;
}

/** Time after which a worker that has not returned a frame counts as dead (ms), since one that is killed sends no event. */
const PATIENCE_MS = 20_000;
/** Buffers of frames that have been registered, for those to come. */
const sparePrepared: Uint8Array[] = [];
/** As many as may be on their way at a time. */
const MOST_SPARE = 8;

/** Cores of this machine, 2 where the browser does not say. */
export const NUM_CORES = navigator.hardwareConcurrency || 2;
/** Threads that prepare frames, at most. */
const MAX_PREPARERS = 4;
/** On a single core, preparing ahead would only take its time from the frame that is being registered. */
export const AHEAD: { maxInFlight?: number } = NUM_CORES === 1 ? { maxInFlight: 1 } : {};

/** Keeps the buffer of a frame that has been registered, for one to come. */
export function keepSpare(bytes: Uint8Array): void {
  if (sparePrepared.length < MOST_SPARE) sparePrepared.push(bytes);
}

/** No frames are to come: their buffers are given back. */
export function dropSpare(): void {
  sparePrepared.length = 0;
}

/** One thread that prepares frames; where it dies, another takes its place. */
export class ThreadPreparer {
  #host = new WorkerHost<PreparerApi>(preparerUrl, {
    // The frame is to blame: it is left out when it has done so twice (package/run/spatial_run.ts).
    crashed: (message) => {
      this.#host.succeeded();
      this.#diedIdle = this.#numWaiting > 0 ? null : message;
    },
    unavailable: () => undefined, // reported by `replace`
  });

  /** Calls that wait for the thread: a crash fails them, and is reported by them. */
  #numWaiting = 0;
  /** Why the thread died between two frames; reported with the next frame. */
  #diedIdle: string | null = null;

  async prepare(
    job: SpatialJob,
    decodeConfig: string,
    signal: AbortSignal,
  ): Promise<{ bytes: Uint8Array; milliseconds: Record<string, number> }> {
    const { index, name, time, file, color, isCloud } = job;
    // The thread gets them for its own; should it die, they are read again.
    const read = async (from: Readable): Promise<Uint8Array> => owned(await from.read());
    const readColors = async (from: Readable): Promise<ColorFile> => {
      const { path } = from;
      return read(from).then(
        (bytes) => ({ path, bytes, problem: null }),
        (error: unknown) => ({ path, bytes: null, problem: textOf(error, path) }),
      );
    };
    const [bytes, colors] = await Promise.all([read(file), color && readColors(color)]);
    // No thread is started for a run that has ended meanwhile.
    signal.throwIfAborted();
    const spare = sparePrepared.pop() ?? null;
    const buffers = [bytes, colors?.bytes, spare].flatMap((given) => (given ? [given.buffer] : []));
    const start = performance.now();
    const { prepared, spent, spentColor } = await this.#patiently(() =>
      isCloud
        ? this.#host.give('prepareCloud', buffers, decodeConfig, name, index, time, bytes, spare)
        : this.#host.give('prepareFrame', buffers, decodeConfig, name, index, time, bytes, colors, spare),
    );
    for (const read of [spent, spentColor]) if (read) giveBack(read);
    return { bytes: prepared, milliseconds: { prepare: performance.now() - start } };
  }

  async depthPicture(file: Readable, colors: Uint32Array): Promise<DepthColors> {
    const bytes = owned(await file.read());
    return this.#patiently(() => this.#host.give('depthPicture', [bytes.buffer], file.path, bytes, colors));
  }

  async topView(file: Readable, fx: number): Promise<TopView> {
    const bytes = owned(await file.read());
    return this.#patiently(() => this.#host.give('topView', [bytes.buffer], file.path, bytes, fx));
  }

  /** Starts another thread; rejects where none can be started. */
  async replace(): Promise<void> {
    await this.#host.start();
  }

  end(): void {
    this.#host.dispose();
  }

  /** As `end`, but the thread is kept for the next client. */
  retire(): void {
    this.#host.retire();
  }

  async #patiently<R>(call: () => Promise<R>): Promise<R> {
    const died = this.#diedIdle;
    this.#diedIdle = null;
    if (died !== null) throw new WorkerDied(died);
    await this.#host.start();
    const timer = setTimeout(() => this.#host.kill('it did not answer'), PATIENCE_MS);
    this.#numWaiting++;
    try {
      return await call();
    } finally {
      clearTimeout(timer);
      this.#numWaiting--;
    }
  }
}

export function problemOf(error: unknown, file: string): Problem {
  if (error instanceof EngineProblem) return { ...error.problem, file: error.problem.file || file };
  const { place = null, problem = messageOf(error), remedy = '' } = error as Partial<Problem>;
  return { file: (error as Partial<Problem>).file || file, place, problem, remedy };
}

/** Starts threads until there is one for each of so many cores, within bounds. */
export function addPreparers(preparers: ThreadPreparer[], numCores: number): void {
  const wanted = Math.min(Math.max(1, numCores), MAX_PREPARERS);
  while (preparers.length < wanted) preparers.push(new ThreadPreparer());
}

/** What is wrong with a file beside the frames is reported, and the frames go on without it. */
export async function tolerate(
  listener: { problem(problem: Problem): void },
  file: string,
  action: () => Promise<unknown>,
): Promise<void> {
  try {
    await action();
  } catch (error) {
    if (error instanceof WorkerDied) throw error;
    listener.problem(problemOf(error, file));
  }
}

/** What went wrong with a file, which is named. */
function textOf(error: unknown, file: string): string {
  return (error as Partial<Problem>).file ? messageOf(error) : `${file}: ${messageOf(error)}`;
}
