/** Prepares frames on several threads and registers them in their order, until all are placed or the run is stopped. */
import { type Registrar, type RunEvent, SpatialRun } from '../run/spatial_run.js';
import { isScanstitchError } from './command.js';
import { type FrameJob, startPreparers } from './preparers.js';
import type { Task } from './results.js';
import { progressLine } from './terminal.js';

type Registered = Extract<RunEvent, { type: 'registered' }>;

/**
 * @param given whenStopped: what happens to the frames that are registered when the run is stopped, behind their number
 * @returns total: wall time (ms)
 */
export async function runFrames(
  { engine, options, complain }: Pick<Task, 'engine' | 'options' | 'complain'>,
  jobs: FrameJob[],
  registrar: Registrar<FrameJob>,
  signal: AbortSignal,
  given: { onRegistered?: (event: Registered) => void; whenStopped?: string } = {},
): Promise<{ total: number; numPlaced: number; workers: number; isStopped: boolean }> {
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
