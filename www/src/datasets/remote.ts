/** The built-in sample, which lies beside the page. */

import type { InputFile } from '../engine/protocol.js';
import type { Dataset } from './dataset.js';
import { compareNaturally } from '../../../npm/natural_order.js';

const sample_scans = import.meta.glob<string>('../../samples/corridor/*.ply', {
  query: '?url',
  import: 'default',
  eager: true,
});
const sample_reference = import.meta.glob<string>('../../samples/corridor/truth.tum', {
  query: '?url',
  import: 'default',
  eager: true,
});

/** The built-in sample: ten rendered scans of a corridor and their ground truth. */
export async function fetchSample(): Promise<Dataset> {
  const scans = Object.entries(sample_scans).map(([path, url]) => ({ name: `corridor/${baseOf(path)}`, url }));
  const [reference] = Object.entries(sample_reference).map(([path, url]) => ({
    name: `corridor/${baseOf(path)}`,
    url,
  }));
  scans.sort((a, b) => compareNaturally(a.name, b.name));
  return {
    title: 'Sample: a corridor',
    is_given: true,
    is_log: false,
    scans: await Promise.all(scans.map(fetchFile)),
    reference: reference ? await fetchFile(reference) : null,
    odometry: null,
  };
}

async function fetchFile({ name, url }: { name: string; url: string }): Promise<InputFile> {
  return { name, bytes: await (await fetchOk(url)).arrayBuffer() };
}

async function fetchOk(url: string): Promise<Response> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} answered ${response.status} ${response.statusText}`);
  return response;
}

function baseOf(path: string): string {
  return path.slice(path.lastIndexOf('/') + 1);
}
