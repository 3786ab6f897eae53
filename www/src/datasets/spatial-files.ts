/**
 * Files of a recording in space: where each one's bytes are, read when they are needed. They may lie on the disk, in a
 * zip, or on the server.
 */
import type { ListedBag } from '../../../package/bag/bag_recordings.js';
import { append } from '../../../package/base/append.js';
import { isBagName, isOfBag } from '../../../package/bag/names.js';
import { needsConversion } from '../../../package/formats/names.js';
import type { Content } from '../../../package/files/content.js';
import { filesInArchive, filesInBags } from '../../../package/recording/contents.js';
import { isArchiveName, isImageName } from '../../../package/files/kinds.js';
import type { ByteSource } from '../../../package/archive/window.js';
import type { Choice, Wishes } from '../../../package/bag/topics.js';
import type { Recording, Understood } from '../../../package/files/recording.js';
import type { Readable } from '../engine/preparer.js';
import { bitmapOf } from './bitmap.js';
import type { Origin } from './dataset.js';
import type { Note } from './note.js';
import type { NamedFile } from './gather.js';

export interface StoredFile extends Readable {
  size: number;
  readHead(length: number): Promise<Uint8Array>;
  /** For an image element. */
  blob(): Promise<Blob>;
  /** Whether it is a file as it was given. */
  is_on_disk?: boolean;
  /** Whether it is a cloud, whatever its name says. */
  isCloud?: boolean;
  /** The recording that it is a part of, in a bag. */
  given?: Recording;
  /** What could not be read of it, once it has been read. */
  losses?: readonly Note[];
}

/** A ROS bag: what is in it, and which of its topics are used as what. */
export interface OpenedBag {
  listed: ListedBag;
  choice: Choice;
}

/**
 * News of bags that are being opened: how many bytes of one without an index have been gone through, the topics, then how many
 * messages of how many have been looked into. What a listener throws ends the opening.
 */
export interface BagListener {
  walking(done: number, total: number): void;
  listed(bags: readonly ListedBag[]): Promise<void>;
  looking(done: number, total: number): void;
}

/** What was opened together. */
export interface SpatialFiles {
  /** How the page calls it; empty: after its folder. */
  title: string;
  origin: Origin;
  files: readonly StoredFile[];
  notes: readonly Note[];
  /** What the files are made out to be, where it is known already. */
  recording?: Understood;
}

/** How a recording is understood is loaded with the first one that may be in space. */
export async function understandFiles(files: readonly StoredFile[]): Promise<Understood> {
  const { understand } = await import('../../../package/recording/understand.js');
  const byPath = new Map(files.map((file) => [file.path, file]));
  return understand(files, async (path, length) => (await byPath.get(path)?.readHead(length)) ?? new Uint8Array());
}

/** Files for the flat view, and what became of those that cannot be opened. */
export interface PlanarFiles {
  files: readonly NamedFile[];
  notes: readonly Note[];
  /** Files that were given, used or not. */
  num_given: number;
}

/** Files that were opened, ready to be understood. */
export interface OpenedFiles {
  /** As they were given. */
  given: readonly NamedFile[];
  files: StoredFile[];
  notes: Note[];
  bags: OpenedBag[];
}

/** What the files are made to, whether they are a recording or lie beside one, and the bag they come from. */
export type OpenedRun = ({ planar: PlanarFiles } | { spatial: SpatialFiles }) & {
  is_recording: boolean;
  bag: OpenedBag | null;
};

/**
 * Which view takes these files: planar scans the flat one, depth images and clouds the one in space; what is neither,
 * as a trajectory alone, the one that is shown.
 */
export async function tellApart(
  { given, files, notes, bags }: OpenedFiles,
  shown: 'planar' | 'spatial',
): Promise<OpenedRun> {
  const recording = await understandFiles(files);
  const { kind, root, notes: told } = recording;
  const is_recording = kind !== 'nothing';
  const bag = bags.find(({ listed }) => listed.bag.path === root) ?? bags[0] ?? null;
  if (kind === 'depth_images' || kind === 'clouds' || (kind === 'nothing' && shown === 'spatial')) {
    return { spatial: { title: '', origin: 'user', files, notes, recording }, is_recording, bag };
  }
  const loose = given.filter(({ name }) => !isArchiveName(name) && !isOfBag(name));
  // What was converted is not what was given.
  const on_disk = new Set(files.filter(({ is_on_disk }) => is_on_disk).map(({ path }) => path));
  const loose_as_given = loose.filter(({ name }) => on_disk.has(name));
  const packed = files.filter(({ is_on_disk }) => !is_on_disk);
  const num_given = Math.max(given.length, files.length);
  if (kind === 'nothing' && (bags.length > 0 || files.filter(({ path }) => isImageName(path)).length > 1)) {
    // Meant as depth images: why they are none is better known there than in the plane.
    return { planar: { files: [], notes: [...notes, ...told], num_given: given.length }, is_recording, bag };
  }
  const unpacked = await unpack(packed);
  const bag_notes = bags.length > 0 ? told : [];
  const all_notes = [...notes, ...bag_notes, ...unpacked.notes];
  return { planar: { files: [...loose_as_given, ...unpacked.files], notes: all_notes, num_given }, is_recording, bag };
}

/** Zips and bags are opened; what lies in them is unpacked when it is read. */
export async function openFiles(
  given: readonly NamedFile[],
  listener: BagListener = { walking: () => undefined, listed: async () => undefined, looking: () => undefined },
): Promise<OpenedFiles> {
  const opened_archives = await openArchives(given);
  const { notes } = opened_archives;
  const of_bags = opened_archives.files.filter(({ path }) => isOfBag(path));
  const rest = await convert(
    opened_archives.files.filter(({ path }) => !isOfBag(path)),
    notes,
  );
  if (!of_bags.some(({ path }) => isBagName(path))) return { given, files: [...rest, ...of_bags], notes, bags: [] };
  const { listBags } = await import('../../../package/bag/bag_recordings.js');
  const sources = of_bags.map((file) => ({ path: file.path, source: () => sourceOf(file, given) }));
  const listed = await listBags(sources, (done, total) => listener.walking(done, total));
  await listener.listed(listed.bags);
  const opened = await openBags(listed.bags, {}, listener);
  return { given, files: [...rest, ...opened.files], notes: [...notes, ...listed.notes], bags: opened.bags };
}

/** What is packed or of a format that the engine does not read is made into what it reads. */
async function convert(files: StoredFile[], notes: Note[]): Promise<StoredFile[]> {
  if (!needsConversion(files)) return files;
  const { convertFiles } = await import('../../../package/formats/convert.js');
  const converted = await convertFiles(files, packed);
  append(notes, converted.notes);
  return converted.files;
}

/** The same files with other topics of their bags. */
export async function chooseTopics(opened: OpenedFiles, wishes: Wishes, listener: BagListener): Promise<OpenedFiles> {
  const { bags, files } = await openBags(
    opened.bags.map(({ listed }) => listed),
    wishes,
    listener,
  );
  const before = new Map(opened.files.map((file) => [file.path, file]));
  const sources = (bag: OpenedBag | undefined): string => JSON.stringify({ ...bag?.choice, reference: '' });
  // Where only the reference changes, the frames are the same, and need not be computed again.
  const is_same = opened.bags.every((bag, i) => sources(bag) === sources(bags[i]));
  const kept = files.map((file) => {
    const old = before.get(file.path);
    return is_same && old && !file.path.endsWith('.tum') ? Object.assign(old, { given: file.given }) : file;
  });
  return { ...opened, files: [...opened.files.filter(({ given }) => !given), ...kept], bags };
}

async function openBags(
  bags: readonly ListedBag[],
  wishes: Wishes,
  listener: BagListener,
): Promise<{ bags: OpenedBag[]; files: StoredFile[] }> {
  const { recordingsOf } = await import('../../../package/bag/bag_recordings.js');
  const recordings = await recordingsOf(bags, wishes, (done, total) => listener.looking(done, total));
  const files = filesInBags(recordings).map(packed);
  return { files, bags: bags.map((listed, i) => ({ listed, choice: recordings[i]?.choice ?? {} })) };
}

/** What lies in an archive or a bag. */
function packed(content: Content): StoredFile {
  return { ...content, blob: async () => blobOf(content.path, await content.read()) };
}

/** On the disk a bag is read piece by piece; one in a zip has to be unpacked as a whole. */
async function sourceOf(file: StoredFile, given: readonly NamedFile[]): Promise<ByteSource> {
  const on_disk = given.find(({ name }) => name === file.path);
  const { bytesOfBlob } = await import('../../../package/archive/archive.js');
  return bytesOfBlob(on_disk?.file ?? (await file.blob()));
}

async function openArchives(files: readonly NamedFile[]): Promise<{ files: StoredFile[]; notes: Note[] }> {
  const opened: StoredFile[] = [];
  const notes: Note[] = [];
  for (const { name, file } of files) {
    if (!isArchiveName(name)) {
      opened.push(onDisk(name, file));
      continue;
    }
    const [{ bytesOfBlob }, { openAnyArchive }] = await Promise.all([
      import('../../../package/archive/archive.js'),
      import('../../../package/archive/open.js'),
    ]);
    try {
      const archive = await openAnyArchive(name, bytesOfBlob(file));
      append(notes, archive.notes);
      append(opened, filesInArchive(archive).map(packed));
    } catch (error) {
      notes.push({ file: name, reason: `not used: ${problemIn(error)}` });
    }
  }
  return { files: opened, notes };
}

function onDisk(path: string, file: File): StoredFile {
  const bytes = async (blob: Blob): Promise<Uint8Array> => {
    try {
      return new Uint8Array(await blob.arrayBuffer());
    } catch {
      const problem = 'The browser could not read this file; was it moved or deleted?';
      throw Object.assign(new Error(`${path}: ${problem}`), { file: path, problem, remedy: 'Drop it again' });
    }
  };
  return {
    path,
    is_on_disk: true,
    // Browsers ask the disk for it, and the page waits: of a folder's files, few are asked.
    get size() {
      return file.size;
    },
    read: () => bytes(file),
    readHead: (length) => bytes(file.slice(0, length)),
    blob: async () => file,
  };
}

/** What can be read of files in archives and bags; the rest, and what of them is lost, is told. */
async function unpack(stored: readonly StoredFile[]): Promise<{ files: NamedFile[]; notes: Note[] }> {
  const files: NamedFile[] = [];
  const notes: Note[] = [];
  const read = await Promise.allSettled(stored.map((file) => file.blob()));
  for (const [index, content] of read.entries()) {
    const { path, losses = [] } = stored[index] as StoredFile;
    if (content.status === 'fulfilled') files.push({ name: path, file: new File([content.value], path) });
    else notes.push({ file: path, reason: `not used: ${problemIn(content.reason)}` });
    append(notes, losses);
  }
  return { files, notes };
}

/** Without the file's name before it. */
function problemIn(error: unknown): string {
  const { problem, message } = error as Error & { problem?: string };
  return problem ?? message;
}

/** Browsers show PNG and JPEG; a pixmap is given as BMP. */
export function blobOf(path: string, bytes: Uint8Array): Blob {
  if (/\.(ppm|pgm)$/i.test(path)) return new Blob([bitmapOf(bytes)], { type: 'image/bmp' });
  const type = /\.jpe?g$/i.test(path) ? 'image/jpeg' : /\.png$/i.test(path) ? 'image/png' : '';
  return new Blob([new Uint8Array(bytes)], { type });
}
