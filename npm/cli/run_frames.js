// @ts-check
/** Prepares frames on several threads and registers them in their order, until all are placed or the run is stopped. */
import { SpatialRun } from '../spatial_run.js';
import { isScanstitchError } from './command.js';
import { startPreparers } from './preparers.js';
import { progressLine } from './terminal.js';

/** @typedef {import('./preparers.js').FrameJob} FrameJob */
/** @typedef {Extract<import('../spatial_run.js').RunEvent, { type: 'registered' }>} Registered */

/**
 * @param {Pick<import('./results.js').Task, 'engine' | 'options' | 'complain'>} task
 * @param {FrameJob[]} jobs
 * @param {import('../spatial_run.js').Registrar<FrameJob>} registrar
 * @param {AbortSignal} signal
 * @param {{ onRegistered?: (event: Registered) => void, whenStopped?: string }} [given] whenStopped: what happens to the frames
 *    that are registered when the run is stopped, behind their number
 * @returns {Promise<{ total: number, numPlaced: number, workers: number, isStopped: boolean }>} total: wall time (ms)
 */
export async function runFrames({ engine, options, complain }, jobs, registrar, signal, given = {}) {
  const { onRegistered = () => {}, whenStopped = '' } = given;
  const workers = Math.min(options.workers, jobs.length);
  const preparers = await startPreparers(engine, workers);
  const progress = progressLine(jobs.length);
  let numPlaced = 0;
  const run = new SpatialRun({
    preparers,
    registrar,
    onEvent: (event) => {
      if (event.type === 'problem') {
        progress.clear();
        complain(isScanstitchError(event.error) ? event.error.message : `${event.name}: ${event.error.message}.`);
      }
      if (event.type === 'registered') {
        numPlaced += 1;
        onRegistered(event);
        progress.show(numPlaced);
      }
    },
  });
  run.add(jobs);
  const start = performance.now();
  try {
    const { state } = await run.run(signal);
    const total = performance.now() - start;
    const isStopped = state === 'stopped';
    if (isStopped && numPlaced > 0) {
      progress.clear();
      complain(`Stopped after ${numPlaced} of ${jobs.length} frames${whenStopped}.`);
    }
    return { total, numPlaced, workers, isStopped };
  } finally {
    progress.clear();
    await Promise.all(preparers.map((preparer) => preparer.close()));
  }
}
