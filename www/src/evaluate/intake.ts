/**
 * What each of the files dropped together is: a trajectory, one pose of many, times, relations, or a cloud. It is
 * told by their names and beginnings, before they are read as a whole.
 */
import { compareNaturally } from '../../../package/base/natural_order.js';
import type { Part } from './protocol.js';

/** Trajectories that were found: one file each, or the files of a folder with one pose each. */
export interface FoundTrajectory {
  name: string;
  parts: readonly Part[];
}

export interface Intake {
  trajectories: FoundTrajectory[];
  times: Part | null;
  relations: Part | null;
  clouds: Part[];
}

/** Files that are none of these, by their names: they are not even read. */
const OTHERS =
  /(^|\/)(\.|__MACOSX\/|Thumbs\.db)|\.(png|jpe?g|gif|svg|bmp|tiff?|mp4|avi|pdf|docx?|md|html?|py|ipynb|m|c|cc|cpp|h|hpp|rs|js|ts|sh|json|ya?ml|toml|xml|pyc)$/i;
const CLOUDS = /\.(ply|pcd)$/i;
const TIMES = /(times?|stamps?)\b[^/]*$/i;
const RELATIONS = /(relation|constraint|loop|closure|edges)[^/]*$/i;
const GRAPHS = /\.g2o$/i;
/** How far the norm of a rounded quaternion may be from 1. */
const NORM_TOLERANCE = 1e-2;
const HEAD_BYTES = 4096;
/** A pose as text takes no more. */
const MAX_POSE_BYTES = 2000;

export function isOfNoUse(name: string): boolean {
  return OTHERS.test(name);
}

export function sortOut(files: readonly Part[]): Intake {
  const intake: Intake = { trajectories: [], times: null, relations: null, clouds: [] };
  const poses = new Map<string, Part[]>();
  const single: Part[] = [];
  for (const file of files) {
    const rows = headOf(file);
    if (CLOUDS.test(file.name)) intake.clouds.push(file);
    else if (isRelations(file.name, rows)) intake.relations = file;
    else if (isTimes(file.name, rows)) intake.times = file;
    else if (isOnePose(file, rows)) {
      const folder = folderOf(file.name);
      poses.set(folder, [...(poses.get(folder) ?? []), file]);
    } else single.push(file);
  }
  for (const [folder, parts] of poses) {
    const [first] = parts;
    if (parts.length === 1 && first) single.push(first);
    else {
      parts.sort((a, b) => compareNaturally(a.name, b.name));
      intake.trajectories.push({ name: folder || `${parts.length} poses`, parts });
    }
  }
  // In the order in which they came, as far as they are files of their own.
  single.sort((a, b) => files.indexOf(a) - files.indexOf(b));
  intake.trajectories.push(...single.map((part) => ({ name: part.name, parts: [part] })));
  intake.clouds.sort((a, b) => compareNaturally(a.name, b.name));
  return intake;
}

/** The columns of the first lines that hold something; none of a binary file. */
function headOf({ bytes }: Part): string[][] {
  const head = bytes.subarray(0, HEAD_BYTES);
  if (head.includes(0)) return [];
  const lines = new TextDecoder('latin1').decode(head).split(/\r\n|\r|\n/);
  // The last line may be cut off.
  if (bytes.length > HEAD_BYTES) lines.pop();
  return lines.flatMap((line) => {
    const columns = line
      .replace(/#.*/, '')
      .split(/[\s,;]+/)
      .filter((column) => column !== '');
    return columns.length > 0 ? [columns] : [];
  });
}

function isRelations(name: string, rows: readonly string[][]): boolean {
  if (GRAPHS.test(name) || rows.some(([word]) => /^EDGE/.test(word ?? ''))) return true;
  if (!RELATIONS.test(name) || rows.length === 0) return false;
  return rows.every((row) => row.length === 8 && areNumbers(row)) && !rows.every(endsWithQuaternion);
}

/** A line of a trajectory: time, x y z and a quaternion. A relation has two times, x y z, and roll, pitch and yaw. */
function endsWithQuaternion(row: readonly string[]): boolean {
  return Math.abs(Math.hypot(...row.slice(-4).map(Number)) - 1) < NORM_TOLERANCE;
}

function isTimes(name: string, rows: readonly string[][]): boolean {
  const is_column = rows.length > 0 && rows.every((row) => row.length === 1 && areNumbers(row));
  return is_column && (rows.length > 1 || TIMES.test(name));
}

function isOnePose({ bytes }: Part, rows: readonly string[][]): boolean {
  if (bytes.length > MAX_POSE_BYTES || rows.length < 3 || rows.length > 4) return false;
  return rows.every((row) => row.length === 4 && areNumbers(row));
}

function areNumbers(words: readonly string[]): boolean {
  return words.every((word) => Number.isFinite(Number(word)));
}

function folderOf(name: string): string {
  return name.slice(0, Math.max(name.lastIndexOf('/'), 0));
}
