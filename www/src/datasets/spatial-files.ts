/**
 * Files of a recording in space: where each one's bytes are, read when they are needed. They may lie on the disk, in a
 * zip, or on the server.
 */
import type { Recording } from '../../../npm/recording.js';
import type { Readable } from '../engine/spatial-client.js';
import type { Note } from './dataset.js';
import type { NamedFile } from './gather.js';

export interface StoredFile extends Readable {
  size: number;
  readHead(length: number): Promise<Uint8Array>;
  /** For an image element. */
  blob(): Promise<Blob>;
}

/** What was opened together. */
export interface SpatialFiles {
  /** How the page calls it; empty: after its folder. */
  title: string;
  /** The built-in sample: replaced, not extended, by the user's files. */
  is_given: boolean;
  files: readonly StoredFile[];
  notes: readonly Note[];
}

export type Kind = Recording['kind'];

/** How a recording is understood is loaded with the first one that may be in space. */
export async function understandFiles(files: readonly StoredFile[]): Promise<Recording> {
  const { understand } = await import('../../../npm/recording.js');
  const byPath = new Map(files.map((file) => [file.path, file]));
  return understand(
    files.map(({ path, size }) => ({ path, size })),
    async (path, length) => (await byPath.get(path)?.readHead(length)) ?? new Uint8Array(),
  );
}

/** Files for the flat view, and what became of those that cannot be opened. */
export interface PlanarFiles {
  files: readonly NamedFile[];
  notes: readonly Note[];
  /** Files that were given, used or not. */
  num_given: number;
}

/**
 * Which view takes these files: planar scans the flat one, depth images and clouds the one in space; what is neither,
 * as a trajectory alone, the one that is shown.
 */
export async function tellApart(
  given: readonly NamedFile[],
  shown: 'planar' | 'spatial',
): Promise<{ planar: PlanarFiles } | { spatial: SpatialFiles }> {
  const { files, notes } = await openFiles(given);
  const { kind, notes: told } = await understandFiles(files);
  if (kind === 'depth_images' || kind === 'clouds' || (kind === 'nothing' && shown === 'spatial')) {
    return { spatial: { title: '', is_given: false, files, notes } };
  }
  const loose = given.filter(({ name }) => !isArchive(name));
  const loose_names = new Set(loose.map(({ name }) => name));
  const packed = files.filter(({ path }) => !loose_names.has(path));
  const num_given = Math.max(given.length, files.length);
  if (kind === 'nothing' && files.filter(({ path }) => isImage(path)).length > 1) {
    // Meant as depth images: why they are none is better known there than in the plane.
    return { planar: { files: [], notes: [...notes, ...told], num_given } };
  }
  const planar_files = [...loose, ...(await Promise.all(packed.map(toNamedFile)))];
  return { planar: { files: planar_files, notes, num_given } };
}

const isImage = (name: string): boolean => /\.(png|jpe?g|pgm|ppm)$/i.test(name);
const isArchive = (name: string): boolean => /\.zip$/i.test(name);

/** Zips are opened; what lies in them is unpacked when it is read. */
export async function openFiles(files: readonly NamedFile[]): Promise<{ files: StoredFile[]; notes: Note[] }> {
  const opened: StoredFile[] = [];
  const notes: Note[] = [];
  for (const { name, file } of files) {
    if (!isArchive(name)) {
      opened.push(onDisk(name, file));
      continue;
    }
    const { bytesOfBlob, openArchive } = await import('../../../npm/archive.js');
    try {
      const archive = await openArchive(name, bytesOfBlob(file));
      notes.push(...archive.notes);
      opened.push(
        ...archive.files.map(({ path, size }) => ({
          path,
          size,
          read: () => archive.read(path),
          readHead: (length: number) => archive.readHead(path, length),
          blob: async () => blobOf(path, await archive.read(path)),
        })),
      );
    } catch (error) {
      const { problem, message } = error as Error & { problem?: string };
      notes.push({ file: name, reason: `left aside: ${problem ?? message}` });
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
    size: file.size,
    read: () => bytes(file),
    readHead: (length) => bytes(file.slice(0, length)),
    blob: async () => file,
  };
}

async function toNamedFile(stored: StoredFile): Promise<NamedFile> {
  return { name: stored.path, file: new File([await stored.blob()], stored.path) };
}

export function blobOf(path: string, bytes: Uint8Array): Blob {
  const type = /\.jpe?g$/i.test(path) ? 'image/jpeg' : /\.png$/i.test(path) ? 'image/png' : '';
  return new Blob([new Uint8Array(bytes)], { type });
}
