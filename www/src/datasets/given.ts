/**
 * What a host names in `src`: the addresses of files, or of a manifest that lists them. They are fetched and become files
 * as a drop has them.
 */
import { HEAD_BYTES } from '../../../package/files/heads.js';
import { isLaserLog } from '../../../package/files/laser_logs.js';
import type { OpenedRecording } from '../../../package/recording_reader.js';
import type { Opened } from './dataset.js';
import { okOnly } from './fetch-ok.js';
import type { NamedFile } from './gather.js';

/** Files that come from the host. What the manifest says of them counts more than what they look like. */
export interface GivenSet {
  /** How the page calls it; empty: after its folder. */
  title: string;
  files: NamedFile[];
  /** Planar scans in the order of the manifest; empty: in natural order. */
  scans: readonly string[];
  reference: string | null;
  odometry: string | null;
}

/** Addresses are relative to the manifest. Each list may be a single address. */
interface Manifest {
  title?: string;
  scans?: string | string[];
  depth?: string | string[];
  color?: string | string[];
  clouds?: string | string[];
  /** Whatever a drop takes: zip, bag, log, and what belongs to the lists above, as a camera. */
  files?: string | string[];
  reference?: string;
  odometry?: string;
}

const LISTS = ['scans', 'depth', 'color', 'clouds', 'files', 'reference', 'odometry'] as const;
const EXAMPLE = '{ "title": "...", "scans": ["0.ply", ...], "reference": "truth.tum" }';
/** Browsers refuse thousands of requests at a time. */
const NUM_CONCURRENT = 8;
const DEFAULT_TITLE = 'Scans of this page';

export interface FetchHooks {
  signal: AbortSignal;
  fetched(done: number, total: number): void;
}

/** The addresses in `src`: separated by spaces, or a JSON list of them. */
export function addressesOf(src: string): string[] {
  const text = src.trim();
  if (!text.startsWith('[')) return text.split(/\s+/).filter((address) => address !== '');
  const list = readJson(text);
  if (Array.isArray(list) && list.every((address) => typeof address === 'string')) return list;
  throw new Error(`src="${text}" is not a list of addresses; it should read ["0.ply", "1.ply"]`);
}

/** Fetches what the addresses name. Relative ones count from the page. */
export async function fetchGiven(addresses: readonly string[], hooks: FetchHooks): Promise<GivenSet> {
  const urls = addresses.map((address) => resolve(address, document.baseURI));
  const [only] = urls;
  if (only && urls.length === 1 && /\.json$/i.test(only.pathname)) {
    const file = await fetchFile(only, nameOf(only), hooks.signal);
    const manifest = await manifestOf(file);
    return manifest ? fetchManifest(manifest, only, hooks) : { ...NOTHING, files: [file] };
  }
  const names = shortNames(urls);
  const files = await fetchAll(
    urls.map((url, i) => ({ url, name: names[i] ?? '' })),
    hooks,
  );
  return { ...NOTHING, files };
}

/** Files of this machine that a host hands over. */
export function givenFiles(files: NamedFile[]): GivenSet {
  return { ...NOTHING, files };
}

const NOTHING: GivenSet = { title: '', files: [], scans: [], reference: null, odometry: null };

/** Null: the file is a laser log written as JSON. */
async function manifestOf({ name, file }: NamedFile): Promise<Manifest | null> {
  const head = new Uint8Array(await file.slice(0, HEAD_BYTES).arrayBuffer());
  if (isLaserLog(head)) return null;
  const manifest = readJson(await file.text());
  if (typeof manifest !== 'object' || manifest === null) {
    throw new Error(`${name} is not a manifest: it is not JSON; it should read ${EXAMPLE}`);
  }
  return manifest;
}

async function fetchManifest(manifest: Manifest, base: URL, hooks: FetchHooks): Promise<GivenSet> {
  const listed = Object.fromEntries(LISTS.map((key) => [key, listOf(manifest[key], key, base)]));
  const paths = [...new Set(Object.values(listed).flat())];
  if (paths.length === 0) {
    const unknown = Object.keys(manifest).filter((key) => key !== 'title' && !LISTS.some((known) => known === key));
    const typo = unknown.length > 0 ? ` (${unknown.join(', ')}: not known)` : '';
    throw new Error(`${base.href} names no scans${typo}; it should read ${EXAMPLE}`);
  }
  const named = paths.map((path) => {
    const url = resolve(path, base.href);
    return { url, name: nameIn(path, url) };
  });
  const files = await fetchAll(named, hooks);
  const nameAt = (path: string): string => named[paths.indexOf(path)]?.name ?? path;
  return {
    title: typeof manifest.title === 'string' ? manifest.title : '',
    files,
    scans: (listed.scans ?? []).map(nameAt),
    reference: listed.reference?.map(nameAt)[0] ?? null,
    odometry: listed.odometry?.map(nameAt)[0] ?? null,
  };
}

function listOf(value: unknown, key: string, base: URL): string[] {
  const list = value === undefined || value === null ? [] : Array.isArray(value) ? value : [value];
  if (list.every((path) => typeof path === 'string')) return list;
  throw new Error(`${base.href}: "${key}" should be an address, or a list of addresses`);
}

/** What these files are, as the manifest has it. Throws where they go to the view of planar scans and hold none. */
export function asTold(recording: OpenedRecording, given: GivenSet, is_planar: boolean): Opened {
  const found = (name: string | null): string | null => (recording.files.has(name ?? '') ? name : null);
  const [reference, odometry] = [found(given.reference), found(given.odometry)];
  const place = (name: string): number => given.scans.indexOf(name);
  const scans = recording.scans.filter((name) => name !== reference && name !== odometry);
  if (given.scans.length > 0) scans.sort((a, b) => place(a) - place(b));
  if (is_planar && scans.length === 0) throw noScan(given, recording);
  const told: OpenedRecording = {
    ...recording,
    scans,
    reference: reference === null ? recording.reference : [reference],
    odometry: odometry ?? recording.odometry,
    notes: recording.notes.filter(({ file }) => file !== reference && file !== odometry),
  };
  return { title: given.title || (is_planar ? DEFAULT_TITLE : ''), origin: 'host', recording: told };
}

function noScan({ files }: GivenSet, { beside, notes }: OpenedRecording): Error {
  const reasons = (beside?.notes ?? notes).map(({ file, reason }) => `${file}: ${reason}`);
  const names = files.map(({ name }) => name).join(', ');
  return new Error(`there is no scan among ${names}${reasons.length > 0 ? ` (${reasons.join('; ')})` : ''}`);
}

// Fetching.

async function fetchAll(
  wanted: readonly { url: URL; name: string }[],
  { signal, fetched }: FetchHooks,
): Promise<NamedFile[]> {
  const files: NamedFile[] = [];
  let [next, done] = [0, 0];
  const fetchSome = async (): Promise<void> => {
    for (let i = next++; i < wanted.length; i = next++) {
      const { url, name } = wanted[i] as (typeof wanted)[number];
      files[i] = await fetchFile(url, name, signal);
      fetched(++done, wanted.length);
    }
  };
  fetched(0, wanted.length);
  await Promise.all(Array.from({ length: NUM_CONCURRENT }, fetchSome));
  return files;
}

async function fetchFile(url: URL, name: string, signal: AbortSignal): Promise<NamedFile> {
  // A browser may keep a blob on the disk: a recording may be larger than the memory.
  return { name, file: new File([await (await fetchShown(url, signal)).blob()], name) };
}

async function fetchShown(url: URL, signal: AbortSignal): Promise<Response> {
  const response = await fetch(url, { signal }).catch((error: unknown) => {
    if (signal.aborted) throw error;
    throw new Error(`${shown(url)} could not be fetched: ${reasonOf(url)}`);
  });
  return okOnly(response, shown(url));
}

/** Browsers do not tell a page why a request to another host failed. */
function reasonOf({ origin }: URL): string {
  return origin === location.origin
    ? 'the network failed'
    : `the network failed, or ${origin} does not let other sites read it (it has to send Access-Control-Allow-Origin)`;
}

function resolve(address: string, base: string): URL {
  try {
    return new URL(address, base);
  } catch {
    throw new Error(`${address} is not an address`);
  }
}

/** A data URL holds the file itself. */
const shown = (url: URL): string => (url.protocol === 'data:' ? `data:…;name=${nameOf(url)}` : url.href);

/** Of a data URL the parameter `name` of its media type. */
function nameOf({ protocol, pathname }: URL): string {
  const given = protocol === 'data:' ? (/^[^,]*?;name=([^;,]+)/.exec(pathname)?.[1] ?? 'data') : undefined;
  return decoded(given ?? pathname.slice(pathname.lastIndexOf('/') + 1));
}

/** The path in a manifest, which keeps its folders; no query, no fragment and no escapes. */
function nameIn(path: string, url: URL): string {
  if (url.protocol === 'data:') return nameOf(url);
  return decoded(path.replace(/[?#].*$/s, '').replace(/^(\.?\/)+/, ''));
}

function decoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Paths without the folders that all have in common. */
function shortNames(urls: readonly URL[]): string[] {
  const folders = urls.map(({ protocol, pathname }) => (protocol === 'data:' ? [] : pathname.split('/').slice(0, -1)));
  const [first = []] = folders;
  let depth = 0;
  while (depth < first.length && folders.every((folder) => folder[depth] === first[depth])) depth++;
  return urls.map((url, i) => [...(folders[i] ?? []).slice(depth), nameOf(url)].join('/'));
}

function readJson(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}
