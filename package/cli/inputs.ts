/** Files named on the command line, read from the disk. */
import { readdirSync, realpathSync, statSync } from 'node:fs';
import type { FileHandle } from 'node:fs/promises';
import { basename, join, normalize, resolve } from 'node:path';
import { LIMITS } from '../archive/directory.js';
import { bytesInMemory, openAnyArchive } from '../archive/open.js';
import type { ByteSource } from '../archive/window.js';
import { isBagName, isOfBag } from '../bag/names.js';
import type { BagFile } from '../bag/open.js';
import type { Wishes } from '../bag/topics.js';
import { append } from '../base/append.js';
import type { Note } from '../base/errors.js';
import type { Content } from '../files/content.js';
import { isArchiveName } from '../files/kinds.js';
import { convertFiles } from '../formats/convert.js';
import { isSystemFile } from '../recording/classify.js';
import { filesInArchive, filesInBags } from '../recording/contents.js';
import { CommandError, isScanstitchError } from './command.js';
import { fileProblem, openFile, readWhole, readWholeLater, sizeOfFile } from './disk.js';

/** A folder that holds more files than a recording has, as the root of a disk does. */
class TooManyFiles extends Error {}

/** name: short, for messages and results */
export type Input = { name: string; path: string };

/**
 * A file that was named, or that lies in a folder, an archive or a bag that was; its path counts from there. `disk`: where
 * it lies; null in an archive or a bag.
 * isNamed: it was named itself
 */
export type Source = Content & { disk: string | null; isNamed?: true };

export type Inputs = { sources: Map<string, Source>; notes: Note[]; close: () => Promise<void> };

/**
 * All files that these arguments name: files as they are, what lies in folders, to any depth, in archives and in the
 * ROS bags. Of most files nothing is read but a beginning, the directories of archives and the indexes of bags; what
 * `convertFiles` lists by its contents is read whole. What cannot be found is reported and left out.
 * @param wishes topics of bags
 * @param most files of folders, beyond which they are none of a recording
 */
export async function gather(
  paths: string[],
  complain: (problem: string) => void,
  wishes: Wishes = {},
  most: number = LIMITS.entries,
): Promise<Inputs> {
  const { found, notes, handles } = await findFiles(paths, complain, most);
  const close = async () => {
    for (const handle of handles) await handle.close();
  };
  try {
    const opened = await openBagsAmong(found, handles, wishes);
    const converted = await convertFiles(opened.sources, (content, { isNamed }) => ({
      ...packed(content),
      ...(isNamed && { isNamed }),
    }));
    const named = withDistinctPaths(converted.files);
    return {
      sources: new Map(named.map((source) => [source.path, source])),
      notes: [...notes, ...opened.notes, ...converted.notes],
      close,
    };
  } catch (error) {
    await close();
    throw error;
  }
}

/** The bags that these arguments name, and their topics. */
export async function gatherBags(paths: string[], complain: (problem: string) => void) {
  const { found, handles } = await findFiles(paths, complain);
  const { listBags } = await import('../bag/bag_recordings.js');
  const listed = await listBags(bagFiles(withDistinctPaths(found), handles));
  return {
    ...listed,
    close: async () => {
      for (const handle of handles) await handle.close();
    },
  };
}

/** To be closed in the end. */
type Handles = FileHandle[];

/** What lies in bags takes the place of their files. */
async function openBagsAmong(
  sources: Source[],
  handles: Handles,
  wishes: Wishes,
): Promise<{ sources: Source[]; notes: Note[] }> {
  const files = bagFiles(withDistinctPaths(sources), handles);
  if (!sources.some(({ path }) => isBagName(path))) {
    if (Object.keys(wishes).length > 0) throw new CommandError('--topic: there is no bag among the input');
    return { sources, notes: [] };
  }
  const { listBags, recordingsOf } = await import('../bag/bag_recordings.js');
  const { bags, notes } = await listBags(files);
  const rest = sources.filter(({ path }) => !isOfBag(path));
  const recordings = await recordingsOf(bags, wishes).catch((error) => {
    // A wish that cannot be granted.
    throw isScanstitchError(error) ? new CommandError(error.message) : error;
  });
  return { sources: [...rest, ...filesInBags(recordings).map(packed)], notes };
}

function bagFiles(sources: Source[], handles: Handles): BagFile[] {
  const files = sources.filter(({ path }) => isOfBag(path));
  return files.map(({ path, disk, read }) => ({
    path,
    source: async () => {
      if (disk === null) {
        return bytesInMemory(await read());
      }
      const handle = await openFile(disk);
      handles.push(handle);
      return bytesOfFile(handle, (await handle.stat()).size);
    },
  }));
}

function packed(content: Content): Source {
  return { ...content, disk: null };
}

function withDistinctPaths(sources: Source[]) {
  const distinct = new Set(sources.map(({ path }) => path)).size === sources.length;
  return distinct ? sources : sources.map((source) => ({ ...source, path: source.disk ?? source.path }));
}

async function findFiles(paths: string[], complain: (problem: string) => void, most = LIMITS.entries) {
  const found: Source[] = [];
  const notes: Note[] = [];
  const handles: FileHandle[] = [];
  for (const path of new Set(paths.map((path) => normalize(path)))) {
    try {
      if (statSync(path).isDirectory()) {
        const before = found.length;
        takeFolder(path, basename(resolve(path)), { found, notes, complain, most, seen: new Set() });
        if (found.length === before) complain(`${path}: There is no file in this folder.`);
      } else if (isArchiveName(path)) {
        const handle = await openFile(path);
        handles.push(handle);
        const archive = await openAnyArchive(basename(path), bytesOfFile(handle, (await handle.stat()).size));
        append(notes, archive.notes);
        append(found, filesInArchive(archive).map(packed));
      } else {
        found.push({ ...sourceOnDisk(path, basename(path)), isNamed: true });
      }
    } catch (error) {
      if (error instanceof TooManyFiles) {
        const remedy = 'Name the folder of one recording';
        throw new CommandError(`${path}: There are more than ${most} files in this folder. ${remedy}.`);
      }
      complain(isScanstitchError(error) ? error.message : `${path}: ${fileProblem(error)}`);
    }
  }
  return { found, notes, handles };
}

/** What comes of looking through folders. `seen`: folders, by where they really lie. */
type Findings = {
  found: Source[];
  notes: Note[];
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
  const { found, notes, complain, seen } = findings;
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
      else if (stats.isFile()) found.push(sourceOnDisk(disk, path));
      else notes.push({ file: path, reason: 'not used: a pipe or a device, not a file' });
    } catch (error) {
      if (error instanceof TooManyFiles) throw error;
      complain(`${disk}: ${fileProblem(error)}`);
    }
  }
}

function sourceOnDisk(disk: string, path: string): Source {
  return {
    path,
    disk,
    size: sizeOfFile(disk),
    read: () => readWholeLater(disk),
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

/** A source's bytes; null where it cannot be read, which is reported. */
export async function readSource(source: Source, name: string, complain: (problem: string) => void) {
  try {
    return await source.read();
  } catch (error) {
    complain(isScanstitchError(error) ? error.message : `${name}: ${fileProblem(error)}`);
    return null;
  }
}
