// @ts-check
/**
 * `scanstitch/recording`: what files hold, wherever they lie. The page, the command line and the package open recordings by this one
 * function, and what it finds is not looked for again. Types and documentation are in `recording_reader.d.ts`.
 */
import { append } from './append.js';
import { isBagName, isOfBag } from './bag/names.js';
import { fileError, notUsed } from './errors.js';
import { needsConversion } from './formats/names.js';
import { understand } from './recording.js';
import { filesInArchive, filesInBags } from './recording/contents.js';
import { isArchiveName } from './recording/kinds.js';
import { contains, folderOf } from './recording/names.js';

/** @typedef {import('./recording/contents.js').Content} Content */
/** @typedef {import('./recording.js').Note} Note */
/** @typedef {import('./recording_reader.js').OpenOptions} OpenOptions */
/** @typedef {import('./recording_reader.js').OpenedRecording} OpenedRecording */
/** @typedef {import('./recording_reader.js').Opened} Opened */

/** @type {typeof import('./recording_reader.js').openRecording} */
export async function openRecording(sources, options = {}) {
  const { signal, topics = {}, onProgress = () => undefined, isTable = false } = options;
  signal?.throwIfAborted();
  /** @type {Note[]} */
  const notes = [...(options.notes ?? [])];
  const given = Array.from(sources, contentOf);
  const contents = await withArchives(given, notes);
  signal?.throwIfAborted();
  const loose = await converted(
    contents.filter(({ path }) => !isOfBag(path)),
    notes,
  );
  const numGiven = Math.max(given.length, contents.length);
  const how = { isTable, ...(options.folder !== undefined && { folder: options.folder }) };
  const ofBags = contents.filter(({ path }) => isOfBag(path));
  if (!ofBags.some(({ path }) => isBagName(path))) {
    return understood({ loose: [...loose, ...ofBags], inBags: [], bags: [], notes, how, numGiven }, signal);
  }
  const listed = await listBagsOf(ofBags, (done, total) => {
    signal?.throwIfAborted();
    onProgress({ stage: 'index', done, total });
  });
  signal?.throwIfAborted();
  append(notes, listed.notes);
  onProgress({ stage: 'topics', bags: listed.bags });
  return understood({ loose, ...(await fromBags(listed.bags, topics, options)), notes, how, numGiven }, signal);
}

export { openRecording as readRecording };

/** The bags among these sources, with their topics. @param {Iterable<import('./recording_reader.js').Source>} sources */
export async function bagsAmong(sources) {
  /** @type {Note[]} */
  const notes = [];
  const contents = await withArchives(Array.from(sources, contentOf), notes);
  const listed = await listBagsOf(contents.filter(({ path }) => isOfBag(path)));
  return { bags: listed.bags, notes: [...notes, ...listed.notes] };
}

/** @param {Content[]} ofBags @param {import('./bag/open.js').OnWalk} [onWalk] */
async function listBagsOf(ofBags, onWalk) {
  const { listBags } = await import('./bag/bag_recordings.js');
  const { bytesInMemory } = await import('./open_archive.js');
  const files = ofBags.map(({ path, open, read }) => ({
    path,
    source: open ?? (async () => bytesInMemory(await read())),
  }));
  return listBags(files, onWalk);
}

/** @param {Opened} opened @param {AbortSignal} [signal] @returns {Promise<OpenedRecording>} */
async function understood(opened, signal) {
  const { loose, inBags, bags, notes, how } = opened;
  const files = new Map([...loose, ...inBags].map((file) => [file.path, file]));
  const all = [...files.values()];
  const file = (/** @type {string} */ path) => files.get(path) ?? fail(path, 'There is no such file in the recording');
  const recording = await understand(
    how.folder === undefined ? all : filesOfRecording(all, how.folder.replace(/\/+$/, '')),
    async (path, length) => {
      signal?.throwIfAborted();
      return file(path).readHead(length);
    },
    how.isTable,
  );
  signal?.throwIfAborted();
  return {
    ...recording,
    notes: [...notes, ...recording.notes],
    ...(recording.beside && {
      beside: { ...recording.beside, notes: [...notes, ...recording.beside.notes] },
    }),
    files,
    bags,
    read: async (path) => file(path).read(),
    trajectories: async () => (await import('./recording/trajectories.js')).trajectoriesAmong(all),
    choose: async (topics, options = {}) => {
      const chosen = await fromBags(
        bags.map(({ listed }) => listed),
        topics,
        options,
      );
      return understood({ ...opened, ...keptOf(opened, chosen) }, options.signal);
    },
    opened,
    with: async ({ opened: more }) =>
      understood({
        how,
        numGiven: opened.numGiven + more.numGiven,
        loose: [...loose, ...more.loose],
        inBags: [...inBags, ...more.inBags],
        bags: [...bags, ...more.bags],
        notes: [...notes, ...more.notes],
      }),
  };
}

/** @param {string} path @param {string} problem @returns {never} */
function fail(path, problem) {
  throw fileError(path, problem);
}

/** @param {import('./recording_reader.js').Source} source @returns {Content} */
function contentOf(source) {
  if ('read' in source) return source;
  const { path, blob } =
    'blob' in source ? source : { path: source.webkitRelativePath || source.name, blob: /** @type {Blob} */ (source) };
  const bytes = async (/** @type {Blob} */ part) => {
    try {
      return new Uint8Array(await part.arrayBuffer());
    } catch {
      throw fileError(path, 'This file could not be read; was it moved or deleted?', 'Give it again');
    }
  };
  return {
    path,
    blob,
    // Browsers ask the disk for it, and the page waits: of a folder's files, few are asked.
    get size() {
      return blob.size;
    },
    read: () => bytes(blob),
    readHead: (length) => bytes(blob.slice(0, length)),
    open: async () => (await import('./archive.js')).bytesOfBlob(blob),
  };
}

/** What lies in archives takes their place. @param {Content[]} given @param {Note[]} notes */
async function withArchives(given, notes) {
  /** @type {Content[]} */
  const files = [];
  for (const file of given) {
    const { path, open, read, isNamed } = file;
    if (!isArchiveName(path) || isNamed === false) {
      files.push(file);
      continue;
    }
    const { bytesInMemory, openAnyArchive } = await import('./open_archive.js');
    try {
      const archive = await openAnyArchive(path, open ? await open() : bytesInMemory(await read()));
      append(notes, archive.notes);
      append(files, filesInArchive(archive));
    } catch (error) {
      notes.push(notUsed(path, error));
    }
  }
  return files;
}

/** What is packed or of a format that the engine does not read is made into what it reads. @param {Content[]} files @param {Note[]} notes */
async function converted(files, notes) {
  if (!needsConversion(files)) return files;
  const { convertFiles } = await import('./formats/convert.js');
  const made = await convertFiles(files, (content, { isNamed }) => ({ ...content, ...(isNamed && { isNamed }) }));
  append(notes, made.notes);
  return made.files;
}

/** @param {readonly import('./recording_reader.js').ListedBag[]} listed @param {import('./bag/topics.js').Wishes} topics @param {OpenOptions} options */
async function fromBags(listed, topics, { signal, onProgress = () => undefined }) {
  const { recordingsOf } = await import('./bag/bag_recordings.js');
  const full = /** @type {import('./bag/bag_recordings.js').ListedBag[]} */ (listed);
  const recordings = await recordingsOf(full, topics, (done, total) => {
    signal?.throwIfAborted();
    onProgress({ stage: 'messages', done, total });
  });
  const bags = listed.map((bag, at) => ({ listed: bag, choice: recordings[at]?.choice ?? {} }));
  return { bags, inBags: filesInBags(recordings) };
}

/**
 * Where only the reference changes, the frames are the same files, and need not be computed again.
 * @param {Pick<Opened, 'bags' | 'inBags'>} before
 * @param {Pick<Opened, 'bags' | 'inBags'>} chosen
 */
function keptOf(before, { bags, inBags }) {
  const frames = (/** @type {Opened['bags']} */ all) =>
    JSON.stringify(all.map(({ choice }) => ({ ...choice, reference: '' })));
  if (frames(before.bags) !== frames(bags)) return { bags, inBags };
  const old = new Map(before.inBags.map((file) => [file.path, file]));
  return {
    bags,
    inBags: inBags.map((file) => {
      const kept = /\.tum$/.test(file.path) ? undefined : old.get(file.path);
      return kept && file.given ? Object.assign(kept, { given: file.given }) : file;
    }),
  };
}

/**
 * What lies in this folder, or beside it on the way down to it.
 * @param {Content[]} files
 * @param {string} chosen
 */
function filesOfRecording(files, chosen) {
  const parts = chosen.split('/').length;
  const folders = files.map(({ path }) => {
    const names = folderOf(path).split('/');
    const end = names.findIndex((_, index) => names.slice(index, index + parts).join('/') === chosen);
    return end < 0 ? null : names.slice(0, end + parts).join('/');
  });
  const folder = folders.find((name) => name !== null) ?? fail(chosen, 'there is no such folder in the input');
  return files.filter(({ path }) => contains(folder, folderOf(path)) || contains(folderOf(path), folder));
}
