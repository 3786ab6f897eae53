// @ts-check
/** A thread that prepares frames, with an instance of the engine of its own. */
import { parentPort, workerData } from 'node:worker_threads';
import * as engine from '../index.js';
import { isScanstitchError } from './command.js';
import { prepare, readContents } from './prepare.js';

/** @typedef {{ id: number, bytes: Uint8Array, milliseconds: Record<string, number> }} Done */
/** @typedef {{ id: number, error: { message: string } & Record<string, unknown> }} Refused */

await engine.load(workerData.module);

/** Frames are prepared in the order in which they come, and read meanwhile. */
let turn = Promise.resolve();

parentPort?.on('message', (/** @type {{ id: number, order: import('./prepare.js').Order }} */ { id, order }) => {
  const reading = readContents(order);
  // A rejection is handled in `answer`, when this frame is reached.
  reading.catch(() => {});
  turn = turn.then(() => answer(id, order, reading));
});

/** @param {number} id @param {import('./prepare.js').Order} order @param {Promise<import('./prepare.js').Contents>} reading */
async function answer(id, order, reading) {
  try {
    const { bytes, milliseconds } = prepare(engine, order, await reading);
    parentPort?.postMessage({ id, bytes, milliseconds }, [/** @type {ArrayBuffer} */ (bytes.buffer)]);
  } catch (error) {
    // Anything but bad input has left this instance of the engine broken: the thread ends and is replaced.
    if (!isScanstitchError(error)) throw error;
    const { message, file, place, problem, remedy } = error;
    parentPort?.postMessage({ id, error: { message, file, place, problem, remedy } });
  }
}
