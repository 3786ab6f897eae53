// @ts-check
/** Text files that list images: their times, and which belong together (TUM's rgb.txt, depth.txt, associations.txt). */
import { contains, folderOf } from './names.js';

/** @typedef {import('../recording.js').ListedFile} ListedFile */
/** @typedef {import('../recording.js').Note} Note */

const LIST_NAMES = /(^|\/)[^/]*(rgb|colou?r|depth|image|assoc|match|list)[^/]*\.(txt|match|csv|lst)$/i;
/** A list of a million images is longer than that; anything longer is no list. */
const MAX_BYTES = 64 * 2 ** 20;

/** @param {string} path */
export function isListName(path) {
  return LIST_NAMES.test(path);
}

/**
 * What the lists of a recording say about its images.
 * @param {string} root folder of the recording
 * @param {readonly ListedFile[]} files
 * @param {readonly { path: string }[]} images
 * @param {(path: string, size: number) => Promise<Uint8Array | null>} read
 * @returns {Promise<{ times: Map<string, number>, partners: Map<string, string>, notes: Note[] }>} partners: of a path,
 *   the path that stands in the same line
 */
export async function readLists(root, files, images, read) {
  const known = new Set(images.map(({ path }) => path));
  /** @type {Map<string, number>} */
  const times = new Map();
  /** @type {Map<string, string>} */
  const partners = new Map();
  /** @type {Note[]} */
  const notes = [];
  for (const file of files) {
    const { path } = file;
    if (!isListName(path) || folderOf(path) !== root || file.size > MAX_BYTES) continue;
    const bytes = await read(path, file.size);
    if (!bytes) continue;
    const { rows, missing } = readRows(new TextDecoder().decode(bytes), root, known);
    for (const row of rows) {
      for (const { image, time } of row) if (time !== null) times.set(image, time);
      const [first, second] = row;
      if (!first || !second) continue;
      partners.set(first.image, second.image);
      partners.set(second.image, first.image);
    }
    if (rows.length > 0 && missing.length > 0) {
      const some = missing.length === 1 ? 'an image that is' : `${missing.length} images that are`;
      notes.push({ file: path, reason: `names ${some} not here, ${missing[0]} first` });
    }
  }
  return { times, partners, notes };
}

/**
 * @param {string} text
 * @param {string} root
 * @param {Set<string>} known
 */
function readRows(text, root, known) {
  /** @type {{ image: string, time: number | null }[][]} */
  const rows = [];
  /** @type {string[]} */
  const missing = [];
  for (const line of text.split('\n')) {
    if (/^\s*(#|$)/.test(line)) continue;
    const words = line.trim().split(/[\s,]+/);
    /** @type {{ image: string, time: number | null }[]} */
    const row = [];
    words.forEach((word, index) => {
      if (!/\.(png|jpe?g|pgm|ppm)$/i.test(word)) return;
      const relative = word.replace(/^\.\//, '');
      const path = root === '' ? relative : `${root}/${relative}`;
      const time = index > 0 ? Number(words[index - 1]) : Number.NaN;
      if (known.has(path)) row.push({ image: path, time: Number.isFinite(time) ? time : null });
      else if (contains(root, folderOf(path))) missing.push(relative);
    });
    if (row.length > 0) rows.push(row);
  }
  return { rows, missing };
}
