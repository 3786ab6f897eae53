// @ts-check
/**
 * What files are to a comparison: trajectories, one pose of many, times, relations, or maps. It is told by their names and
 * beginnings.
 */
import { compareNaturally } from '../natural_order.js';
import { isCloudName } from './kinds.js';
import { folderOf } from './names.js';
import { isPoseDocument, posesOfDocument } from './pose_file.js';

/** @typedef {import('./contents.js').Content} Content */
/** @typedef {import('../recording_reader.js').Trajectories} Trajectories */
/** @typedef {string[][]} Rows columns of the first lines that hold something; none of a binary file */

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

/** @param {readonly Content[]} files @returns {Promise<Trajectories>} */
export async function trajectoriesAmong(files) {
  /** @type {Trajectories} */
  const found = { trajectories: [], times: null, relations: null, maps: [], skipped: [], problems: [] };
  /** @type {Map<string, string[]>} */
  const poses = new Map();
  /** @type {string[]} */
  const single = [];
  for (const file of files) {
    const { path } = file;
    /** @type {Rows} */
    let rows = [];
    try {
      if (isPoseDocument(path) ? !posesOfDocument(await file.read()) : OTHERS.test(path)) {
        found.skipped.push(path);
        continue;
      }
      rows = isPoseDocument(path) ? [] : await headOf(file);
    } catch (error) {
      found.problems.push(/** @type {Error} */ (error).message);
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

/** @param {Content} file @returns {Promise<Rows>} */
async function headOf({ size, readHead }) {
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

/** @param {string} path @param {Rows} rows */
function isRelations(path, rows) {
  if (GRAPHS.test(path) || rows.some(([word]) => /^EDGE/.test(word ?? ''))) return true;
  if (!RELATIONS.test(path) || rows.length === 0) return false;
  return rows.every((row) => row.length === 8 && areNumbers(row)) && !rows.every(endsWithQuaternion);
}

/** A line of a trajectory: time, x y z and a quaternion. A relation has two times, x y z, and roll, pitch and yaw. @param {string[]} row */
function endsWithQuaternion(row) {
  return Math.abs(Math.hypot(...row.slice(-4).map(Number)) - 1) < NORM_TOLERANCE;
}

/** @param {string} path @param {Rows} rows */
function isTimes(path, rows) {
  const isColumn = rows.length > 0 && rows.every((row) => row.length === 1 && areNumbers(row));
  return isColumn && (rows.length > 1 || TIMES.test(path));
}

/** @param {Content} file @param {Rows} rows */
function isOnePose({ size }, rows) {
  if (size > MAX_POSE_BYTES || rows.length < 3 || rows.length > 4) return false;
  return rows.every((row) => row.length === 4 && areNumbers(row));
}

/** @param {string[]} words */
function areNumbers(words) {
  return words.every((word) => Number.isFinite(Number(word)));
}
