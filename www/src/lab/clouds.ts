/** Where the lab's clouds come from: files of the user, the sample, addresses of a course page. */
import type { GivenCloud, GivenClouds } from '../components/given-clouds.js';
import type { NamedFile } from '../datasets/gather.js';
import { fetchDataset, fetchSample } from '../datasets/remote.js';
import { compareNaturally } from '../../../npm/natural_order.js';

/** Name of the sample in a link. */
export const SAMPLE = 'corridor';

export const isCloudName = (name: string): boolean => /\.(ply|pcd)$/i.test(name);

export function fileCloud({ name, file }: NamedFile): GivenCloud {
  return { name, read: async () => ({ kind: 'file', name, bytes: new Uint8Array(await file.arrayBuffer()) }) };
}

/** Clouds that the user dropped: on their own, or joining those that are there. */
export function joined(present: GivenClouds | null, files: readonly NamedFile[]): GivenClouds | null {
  const fresh = files.map(fileCloud).sort((a, b) => compareNaturally(a.name, b.name));
  const [first, second] = fresh;
  if (!first) return null;
  if (second) return givenClouds('Your clouds', '', fresh, second.name, first.name);
  const others = (present?.clouds ?? []).filter(({ name }) => name !== first.name);
  const target = present && present.source !== first.name ? (present.source ?? '') : (others[0]?.name ?? '');
  return givenClouds('Your clouds', '', [...others, first], first.name, target);
}

export function givenClouds(
  title: string,
  sample: string,
  clouds: readonly GivenCloud[],
  source: string,
  target: string,
): GivenClouds {
  return { title, sample, of: clouds, clouds, source, target, options: null, init_T_target_source: null };
}

/** The second scan to the first one, unless others are named. */
export async function sampleClouds(source = '', target = ''): Promise<GivenClouds> {
  return fromScans(await fetchSample(), SAMPLE, source, target);
}

/** The clouds that a course page names: the first address is the source, the second the target. */
export async function addressedClouds(src: string): Promise<GivenClouds> {
  const dataset = await fetchDataset(src);
  // The data set is in the natural order of its names; two addresses are in the order of the page.
  const names = src.trim().split(/\s+/);
  const named = (address: string | undefined): string =>
    dataset.scans.find(({ name }) => address?.split(/[?#]/)[0]?.endsWith(name))?.name ?? '';
  const is_pair = names.length === 2;
  return fromScans(dataset, '', is_pair ? named(names[0]) : '', is_pair ? named(names[1]) : '');
}

interface Scans {
  title: string;
  scans: readonly { name: string; bytes: ArrayBuffer }[];
}

function fromScans({ title, scans }: Scans, sample: string, source: string, target: string): GivenClouds {
  const clouds = scans.map(({ name, bytes }) => ({
    name,
    read: async () => ({ kind: 'file' as const, name, bytes: new Uint8Array(bytes) }),
  }));
  const has = (name: string): boolean => clouds.some((cloud) => cloud.name === name);
  const chosen_target = has(target) ? target : (clouds[0]?.name ?? '');
  const chosen_source = has(source) ? source : (clouds.find(({ name }) => name !== chosen_target)?.name ?? '');
  return givenClouds(title, sample, clouds, chosen_source, chosen_target);
}
