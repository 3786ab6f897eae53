// @ts-check
/**
 * `scanstitch/recording`: what a folder, an archive or a bag holds, as the page and the command line understand it. Types and
 * documentation are in `recording_reader.d.ts`.
 */
import { append } from './append.js';
import { bytesOfBlob } from './archive.js';
import { isBagName, isOfBag } from './bag/names.js';
import { convertFiles } from './formats/convert.js';
import { openAnyArchive } from './open_archive.js';
import { understand } from './recording.js';
import { filesInArchive, filesInBags } from './recording/contents.js';
import { isArchiveName } from './recording/kinds.js';

/** @typedef {import('./recording/contents.js').Content & { blob?: Blob }} Content blob: where it lies as it is */
/** @typedef {import('./recording.js').Note} Note */

/** @type {typeof import('./recording_reader.js').readRecording} */
export async function readRecording(given, { topics = {} } = {}) {
  const named = Array.from(given, (one) =>
    'blob' in one ? one : { path: one.webkitRelativePath || one.name, blob: one },
  );
  /** @type {Note[]} */
  const notes = [];
  const opened = await Promise.all(named.map((file) => openFile(file, notes)));
  const unpacked = await withBags(opened.flat(), topics, notes);
  const { files, notes: told } = await convertFiles(unpacked, (content) => content);
  append(notes, told);
  const byPath = new Map(files.map((file) => [file.path, file]));
  const readHead = async (/** @type {string} */ path, /** @type {number} */ length) =>
    (await byPath.get(path)?.readHead(length)) ?? new Uint8Array();
  const recording = await understand(files, readHead);
  return {
    ...recording,
    notes: [...notes, ...recording.notes],
    read: async (path) => {
      const file = byPath.get(path);
      if (!file) throw new Error(`${path}: there is no such file in the recording`);
      return file.read();
    },
  };
}

/**
 * @param {{ path: string, blob: Blob }} file
 * @param {Note[]} notes
 * @returns {Promise<Content[]>}
 */
async function openFile({ path, blob }, notes) {
  if (isArchiveName(path)) {
    const archive = await openAnyArchive(path, bytesOfBlob(blob));
    append(notes, archive.notes);
    return filesInArchive(archive);
  }
  const read = async (/** @type {Blob} */ part) => new Uint8Array(await part.arrayBuffer());
  return [{ path, blob, size: blob.size, read: () => read(blob), readHead: (length) => read(blob.slice(0, length)) }];
}

/**
 * What lies in bags takes the place of their files.
 * @param {Content[]} files
 * @param {import('./bag/topics.js').Wishes} topics
 * @param {Note[]} notes
 */
async function withBags(files, topics, notes) {
  if (!files.some(({ path }) => isBagName(path))) return files;
  const { listBags, recordingsOf } = await import('./bag/bag_recordings.js');
  const sources = files
    .filter(({ path }) => isOfBag(path))
    .map(({ path, blob, read }) => ({
      path,
      source: async () => bytesOfBlob(blob ?? new Blob([/** @type {BlobPart} */ (await read())])),
    }));
  const listed = await listBags(sources);
  append(notes, listed.notes);
  return [...files.filter(({ path }) => !isOfBag(path)), ...filesInBags(await recordingsOf(listed.bags, topics))];
}
