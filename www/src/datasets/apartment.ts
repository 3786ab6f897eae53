/** The built-in sample in space, loaded when it is asked for: even the addresses of its files are many. */
import { fetchOk } from './fetch-ok.js';
import { type Content, openRecording } from '../../../package/recording_reader.js';
import type { Opened } from './dataset.js';

const apartment = import.meta.glob<string>('../../samples/apartment/**/*.{jpg,png,npy,json,txt}', {
  query: '?url',
  import: 'default',
  eager: true,
});

/** The built-in sample: depth images of an apartment. Its files are fetched one by one, when they are needed. */
export async function fetchApartment(): Promise<Opened> {
  if (Object.keys(apartment).length === 0)
    throw new Error('This copy of Scanstitch comes without the sample of depth images');
  const entries = Object.entries(apartment).map(([path, url]) => onServer(path.slice(path.indexOf('apartment/')), url));
  const recording = await openRecording(await Promise.all(entries));
  return { title: 'Sample: an apartment', origin: 'sample', recording };
}

async function onServer(path: string, url: string): Promise<Content> {
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
    // Of images it is unknown before they are fetched, and only whether they are empty matters.
    size: /\.(jpg|png)$/.test(path) ? 1 : (await read()).length,
    read: async () => (await read()).slice(),
    readHead: async (length) => (await read()).slice(0, length),
  };
}

async function fetchBytes(url: string): Promise<Uint8Array> {
  return new Uint8Array(await (await fetchOk(url)).arrayBuffer());
}
