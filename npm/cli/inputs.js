// @ts-check
/** Files named on the command line, read from the disk. */
import { append } from '../append.js';
import { readdirSync, realpathSync, statSync } from 'node:fs';
import { basename, join, normalize, resolve } from 'node:path';
import { LIMITS } from '../archive_directory.js';
import { isBagName, isOfBag } from '../bag/names.js';
import { convertFiles } from '../formats/convert.js';
import { bytesInMemory, openAnyArchive } from '../open_archive.js';
import { isSystemFile } from '../recording/classify.js';
import { filesInArchive, filesInBags } from '../recording/contents.js';
import { isArchiveName } from '../recording/kinds.js';
import { CommandError, isScanstitchError } from './command.js';
import { fileProblem, openFile, readWhole, readWholeLater, sizeOfFile } from './disk.js';

/** A folder that holds more files than a recording has, as the root of a disk does. */
class TooManyFiles extends Error {}

/** @typedef {{ name: string, path: string }} Input name: short, for messages and results */

/**
 * A file that was named, or that lies in a folder, an archive or a bag that was; its path counts from there. `disk`: where
 * it lies; null in an archive or a bag.
 * @typedef {import('../recording/contents.js').Content & { disk: string | null, isNamed?: true }} Source isNamed: it was named
 *    itself
 */

/** @typedef {import('../bag/topics.js').Wishes} Wishes */
/** @typedef {{ sources: Map<string, Source>, notes: import('../recording.js').Note[], close: () => Promise<void> }} Inputs */

/**
 * All files that these arguments name: files as they are, what lies in folders, to any depth, in archives and in the
 * ROS bags. Of most files nothing is read but a beginning, the directories of archives and the indexes of bags; what
 * `convertFiles` lists by its contents is read whole. What cannot be found is reported and left out.
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 * @param {Wishes} [wishes] topics of bags
 * @param {number} [most] files of folders, beyond which they are none of a recording
 * @returns {Promise<Inputs>}
 */
export async function gather(paths, complain, wishes = {}, most = LIMITS.entries) {
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

/**
 * The bags that these arguments name, and their topics.
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 */
export async function gatherBags(paths, complain) {
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

/** @typedef {import('node:fs/promises').FileHandle[]} Handles to be closed in the end */

/**
 * What lies in bags takes the place of their files.
 * @param {Source[]} sources
 * @param {Handles} handles
 * @param {Wishes} wishes
 * @returns {Promise<{ sources: Source[], notes: import('../recording.js').Note[] }>}
 */
async function openBagsAmong(sources, handles, wishes) {
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

/**
 * @param {Source[]} sources
 * @param {Handles} handles
 * @returns {import('../bag/open.js').BagFile[]}
 */
function bagFiles(sources, handles) {
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

/**
 * @param {import('../recording/contents.js').Content} content
 * @returns {Source}
 */
function packed(content) {
  return { ...content, disk: null };
}

/** @param {Source[]} sources */
function withDistinctPaths(sources) {
  const distinct = new Set(sources.map(({ path }) => path)).size === sources.length;
  return distinct ? sources : sources.map((source) => ({ ...source, path: source.disk ?? source.path }));
}

/**
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 */
async function findFiles(paths, complain, most = LIMITS.entries) {
  /** @type {Source[]} */
  const found = [];
  /** @type {import('../recording.js').Note[]} */
  const notes = [];
  /** @type {import('node:fs/promises').FileHandle[]} */
  const handles = [];
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

/**
 * What comes of looking through folders. `seen`: folders, by where they really lie.
 * @typedef {{ found: Source[], notes: import('../recording.js').Note[], complain: (problem: string) => void, most: number, seen: Set<string> }} Findings
 */

/**
 * The files of a folder and of those in it, each folder once, however links lead to it. What cannot be read is told, and
 * the rest is taken.
 * @param {string} folder
 * @param {string} title its path for messages and results
 * @param {Findings} findings
 */
function takeFolder(folder, title, findings) {
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

/**
 * @param {string} disk
 * @param {string} path
 * @returns {Source}
 */
function sourceOnDisk(disk, path) {
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
 * The file's bytes; null where it cannot be read, which is reported.
 * @param {Input} input
 * @param {(problem: string) => void} complain
 */
export function readInput({ name, path }, complain) {
  try {
    return readWhole(path);
  } catch (error) {
    complain(`${name}: ${fileProblem(error)}`);
    return null;
  }
}

/** The file's bytes; throws a CommandError where it cannot be read. @param {Input} input */
export function readRequired({ name, path }) {
  try {
    return readWhole(path);
  } catch (error) {
    throw new CommandError(`${name}: ${fileProblem(error)}`);
  }
}

/**
 * A source's bytes; null where it cannot be read, which is reported.
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
