// @ts-check
/** Files named on the command line, read from the disk. */
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { open, readFile } from 'node:fs/promises';
import { basename, join, normalize, resolve, sep } from 'node:path';
import { isArchiveName, openArchive } from '../archive.js';
import { isScanstitchError } from './command.js';

/** @typedef {{ name: string, path: string }} Input name: short, for messages and results */

/**
 * A file that was named, or that lies in a folder or an archive that was.
 * @typedef {object} Source
 * @property {string} path as the results call it: from the folder or archive that was named
 * @property {number} size bytes
 * @property {string | null} disk where it lies; null in an archive
 * @property {() => Promise<Uint8Array>} read
 * @property {(length: number) => Promise<Uint8Array>} readHead
 */

/** @typedef {{ sources: Map<string, Source>, notes: import('../recording.js').Note[], close: () => Promise<void> }} Inputs */

/**
 * All files that these arguments name: files as they are, what lies in folders, to any depth, and in ZIP archives.
 * Nothing is read but the archives' directories. What cannot be found is told and left out.
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 * @returns {Promise<Inputs>}
 */
export async function gather(paths, complain) {
  /** @type {Source[]} */
  const found = [];
  /** @type {import('../recording.js').Note[]} */
  const notes = [];
  /** @type {import('node:fs/promises').FileHandle[]} */
  const handles = [];
  for (const path of new Set(paths.map((path) => normalize(path)))) {
    try {
      if (statSync(path).isDirectory()) {
        const inside = filesUnder(path);
        if (inside.length === 0) complain(`${path}: There is no file in this folder.`);
        found.push(...inside);
      } else if (isArchiveName(path)) {
        const handle = await open(path);
        handles.push(handle);
        const archive = await openArchive(basename(path), bytesOfFile(handle, (await handle.stat()).size));
        notes.push(...archive.notes);
        found.push(...archive.files.map((file) => sourceInArchive(archive, file)));
      } else {
        found.push(sourceOnDisk(path, basename(path)));
      }
    } catch (error) {
      complain(isScanstitchError(error) ? error.message : `${path}: ${fileProblem(error)}`);
    }
  }
  const distinct = new Set(found.map(({ path }) => path)).size === found.length;
  const named = distinct ? found : found.map((source) => ({ ...source, path: source.disk ?? source.path }));
  return {
    sources: new Map(named.map((source) => [source.path, source])),
    notes,
    close: async () => {
      for (const handle of handles) await handle.close();
    },
  };
}

/** @param {string} folder */
function filesUnder(folder) {
  const title = basename(resolve(folder));
  return readdirSync(folder, { recursive: true, encoding: 'utf8' }).flatMap((inside) => {
    const disk = join(folder, inside);
    // Gone since, or a link that leads nowhere.
    const isFile = statSync(disk, { throwIfNoEntry: false })?.isFile() ?? false;
    return isFile ? [sourceOnDisk(disk, join(title, inside).split(sep).join('/'))] : [];
  });
}

/**
 * @param {string} disk
 * @param {string} path
 * @returns {Source}
 */
function sourceOnDisk(disk, path) {
  return {
    path,
    disk,
    size: statSync(disk).size,
    read: () => readFile(disk),
    readHead: async (length) => {
      const handle = await open(disk);
      try {
        const { size } = await handle.stat();
        return await bytesOfFile(handle, size).read(0, Math.min(length, size));
      } finally {
        await handle.close();
      }
    },
  };
}

/**
 * @param {import('../archive.js').Archive} archive
 * @param {import('../recording.js').ListedFile} file
 * @returns {Source}
 */
function sourceInArchive(archive, { path, size }) {
  return {
    path,
    size,
    disk: null,
    read: () => archive.read(path),
    readHead: (length) => archive.readHead(path, length),
  };
}

/**
 * @param {import('node:fs/promises').FileHandle} handle
 * @param {number} size
 * @returns {import('../archive.js').ByteSource}
 */
function bytesOfFile(handle, size) {
  return {
    size,
    read: async (start, end) => {
      const bytes = new Uint8Array(Math.max(0, Math.min(end, size) - start));
      const { bytesRead } = await handle.read(bytes, 0, bytes.length, start);
      return bytes.subarray(0, bytesRead);
    },
  };
}

/**
 * The file's bytes; null where it cannot be read, which is told.
 * @param {Input} input
 * @param {(problem: string) => void} complain
 */
export function readInput({ name, path }, complain) {
  try {
    return readFileSync(path);
  } catch (error) {
    complain(`${name}: ${fileProblem(error)}`);
    return null;
  }
}

/**
 * A source's bytes; null where it cannot be read, which is told.
 * @param {Source} source
 * @param {string} name
 * @param {(problem: string) => void} complain
 */
export async function readSource(source, name, complain) {
  try {
    return await source.read();
  } catch (error) {
    complain(isScanstitchError(error) ? error.message : `${name}: ${fileProblem(error)}`);
    return null;
  }
}

/** @param {unknown} error */
export function fileProblem(error) {
  const { code, message } = /** @type {NodeJS.ErrnoException} */ (error);
  switch (code) {
    case 'ENOENT':
      return 'There is no such file or folder.';
    case 'EACCES':
    case 'EPERM':
      return 'The file may not be read or written: permission denied.';
    case 'EISDIR':
      return 'This is a folder, not a file.';
    case 'ENOTDIR':
    case 'EEXIST':
      return 'There is a file where a folder should be.';
    default:
      return message;
  }
}
