/** Data sets that lie on a server: the built-in sample, or what a course page names in `src`. */

import type { InputFile } from '../engine/protocol.js';
import { classify } from '../../../npm/recording/classify.js';
import { HEAD_BYTES } from '../../../npm/recording/heads.js';
import { assignRoles } from '../../../npm/recording/planar.js';
import type { Dataset } from './dataset.js';
import { compareNaturally } from '../../../npm/natural_order.js';

/** A manifest a course page can point to: paths relative to the manifest itself. */
interface Manifest {
  title?: string;
  scans: string[];
  reference?: string;
  odometry?: string;
}

/** The built-in sample: ten rendered scans of a corridor and their ground truth. */
export async function fetchSample(): Promise<Dataset> {
  const { corridorFiles } = await import('./corridor.js');
  return { title: 'Sample: a corridor', is_given: true, is_log: false, ...corridorFiles(), odometry: null };
}

/**
 * The set a course page names: the address of a manifest (`.json`), or addresses of scans and one trajectory, apart by
 * spaces. Relative addresses count from the page.
 */
export async function fetchDataset(src: string): Promise<Dataset> {
  const addresses = src.trim().split(/\s+/);
  const [only] = addresses;
  if (addresses.length === 1 && only && /\.json([?#].*)?$/.test(only))
    return fetchManifest(new URL(only, document.baseURI));
  const files = await Promise.all(
    addresses
      .map((address) => new URL(address, document.baseURI))
      .map((url) => fetchFile({ name: nameOf(url), url: url.href })),
  );
  const known = files.map((file) => {
    const head = new Uint8Array(file.bytes, 0, Math.min(file.bytes.byteLength, HEAD_BYTES));
    return { name: file.name, role: classify(file.name, head), file };
  });
  const { scans, reference, odometry } = assignRoles(known);
  if (scans.length === 0) throw new Error(`none of the addresses in src="${src}" is a scan`);
  return {
    title: 'Scans of this page',
    is_given: true,
    is_log: false,
    scans: scans.sort((a, b) => compareNaturally(a.name, b.name)),
    reference,
    odometry,
  };
}

async function fetchManifest(url: URL): Promise<Dataset> {
  const manifest = (await (await fetchOk(url.href)).json()) as Partial<Manifest>;
  if (!Array.isArray(manifest.scans) || manifest.scans.length === 0) {
    throw new Error(
      `${url.href} names no scans; it should read { "title": "...", "scans": ["0.ply", ...], "reference": "truth.tum" }`,
    );
  }
  const located = (path: string): { name: string; url: string } => ({ name: path, url: new URL(path, url).href });
  return {
    title: manifest.title ?? 'Scans of this page',
    is_given: true,
    is_log: false,
    scans: await Promise.all(manifest.scans.map((path) => fetchFile(located(path)))),
    reference: manifest.reference ? await fetchFile(located(manifest.reference)) : null,
    odometry: manifest.odometry ? await fetchFile(located(manifest.odometry)) : null,
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

function nameOf(url: URL): string {
  return decodeURIComponent(baseOf(url.pathname));
}

function baseOf(path: string): string {
  return path.slice(path.lastIndexOf('/') + 1);
}
