/** Text files that list images: their times, and which belong together (TUM's rgb.txt, depth.txt, associations.txt). */
import type { Note } from '../base/errors.js';
import { ticksPerSecond } from '../base/units.js';
import { contains, folderOf } from '../files/names.js';
import type { ListedFile } from '../files/recording.js';

const LIST_NAMES = /(^|\/)[^/]*(rgb|colou?r|depth|image|assoc|match|list)[^/]*\.(txt|match|csv|lst)$/i;
/** A list of a million images is longer than that; anything longer is no list. */
const MAX_BYTES = 64 * 2 ** 20;

export function isListName(path: string) {
  return LIST_NAMES.test(path);
}

/**
 * What the lists of a recording say about its images.
 * @param root folder of the recording
 * @returns partners: of a path, the path that stands in the same line
 */
export async function readLists(
  root: string,
  files: readonly ListedFile[],
  images: readonly { path: string }[],
  read: (path: string, size: number) => Promise<Uint8Array | null>,
): Promise<{ times: Map<string, number>; partners: Map<string, string>; notes: Note[] }> {
  const known = new Set(images.map(({ path }) => path));
  const times: Map<string, number> = new Map();
  const partners: Map<string, string> = new Map();
  const notes: Note[] = [];
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

function readRows(text: string, root: string, known: Set<string>) {
  const rows: { image: string; time: number | null }[][] = [];
  const missing: string[] = [];
  for (const line of text.split('\n')) {
    if (/^\s*(#|$)/.test(line)) continue;
    const words = line.trim().split(/[\s,]+/);
    const row: { image: string; time: number | null }[] = [];
    words.forEach((word, index) => {
      if (!/\.(png|jpe?g|pgm|ppm)$/i.test(word)) return;
      const relative = word.replace(/^\.\//, '');
      const path = root === '' ? relative : `${root}/${relative}`;
      const written = index > 0 ? Number(words[index - 1]) : Number.NaN;
      const time = written / (ticksPerSecond(written) ?? 1);
      if (known.has(path)) row.push({ image: path, time: Number.isFinite(time) ? time : null });
      else if (contains(root, folderOf(path))) missing.push(relative);
    });
    if (row.length > 0) rows.push(row);
  }
  return { rows, missing };
}
