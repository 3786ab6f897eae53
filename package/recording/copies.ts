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

/** A note about each file that is a copy of another one. */
export async function notesOnCopies(
  files: readonly ListedFile[],
  read: (path: string, length: number) => Promise<Uint8Array | null>,
): Promise<Note[]> {
  if (files.length > MOST_FILES) return [];
  const notes: Note[] = [];
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
        notes.push({ file: path, reason: `the same as ${first}, and used as a frame of its own; leave the copy out` });
      } else if (text !== null) known.set(text, path);
    }
  }
  return notes;
}
