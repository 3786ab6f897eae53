/** Where the lab's clouds come from: files of the user, the sample, addresses of a course page. */
import type { CloudData, GivenCloud, GivenClouds } from '../run/given-clouds.js';
import type { MenuItem } from '../components/menu.js';
import type { NamedFile } from '../datasets/gather.js';
import { addressesOf, fetchGiven } from '../datasets/given.js';
import { fetchSample } from '../datasets/remote.js';

import { lab_scene, lab_scenes } from '../../../package/lab/scenes.js';
import { baseName } from '../views/format.js';
import type { LabLink } from './link.js';
import type { Options } from './protocol.js';
import { compareNaturally } from '../../../package/base/natural_order.js';

/** Name of the sample in a link. */
export const SAMPLE = 'sample';

/** A map of a run, which no file holds. */
export const isMapName = (name: string): boolean => /^map (of|before) /.test(name);

export const isCloudName = (name: string): boolean => /\.(ply|pcd)$/i.test(name);

/** Poses of the user's own ICP. */
export const isPosesName = (name: string): boolean => /\.(csv|txt|json|npy)$/i.test(name);

function fileCloud({ name, file }: NamedFile): GivenCloud {
  return { name, read: async () => ({ kind: 'file', name, bytes: new Uint8Array(await file.arrayBuffer()) }) };
}

/** Clouds that the user dropped: on their own, or joining those that are there. */
export function joined(present: GivenClouds | null, files: readonly NamedFile[]): GivenClouds | null {
  const fresh = files.map(fileCloud).sort((a, b) => compareNaturally(a.name, b.name));
  const [first, second] = fresh;
  if (!first) return null;
  if (second) {
    // As the files are called, or else the second to the first.
    const named = (role: RegExp): string | undefined => fresh.find(({ name }) => role.test(name))?.name;
    const target = named(/target/i) ?? first.name;
    const source = named(/source/i) ?? fresh.find(({ name }) => name !== target)?.name ?? second.name;
    return givenClouds('Your clouds', '', fresh, source, target);
  }
  const others = (present?.clouds ?? []).filter(({ name }) => name !== first.name);
  const target = present && present.source !== first.name ? (present.source ?? '') : (others[0]?.name ?? '');
  return givenClouds('Your clouds', '', [...others, first], first.name, target);
}

/** The clouds in the roles that a link gives them, with what it says; null where they are others. */
export function asLinked(given: GivenClouds, link: LabLink): (LabLink & { given: GivenClouds }) | null {
  const called = (wanted: string): string =>
    given.clouds.find(({ name }) => baseName(name) === baseName(wanted))?.name ?? '';
  const [source, target] = [called(link.source), called(link.target)];
  return source && target ? { ...link, given: { ...given, source, target } } : null;
}

function givenClouds(
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
  const ignore = { signal: new AbortController().signal, fetched: () => undefined };
  const { title, files } = await fetchGiven(addressesOf(src), ignore);
  const clouds = files.filter(({ name }) => isCloudName(name));
  if (clouds.length < 2) throw new Error(`src="${src}" names ${clouds.length} clouds; it takes two, as PLY or PCD`);
  const scans = await Promise.all(clouds.map(async ({ name, file }) => ({ name, bytes: await file.arrayBuffer() })));
  const [source, target] = scans.length === 2 ? scans.map(({ name }) => name) : [];
  scans.sort((a, b) => compareNaturally(a.name, b.name));
  return fromScans({ title: title || 'Clouds of this page', scans }, '', source ?? '', target ?? '');
}

/** Scenes by which a course shows one thing each. */
export const SCENE_ITEMS: readonly MenuItem[] = lab_scenes().map((name) => {
  const { title, question } = lab_scene(name);
  return { id: name, label: title, detail: question };
});

/** A scene of the gallery as clouds to open; null where there is none of this name. */
export function sceneClouds(name: string): OpenedScene | null {
  if (!lab_scenes().includes(name)) return null;
  const scene = lab_scene(name);
  const cloud = (role: 'source' | 'target'): GivenCloud => ({
    name: role,
    read: async () => ({ kind: 'positions', name: role, xyz: Float32Array.from(scene[role]) }),
  });
  const given = givenClouds(scene.title, name, [cloud('source'), cloud('target')], 'source', 'target');
  const [first = {}, ...others] = scene.methods;
  const { title, question, answer, look_at } = scene;
  return { given, first, others, text: { title, question, answer, look_at } };
}

export interface OpenedScene {
  given: GivenClouds;
  /** Its method, and those to compare it with. */
  first: Options;
  others: readonly Options[];
  text: { title: string; question: string; answer: string; look_at: string };
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
  const chosenTarget = has(target) ? target : (clouds[0]?.name ?? '');
  const chosenSource = has(source) ? source : (clouds.find(({ name }) => name !== chosenTarget)?.name ?? '');
  return givenClouds(title, sample, clouds, chosenSource, chosenTarget);
}

/** The two clouds as the engine takes them. */
export function readPair({ clouds, source, target }: GivenClouds): Promise<[source: CloudData, target: CloudData]> {
  const read = (name: string): Promise<CloudData> => {
    const cloud = clouds.find((one) => one.name === name);
    if (!cloud) throw new Error(`${name} is not among the clouds`);
    return cloud.read();
  };
  return Promise.all([read(source), read(target)]);
}

/** Another cloud of the list as source or target, from where they lie. */
export function withChoice(given: GivenClouds, role: 'source' | 'target', name: string): GivenClouds {
  const { source, target } = given;
  // The same cloud twice makes no sense: source and target are exchanged.
  const isExchange = name === (role === 'source' ? target : source);
  const chosen = isExchange ? { source: target, target: source } : { source, target, [role]: name };
  return { ...given, ...chosen, init_T_target_source: null };
}
