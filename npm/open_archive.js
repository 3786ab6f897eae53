// @ts-check
/** Archives of every kind that is opened: ZIP, tar, and tar packed by gzip, bzip2 or Zstandard. */
import { openArchive } from './archive.js';
import { LIMITS } from './archive_directory.js';
import { lost } from './errors.js';
import { unpackedName, unpackWhole } from './packed.js';
import { openTar } from './tar.js';

/** @typedef {import('./archive.js').ByteSource} ByteSource */

/** What lies in memory as a source of bytes. @param {Uint8Array} bytes @returns {ByteSource} */
export function bytesInMemory(bytes) {
  return { size: bytes.length, read: async (start, end) => bytes.subarray(start, end) };
}

/**
 * @param {string} name by which the kind is known
 * @param {ByteSource} source
 * @param {import('./archive_directory.js').Limits} [limits]
 * @returns {Promise<import('./archive.js').Archive>} rejects with a ScanstitchError
 */
export async function openAnyArchive(name, source, limits = LIMITS) {
  if (/\.zip$/i.test(name)) return openArchive(name, source, limits);
  if (unpackedName(name) === null) return openTar(name, source, limits);
  const { bytes, fault } = await unpackWhole(name, source, limits);
  const archive = await openTar(name, bytesInMemory(bytes), limits);
  if (fault !== null) archive.notes.push(lost(name, `${fault}; what was packed before that is used`));
  return archive;
}
