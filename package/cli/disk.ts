/**
 * Reads and writes files on the disk. Only regular files are read, and only as many bytes as they had when they were
 * opened: a pipe or a device may never end. Files are written under a temporary name beside the file and renamed when they
 * are complete, so a file with the final name is always whole.
 */
import {
  closeSync,
  constants,
  fstatSync,
  fsync,
  openSync,
  readSync,
  rmSync,
  type Stats,
  statSync,
  writeFile as writeDescriptor,
} from 'node:fs';
import { mkdir, open, realpath, rename, rm, stat, writeFile as writeAt } from 'node:fs/promises';
import { constants as system } from 'node:os';
import { dirname, join } from 'node:path';
import { promisify } from 'node:util';
import { CommandError, SIGNALS } from './command.js';
import { invocation } from './invocation.js';

/** The engine's memory ends at twice as much. */
const MOST_BYTES = 2 ** 31;
/** So much is read at a time. */
const PIECE_BYTES = 2 ** 24;
/** Of what is piped in: points to project, a line each. */
const MOST_PIPED_BYTES = 2 ** 26;
/** A pipe that nobody writes into would otherwise be waited for. */
const READ = constants.O_RDONLY | (constants.O_NONBLOCK ?? 0);

/** What is neither a file nor a folder. */
class NoFileError extends Error {
  code = 'NO_FILE';
}

function mustBeFile(stats: Stats) {
  if (stats.isDirectory()) throw Object.assign(new Error('This is a folder'), { code: 'EISDIR' });
  if (!stats.isFile()) throw new NoFileError('A pipe or a device, not a file; save it as a file first.');
  return stats;
}

/** Whether it is a folder that can be looked at. */
export function isFolder(path: string) {
  try {
    return statSync(path).isDirectory();
  } catch {
    return false;
  }
}

/** Bytes of a regular file. */
export function sizeOfFile(path: string) {
  return mustBeFile(statSync(path)).size;
}

function mustFit(size: number, most: number) {
  if (size > most) {
    const megabytes = (bytes: number) => `${Math.ceil(bytes / 2 ** 20)} MB`;
    throw new Error(`It has ${megabytes(size)}, and at most ${megabytes(most)} are read at once.`);
  }
}

/** A whole file. */
export function readWhole(path: string): Uint8Array<ArrayBuffer> {
  mustBeFile(statSync(path));
  const file = openSync(path, READ);
  try {
    const { size } = mustBeFile(fstatSync(file));
    mustFit(size, MOST_BYTES);
    return readUpTo(file, size);
  } finally {
    closeSync(file);
  }
}

/** What is piped in. */
export function readPiped(): Uint8Array<ArrayBuffer> {
  const bytes = readUpTo(0, MOST_PIPED_BYTES + 1);
  mustFit(bytes.length, MOST_PIPED_BYTES);
  return bytes;
}

/** Memory grows with what comes. */
function readUpTo(file: number, most: number) {
  let bytes = new Uint8Array(Math.min(most, PIECE_BYTES));
  let filled = 0;
  while (filled < most) {
    if (filled === bytes.length) {
      const grown = new Uint8Array(Math.min(most, 2 * filled));
      grown.set(bytes);
      bytes = grown;
    }
    const count = readSync(file, bytes, filled, Math.min(bytes.length - filled, PIECE_BYTES), null);
    if (count === 0) break;
    filled += count;
  }
  return filled === bytes.length ? bytes : bytes.slice(0, filled);
}

/** A file to be read in parts. */
export async function openFile(path: string) {
  mustBeFile(await stat(path));
  const handle = await open(path, READ);
  try {
    mustBeFile(await handle.stat());
    return handle;
  } catch (error) {
    await handle.close();
    throw error;
  }
}

/** A whole file, without holding up this thread. */
export async function readWholeLater(path: string): Promise<Uint8Array<ArrayBuffer>> {
  const handle = await openFile(path);
  try {
    const { size } = await handle.stat();
    mustFit(size, MOST_BYTES);
    const bytes = new Uint8Array(size);
    let filled = 0;
    while (filled < size) {
      const { bytesRead } = await handle.read(bytes, filled, Math.min(size - filled, PIECE_BYTES), filled);
      if (bytesRead === 0) break;
      filled += bytesRead;
    }
    return filled === size ? bytes : bytes.slice(0, filled);
  } finally {
    await handle.close();
  }
}

/**
 * Writes one file, whole or not at all.
 * @returns rejects with a CommandError that names what has been written before
 */
export async function writeWhole(path: string, contents: string | Uint8Array): Promise<void> {
  const { written } = invocation();
  try {
    await replace(path, contents);
    written.push(path);
  } catch (error) {
    const before = written.length > 0 ? ` Complete before that: ${written.join(', ')}.` : '';
    throw new CommandError(`${path}: The file could not be written. ${fileProblem(error)}${before}`);
  }
}

let numTemporary = 0;

async function replace(path: string, contents: string | Uint8Array) {
  const before = await stat(path).catch(() => null);
  // A pipe or a device, such as /dev/stdout, cannot be replaced.
  if (before && !before.isFile() && !before.isDirectory()) return writeAt(path, contents);
  if (before?.isDirectory()) mustBeFile(before);
  const target = before ? await realpath(path) : path;
  const temporary = join(dirname(target), `.scanstitch-${process.pid}-${(numTemporary += 1)}.part`);
  const release = removeWhenInterrupted(temporary);
  try {
    // Made at once: what another thread would still be making could not be removed.
    const file = openSync(temporary, 'wx', before ? before.mode & 0o777 : 0o666);
    try {
      await promisify(writeDescriptor)(file, contents);
      await promisify(fsync)(file);
    } finally {
      closeSync(file);
    }
    await rename(temporary, target);
  } catch (error) {
    await rm(temporary, { force: true });
    throw error;
  } finally {
    release();
  }
}

function removeWhenInterrupted(temporary: string) {
  const stop = (signal: 'SIGINT' | 'SIGTERM') => {
    rmSync(temporary, { force: true });
    process.exit(128 + system.signals[signal]);
  };
  for (const signal of SIGNALS) process.on(signal, stop);
  return () => {
    for (const signal of SIGNALS) process.removeListener(signal, stop);
  };
}

/** Writes files into a folder, which is made where it is missing. */
export async function writeResults(folder: string, files: Record<string, string | Uint8Array>) {
  try {
    await mkdir(folder, { recursive: true });
  } catch (error) {
    throw new CommandError(`${folder}: The results could not be written. ${fileProblem(error)}`);
  }
  for (const [name, contents] of Object.entries(files)) await writeWhole(join(folder, name), contents);
}

export function fileProblem(error: unknown) {
  const { code, message } = error as NodeJS.ErrnoException;
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
    case 'ELOOP':
      return 'This is a link that leads to itself.';
    case 'ENOSPC':
    case 'EDQUOT':
      return 'There is no space left on the device.';
    case 'EFBIG':
      return 'The file would be larger than the system allows.';
    case 'EROFS':
      return 'The device is read-only.';
    case 'ENAMETOOLONG':
      return 'The name is too long.';
    default:
      return message;
  }
}
