/**
 * What a folder, an archive or a drop of files is: planar scans, depth images or clouds in space, in which order, and
 * which files give the ground truth and the camera. One understanding for the page and the command line. Names, sizes
 * and the beginnings of files are looked at, lists, trajectories and cameras as a whole; nothing is kept.
 */
import { lost, type Note } from '../base/errors.js';
import { compareNaturally } from '../base/natural_order.js';
import { HEAD_BYTES, IMAGE_HEAD_BYTES, imageSize, isPly, readPlyExtent } from '../files/heads.js';
import { isCloudName, isForeignDepthName, isImageName } from '../files/kinds.js';
import { baseOf, commonFolder, contains, folderOf, groupBy, nameOf, seriesOf } from '../files/names.js';
import { empty, type Found, type ListedFile, type ReadHead, type Understood } from '../files/recording.js';
import type { Frames, Read } from './cameras.js';
import { classify, isColumn, isSystemFile } from './classify.js';
import { notesOnCopies } from './copies.js';
import type { DepthImages, Peek } from './depth_images.js';
import { nothing } from './nothing.js';
import { unused } from './other_formats.js';
import { assignRoles, classifyAll } from './planar.js';

const inSpace = () => import('./in_space.js');

/** So many clouds are looked into to tell planar ones from those in space. */
const LOOKED_INTO = 8;
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
 * @param isTable whether tables of numbers are said to be laser scans
 */
export async function understand(
  files: readonly ListedFile[],
  readHead: ReadHead,
  isTable = false,
): Promise<Understood> {
  const known = withoutResults(files.filter(({ path }) => !isSystemFile(path))).toSorted(byName);
  const unreadable: Note[] = [];
  const read = async (path: string, length: number) => {
    try {
      return await readHead(path, length);
    } catch (error) {
      if (unreadable.every(({ file }) => file !== path)) {
        const { problem } = error as { problem?: string };
        const reason = problem === undefined ? 'could not be read; was it moved or deleted?' : `not used: ${problem}`;
        unreadable.push(lost(path, reason));
      }
      return null;
    }
  };
  const given = known.flatMap((file) => file.given ?? []);
  if (given.length > 0) {
    const { givenRecording } = await import('./given_recording.js');
    const recording = await givenRecording(new Set(given), known, (files, frames) =>
      referenceAndCamera(files, frames, read),
    );
    return { ...recording, image_size: null, notes: [...unreadable, ...recording.notes] };
  }
  const depth = await findDepth(known, (path, length = IMAGE_HEAD_BYTES) => read(path, length));
  const numFrames = depth.recordings[0]?.depth.members.length ?? 0;
  const clouds = await findClouds(known, numFrames, read, isTable);
  const recording =
    numFrames > 0 && numFrames >= clouds.files.length
      ? await depthImages(depth, known, read)
      : clouds.extent === 'space'
        ? await spatialClouds(clouds.files, known, read)
        : clouds.files.length > 0
          ? await planarScans(known, read, isTable)
          : (await isColumnAlone(known, read))
            ? await planarScans(known, read, true)
            : await nothing(depth.notes, known, read);
  // What is wrong with a frame is told when its turn comes.
  const frames = new Set([...(recording.clouds ?? []), ...(recording.depth_frames ?? []).map(({ depth }) => depth)]);
  const others = unreadable.filter(({ file }) => !frames.has(file));
  const notes = [...others, ...recording.notes];
  const beside = recording.beside && { ...recording.beside, notes: [...others, ...recording.beside.notes] };
  return { ...empty(), image_size: null, ...recording, notes, ...(beside && { beside }) };
}

/** Whether there is one file, a number a line: the ranges of a scan, perhaps, whose angles have to be asked for. */
async function isColumnAlone([file, ...others]: readonly ListedFile[], read: Read) {
  if (!file || others.length > 0 || isImageName(file.path)) return false;
  const head = await read(file.path, HEAD_BYTES);
  return head !== null && classify(file.path, head, true).role === 'scan' && isColumn(head);
}

/** The depth images; their module is not loaded for names among which there can be none. */
async function findDepth(files: ListedFile[], peek: Peek): Promise<DepthImages> {
  if (!files.some(({ path }) => isImageName(path) || isForeignDepthName(path)))
    return { recordings: [], notes: [], pictures: [] };
  const { findDepthRecordings } = await inSpace();
  return findDepthRecordings(files, peek);
}

function isCloud({ path, isCloud }: ListedFile) {
  return isCloud === true || isCloudName(path);
}

function byName(a: ListedFile, b: ListedFile) {
  return compareNaturally(a.path, b.path);
}

function withoutResults(files: ListedFile[]) {
  const paths = new Set(files.map(({ path }) => path));
  const isResult = ({ path }: ListedFile) => {
    const folder = folderOf(path);
    const inFolder = (name: string) => (folder === '' ? name : `${folder}/${name}`);
    const [results, maps] = [RESULTS.map(inFolder), MAPS.map(inFolder)];
    const isComplete = results.every((name) => paths.has(name)) && maps.some((name) => paths.has(name));
    if (!isComplete) return false;
    return [...results, ...maps, ...OTHER_RESULTS.map(inFolder)].includes(path) || PIECES.test(baseOf(path));
  };
  return files.filter((file) => !isResult(file));
}

/** Where the points of a cloud lie. It may begin with thousands that were not seen, or with a floor. */
async function extentOf(path: string, read: Read) {
  for (let size = HEAD_BYTES; ; size *= 16) {
    const head = await read(path, size);
    // Of a PCD that is read as PLY, the points lie in the plane.
    if (head === null || (/\.pcd$/i.test(path) && !isPly(head))) return 'space';
    const extent = readPlyExtent(head);
    if (extent === 'space' || extent === 'unknown' || head.length < size) return extent;
  }
}

/**
 * All clouds, and whether they lie in the plane or in space: as most of those looked into do.
 * @param numFrames depth images there are
 */
async function findClouds(files: ListedFile[], numFrames: number, read: Read, isTable: boolean) {
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
    const extent = await extentOf(path, read);
    if (extent === 'space') inSpace += 1;
    if (extent === 'plane') inPlane += 1;
  }
  return { files: clouds, extent: (inSpace > inPlane ? 'space' : 'plane') as 'space' | 'plane' };
}

async function depthImages(
  { recordings: [chosen, ...others], notes, pictures }: DepthImages,
  files: ListedFile[],
  read: Read,
): Promise<Found> {
  if (!chosen) return { notes };
  const { findExif, framesOf, isApart, leftAside } = await inSpace();
  const { frames, notes: pairNotes } = await framesOf(chosen, files, read);
  const { root } = chosen;
  const keyOf = new Map(chosen.depth.members.map(({ path, key }) => [path, key]));
  const elsewhere = others.map(({ root }) => root).filter((other) => isApart(other, root));
  const isElsewhere = (folder: string) => elsewhere.some((other) => contains(other, folder));
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

async function spatialClouds(clouds: ListedFile[], files: ListedFile[], read: Read): Promise<Found> {
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

/** A note about each folder of clouds. */
function otherClouds(clouds: ListedFile[], used: string): Note[] {
  const folders = groupBy(clouds, ({ path }) => folderOf(path));
  return [...folders.values()].map((files) => {
    const [first] = files;
    const what = files.length === 1 ? 'another cloud' : `the first of ${files.length} other clouds`;
    return { file: first?.path ?? '', reason: `not used: ${what}; ${used}` };
  });
}

/** The folder with the most clouds, without a map that lies beside them. */
function chooseClouds(clouds: ListedFile[]) {
  const folders = groupBy(clouds, ({ path }) => folderOf(path));
  const largest = [...folders.values()].toSorted((a, b) => b.length - a.length)[0] ?? [];
  // One cloud in each folder: the folders are numbered, not the clouds.
  const candidates = largest.length > 1 ? largest : clouds;
  const numbered = candidates.filter(({ path }) => /\d/.test(baseOf(path)));
  const chosen = largest.length > 1 && numbered.length >= 3 ? numbered : candidates;
  return { chosen, others: clouds.filter((cloud) => !chosen.includes(cloud)) };
}

/** The reference, the camera, and a word about every other file. */
async function referenceAndCamera(files: ListedFile[], frames: Frames, read: Read) {
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

async function planarScans(files: ListedFile[], read: Read, isTable: boolean): Promise<Found> {
  const { reference, notes, ...found } = assignRoles(await classifyAll(files, read, isTable));
  const root = found.scans.map(folderOf).reduce(commonFolder);
  const isUsed = new Set(found.scans);
  const copies = await notesOnCopies(
    files.filter(({ path }) => isUsed.has(path)),
    read,
  );
  return {
    ...found,
    kind: 'planar_scans',
    root,
    reference: reference === null ? [] : [reference],
    notes: [...notes, ...copies],
  };
}
