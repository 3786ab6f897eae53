// @ts-check
/** File names: which share a numbering, the number of each, and the kind that their words hint at. */
import { compareNaturally } from '../natural_order.js';

/** @typedef {import('../recording.js').ListedFile} ListedFile */
/** @typedef {{ path: string, key: string, time: number | null }} Member key: equal in files that belong together */
/** Files of one folder whose names differ in their numbers alone, in natural order. */
/** @typedef {{ folder: string, pattern: string, members: Member[] }} Series */

/** @param {string} path */
export function folderOf(path) {
  return path.slice(0, Math.max(0, path.lastIndexOf('/')));
}

/** @param {string} path */
export function baseOf(path) {
  return path.slice(path.lastIndexOf('/') + 1);
}

/**
 * The folder that holds both.
 * @param {string} a
 * @param {string} b
 */
export function commonFolder(a, b) {
  const [partsA, partsB] = [a.split('/'), b.split('/')];
  const same = partsA.findIndex((part, index) => part !== partsB[index]);
  return (same < 0 ? partsA : partsA.slice(0, same)).join('/');
}

/** @param {string} folder @param {string} inner */
export function contains(folder, inner) {
  return folder === '' || inner === folder || inner.startsWith(`${folder}/`);
}

/**
 * In the recording's folder, inside it, or on the way to it.
 * @param {string} folder
 * @param {{ root: string, isElsewhere: (folder: string) => boolean }} frames
 */
export function isNear(folder, { root, isElsewhere }) {
  return (contains(root, folder) || contains(folder, root)) && !isElsewhere(folder);
}

/** Folders above it. @param {string} folder */
export function depthOf(folder) {
  return folder === '' ? 0 : folder.split('/').length;
}

/** What to call these files. @param {Series} series */
export function nameOf({ members }) {
  const [first] = members;
  const last = members.at(-1);
  if (!first || !last) return '';
  return first === last ? first.path : `${first.path} to ${baseOf(last.path)}`;
}

/**
 * @template T
 * @param {readonly T[]} values
 * @param {(value: T) => string} keyOf
 */
export function groupBy(values, keyOf) {
  /** @type {Map<string, T[]>} */
  const groups = new Map();
  for (const value of values) {
    const group = groups.get(keyOf(value));
    if (group) group.push(value);
    else groups.set(keyOf(value), [value]);
  }
  return groups;
}

/**
 * @param {readonly ListedFile[]} files
 * @returns {Series[]}
 */
export function seriesOf(files) {
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

/**
 * Numbers that are the same in every name (of a camera, of a day) tell no file from another.
 * @param {string[]} names
 */
function keysOf(names) {
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

/**
 * The time (s) that a name is: a decimal fraction, or a count of milli-, micro- or nanoseconds since 1970.
 * @param {string} name
 */
function timeOf(name) {
  const stem = name.replace(/\.[a-z]+$/i, '');
  const [, fraction] = stem.match(/(?:^|[^\d.])(\d+\.\d+)(?:$|[^\d.])/) ?? [];
  if (fraction !== undefined) return Number(fraction);
  const [, count] = stem.match(/(?:^|\D)(\d{13}|\d{16}|\d{19})(?:$|\D)/) ?? [];
  if (count === undefined) return null;
  // Split first: nanoseconds since 1970 have more digits than a double.
  return Number(`${count.slice(0, 10)}.${count.slice(10)}`);
}

/** @typedef {'depth' | 'color' | 'aside'} Hint */

/** What is made from the images of a recording, and is none of it. */
const ASIDE =
  /^(semantics?|seg(mentations?|ms?)?|labels?|masks?|instances?|normals?|conf(idences?)?|ir\d*|infra.*|vis\w*|previews?|viz|colormaps?|jet|heat\w*|debug|overlays?|matches)$/;
const DEPTH = /^(dep(th\w*)?|dpt|disp(arity)?)$/;
const COLOR =
  /^(rgb(?!d)\w*|colou?rs?|images?|imgs?|photos?|pics?|pictures?|gr[ae]y|left|right|cams?|mono|stereo|(cost)?maps?|grid|occupancy)$/;

/** @param {string} word @returns {Hint | null} */
function roleOf(word) {
  if (ASIDE.test(word)) return 'aside';
  if (DEPTH.test(word)) return 'depth';
  return COLOR.test(word) ? 'color' : null;
}

/** Words of a name, without its numbers. @param {string} name */
export function wordsOf(name) {
  return name
    .replaceAll(/([a-z])([A-Z])/g, '$1 $2')
    .toLowerCase()
    .split(/[^a-z]+/)
    .filter((word) => word !== '');
}

/**
 * What the name of a file or folder hints at; what is derived ("depth_vis") outweighs the rest.
 * @param {string} name without the ending
 * @returns {Hint | null}
 */
export function hintOf(name) {
  const roles = wordsOf(name).map(roleOf);
  const ranked = /** @type {const} */ (['aside', 'depth', 'color']);
  return ranked.find((role) => roles.includes(role)) ?? null;
}

/**
 * What the names of a series hint at: the files' own, or else the folder's.
 * @param {Series} series
 */
export function hintOfSeries({ folder, pattern }) {
  const parts = folder.split('/').reverse().slice(0, 2);
  for (const name of [pattern.replace(/\.[^.]*$/, ''), ...parts]) {
    const hint = hintOf(name);
    if (hint) return hint;
  }
  return null;
}
