/** Archives of every kind that is opened: ZIP, tar, and tar packed by gzip, bzip2 or Zstandard. */
import { lost } from '../base/errors.js';
import { type Archive, openArchive } from './archive.js';
import { LIMITS, type Limits } from './directory.js';
import { unpackedName, unpackWhole } from './packed.js';
import { openTar } from './tar.js';
import type { ByteSource } from './window.js';

/** What lies in memory as a source of bytes. */
export function bytesInMemory(bytes: Uint8Array): ByteSource {
  return { size: bytes.length, read: async (start, end) => bytes.subarray(start, end) };
}

/**
 * @param name by which the kind is known
 * @returns rejects with a ScanstitchError
 */
export async function openAnyArchive(name: string, source: ByteSource, limits: Limits = LIMITS): Promise<Archive> {
  if (/\.zip$/i.test(name)) return openArchive(name, source, limits);
  if (unpackedName(name) === null) return openTar(name, source, limits);
  const { bytes, fault } = await unpackWhole(name, source, limits);
  const archive = await openTar(name, bytesInMemory(bytes), limits);
  if (fault !== null) archive.notes.push(lost(name, `${fault}; what was packed before that is used`));
  return archive;
}
