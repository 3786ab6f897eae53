/**
 * What a folder, an archive or a ROS bag holds: planar scans, depth images or clouds in space, in which order, with which ground
 * truth and camera. The page and the command line open recordings by this function, too, and what it finds is not looked for again.
 */

import type { ListedBag } from './bag/bag_recordings.js';
import type { OnWalk } from './bag/container.js';
import { isBagName, isOfBag } from './bag/names.js';
import type { Choice, Wishes } from './bag/topics.js';
import { append } from './base/append.js';
import { fileError, type Note, notUsed } from './base/errors.js';
import type { Content } from './files/content.js';
import { isArchiveName } from './files/kinds.js';
import { contains, folderOf } from './files/names.js';
import type { Understood } from './files/recording.js';
import { needsConversion } from './formats/names.js';
import { filesInArchive, filesInBags } from './recording/contents.js';
import type { Trajectories } from './recording/trajectories.js';
import { understand } from './recording/understand.js';

export type { ListedBag } from './bag/bag_recordings.js';
export type { Note } from './base/errors.js';
export type { Content } from './files/content.js';
export type { DepthFrame, Recording } from './files/recording.js';
export type { Trajectories } from './recording/trajectories.js';

/** A file: as a page has it, any blob, or something that is read when it is needed. Folders of a path are separated by slashes. */
export type Source = File | { path: string; blob: Blob } | Content;

/** What is being done with a bag, or its topics as soon as they are known; `done` and `total` count bytes or messages. */
export type OpenProgress =
  { stage: 'index' | 'messages'; done: number; total: number } | { stage: 'topics'; bags: readonly ListedBag[] };

/** A ROS bag: what is in it, and which of its topics are used as what. */
export interface OpenedBag {
  listed: ListedBag;
  choice: Choice;
}

export interface OpenOptions {
  /** Rejects with its reason once it is aborted. */
  signal?: AbortSignal;
  /** Topics of a bag to use instead of those that are found; null: to do without. */
  topics?: Wishes;
  onProgress?: (progress: OpenProgress) => void;
  /** Of files that are missing among the sources: they come before the others. */
  notes?: readonly Note[];
  /** Whether tables of numbers are said to be laser scans. */
  isTable?: boolean;
  /** Which recording to use, where there are several: the folder it lies in, or the end of its path. The longest without. */
  folder?: string;
}

/**
 * What is read of files, with their bytes when they are asked for:
 *
 * ```js
 * import { openAsBlob } from 'node:fs';
 * import { load, Reconstruction } from 'scanstitch';
 * import { openRecording } from 'scanstitch/recording';
 *
 * await load();
 * const names = ['0.ply', '1.ply', '2.ply', 'reference.tum'];
 * const files = await Promise.all(names.map(async (path) => ({ path, blob: await openAsBlob(path) })));
 * const recording = await openRecording(files);
 * const reconstruction = new Reconstruction();
 * for (const path of recording.scans) reconstruction.add_scan(path, await recording.read(path));
 * while (reconstruction.step().stage !== 'done');
 * console.log(recording.kind, recording.reference, reconstruction.result().frames.length);
 * reconstruction.free();
 * ```
 */
export interface OpenedRecording extends Understood {
  /** All files by their paths, unpacked and converted. */
  files: ReadonlyMap<string, Content>;
  bags: readonly OpenedBag[];
  /** The bytes of a file that the recording names. */
  read(path: string): Promise<Uint8Array>;
  /** The same files with other topics of the bags. Rejects where a bag has no such topic. */
  choose(topics: Wishes, options?: Pick<OpenOptions, 'signal' | 'onProgress'>): Promise<OpenedRecording>;
  /** The files of both, as one recording. */
  with(others: Pick<OpenedRecording, 'opened'>): Promise<OpenedRecording>;
  /** What the files are to a comparison. */
  trajectories(): Promise<Trajectories>;
  /** For `with`. */
  readonly opened: Opened;
}

interface Opened {
  /** What lies in no bag. */
  loose: readonly Content[];
  inBags: readonly Content[];
  bags: readonly OpenedBag[];
  notes: readonly Note[];
  how: Pick<OpenOptions, 'isTable' | 'folder'>;
  /** Files that were given, or lie in what was given: used or not. */
  numGiven: number;
}

/**
 * Understands files. Archives and bags among them are opened. Before `read` is called, packed files, files of MATLAB, scans and clouds
 * as text, trajectories and cameras are read whole; of all others only their names and beginnings.
 */
export async function openRecording(sources: Iterable<Source>, options: OpenOptions = {}): Promise<OpenedRecording> {
  const { signal, topics = {}, onProgress = () => undefined, isTable = false } = options;
  signal?.throwIfAborted();
  const notes: Note[] = [...(options.notes ?? [])];
  const given = Array.from(sources, contentOf);
  const contents = await withArchives(given, notes);
  signal?.throwIfAborted();
  const loose = await converted(
    contents.filter(({ path }) => !isOfBag(path)),
    notes,
  );
  const numGiven = Math.max(given.length, contents.length);
  const how = { isTable, ...(options.folder !== undefined && { folder: options.folder }) };
  const ofBags = contents.filter(({ path }) => isOfBag(path));
  if (!ofBags.some(({ path }) => isBagName(path))) {
    return understood({ loose: [...loose, ...ofBags], inBags: [], bags: [], notes, how, numGiven }, signal);
  }
  const listed = await listBagsOf(ofBags, (done, total) => {
    signal?.throwIfAborted();
    onProgress({ stage: 'index', done, total });
  });
  signal?.throwIfAborted();
  append(notes, listed.notes);
  onProgress({ stage: 'topics', bags: listed.bags });
  return understood({ loose, ...(await fromBags(listed.bags, topics, options)), notes, how, numGiven }, signal);
}

/** Former name of `openRecording`. */
export { openRecording as readRecording };

/** The bags among these sources, with their topics. */
export async function bagsAmong(sources: Iterable<Source>) {
  const notes: Note[] = [];
  const contents = await withArchives(Array.from(sources, contentOf), notes);
  const listed = await listBagsOf(contents.filter(({ path }) => isOfBag(path)));
  return { bags: listed.bags, notes: [...notes, ...listed.notes] };
}

async function listBagsOf(ofBags: Content[], onWalk?: OnWalk) {
  const { listBags } = await import('./bag/bag_recordings.js');
  const { bytesInMemory } = await import('./archive/open.js');
  const files = ofBags.map(({ path, open, read }) => ({
    path,
    source: open ?? (async () => bytesInMemory(await read())),
  }));
  return listBags(files, onWalk);
}

async function understood(opened: Opened, signal?: AbortSignal): Promise<OpenedRecording> {
  const { loose, inBags, bags, notes, how } = opened;
  const files = new Map([...loose, ...inBags].map((file) => [file.path, file]));
  const all = [...files.values()];
  const file = (path: string) => files.get(path) ?? fail(path, 'There is no such file in the recording');
  const recording = await understand(
    how.folder === undefined ? all : filesOfRecording(all, how.folder.replace(/\/+$/, '')),
    async (path, length) => {
      signal?.throwIfAborted();
      return file(path).readHead(length);
    },
    how.isTable,
  );
  signal?.throwIfAborted();
  return {
    ...recording,
    notes: [...notes, ...recording.notes],
    ...(recording.beside && {
      beside: { ...recording.beside, notes: [...notes, ...recording.beside.notes] },
    }),
    files,
    bags,
    read: async (path) => file(path).read(),
    trajectories: async () => (await import('./recording/trajectories.js')).trajectoriesAmong(all),
    choose: async (topics, options = {}) => {
      const chosen = await fromBags(
        bags.map(({ listed }) => listed),
        topics,
        options,
      );
      return understood({ ...opened, ...keptOf(opened, chosen) }, options.signal);
    },
    opened,
    with: async ({ opened: more }) =>
      understood({
        how,
        numGiven: opened.numGiven + more.numGiven,
        loose: [...loose, ...more.loose],
        inBags: [...inBags, ...more.inBags],
        bags: [...bags, ...more.bags],
        notes: [...notes, ...more.notes],
      }),
  };
}

function fail(path: string, problem: string): never {
  throw fileError(path, problem);
}

function contentOf(source: Source): Content {
  if ('read' in source) return source;
  const { path, blob } =
    'blob' in source ? source : { path: source.webkitRelativePath || source.name, blob: source as Blob };
  const bytes = async (part: Blob) => {
    try {
      return new Uint8Array(await part.arrayBuffer());
    } catch {
      throw fileError(path, 'This file could not be read; was it moved or deleted?', 'Give it again');
    }
  };
  return {
    path,
    blob,
    // Browsers ask the disk for it, and the page waits: of a folder's files, few are asked.
    get size() {
      return blob.size;
    },
    read: () => bytes(blob),
    readHead: (length) => bytes(blob.slice(0, length)),
    open: async () => (await import('./archive/archive.js')).bytesOfBlob(blob),
  };
}

/** What lies in archives takes their place. */
async function withArchives(given: Content[], notes: Note[]) {
  const files: Content[] = [];
  for (const file of given) {
    const { path, open, read, isNamed } = file;
    if (!isArchiveName(path) || isNamed === false) {
      files.push(file);
      continue;
    }
    const { bytesInMemory, openAnyArchive } = await import('./archive/open.js');
    try {
      const archive = await openAnyArchive(path, open ? await open() : bytesInMemory(await read()));
      append(notes, archive.notes);
      const inside = filesInArchive(archive);
      const { openWorkbench } = await import('./report/workbench.js');
      append(files, (await openWorkbench(inside)) ?? inside);
    } catch (error) {
      notes.push(notUsed(path, error));
    }
  }
  return files;
}

/** What is packed or of a format that the engine does not read is made into what it reads. */
async function converted(files: Content[], notes: Note[]) {
  if (!needsConversion(files)) return files;
  const { convertFiles } = await import('./formats/convert.js');
  const made = await convertFiles(files, (content, { isNamed }) => ({ ...content, ...(isNamed && { isNamed }) }));
  append(notes, made.notes);
  return made.files;
}

async function fromBags(
  listed: readonly ListedBag[],
  topics: Wishes,
  { signal, onProgress = () => undefined }: OpenOptions,
) {
  const { recordingsOf } = await import('./bag/bag_recordings.js');
  const recordings = await recordingsOf(listed, topics, (done, total) => {
    signal?.throwIfAborted();
    onProgress({ stage: 'messages', done, total });
  });
  const bags = listed.map((bag, at) => ({ listed: bag, choice: recordings[at]?.choice ?? {} }));
  return { bags, inBags: filesInBags(recordings) };
}

/** Where only the reference changes, the frames are the same files, and need not be computed again. */
function keptOf(before: Pick<Opened, 'bags' | 'inBags'>, { bags, inBags }: Pick<Opened, 'bags' | 'inBags'>) {
  const frames = (all: Opened['bags']) => JSON.stringify(all.map(({ choice }) => ({ ...choice, reference: '' })));
  if (frames(before.bags) !== frames(bags)) return { bags, inBags };
  const old = new Map(before.inBags.map((file) => [file.path, file]));
  return {
    bags,
    inBags: inBags.map((file) => {
      const kept = /\.tum$/.test(file.path) ? undefined : old.get(file.path);
      return kept && file.given ? Object.assign(kept, { given: file.given }) : file;
    }),
  };
}

/** What lies in this folder, or beside it on the way down to it. */
function filesOfRecording(files: Content[], chosen: string) {
  const parts = chosen.split('/').length;
  const folders = files.map(({ path }) => {
    const names = folderOf(path).split('/');
    const end = names.findIndex((_, index) => names.slice(index, index + parts).join('/') === chosen);
    return end < 0 ? null : names.slice(0, end + parts).join('/');
  });
  const folder = folders.find((name) => name !== null) ?? fail(chosen, 'there is no such folder in the input');
  return files.filter(({ path }) => contains(folder, folderOf(path)) || contains(folderOf(path), folder));
}
