// @ts-check
/**
 * What a folder, an archive or a drop of files is: planar scans, depth images or clouds in space, in which order, and
 * which files give the ground truth and the camera. One understanding for the page and the command line. Names, sizes
 * and the beginnings of files are looked at, lists, trajectories and cameras as a whole; nothing is kept.
 */
import { append } from './append.js';
import { lost } from './errors.js';
import { compareNaturally } from './natural_order.js';
import { classify, isColumn, isSystemFile, looksLikeNumbers } from './recording/classify.js';
import { notesOnCopies } from './recording/copies.js';
import { HEAD_BYTES, IMAGE_HEAD_BYTES, imageSize, isPly, readPlyExtent } from './recording/heads.js';
import { isCloudName, isForeignDepthName, isImageName } from './recording/kinds.js';
import { baseOf, commonFolder, contains, folderOf, groupBy, nameOf, seriesOf } from './recording/names.js';
import { adviceByContents, adviceFor, isGraph } from './recording/other_formats.js';
import { assignRoles } from './recording/planar.js';

const inSpace = () => import('./recording/in_space.js');

/** @typedef {{ path: string, size: number, given?: Recording, isCloud?: boolean }} ListedFile path: folders separated by slashes;
 *    size in bytes; given: the recording that it is a part of, where that is known, as it is of what lies in a bag; isCloud:
 *    whether it is a cloud, whatever its name says */
/** @typedef {{ file: string, reason: string, is_loss?: true }} Note reason: completes "FILE: ..."; is_loss: it could have been
 *    used */
/** @typedef {{ name: string, depth: string, color: string | null, time: number | null }} DepthFrame name: short, for messages
 *    and results; depth, color: paths; time: seconds, where the recording has times */
/**
 * @typedef {object} Recording
 * @property {'planar_scans' | 'depth_images' | 'clouds' | 'nothing'} kind
 * @property {string} root the folder that holds it; empty where that is the top
 * @property {DepthFrame[]} depth_frames in order
 * @property {string[]} clouds paths, in order
 * @property {number[]} [cloud_times] of the clouds, where the recording has times (s)
 * @property {string[]} scans paths, in order
 * @property {string[]} reference the reference trajectory: one file, or a file with one pose for each frame; empty without
 * @property {string | null} odometry what the wheels of a robot with planar scans told: one file
 * @property {string | null} intrinsics a file that describes the depth camera
 * @property {import('./recording/camera_file.js').Size | null} image_size of the first depth image, where its head tells it
 * @property {Note[]} notes what was not used or is worth knowing, in plain words
 */

/** @typedef {(path: string, length: number) => Promise<Uint8Array>} ReadHead the first bytes of a file, or all it has */

/** So many clouds are looked into to tell planar ones from those in space. */
const LOOKED_INTO = 8;
/** Of files that are no recording, so many are looked into to tell numbers from others. */
const LOOKED_FOR_NUMBERS = 100;
/** What `scanstitch reconstruct` writes: its own results are no input. */
const RESULTS = ['trajectory.tum', 'report.json'];
const MAPS = ['map.ply', 'map.pcd'];
/** These may lie beside them. */
const OTHER_RESULTS = ['map.pgm', 'map.yaml', 'report.html'];
/** So may the grids of a map in pieces. */
const PIECES = /^map_piece_\d+\.(pgm|yaml)$/;

/**
 * Understands the files of a drop, a folder or an archive. Where they hold several recordings, the one with the most
 * frames is taken and the others are named in the notes.
 *
 * @param {readonly ListedFile[]} files
 * @param {ReadHead} readHead
 * @param {boolean} [isTable] whether tables of numbers are said to be laser scans
 * @returns {Promise<Recording>}
 */
export async function understand(files, readHead, isTable = false) {
  const known = withoutResults(files.filter(({ path }) => !isSystemFile(path))).toSorted(byName);
  /** @type {Note[]} */
  const unreadable = [];
  const read = async (/** @type {string} */ path, /** @type {number} */ length) => {
    try {
      return await readHead(path, length);
    } catch (error) {
      if (unreadable.every(({ file }) => file !== path)) {
        const { problem } = /** @type {{ problem?: string }} */ (error);
        const reason = problem === undefined ? 'could not be read; was it moved or deleted?' : `not used: ${problem}`;
        unreadable.push(lost(path, reason));
      }
      return null;
    }
  };
  const given = known.flatMap((file) => file.given ?? []);
  if (given.length > 0) {
    const recording = await givenRecording(new Set(given), known, read);
    return { ...recording, notes: [...unreadable, ...recording.notes] };
  }
  const depth = await findDepth(known, (path) => read(path, IMAGE_HEAD_BYTES));
  const numFrames = depth.recordings[0]?.depth.members.length ?? 0;
  const clouds = await findClouds(known, numFrames, read, isTable);
  const recording =
    numFrames > 0 && numFrames >= clouds.files.length
      ? await depthImages(depth, known, read)
      : clouds.extent === 'space'
        ? await spatialClouds(clouds.files, known, read)
        : clouds.files.length > 0
          ? await planarScans(known, read, isTable)
          : await nothing(depth.notes, known, read);
  const notes = [...unreadable, ...recording.notes];
  return { ...empty(), ...recording, notes };
}

/**
 * The depth images; their module is not loaded for names among which there can be none.
 * @param {ListedFile[]} files
 * @param {import('./recording/depth_images.js').Peek} peek
 * @returns {ReturnType<typeof import('./recording/depth_images.js').findDepthRecordings>}
 */
async function findDepth(files, peek) {
  if (!files.some(({ path }) => isImageName(path) || isForeignDepthName(path)))
    return { recordings: [], notes: [], pictures: [] };
  const { findDepthRecordings } = await inSpace();
  return findDepthRecordings(files, peek);
}

/**
 * The longest of the recordings that are known, with a reference or a camera that lies beside it.
 * @param {ReadonlySet<Recording>} given
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<Recording>}
 */
async function givenRecording(given, files, read) {
  const [chosen = empty(), ...others] = [...given].sort((a, b) => numFramesOf(b) - numFramesOf(a));
  const { kind, root } = chosen;
  const loose = files.filter((file) => !file.given);
  const isOther = (/** @type {ListedFile} */ file) => !isImageName(file.path) && !isCloud(file);
  const beside = await referenceAndCamera(
    loose.filter(isOther),
    {
      root,
      keys: [...chosen.depth_frames.map(({ depth }) => depth), ...chosen.clouds],
      times: chosen.depth_frames.flatMap(({ time }) => time ?? []),
      size: null,
      isElsewhere: () => false,
    },
    read,
  );
  const reference = beside.reference.length === 0 ? chosen.reference : beside.reference;
  const intrinsics = kind === 'depth_images' ? (beside.intrinsics ?? chosen.intrinsics) : null;
  const images = loose.filter((file) => !isOther(file));
  const notes = [
    ...chosen.notes,
    ...notesOfGiven(chosen, others, { reference, intrinsics }),
    ...beside.notes,
    ...unused(images, 'it lies beside a bag, which is used'),
  ];
  return { ...chosen, reference, intrinsics, notes };
}

/**
 * What is not used of recordings that are known, and what the chosen one lacks.
 * @param {Recording} chosen
 * @param {Recording[]} others
 * @param {Pick<Recording, 'reference' | 'intrinsics'>} used in its place or of its own
 * @returns {Note[]}
 */
function notesOfGiven({ kind, root, reference: [own] }, others, { reference: [used], intrinsics }) {
  /** @type {Note[]} */
  const notes = [];
  if (own !== undefined && used !== own) {
    notes.push({ file: own, reason: `not used: one reference trajectory is used at a time, here ${used}` });
  }
  for (const recording of others.filter((recording) => numFramesOf(recording) > 0)) {
    const reason = `not used: another recording; one is used at a time, the longest: ${root}`;
    notes.push({ file: recording.root, reason });
  }
  if (kind === 'depth_images' && intrinsics === null) {
    const remedy = 'give fx fy cx cy in a file beside the bag, or set field_of_view';
    const reason = `no CameraInfo gives the focal length of its depth images; a typical one is assumed, and the map may be distorted; ${remedy}`;
    notes.push({ file: root, reason });
  }
  if (kind === 'nothing') {
    for (const recording of others) append(notes, recording.notes);
    notes.push({ file: root, reason: 'no topic of this bag can be used as depth images, clouds or laser scans' });
  }
  return notes;
}

/** @param {Recording} recording */
function numFramesOf({ depth_frames, clouds, scans }) {
  return depth_frames.length + clouds.length + scans.length;
}

/**
 * A reference that is one file for each frame, as one text: what the engine takes.
 * @param {readonly Uint8Array[]} files
 */
export function joinPoses(files) {
  const texts = files.map((bytes) => new TextDecoder().decode(bytes).trim());
  return new TextEncoder().encode(`${texts.join('\n')}\n`);
}

/** @param {ListedFile} file */
function isCloud({ path, isCloud }) {
  return isCloud === true || isCloudName(path);
}

/** A recording of nothing. @returns {Recording} */
export function empty() {
  return {
    kind: 'nothing',
    root: '',
    depth_frames: [],
    clouds: [],
    scans: [],
    reference: [],
    odometry: null,
    intrinsics: null,
    image_size: null,
    notes: [],
  };
}

/** @param {ListedFile} a @param {ListedFile} b */
function byName(a, b) {
  return compareNaturally(a.path, b.path);
}

/** @param {ListedFile[]} files */
function withoutResults(files) {
  const paths = new Set(files.map(({ path }) => path));
  const isResult = (/** @type {ListedFile} */ { path }) => {
    const folder = folderOf(path);
    const inFolder = (/** @type {string} */ name) => (folder === '' ? name : `${folder}/${name}`);
    const [results, maps] = [RESULTS.map(inFolder), MAPS.map(inFolder)];
    const isComplete = results.every((name) => paths.has(name)) && maps.some((name) => paths.has(name));
    if (!isComplete) return false;
    return [...results, ...maps, ...OTHER_RESULTS.map(inFolder)].includes(path) || PIECES.test(baseOf(path));
  };
  return files.filter((file) => !isResult(file));
}

/** @typedef {(path: string, length: number) => Promise<Uint8Array | null>} Read null: it cannot be read, which is noted */

/**
 * All clouds, and whether they lie in the plane or in space: as most of those looked into do.
 * @param {ListedFile[]} files
 * @param {number} numFrames depth images there are
 * @param {Read} read
 * @param {boolean} isTable
 */
async function findClouds(files, numFrames, read, isTable) {
  const clouds = files.filter(isCloud);
  // A PLY file may have lost its ending; it is searched for where there is nothing else.
  for (const file of numFrames === 0 && clouds.length === 0 ? files : []) {
    if (isImageName(file.path)) continue;
    const head = await read(file.path, HEAD_BYTES);
    if (head && classify(file.path, head, isTable).role === 'scan') clouds.push(file);
  }
  const step = Math.max(1, clouds.length / LOOKED_INTO);
  const looked = clouds.filter((_, index) => index % step < 1);
  let inSpace = 0;
  let inPlane = 0;
  for (const { path } of looked) {
    // Of a PCD that is read as PLY, the points lie in the plane.
    const head = await read(path, HEAD_BYTES);
    const isPcd = /\.pcd$/i.test(path) && !(head && isPly(head));
    const extent = head === null || isPcd ? 'space' : readPlyExtent(head);
    if (extent === 'space') inSpace += 1;
    if (extent === 'plane') inPlane += 1;
  }
  return { files: clouds, extent: /** @type {'space' | 'plane'} */ (inSpace > inPlane ? 'space' : 'plane') };
}

/**
 * @param {Awaited<ReturnType<typeof findDepth>>} found
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<Partial<Recording> & { notes: Note[] }>}
 */
async function depthImages({ recordings: [chosen, ...others], notes, pictures }, files, read) {
  if (!chosen) return { notes };
  const { findExif, framesOf, isApart, leftAside } = await inSpace();
  const { frames, notes: pairNotes } = await framesOf(chosen, files, read);
  const { root } = chosen;
  const keyOf = new Map(chosen.depth.members.map(({ path, key }) => [path, key]));
  const elsewhere = others.map(({ root }) => root).filter((other) => isApart(other, root));
  const isElsewhere = (/** @type {string} */ folder) => elsewhere.some((other) => contains(other, folder));
  const head = frames[0] && (await read(frames[0].depth, IMAGE_HEAD_BYTES));
  const size = head ? imageSize(head) : null;
  const rest = await referenceAndCamera(
    files.filter((file) => !isImageName(file.path) && !isCloud(file)),
    {
      root,
      keys: frames.map(({ depth }) => keyOf.get(depth) ?? ''),
      times: frames.flatMap(({ time }) => time ?? []),
      size,
      isElsewhere,
    },
    read,
  );
  const picture = rest.intrinsics === null && size ? await findExif(frames[0]?.color ?? null, size, read) : null;
  const clouds = files.filter(isCloud);
  return {
    ...rest,
    intrinsics: rest.intrinsics ?? picture?.file ?? null,
    kind: 'depth_images',
    root,
    depth_frames: frames,
    image_size: size,
    notes: [
      ...notes,
      ...pairNotes,
      ...leftAside(chosen, others, pictures),
      ...rest.notes,
      ...(picture ? [picture] : []),
      ...unused(clouds, 'a cloud beside depth images'),
    ],
  };
}

/**
 * @param {ListedFile[]} clouds
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<Partial<Recording> & { notes: Note[] }>}
 */
async function spatialClouds(clouds, files, read) {
  const { chosen, others } = chooseClouds(clouds);
  const root = chosen.map(({ path }) => folderOf(path)).reduce(commonFolder);
  const elsewhere = new Set(others.map(({ path }) => folderOf(path)));
  const members = seriesOf(chosen).flatMap(({ members }) => members);
  const { timesOfClouds } = await inSpace();
  const timed = await timesOfClouds(chosen, files, read);
  const rest = await referenceAndCamera(
    files.filter((file) => !isImageName(file.path) && !isCloud(file) && file.path !== timed?.path),
    {
      root,
      keys: members.map(({ key }) => key),
      times: members.flatMap(({ time }) => time ?? []),
      size: null,
      isElsewhere: (folder) => folder !== root && elsewhere.has(folder),
    },
    read,
  );
  const images = files.filter(({ path }) => isImageName(path));
  const used = `those of one folder are used, the one with most, here ${nameOf({ folder: '', pattern: '', members })}`;
  return {
    ...rest,
    kind: 'clouds',
    root,
    clouds: chosen.map(({ path }) => path),
    ...(timed ? { cloud_times: timed.times } : {}),
    intrinsics: null,
    notes: [
      ...otherClouds(others, used),
      ...(await notesOnCopies(chosen, read)),
      ...rest.notes,
      ...unused(images, 'an image beside clouds'),
    ],
  };
}

/**
 * A note about each folder of clouds.
 * @param {ListedFile[]} clouds
 * @param {string} used
 * @returns {Note[]}
 */
function otherClouds(clouds, used) {
  const folders = groupBy(clouds, ({ path }) => folderOf(path));
  return [...folders.values()].map((files) => {
    const [first] = files;
    const what = files.length === 1 ? 'another cloud' : `the first of ${files.length} other clouds`;
    return { file: first?.path ?? '', reason: `not used: ${what}; ${used}` };
  });
}

/**
 * The folder with the most clouds, without a map that lies beside them.
 * @param {ListedFile[]} clouds
 */
function chooseClouds(clouds) {
  const folders = groupBy(clouds, ({ path }) => folderOf(path));
  const largest = [...folders.values()].toSorted((a, b) => b.length - a.length)[0] ?? [];
  // One cloud in each folder: the folders are numbered, not the clouds.
  const candidates = largest.length > 1 ? largest : clouds;
  const numbered = candidates.filter(({ path }) => /\d/.test(baseOf(path)));
  const chosen = largest.length > 1 && numbered.length >= 3 ? numbered : candidates;
  return { chosen, others: clouds.filter((cloud) => !chosen.includes(cloud)) };
}

/**
 * The reference, the camera, and a word about every other file.
 * @param {ListedFile[]} files
 * @param {import('./recording/reference.js').Frames} frames
 * @param {Read} read
 */
async function referenceAndCamera(files, frames, read) {
  const { findIntrinsics, findReference, isListName } = await inSpace();
  const reference = await findReference(files, frames, read);
  const camera = await findIntrinsics(files, frames, read);
  const rest = files.filter(
    ({ path }) =>
      !frames.isElsewhere(folderOf(path)) && !reference.taken.has(path) && !camera.taken.has(path) && !isListName(path),
  );
  const notes = [
    ...reference.notes,
    ...camera.notes,
    ...unused(rest, 'neither an image nor a trajectory of this recording'),
  ];
  return { reference: reference.reference, intrinsics: camera.intrinsics, notes };
}

/**
 * A note about each file, or about each series of files.
 * @param {ListedFile[]} files
 * @param {string} what
 * @returns {Note[]}
 */
function unused(files, what) {
  return seriesOf(files).map((series) => {
    return { file: nameOf(series), reason: `not used: ${adviceFor(series.members[0]?.path ?? '') ?? what}` };
  });
}

/**
 * @param {ListedFile[]} files
 * @param {Read} read
 * @param {boolean} isTable
 * @returns {Promise<Partial<Recording> & { notes: Note[] }>}
 */
async function planarScans(files, read, isTable) {
  /** @type {{ name: string, role: import('./recording/classify.js').Role, file: string }[]} */
  const known = [];
  for (const { path } of files) {
    const nameSaysAll = /\.ply$/i.test(path) || isImageName(path);
    const head = nameSaysAll ? null : await read(path, HEAD_BYTES);
    if (nameSaysAll || head) known.push({ name: path, role: classify(path, head, isTable), file: path });
  }
  const { scans, reference, odometry, notes } = assignRoles(known);
  const isUsed = new Set(scans);
  const used = files.filter(({ path }) => isUsed.has(path));
  const root = scans.map(folderOf).reduce(commonFolder);
  return {
    kind: 'planar_scans',
    root,
    scans,
    reference: reference === null ? [] : [reference],
    odometry,
    notes: [...notes, ...(await notesOnCopies(used, read))],
  };
}

/**
 * @param {Note[]} notes about images
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<Partial<Recording> & { notes: Note[] }>}
 */
async function nothing(notes, files, read) {
  const told = new Set(notes.map(({ file }) => file));
  const others = files.filter(({ path }) => !isImageName(path));
  const heads = await Promise.all(others.slice(0, LOOKED_FOR_NUMBERS).map(({ path }) => read(path, HEAD_BYTES)));
  const headOf = (/** @type {number} */ at) => heads[at] ?? new Uint8Array();
  /** @type {Map<string, ListedFile[]>} */
  const advised = groupBy(
    others.filter((_, at) => adviceByContents(headOf(at)) !== null),
    (file) => adviceByContents(headOf(others.indexOf(file))) ?? '',
  );
  const advisedFiles = new Set([...advised.values()].flat());
  const graphs = others.filter((_, at) => isGraph(headOf(at)));
  const columns = others.filter((_, at) => isColumn(headOf(at)));
  const isNumbers = (/** @type {ListedFile} */ file, /** @type {number} */ at) =>
    !advisedFiles.has(file) && !graphs.includes(file) && looksLikeNumbers(headOf(at));
  const numbers = new Set(others.filter(isNumbers));
  const rest = [
    ...[...advised].flatMap(([advice, files]) =>
      files.map(({ path }) => ({ file: path, reason: `not used: ${advice}` })),
    ),
    ...unused(graphs, 'relations between poses, without scans; give the log or bag of the laser'),
    ...unused(
      columns,
      'a number a line; where these are the ranges of a scan, say where it begins and its step: --table range=1,start=-135deg,step=0.5deg',
    ),
    ...unused(
      [...numbers],
      'numbers without a scan, as of a trajectory; trajectories are compared by scanstitch evaluate, on the page under Evaluate; of points x y or x y z, give two files or more',
    ),
    ...unused(
      others.filter(
        (file) => !advisedFiles.has(file) && !numbers.has(file) && !graphs.includes(file) && !columns.includes(file),
      ),
      'neither a scan, nor a cloud, nor a depth image',
    ),
  ];
  return { notes: [...notes, ...rest.filter(({ file }) => !told.has(file))] };
}
