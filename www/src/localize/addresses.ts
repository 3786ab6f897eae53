/** A map and a recording that a host page or a link names: fetched, they are what a drop has. */
import type { NamedFile } from '../datasets/gather.js';
import { addressesOf, asTold, type FetchHooks, fetchGiven } from '../datasets/given.js';
import { imageOf, isYaml } from './map-files.js';
import { type Dropped, understandDrop } from './opening.js';

/** Either may be empty. */
export async function fetchDropped(map: string, src: string, hooks: FetchHooks): Promise<Dropped> {
  const ofMap = map === '' ? [] : await fetchMap(map, hooks);
  const given = src === '' ? null : await fetchGiven(addressesOf(src), hooks);
  const files = [...ofMap, ...(given?.files ?? [])];
  const dropped = await understandDrop(files, { isForMap: map !== '', notes: [], signal: hooks.signal });
  const { recording } = dropped;
  return given && recording ? { ...dropped, recording: asTold(recording, given, true).recording } : dropped;
}

/** A file, and with a YAML file of map_server the picture that it names. */
async function fetchMap(address: string, hooks: FetchHooks): Promise<NamedFile[]> {
  const [first] = (await fetchGiven([address], hooks)).files;
  if (!first) return [];
  const image = isYaml(first) ? imageOf(await first.file.text()) : null;
  if (image === null) return [first];
  const url = new URL(image, new URL(address, document.baseURI));
  return [first, ...(await fetchGiven([url.href], hooks)).files];
}
