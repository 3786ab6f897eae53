/**
 * What files are to a comparison: trajectories, one pose of many, times, relations, or maps. It is told by their names and
 * beginnings.
 */
import { compareNaturally } from '../base/natural_order.js';
import type { Content } from '../files/content.js';
import { isCloudName } from '../files/kinds.js';
import { folderOf } from '../files/names.js';
import { isPoseDocument, posesOfDocument } from './pose_file.js';

/** Columns of the first lines that hold something; none of a binary file. */
type Rows = string[][];

/** Files as a comparison of trajectories takes them. */
export interface Trajectories {
  /** One file each, or the files of a folder with one pose each. */
  trajectories: { name: string; paths: string[] }[];
  /** Times of the poses, for trajectories without. */
  times: string | null;
  /** Known relations between poses. */
  relations: string | null;
  /** Clouds. */
  maps: string[];
  /** What is none of these. */
  skipped: string[];
  /** Why files cannot be read. */
  problems: string[];
}

/** Files that are none of these, by their names: they are not even read. */
const OTHERS =
  /(^|\/)(\.|__MACOSX\/|Thumbs\.db)|\.(png|jpe?g|gif|svg|bmp|tiff?|mp4|avi|pdf|docx?|md|html?|py|ipynb|m|c|cc|cpp|h|hpp|rs|js|ts|sh|json|ya?ml|toml|xml|pyc)$/i;
const TIMES = /(times?|stamps?)\b[^/]*$/i;
const RELATIONS = /(relation|constraint|loop|closure|edges)[^/]*$/i;
const GRAPHS = /\.g2o$/i;
/** How far the norm of a rounded quaternion may be from 1. */
const NORM_TOLERANCE = 1e-2;
const HEAD_BYTES = 4096;
/** A pose as text takes no more. */
const MAX_POSE_BYTES = 2000;

export async function trajectoriesAmong(files: readonly Content[]): Promise<Trajectories> {
  const found: Trajectories = { trajectories: [], times: null, relations: null, maps: [], skipped: [], problems: [] };
  const poses: Map<string, string[]> = new Map();
  const single: string[] = [];
  for (const file of files) {
    const { path } = file;
    let rows: Rows = [];
    try {
      if (isPoseDocument(path) ? !posesOfDocument(await file.read()) : OTHERS.test(path)) {
        found.skipped.push(path);
        continue;
      }
      rows = isPoseDocument(path) ? [] : await headOf(file);
    } catch (error) {
      found.problems.push((error as Error).message);
      continue;
    }
    if (isCloudName(path)) found.maps.push(path);
    else if (isRelations(path, rows)) found.relations = path;
    else if (isTimes(path, rows)) found.times = path;
    else if (isOnePose(file, rows)) poses.set(folderOf(path), [...(poses.get(folderOf(path)) ?? []), path]);
    else single.push(path);
  }
  for (const [folder, paths] of poses) {
    const name = folder || `${paths.length} poses`;
    if (paths.length === 1) single.push(...paths);
    else found.trajectories.push({ name, paths: paths.sort(compareNaturally) });
  }
  // In the order in which they came, as far as they are files of their own.
  const order = files.map(({ path }) => path);
  single.sort((a, b) => order.indexOf(a) - order.indexOf(b));
  found.trajectories.push(...single.map((path) => ({ name: path, paths: [path] })));
  found.maps.sort(compareNaturally);
  return found;
}

async function headOf({ size, readHead }: Content): Promise<Rows> {
  const head = await readHead(HEAD_BYTES);
  if (head.includes(0)) return [];
  const lines = new TextDecoder('latin1').decode(head).split(/\r\n|\r|\n/);
  // The last line may be cut off.
  if (size > HEAD_BYTES) lines.pop();
  return lines.flatMap((line) => {
    const columns = line
      .replace(/#.*/, '')
      .split(/[\s,;]+/)
      .filter((column) => column !== '');
    return columns.length > 0 ? [columns] : [];
  });
}

function isRelations(path: string, rows: Rows) {
  if (GRAPHS.test(path) || rows.some(([word]) => /^EDGE/.test(word ?? ''))) return true;
  if (!RELATIONS.test(path) || rows.length === 0) return false;
  return rows.every((row) => row.length === 8 && areNumbers(row)) && !rows.every(endsWithQuaternion);
}

/** A line of a trajectory: time, x y z and a quaternion. A relation has two times, x y z, and roll, pitch and yaw. */
function endsWithQuaternion(row: string[]) {
  return Math.abs(Math.hypot(...row.slice(-4).map(Number)) - 1) < NORM_TOLERANCE;
}

function isTimes(path: string, rows: Rows) {
  const isColumn = rows.length > 0 && rows.every((row) => row.length === 1 && areNumbers(row));
  return isColumn && (rows.length > 1 || TIMES.test(path));
}

function isOnePose({ size }: Content, rows: Rows) {
  if (size > MAX_POSE_BYTES || rows.length < 3 || rows.length > 4) return false;
  return rows.every((row) => row.length === 4 && areNumbers(row));
}

function areNumbers(words: string[]) {
  return words.every((word) => Number.isFinite(Number(word)));
}
