/** The built-in sample in space, loaded when it is asked for: even the addresses of its files are many. */
import { blobOf, type SpatialFiles, type StoredFile } from './spatial-files.js';

const apartment = import.meta.glob<string>('../../samples/apartment/**/*.{jpg,png,npy,json,txt}', {
  query: '?url',
  import: 'default',
  eager: true,
});

/** The built-in sample: depth images of an apartment. Its files are fetched one by one, when they are needed. */
export async function fetchApartment(): Promise<SpatialFiles> {
  const files = Object.entries(apartment).map(([path, url]) => onServer(path.slice(path.indexOf('apartment/')), url));
  return { title: 'Sample: an apartment', is_given: true, files, notes: [] };
}

function onServer(path: string, url: string): StoredFile {
  let kept: Promise<Uint8Array> | null = null;
  const read = (): Promise<Uint8Array> => {
    kept ??= fetchBytes(url).catch((error: unknown) => {
      kept = null;
      throw error;
    });
    return kept;
  };
  return {
    path,
    size: 1, // unknown before it is fetched; only whether it is empty matters
    read: async () => (await read()).slice(),
    readHead: async (length) => (await read()).slice(0, length),
    blob: async () => blobOf(path, await read()),
  };
}

async function fetchBytes(url: string): Promise<Uint8Array> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} answered ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}
