/**
 * A browser compiles the engine while it runs: at first quickly, and what is much used once more, well. The first recording
 * would pay for that, and for threads that start. So while the user is still choosing files, a few frames of the sample
 * are computed and thrown away; the threads stay for the recording.
 */
import { fetchApartment } from '../datasets/apartment.js';
import { SpatialClient } from '../engine/spatial-client.js';
import { jobsOf } from '../spatial/take-in.js';

/** Enough for nearly all that is much used; more frames would hardly find more. */
const NUM_FRAMES = 16;

/** The mark in the browser's own timeline when the warm-up is done. */
const WARM = 'scanstitch-warm';

/** Until it is done, or `signal` says that there is real work. */
export async function warmUp(signal: AbortSignal): Promise<void> {
  const { recording } = await fetchApartment();
  const jobs = jobsOf(recording).slice(0, NUM_FRAMES);
  if (signal.aborted) return;
  const ignore = (): void => undefined;
  const client = new SpatialClient({
    ready: () => client.load({ jobs, num_recorded: jobs.length, intrinsics: null, reference: null }, {}),
    snapshot: async (state) => {
      if (state !== 'done') return;
      await client.retire();
      performance.mark(WARM);
    },
    // What is wrong with the engine or the sample is reported when they are wanted.
    unavailable: () => client.dispose(),
    crashed: () => client.dispose(),
    problem: ignore,
    registered: ignore,
    finishing: ignore,
    replaced: ignore,
  });
  signal.addEventListener('abort', () => client.dispose(), { once: true });
}
