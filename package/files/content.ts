/** A file of a recording, wherever it lies: on the disk, in an archive or in a bag. */
import type { Note } from '../base/errors.js';
import type { Recording } from './recording.js';

export interface Content {
  /** Folders separated by slashes. */
  path: string;
  /** In bytes. */
  size: number;
  /** Reads all of it. */
  read(): Promise<Uint8Array>;
  /** Its first bytes, or all it has. */
  readHead(length: number): Promise<Uint8Array>;
  /** Whether it is a cloud, whatever its name says. */
  isCloud?: boolean;
  /** The recording that it is a part of, in a bag. */
  given?: Recording;
  /** What could not be read of it, once it has been read. */
  losses?: readonly Note[];
  /** Its bytes piece by piece, where an archive or a bag need not be read as a whole. */
  open?(): Promise<{ size: number; read(start: number, end: number): Promise<Uint8Array> }>;
  /** As the browser has it. */
  blob?: Blob;
  /** Where it lies on the disk. */
  disk?: string;
  /** Whether it was named itself; false: the folder that it lies in was, in which no archive is opened. */
  isNamed?: boolean;
}

/** A file whose bytes are in memory; each reader has a copy of its own. */
export function fileInMemory(path: string, bytes: Uint8Array): Content {
  return {
    path,
    size: bytes.length,
    read: async () => bytes.slice(),
    readHead: async (length) => bytes.slice(0, length),
  };
}
