/** A thread that prepares frames, with an instance of the engine of its own. */
import { parentPort, workerData } from 'node:worker_threads';
import * as engine from '../index.js';
import { isScanstitchError } from './command.js';
import { type Contents, type Order, prepare, readContents } from './prepare.js';

export type Done = { id: number; bytes: Uint8Array; milliseconds: Record<string, number> };
export type Refused = { id: number; error: { message: string } & Record<string, unknown> };

await engine.load(workerData.module);

/** Frames are prepared in the order in which they come, and read meanwhile. */
let turn = Promise.resolve();

parentPort?.on('message', ({ id, order }: { id: number; order: Order }) => {
  const reading = readContents(order);
  // A rejection is handled in `answer`, when this frame is reached.
  reading.catch(() => {});
  turn = turn.then(() => answer(id, order, reading));
});

async function answer(id: number, order: Order, reading: Promise<Contents>) {
  try {
    const { bytes, milliseconds } = prepare(engine, order, await reading);
    parentPort?.postMessage({ id, bytes, milliseconds }, [bytes.buffer as ArrayBuffer]);
  } catch (error) {
    // Anything but bad input has left this instance of the engine broken: the thread ends and is replaced.
    if (!isScanstitchError(error)) throw error;
    const { message, file, place, problem, remedy } = error;
    parentPort?.postMessage({ id, error: { message, file, place, problem, remedy } });
  }
}
