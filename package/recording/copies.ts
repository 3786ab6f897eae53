/** Files that are there twice under two names: each would count as a scan of its own, and agree with the other by itself. */
import type { Note } from '../base/errors.js';
import { groupBy } from '../files/names.js';
import type { ListedFile } from '../files/recording.js';

/** Of more files, none is compared. */
const MOST_FILES = 500;
/** Shorter files are no scans (bytes). */
const MIN_BYTES = 512;
/** Of longer files, this much is compared. */
const MOST_BYTES = 2 ** 24;
/** Files of equal length that differ so far are not the same, and are not compared as a whole. */
const COMPARED_BYTES = 16_384;

/** @returns null: no such file */
type ReadHead = (path: string, length: number) => Promise<Uint8Array | null>;

/** A note about each file that is a copy of another one. */
export async function notesOnCopies(files: readonly ListedFile[], read: ReadHead): Promise<Note[]> {
  const copies = await copiesAmong(files, read);
  return copies.map(({ path, first }) => ({
    file: path,
    reason: `the same as ${first}, and used as a frame of its own; leave the copy out`,
  }));
}

/** A note about depth images that are copies of others, as those of a simulated camera at rest are, too. */
export async function noteOnCopiedImages(files: readonly ListedFile[], read: ReadHead): Promise<Note[]> {
  const copies = await copiesAmong(files, read);
  const [copy] = copies;
  if (!copy) return [];
  const some = copies.length === 1 ? '' : ` (and ${copies.length - 1} more of ${files.length} are copies)`;
  const reason = `the same as ${copy.first}${some}: a camera at rest, or one image under two names, which is then a frame too many`;
  return [{ file: copy.path, reason }];
}

async function copiesAmong(files: readonly ListedFile[], read: ReadHead): Promise<{ path: string; first: string }[]> {
  if (files.length > MOST_FILES) return [];
  const copies: { path: string; first: string }[] = [];
  const long = files.filter(({ size }) => size >= MIN_BYTES);
  for (const alike of groupBy(long, ({ size }) => `${size}`).values()) {
    const known: Map<string, string> = new Map();
    for (const { path } of alike.length > 1 ? alike : []) {
      const beginning = async (length: number, of = path) => {
        const bytes = await read(of, length);
        return bytes === null || bytes.length === 0 ? null : new TextDecoder('latin1').decode(bytes);
      };
      const text = await beginning(COMPARED_BYTES);
      const first = text === null ? undefined : known.get(text);
      if (first !== undefined) {
        if ((await beginning(MOST_BYTES)) !== (await beginning(MOST_BYTES, first))) continue;
        copies.push({ path, first });
      } else if (text !== null) known.set(text, path);
    }
  }
  return copies;
}
