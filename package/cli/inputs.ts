/** Files named on the command line, read from the disk. */
import { readdirSync, realpathSync, statSync } from 'node:fs';
import type { FileHandle } from 'node:fs/promises';
import { basename, join, normalize, resolve } from 'node:path';
import { LIMITS } from '../archive/directory.js';
import type { ByteSource } from '../archive/window.js';
import { isBagName } from '../bag/names.js';
import { fileError, type Note } from '../base/errors.js';
import type { Content as Source } from '../files/content.js';
import { isSystemFile } from '../recording/classify.js';
import { bagsAmong, type OpenedRecording, type OpenOptions, openRecording } from '../recording_reader.js';
import { CommandError, isScanstitchError } from './command.js';
import { fileProblem, openFile, readWhole, readWholeLater, sizeOfFile } from './disk.js';

/** A folder that holds more files than a recording has, as the root of a disk does. */
class TooManyFiles extends Error {}

/** name: short, for messages and results */
export type Input = { name: string; path: string };

/**
 * The recording that these arguments name: files as they are, what lies in folders, to any depth, in archives and in
 * the ROS bags.
 * What cannot be found is reported and left out.
 * @param most files of folders, beyond which they are none of a recording
 */
export async function openInputs(
  paths: string[],
  complain: (problem: string) => void,
  options: Pick<OpenOptions, 'topics' | 'folder' | 'isTable'> = {},
  most: number = LIMITS.entries,
): Promise<{ recording: OpenedRecording; close: () => Promise<void> }> {
  const { found, notes, close } = findFiles(paths, complain, most);
  try {
    const recording = await openRecording(found, { ...options, notes });
    const isWithoutBag = recording.bags.length === 0 && !recording.notes.some(({ file }) => isBagName(file));
    if (Object.keys(options.topics ?? {}).length > 0 && isWithoutBag) {
      throw new CommandError('--topic: there is no bag among the input');
    }
    return { recording, close };
  } catch (error) {
    await close();
    // A topic or a folder that is not there.
    if (!isScanstitchError(error)) throw error;
    throw new CommandError(`${error.file === options.folder ? '--recording ' : ''}${error.message}`);
  }
}

/** The bags that these arguments name, and their topics. */
export async function openBags(paths: string[], complain: (problem: string) => void) {
  const { found, notes, close } = findFiles(paths, complain);
  const listed = await bagsAmong(found);
  return { bags: listed.bags, notes: [...notes, ...listed.notes], close };
}

function findFiles(paths: string[], complain: (problem: string) => void, most = LIMITS.entries) {
  const found: Source[] = [];
  const notes: Note[] = [];
  const handles: FileHandle[] = [];
  for (const path of new Set(paths.map((path) => normalize(path)))) {
    try {
      if (statSync(path).isDirectory()) {
        const before = found.length;
        takeFolder(path, basename(resolve(path)), { found, notes, handles, complain, most, seen: new Set() });
        if (found.length === before) complain(`${path}: There is no file in this folder.`);
      } else found.push({ ...sourceOnDisk(path, basename(path), handles), isNamed: true });
    } catch (error) {
      if (error instanceof TooManyFiles) {
        const remedy = 'Name the folder of one recording';
        throw new CommandError(`${path}: There are more than ${most} files in this folder. ${remedy}.`);
      }
      complain(isScanstitchError(error) ? error.message : `${path}: ${fileProblem(error)}`);
    }
  }
  const close = async () => {
    for (const handle of handles) await handle.close();
  };
  return { found: withDistinctPaths(found), notes, close };
}

function withDistinctPaths(sources: Source[]) {
  const distinct = new Set(sources.map(({ path }) => path)).size === sources.length;
  return distinct ? sources : sources.map((source) => ({ ...source, path: source.disk ?? source.path }));
}

/**
 * What comes of looking through folders. `handles`: to be closed in the end; `seen`: folders, by where they really lie.
 */
type Findings = {
  found: Source[];
  notes: Note[];
  handles: FileHandle[];
  complain: (problem: string) => void;
  most: number;
  seen: Set<string>;
};

/**
 * The files of a folder and of those in it, each folder once, however links lead to it. What cannot be read is told, and
 * the rest is taken.
 * @param title its path for messages and results
 */
function takeFolder(folder: string, title: string, findings: Findings) {
  const { found, notes, handles, complain, seen } = findings;
  const place = realpathSync(folder);
  if (seen.has(place)) {
    notes.push({ file: title, reason: 'not used: a link to a folder that has been looked through' });
    return;
  }
  seen.add(place);
  for (const name of readdirSync(folder)) {
    if (isSystemFile(name)) continue;
    if (found.length >= findings.most) throw new TooManyFiles();
    const [disk, path] = [join(folder, name), `${title}/${name}`];
    try {
      const stats = statSync(disk);
      if (stats.isDirectory()) takeFolder(disk, path, findings);
      else if (stats.isFile()) found.push({ ...sourceOnDisk(disk, path, handles), isNamed: false });
      else notes.push({ file: path, reason: 'not used: a pipe or a device, not a file' });
    } catch (error) {
      if (error instanceof TooManyFiles) throw error;
      complain(`${disk}: ${fileProblem(error)}`);
    }
  }
}

function sourceOnDisk(disk: string, path: string, handles: FileHandle[]): Source {
  return {
    path,
    disk,
    size: sizeOfFile(disk),
    read: () => readWholeLater(disk),
    open: async () => {
      const handle = await openFile(disk).catch((error) => {
        throw fileError(path, fileProblem(error).replace(/\.$/, ''));
      });
      handles.push(handle);
      return bytesOfFile(handle, (await handle.stat()).size);
    },
    readHead: async (length) => {
      const handle = await openFile(disk);
      try {
        const { size } = await handle.stat();
        return await bytesOfFile(handle, size).read(0, Math.min(length, size));
      } finally {
        await handle.close();
      }
    },
  };
}

function bytesOfFile(handle: FileHandle, size: number): ByteSource {
  return {
    size,
    read: async (start, end) => {
      const bytes = new Uint8Array(Math.max(0, Math.min(end, size) - start));
      const { bytesRead } = await handle.read(bytes, 0, bytes.length, start);
      return bytes.subarray(0, bytesRead);
    },
  };
}

/** The file's bytes; null where it cannot be read, which is reported. */
export function readInput({ name, path }: Input, complain: (problem: string) => void) {
  try {
    return readWhole(path);
  } catch (error) {
    complain(`${name}: ${fileProblem(error)}`);
    return null;
  }
}

/** The file's bytes; throws a CommandError where it cannot be read. */
export function readRequired({ name, path }: Input) {
  try {
    return readWhole(path);
  } catch (error) {
    throw new CommandError(`${name}: ${fileProblem(error)}`);
  }
}

/** What `understand` makes of a file of text that people write; throws a CommandError where it cannot be read, or makes no sense. */
export function readText<T>(path: string, understand: (text: string) => T): T {
  const bytes = readRequired({ name: basename(path), path });
  try {
    return understand(new TextDecoder().decode(bytes));
  } catch (error) {
    throw new CommandError(`${basename(path)}: ${(error as Error).message}.`);
  }
}

/** A source's bytes; null where it cannot be read, which is reported. */
export async function readSource(source: Source, name: string, complain: (problem: string) => void) {
  try {
    return await source.read();
  } catch (error) {
    complain(isScanstitchError(error) ? error.message : `${name}: ${fileProblem(error)}`);
    return null;
  }
}

/** The bytes of a file without which nothing is done; throws a ScanstitchError. */
export async function readFirst(name: string, file: Source) {
  try {
    return await file.read();
  } catch (error) {
    throw isScanstitchError(error) ? error : fileError(name, fileProblem(error).replace(/\.$/, ''));
  }
}
