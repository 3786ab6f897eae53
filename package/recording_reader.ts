/**
 * What a folder, an archive or a ROS bag holds, as the page and the command line understand it: planar scans, depth images or
 * clouds in space, in which order, with which ground truth and camera.
 *
 * ```js
 * import { openAsBlob } from 'node:fs';
 * import { load, Reconstruction } from 'scanstitch';
 * import { readRecording } from 'scanstitch/recording';
 *
 * await load();
 * const names = ['0.ply', '1.ply', '2.ply', 'reference.tum'];
 * const files = await Promise.all(names.map(async (path) => ({ path, blob: await openAsBlob(path) })));
 * const recording = await readRecording(files);
 * const reconstruction = new Reconstruction();
 * for (const path of recording.scans) reconstruction.add_scan(path, await recording.read(path));
 * while (reconstruction.step().stage !== 'done');
 * console.log(recording.kind, recording.reference, reconstruction.result().frames.length);
 * reconstruction.free();
 * ```
 */

import { bytesOfBlob } from './archive/archive.js';
import { openAnyArchive } from './archive/open.js';
import { isBagName, isOfBag } from './bag/names.js';
import type { Role } from './bag/roles.js';
import type { Wishes } from './bag/topics.js';
import { append } from './base/append.js';
import type { Note } from './base/errors.js';
import type { Content } from './files/content.js';
import type { Recording } from './files/recording.js';
import { isArchiveName } from './files/kinds.js';
import { convertFiles } from './formats/convert.js';
import { filesInArchive, filesInBags } from './recording/contents.js';
import { understand } from './recording/understand.js';

export type { Note } from './base/errors.js';
export type { DepthFrame, Recording } from './files/recording.js';

/** blob: where it lies as it is */
type GivenFile = Content & { blob?: Blob };

export interface OpenedRecording extends Recording {
  /** The bytes of a file that the recording names. */
  read(path: string): Promise<Uint8Array>;
}

/**
 * Understands files of a page (`File`s) or any blobs with their paths. Archives and bags among them are opened. Before `read`
 * is called, packed files, files of MATLAB, scans and clouds as text, trajectories and cameras are read whole; of all others only
 * their names and beginnings.
 */
export async function readRecording(
  given: Iterable<File | { path: string; blob: Blob }>,
  options: {
    /** Topics of a bag to use instead of those that are found; null: to do without. */
    topics?: Partial<Record<Role, string | null>>;
  } = {},
): Promise<OpenedRecording> {
  const named = Array.from(given, (one) =>
    'blob' in one ? one : { path: one.webkitRelativePath || one.name, blob: one },
  );
  const notes: Note[] = [];
  const opened = await Promise.all(named.map((file) => openFile(file, notes)));
  const unpacked = await withBags(opened.flat(), options.topics ?? {}, notes);
  const { files, notes: told } = await convertFiles(unpacked, (content) => content);
  append(notes, told);
  const byPath = new Map(files.map((file) => [file.path, file]));
  const readHead = async (path: string, length: number) =>
    (await byPath.get(path)?.readHead(length)) ?? new Uint8Array();
  const recording = await understand(files, readHead);
  return {
    ...recording,
    notes: [...notes, ...recording.notes],
    read: async (path: string) => {
      const file = byPath.get(path);
      if (!file) throw new Error(`${path}: there is no such file in the recording`);
      return file.read();
    },
  };
}

async function openFile({ path, blob }: { path: string; blob: Blob }, notes: Note[]): Promise<GivenFile[]> {
  if (isArchiveName(path)) {
    const archive = await openAnyArchive(path, bytesOfBlob(blob));
    append(notes, archive.notes);
    return filesInArchive(archive);
  }
  const read = async (part: Blob) => new Uint8Array(await part.arrayBuffer());
  return [{ path, blob, size: blob.size, read: () => read(blob), readHead: (length) => read(blob.slice(0, length)) }];
}

/** What lies in bags takes the place of their files. */
async function withBags(files: GivenFile[], topics: Wishes, notes: Note[]) {
  if (!files.some(({ path }) => isBagName(path))) return files;
  const { listBags, recordingsOf } = await import('./bag/bag_recordings.js');
  const sources = files
    .filter(({ path }) => isOfBag(path))
    .map(({ path, blob, read }) => ({
      path,
      source: async () => bytesOfBlob(blob ?? new Blob([(await read()) as BlobPart])),
    }));
  const listed = await listBags(sources);
  append(notes, listed.notes);
  return [...files.filter(({ path }) => !isOfBag(path)), ...filesInBags(await recordingsOf(listed.bags, topics))];
}
