/** Which file beside depth images describes their camera. */
import type { Note } from '../base/errors.js';
import { compareNaturally } from '../base/natural_order.js';
import type { Size } from '../files/heads.js';
import { baseOf, commonFolder, depthOf, folderOf, isNear, seriesOf, wordsOf } from '../files/names.js';
import type { ListedFile } from '../files/recording.js';
import { cameraFor, MAX_CAMERA_BYTES, readCameras } from './camera_file.js';
import { EXIF_BYTES, focalShare } from './exif.js';

export type Read = (path: string, size: number) => Promise<Uint8Array | null>;

/** keys: of the frames' names; size: of the depth images; isElsewhere: whether a folder belongs to another recording */
export type Frames = {
  root: string;
  keys: string[];
  times: number[];
  size: Size | null;
  isElsewhere: (folder: string) => boolean;
};

/** Formats that say what their numbers are; in other texts numbers alone are a camera where the name says so. */
const SELF_TOLD = /\.(json|ya?ml|xml|conf|cfg|ini)$/i;
const TEXTS = /(\.(txt|csv|dat|k|intrinsics?|pincam)|^[^.]+)$/i;
/** Longer texts than this are no cameras. */
const MAX_TEXT_BYTES = 2 ** 16;
/** More files of one numbering are one a frame, which say the same: the first one is read. */
const MAX_CAMERAS = 4;

/** How much a name tells of a camera; 0: nothing. */
export function rankOfCamera(path: string) {
  if (/\.pincam$/i.test(path)) return 3; // of ARKit: width height fx fy cx cy
  const words = wordsOf(baseOf(path).replace(/\.[^.]*$/, ''));
  const ranks = words.map((word) => {
    if (/^intrinsics?$/.test(word)) return 3;
    if (/^calib\w*$/.test(word)) return 2;
    return /^(camera|cam|camchain|pinhole|k)$/.test(word) ? 1 : 0;
  });
  const best = Math.max(0, ...ranks);
  // Where each camera has its own file, the depth's is the one.
  if (best > 0 && words.includes('depth')) return best + 0.5;
  return best > 0 && words.some((word) => /^(rgb|colou?r)$/.test(word)) ? best - 0.5 : best;
}

/** @returns taken: files that are spoken of */
export async function findIntrinsics(
  files: readonly ListedFile[],
  frames: Frames,
  read: Read,
): Promise<{ intrinsics: string | null; notes: Note[]; taken: Set<string> }> {
  const candidates: { path: string; bytes: Uint8Array; rank: number; closeness: number }[] = [];
  const taken: Set<string> = new Set();
  const sizes = new Map(files.map(({ path, size }) => [path, size]));
  for (const { members } of seriesOf(files.filter(({ path }) => isNear(folderOf(path), frames)))) {
    const isOfFrames = members.length > MAX_CAMERAS;
    for (const { path } of isOfFrames ? members.slice(0, 1) : members) {
      const bytes = await cameraBytes(path, sizes.get(path) ?? 0, read);
      if (!bytes) continue;
      const closeness = depthOf(commonFolder(folderOf(path), frames.root));
      candidates.push({ path, bytes, rank: rankOfCamera(path), closeness });
      for (const member of isOfFrames ? members : [{ path }]) taken.add(member.path);
    }
  }
  candidates.sort((a, b) => b.rank - a.rank || b.closeness - a.closeness || compareNaturally(a.path, b.path));
  const notes: Note[] = [];
  let intrinsics: string | null = null;
  for (const { path, bytes } of candidates) {
    if (intrinsics !== null) {
      notes.push({ file: path, reason: `not used: the camera is described by ${intrinsics}` });
      continue;
    }
    const { reasons, isUsed } = wordsAbout(path, bytes, frames.size);
    if (isUsed) intrinsics = path;
    notes.push(
      ...reasons.map((reason) => (isUsed ? { file: path, reason } : { file: path, reason, is_loss: true as const })),
    );
  }
  return { intrinsics, notes, taken };
}

/** The bytes of a file that describes a camera, or that is meant to; null where it is another one. */
async function cameraBytes(path: string, size: number, read: Read) {
  const isRead = SELF_TOLD.test(path) ? size <= MAX_CAMERA_BYTES : TEXTS.test(baseOf(path)) && size <= MAX_TEXT_BYTES;
  const bytes = isRead ? await read(path, size) : null;
  if (!bytes) return null;
  const [camera] = readCameras(bytes);
  const rank = rankOfCamera(path);
  if (camera) return rank > 0 || camera.label !== '' ? bytes : null;
  return rank >= 2 && hasNumbers(bytes) ? bytes : null;
}

/** Four numbers or more: meant as a camera. */
function hasNumbers(bytes: Uint8Array) {
  return (new TextDecoder().decode(bytes).match(/(?<![\w.])[-+]?\d+(\.\d*)?/g)?.length ?? 0) >= 4;
}

/**
 * What is to be said of a camera's file, and whether it can be used.
 * @param size of the depth images
 */
function wordsAbout(path: string, bytes: Uint8Array, size: Size | null) {
  try {
    const { notes } = cameraFor(path, bytes, size);
    const rows = rowsOfViewer(bytes);
    const view = `the camera of a viewer that spans 60 degrees over ${rows} rows, perhaps not the one that recorded the depth; if the map is bent, give that one`;
    return { reasons: rows === null ? notes : [view, ...notes], isUsed: true };
  } catch (error) {
    const { problem, remedy } = error as { problem?: string; remedy?: string };
    if (problem === undefined) throw error;
    return { reasons: [`not used: ${problem}. ${remedy}`], isUsed: false };
  }
}

/**
 * Rows of the images where the camera is the one that Open3D's viewer begins with: 60 degrees from top to bottom, as no
 * sensor has them to the last digit. People save it beside recordings it has nothing to do with.
 */
function rowsOfViewer(bytes: Uint8Array) {
  const [camera] = readCameras(bytes);
  if (!camera?.size) return null;
  const { fx, size } = camera;
  return Math.abs(fx - size.height / 2 / Math.tan(Math.PI / 6)) < 1e-9 * fx ? size.height : null;
}

/**
 * The first colour picture, where it says by its EXIF data how it was taken.
 * @param size of the depth images
 * @returns its file, and what is made of it
 */
export async function findExif(path: string | null, size: Size, read: Read): Promise<Note | null> {
  const head = path === null ? null : await read(path, EXIF_BYTES);
  if (path === null || !head || focalShare(head) === null) return null;
  return { file: path, reason: cameraFor(path, head, size).notes.join('; ') };
}
