/**
 * Clouds of KITTI and its like: 32-bit floats without a header, x y z and reflectance a point. nuScenes adds the ring of the
 * laser. Their ground truth is the left camera's.
 *
 * Source of the layout: A. Geiger et al., "Vision meets Robotics: The KITTI Dataset", IJRR 2013, and the devkit of its odometry
 * benchmark (poses.txt: 3 x 4 matrices T_world_camera, a row each; calib.txt: Tr is T_camera_velodyne).
 */
import { inverted, multiplied } from '../base/matrices.js';
import { baseOf, commonFolder, depthOf, folderOf } from '../files/names.js';
import { plyFile } from './ply.js';

/** Properties of a point, most common first. */
const LAYOUTS: readonly (readonly string[])[] = [
  ['x', 'y', 'z', 'intensity'],
  ['x', 'y', 'z', 'intensity', 'ring'],
  ['x', 'y', 'z', 'intensity', 'ring', 'time'],
];
const POSITION: readonly string[] = ['x', 'y', 'z'];
/** How far apart numbers are that are not one coordinate of neighbouring points. */
const OTHER_LAGS: readonly number[] = [1, 2, 4, 5, 7, 8];
/** No coordinate is larger, in millimetres or of a map. */
const MAX_COORDINATE = 1e7;
/** Reflectance is 0 to 1, or 0 to 255. */
const MAX_INTENSITY = 255;
/** A list of a million times is shorter than that (bytes). */
const MAX_TIMES_BYTES = 64 * 2 ** 20;
/** A cloud of fewer points is none. */
const MIN_POINTS = 16;

/** names: of the properties of a point; bytes: of each of them */
type Layout = { names: readonly string[]; bytes: 4 | 8 };

/**
 * The layout of a cloud, by its first points; null where it is none.
 * @param size of the file (bytes)
 */
function layoutOf(head: Uint8Array, size: number): Layout | null {
  const whole = (bytes: number) => head.slice(0, head.length - (head.length % bytes)).buffer;
  const floats = new Float32Array(whole(4));
  const single = LAYOUTS.find((names) => isLayout(floats, names.length, size / 4));
  if (single) return { names: single, bytes: 4 };
  const doubles = new Float64Array(whole(8));
  // As NumPy writes an array of its own floats.
  const [names = []] = LAYOUTS;
  if (isLayout(doubles, names.length, size / 8)) return { names, bytes: 8 };
  if (isPositions(floats, size / 4)) return { names: POSITION, bytes: 4 };
  return isPositions(doubles, size / 8) ? { names: POSITION, bytes: 8 } : null;
}

/** Whether these are points without a brightness: each third number differs little from the one before, as points of one surface follow one another. */
function isPositions(values: Float32Array | Float64Array, count: number) {
  const difference = (lag: number) => {
    const differences = Array.from(values.subarray(lag), (value, index) => Math.abs(value - (values[index] ?? 0)));
    return differences.filter(Number.isFinite).reduce((sum, value) => sum + value, 0);
  };
  const others = OTHER_LAGS.map(difference);
  return isLayout(values, POSITION.length, count) && 2 * difference(POSITION.length) < Math.min(...others);
}

/** @param count of the numbers in the whole file */
function isLayout(values: Float32Array | Float64Array, columns: number, count: number) {
  const rows = Math.floor(values.length / columns);
  if (count % columns !== 0 || rows < MIN_POINTS) return false;
  let inSight = 0;
  for (let row = 0; row < rows; row += 1) {
    const [x = 0, y = 0, z = 0, intensity = 0, ring = 0] = values.subarray(row * columns, (row + 1) * columns);
    // No return, as drivers of spinning lidars write it.
    if ([x, y, z].every(Number.isNaN)) continue;
    const isPoint = Math.max(Math.abs(x), Math.abs(y), Math.abs(z)) < MAX_COORDINATE;
    if (!isPoint || !(intensity >= 0 && intensity <= MAX_INTENSITY) || !Number.isInteger(ring)) return false;
    // Bytes that are no floats mostly make numbers next to zero.
    if (Math.hypot(x, y, z) > 0.01) inSight += 1;
  }
  return 2 * inSight > rows;
}

/**
 * A cloud as PLY; null where the file is none.
 * @param bytes or its beginning
 * @param size of the file (bytes)
 */
export function kittiCloud(bytes: Uint8Array, size: number) {
  const layout = layoutOf(bytes.subarray(0, 8192), size);
  if (!layout) return null;
  const { names, bytes: each } = layout;
  return plyFile(bytes, size / (each * names.length), names, each === 8 ? 'double' : 'float');
}

/** Of 3 x 4 numbers, row by row: a motion. */
type Matrix = readonly number[];

/** The matrix `Tr` of a calib.txt; null where there is none. */
export function cameraFromVelodyne(text: string): Matrix | null {
  const [, list = ''] = text.match(/^\s*Tr(?:_velo_(?:to_)?cam)?:\s*(.*)$/m) ?? [];
  return matrixOf(list);
}

function matrixOf(line: string): Matrix | null {
  const numbers = line
    .trim()
    .split(/[\s,]+/)
    .map(Number);
  return numbers.length === 12 && numbers.every(Number.isFinite) ? numbers : null;
}

/** Poses, a line each; null where a line is none. */
export function posesOf(text: string): Matrix[] | null {
  const poses = text
    .split('\n')
    .filter((line) => line.trim() !== '')
    .map(matrixOf);
  return poses.length > 0 && poses.every((pose) => pose !== null) ? poses : null;
}

/**
 * The laser's poses, in the frame of the first cloud's world: T_velodyne_camera * T_world_camera * T_camera_velodyne.
 * @param cameras T_world_camera of the frames
 * @param Tr T_camera_velodyne
 */
export function velodynePoses(cameras: readonly Matrix[], Tr: Matrix) {
  const whole = (matrix: Matrix) => [...matrix, 0, 0, 0, 1];
  const [there, back] = [whole(Tr), inverted(whole(Tr))];
  const poses = cameras.map((camera) => multiplied(multiplied(back, whole(camera)), there).slice(0, 12));
  return poses.map((pose) => `${pose.join(' ')}\n`).join('');
}

/**
 * Which file is the calibration of clouds in a folder, and which their poses: the nearest of those so called.
 * @param folder of the clouds
 */
export function besideClouds<T extends { path: string }>(files: readonly T[], folder: string) {
  const nearest = (name: RegExp) => {
    const closeness = ({ path }: T) => depthOf(commonFolder(folderOf(path), folder));
    return files.filter(({ path }) => name.test(baseOf(path))).sort((a, b) => closeness(b) - closeness(a))[0];
  };
  // The benchmark names the poses after the sequence, poses/00.txt, whose clouds are in sequences/00/velodyne.
  const sequence = folder.split('/').findLast((part) => /^\d\d$/.test(part));
  const ofSequence = sequence === undefined ? undefined : nearest(new RegExp(`^${sequence}\\.txt$`));
  return { calibration: nearest(/^calib\w*\.txt$/i), poses: ofSequence ?? nearest(/^(gt_?)?poses?\w*\.txt$/i) };
}

/** The frame that a cloud's name counts. */
export function frameOf(path: string) {
  const number = baseOf(path).match(/(\d+)\D*$/)?.[1];
  return number === undefined ? null : Number(number);
}

/**
 * Times of frames as KITTI lists them, a line each: seconds (times.txt), or dates (timestamps.txt). Null where a line
 * is neither,
 * or where they do not ascend.
 */
function timesOf(text: string) {
  const times = text
    .split('\n')
    .map((line) => line.trim())
    .filter((line) => line !== '')
    .map((line) => (Number.isFinite(Number(line)) ? Number(line) : secondsOf(line)));
  const ascend = times.every((time, index) => index === 0 || time > (times[index - 1] ?? time));
  return times.length > 0 && ascend && times.every(Number.isFinite) ? times : null;
}

/** `2011-09-26 13:02:25.964389445` as seconds since 1970. */
function secondsOf(line: string) {
  const [, minute = '', seconds = ''] = line.match(/^(\d{4}-\d\d-\d\d[ T]\d\d:\d\d):(\d\d(?:\.\d*)?)Z?$/) ?? [];
  return Date.parse(`${minute.replace(' ', 'T')}:00Z`) / 1000 + Number(seconds);
}

/**
 * The times of clouds, by the numbers in their names, and the file that they stand in: the nearest of those called so. Null
 * where there is none, or where it has no time for one of them.
 * @param clouds of one folder
 */
export async function timesOfClouds(
  clouds: readonly { path: string }[],
  files: readonly { path: string; size: number }[],
  read: (path: string, length: number) => Promise<Uint8Array | null>,
) {
  const folder = folderOf(clouds[0]?.path ?? '');
  const lies = (path: string) => folderOf(path) === folder || folderOf(path) === folderOf(folder);
  const [file] = files
    .filter(({ path, size }) => /^times(tamps)?\.txt$/i.test(baseOf(path)) && lies(path) && size < MAX_TIMES_BYTES)
    .sort((a, b) => depthOf(folderOf(b.path)) - depthOf(folderOf(a.path)));
  const bytes = file && (await read(file.path, file.size));
  const listed = bytes && timesOf(new TextDecoder().decode(bytes));
  if (!file || !listed) return null;
  const isWhole = listed.length === clouds.length;
  const times = clouds.map(({ path }, index) => listed[isWhole ? index : (frameOf(path) ?? -1)]);
  return times.every((time) => time !== undefined) ? { path: file.path, times } : null;
}
