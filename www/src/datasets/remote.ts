/** The built-in sample, which lies beside the page. */
import type { Dataset } from './dataset.js';

/** Ten rendered scans of a corridor and their ground truth. */
export async function fetchSample(): Promise<Dataset> {
  const { corridorFiles } = await import('./corridor.js');
  return { title: 'Sample: a corridor', origin: 'sample', ...corridorFiles(), odometry: null };
}
