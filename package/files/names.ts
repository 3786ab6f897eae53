/** File names: which share a numbering, the number of each, and the kind that their words hint at. */
import { compareNaturally } from '../base/natural_order.js';
import type { ListedFile } from './recording.js';

/** key: equal in files that belong together */
export type Member = { path: string; key: string; time: number | null };
/** Files of one folder whose names differ in their numbers alone, in natural order. */
export type Series = { folder: string; pattern: string; members: Member[] };

export function folderOf(path: string) {
  return path.slice(0, Math.max(0, path.lastIndexOf('/')));
}

export function baseOf(path: string) {
  return path.slice(path.lastIndexOf('/') + 1);
}

/** The folder that holds both. */
export function commonFolder(a: string, b: string) {
  const [partsA, partsB] = [a.split('/'), b.split('/')];
  const same = partsA.findIndex((part, index) => part !== partsB[index]);
  return (same < 0 ? partsA : partsA.slice(0, same)).join('/');
}

export function contains(folder: string, inner: string) {
  return folder === '' || inner === folder || inner.startsWith(`${folder}/`);
}

/** In the recording's folder, inside it, or on the way to it. */
export function isNear(
  folder: string,
  { root, isElsewhere }: { root: string; isElsewhere: (folder: string) => boolean },
) {
  return (contains(root, folder) || contains(folder, root)) && !isElsewhere(folder);
}

/** Folders above it. */
export function depthOf(folder: string) {
  return folder === '' ? 0 : folder.split('/').length;
}

/** What to call these files. */
export function nameOf({ members }: Series) {
  const [first] = members;
  const last = members.at(-1);
  if (!first || !last) return '';
  return first === last ? first.path : `${first.path} to ${baseOf(last.path)}`;
}

/** What to call a reference: its file, or the folder of its files. */
export function nameOfReference([first = '', ...others]: readonly string[]) {
  return others.length > 0 ? folderOf(first) || 'the pose files' : first;
}

export function groupBy<T>(values: readonly T[], keyOf: (value: T) => string) {
  const groups: Map<string, T[]> = new Map();
  for (const value of values) {
    const group = groups.get(keyOf(value));
    if (group) group.push(value);
    else groups.set(keyOf(value), [value]);
  }
  return groups;
}

export function seriesOf(files: readonly ListedFile[]): Series[] {
  const groups = groupBy(files, ({ path }) => {
    return `${folderOf(path)}/${baseOf(path).toLowerCase().replaceAll(/\d+/g, '#')}`;
  });
  return [...groups].map(([id, group]) => {
    const pattern = baseOf(id);
    const sorted = group.sort((a, b) => compareNaturally(a.path, b.path));
    const keys = keysOf(sorted.map(({ path }) => baseOf(path)));
    const members = sorted.map(({ path }, index) => {
      return { path, key: keys[index] ?? '', time: timeOf(baseOf(path)) };
    });
    return { folder: folderOf(id), pattern, members };
  });
}

/** Numbers that are the same in every name (of a camera, of a day) tell no file from another. */
function keysOf(names: string[]) {
  const rows = names.map((name) => name.match(/\d+/g) ?? []);
  const columns = (rows[0] ?? []).map((_, column) => column);
  const varying = columns.filter((column) => rows.some((row) => row[column] !== rows[0]?.[column]));
  const telling = varying.length > 0 ? varying : columns.slice(-1);
  return names.map((name, index) => {
    if (telling.length === 0)
      return `name ${wordsOf(name.replace(/\.[^.]*$/, ''))
        .filter((word) => !roleOf(word))
        .join(' ')}`;
    return telling.map((column) => (rows[index]?.[column] ?? '').replace(/^0+(?=\d)/, '')).join(' ');
  });
}

/** The time (s) that a name is: a decimal fraction, or a count of milli-, micro- or nanoseconds since 1970. */
function timeOf(name: string) {
  const stem = name.replace(/\.[a-z]+$/i, '');
  const [, fraction] = stem.match(/(?:^|[^\d.])(\d+\.\d+)(?:$|[^\d.])/) ?? [];
  if (fraction !== undefined) return Number(fraction);
  const [, count] = stem.match(/(?:^|\D)(\d{13}|\d{16}|\d{19})(?:$|\D)/) ?? [];
  if (count === undefined) return null;
  // Split first: nanoseconds since 1970 have more digits than a double.
  return Number(`${count.slice(0, 10)}.${count.slice(10)}`);
}

export type Hint = 'depth' | 'color' | 'aside';

/** What is made from the images of a recording, and is none of it. */
const ASIDE =
  /^(semantics?|seg(mentations?|ms?)?|labels?|masks?|instances?|normals?|conf(idences?)?|ir\d*|infra.*|vis\w*|previews?|viz|colormaps?|jet|heat\w*|debug|overlays?|matches)$/;
const DEPTH = /^(dep(th\w*)?|dpt|disp(arity)?)$/;
const COLOR =
  /^(rgb(?!d)\w*|colou?rs?|images?|imgs?|photos?|pics?|pictures?|gr[ae]y|left|right|cams?|mono|stereo|(cost)?maps?|grid|occupancy)$/;

function roleOf(word: string): Hint | null {
  if (ASIDE.test(word)) return 'aside';
  if (DEPTH.test(word)) return 'depth';
  return COLOR.test(word) ? 'color' : null;
}

/** Words of a name, without its numbers. */
export function wordsOf(name: string) {
  return name
    .replaceAll(/([a-z])([A-Z])/g, '$1 $2')
    .toLowerCase()
    .split(/[^a-z]+/)
    .filter((word) => word !== '');
}

/**
 * What the name of a file or folder hints at; what is derived ("depth_vis") outweighs the rest.
 * @param name without the ending
 */
export function hintOf(name: string): Hint | null {
  const roles = wordsOf(name).map(roleOf);
  const ranked = ['aside', 'depth', 'color'] as const;
  return ranked.find((role) => roles.includes(role)) ?? null;
}

/** What the names of a series hint at: the files' own, or else the folder's. */
export function hintOfSeries({ folder, pattern }: Series) {
  const parts = folder.split('/').reverse().slice(0, 2);
  for (const name of [pattern.replace(/\.[^.]*$/, ''), ...parts]) {
    const hint = hintOf(name);
    if (hint) return hint;
  }
  return null;
}
