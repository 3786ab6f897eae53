// @ts-check
/** Files named on the command line, read from the disk. */
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { open, readFile } from 'node:fs/promises';
import { basename, join, normalize, resolve, sep } from 'node:path';
import { openArchive } from '../archive.js';
import { isBagMetadata, isBagName } from '../bag/names.js';
import { filesInArchive, filesInBags } from '../recording/contents.js';
import { isArchiveName } from '../recording/kinds.js';
import { CommandError, isScanstitchError } from './command.js';

/** @typedef {{ name: string, path: string }} Input name: short, for messages and results */

/**
 * A file that was named, or that lies in a folder, an archive or a bag that was; its path counts from there. `disk`: where
 * it lies; null in an archive or a bag.
 * @typedef {import('../recording/contents.js').Content & { disk: string | null }} Source
 */

/** @typedef {import('../bag/topics.js').Wishes} Wishes */
/** @typedef {{ sources: Map<string, Source>, notes: import('../recording.js').Note[], close: () => Promise<void> }} Inputs */

/**
 * All files that these arguments name: files as they are, what lies in folders, to any depth, in ZIP archives and in the
 * bags of ROS 2. Nothing is read but the directories of archives and the indexes of bags. What cannot be found is reported and
 * left out.
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 * @param {Wishes} [wishes] topics of bags
 * @returns {Promise<Inputs>}
 */
export async function gather(paths, complain, wishes = {}) {
  const { found, notes, handles } = await findFiles(paths, complain);
  const close = async () => {
    for (const handle of handles) await handle.close();
  };
  try {
    const opened = await openBagsAmong(found, handles, wishes);
    const named = withDistinctPaths(opened.sources);
    return {
      sources: new Map(named.map((source) => [source.path, source])),
      notes: [...notes, ...opened.notes],
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
  const rest = sources.filter(({ path }) => !isBagName(path) && !isBagMetadata(path));
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
  const files = sources.filter(({ path }) => isBagName(path) || isBagMetadata(path));
  return files.map(({ path, disk, read }) => ({
    path,
    source: async () => {
      if (disk === null) {
        const bytes = await read();
        return { size: bytes.length, read: async (start, end) => bytes.subarray(start, end) };
      }
      const handle = await open(disk);
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
async function findFiles(paths, complain) {
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
        found.push(...filesInArchive(archive).map(packed));
      } else {
        found.push(sourceOnDisk(path, basename(path)));
      }
    } catch (error) {
      complain(isScanstitchError(error) ? error.message : `${path}: ${fileProblem(error)}`);
    }
  }
  return { found, notes, handles };
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
    return readFileSync(path);
  } catch (error) {
    complain(`${name}: ${fileProblem(error)}`);
    return null;
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
