/** Which file is the reference trajectory of a recording. */
import type { Note } from '../base/errors.js';
import { compareNaturally } from '../base/natural_order.js';
import { readNpyShape } from '../files/heads.js';
import { baseOf, commonFolder, depthOf, folderOf, isNear, seriesOf, wordsOf } from '../files/names.js';
import type { ListedFile } from '../files/recording.js';
import { type Frames, rankOfCamera, type Read } from './cameras.js';
import { isListName } from './lists.js';
import { isPoseDocument, MAX_POSE_DOCUMENT_BYTES, poseOfFrame, posesOfDocument } from './pose_file.js';

type Candidate = { paths: string[]; likelihood: number; fits: number; closeness: number };

/** A path of a million poses is longer than that; anything longer is no trajectory. */
const MAX_BYTES = 64 * 2 ** 20;
const TRAJECTORY_NAMES = /\.(npy|tum|traj|log|csv|txt|tsv|dat|kitti|freiburg|mat|xyz|json|ya?ml|xml)$/i;

/** How likely a file of such a name is the reference; below zero: somebody's own estimate. */
const WORDS = [
  [-1, /^(est\w*|result\w*|reconstruct\w*|pred\w*|slam|orb|icp|mine|output|scanstitch)$/],
  [5, /^(gt|truth|ground|groundtruth)$/],
  [4, /^(ref|reference)$/],
  [3, /^(poses?|extrinsics?)$/],
  [2, /^(odom|odometry)$/],
  [1, /^(traj|trajectory|tum|kitti|path)$/],
] as const;

function likelihood(path: string) {
  const words = wordsOf(baseOf(path));
  return WORDS.find(([, pattern]) => words.some((word) => pattern.test(word)))?.[0] ?? 0;
}

/**
 * @param files those that are no images and no clouds
 * @returns taken: files that are spoken of
 */
export async function findReference(
  files: readonly ListedFile[],
  frames: Frames,
  read: Read,
): Promise<{ reference: string[]; notes: Note[]; taken: Set<string> }> {
  // A file a frame may lie in a folder of its own, beside that of the frames.
  const isBeside = (folder: string) =>
    folderOf(folder) === folderOf(frames.root) && likelihood(folder) > 0 && !frames.isElsewhere(folder);
  const near = files.filter(
    ({ path }) => TRAJECTORY_NAMES.test(path) && (isNear(folderOf(path), frames) || isBeside(folderOf(path))),
  );
  const { candidate: perFrame, aside } = await posesPerFrame(near, frames, read);
  const inSeries = new Set([...(perFrame?.paths ?? []), ...aside.flatMap(({ paths }) => paths)]);
  const candidates: Candidate[] = perFrame ? [perFrame] : [];
  for (const { path, size } of near) {
    if (
      inSeries.has(path) ||
      (isCameraName(path) && !isPoseDocument(path)) ||
      (isListName(path) && likelihood(path) <= 0)
    )
      continue;
    const poses = await countPoses(path, size, read);
    const fits = poses ? fitOf(poses, frames) : 0;
    const likely = likelihood(path);
    if (poses && (likely > 0 || (likely === 0 && fits > 0 && poses.isFull))) {
      const closeness = depthOf(commonFolder(folderOf(path), frames.root));
      candidates.push({ paths: [path], likelihood: likely, fits, closeness });
    }
  }
  candidates.sort(
    (a, b) =>
      b.fits - a.fits ||
      b.likelihood - a.likelihood ||
      b.closeness - a.closeness ||
      compareNaturally(a.paths[0] ?? '', b.paths[0] ?? ''),
  );
  const [best, ...rest] = candidates;
  const notes = rest.map(({ paths }) => ({
    file: paths[0] ?? '',
    reason: `not used: one reference trajectory is used at a time, here ${best?.paths[0]}`,
  }));
  const taken = new Set([...inSeries, ...candidates.flatMap(({ paths }) => paths)]);
  return { reference: best?.paths ?? [], notes: [...notes, ...aside.map(({ note }) => note)], taken };
}

/**
 * Of files with one pose each, that of each frame, by the numbers in the names; null where a frame has none.
 * @param names of the files
 * @param frames paths
 */
export function posesOfFrames(names: readonly string[], frames: readonly string[]): string[] | null {
  const membersOf = (paths: readonly string[]) =>
    seriesOf(paths.map((path) => ({ path, size: 1 }))).flatMap(({ members }) => members);
  const nameOfKey = new Map(membersOf(names).map(({ key, path }) => [key, path]));
  const keyOf = new Map(membersOf(frames).map(({ key, path }) => [path, key]));
  const found = frames.flatMap((path) => nameOfKey.get(keyOf.get(path) ?? '') ?? []);
  return found.length === frames.length ? found : null;
}

/** Whether there is a file for each frame, all numbered higher or lower by the same: from 1 where the frames count from 0. */
function isShifted(members: readonly { key: string }[], keys: readonly string[]) {
  const shifts = new Set(members.map(({ key }, at) => Number(key) - Number(keys[at])));
  const [shift] = shifts;
  return members.length === keys.length && shifts.size === 1 && shift !== 0 && Number.isInteger(shift);
}

/** Files with one pose each, numbered as the frames are; with gaps they are of no use. */
async function posesPerFrame(files: readonly ListedFile[], { root, keys }: Frames, read: Read) {
  const candidates: Candidate[] = [];
  const aside: { paths: string[]; note: Note }[] = [];
  for (const { folder, members } of keys.length < 2 ? [] : seriesOf(files)) {
    const likely =
      likelihood(members[0]?.path ?? '') ||
      likelihood(folder) ||
      ((await holdPoses(members, read)) ? likelihood('pose') : 0);
    const pathOf = new Map(members.map(({ key, path }) => [key, path]));
    const paths = keys.flatMap((key) => pathOf.get(key) ?? []);
    if (likely > 0 && isShifted(members, keys)) {
      const [all, first] = [members.map(({ path }) => path), baseOf(members[0]?.path ?? '')];
      const reason = `numbered from ${first}, the frames from ${keys[0]}; as there are ${keys.length} of each, they are paired in their order`;
      aside.push({ paths: all, note: { file: all[0] ?? '', reason } });
      candidates.push({ paths: all, likelihood: likely, fits: 2, closeness: depthOf(commonFolder(folder, root)) });
      continue;
    }
    if (likely <= 0 || paths.length < 2) continue;
    if (paths.length === keys.length) {
      const unused = members.flatMap(({ path }) => (paths.includes(path) ? [] : [path]));
      const more = unused.length > 1 ? ` (and ${unused.length - 1} more)` : '';
      const reason = `not used: there is no frame of its number${more}`;
      if (unused[0] !== undefined) aside.push({ paths: unused, note: { file: unused[0], reason } });
      candidates.push({ paths, likelihood: likely, fits: 2, closeness: depthOf(commonFolder(folder, root)) });
    } else if (members.length > 2) {
      const missing = keys.length - paths.length;
      const first = keys.find((key) => !pathOf.has(key));
      const reason = `not used: ${missing} of ${keys.length} frames have no such file (number ${first} first); a ground truth needs one for each`;
      aside.push({ paths: members.map(({ path }) => path), note: { file: members[0]?.path ?? '', reason } });
    }
  }
  return { candidate: candidates.sort((a, b) => b.likelihood - a.likelihood)[0] ?? null, aside };
}

/** Whether each holds the pose of its frame, where names tell nothing: that of the last is another than that of the first. */
async function holdPoses(members: readonly { path: string }[], read: Read) {
  const ends = [members[0]?.path ?? '', members.at(-1)?.path ?? ''];
  if (members.length < 2 || !ends.every(isPoseDocument)) return false;
  const files = await Promise.all(ends.map((path) => read(path, MAX_POSE_DOCUMENT_BYTES)));
  const [first, last] = files.map((bytes) => bytes && poseOfFrame(new TextDecoder().decode(bytes)));
  return Boolean(first && last && first !== last);
}

/** isFull: with their rotation */
type Poses = { count: number; isFull: boolean; times: [first: number, last: number] | null };

/** @returns null: no trajectory */
async function countPoses(path: string, size: number, read: Read): Promise<Poses | null> {
  if (size > (isPoseDocument(path) ? MAX_POSE_DOCUMENT_BYTES : MAX_BYTES)) return null;
  if (/\.npy$/i.test(path)) {
    const head = await read(path, Math.min(size, 1024));
    const [count = 0, ...shape] = (head && readNpyShape(head)) || [];
    const isFull = ['7', '8', '12', '16', '4,4', '3,4'].includes(shape.join());
    return isFull ? { count, isFull, times: null } : null;
  }
  const bytes = await read(path, size);
  if (!bytes || !isPoseDocument(path)) return bytes && countRows(bytes);
  const found = posesOfDocument(bytes);
  return found && { count: found.count, isFull: true, times: null };
}

/** Poses in a text, by its rows of numbers: a row each, or four rows of four. */
function countRows(bytes: Uint8Array): Poses | null {
  if (bytes.includes(0)) return null;
  const rowsOf: Map<number, number> = new Map();
  const first: number[] = [];
  let foreign = 0;
  for (const line of new TextDecoder().decode(bytes).split('\n')) {
    const words = line.split(/[\s,;]+/).filter((word) => word !== '');
    if (words.length === 0 || /^(#|%|\/\/)/.test(words[0] ?? '')) continue;
    const isNumbers = words.every((word) => /^[-+]?(nan|inf\w*)$/i.test(word) || Number.isFinite(Number(word)));
    if (!isNumbers) foreign += 1;
    else rowsOf.set(words.length, (rowsOf.get(words.length) ?? 0) + 1);
    if (isNumbers) first.push(Number(words[0]));
  }
  const [columns, rows] = [...rowsOf].sort((a, b) => b[1] - a[1])[0] ?? [0, 0];
  // A table may begin with the names of its columns, and a row may be damaged.
  if (columns < 2 || foreign > 1 + rows / 10) return null;
  if (columns === 4 && rows % 4 === 0) return { count: rows / 4, isFull: true, times: null };
  const isFull = columns >= 7;
  return { count: rows, isFull, times: columns >= 8 ? [first[0] ?? 0, first.at(-1) ?? 0] : null };
}

/** 2: made for these frames; 0: not, or not to be told by the count. */
function fitOf({ count, times }: Poses, frames: Frames) {
  if (count === frames.keys.length) return 2;
  const [first] = frames.times;
  const last = frames.times.at(-1);
  if (!times || first === undefined || last === undefined) return 0;
  // Recorded together: the times overlap.
  return times[0] <= last && times[1] >= first ? 2 : 0;
}

function isCameraName(path: string) {
  return /\.(txt|json|ya?ml|xml|csv|npy)$/i.test(path) && rankOfCamera(path) > 0 && likelihood(path) <= 0;
}
