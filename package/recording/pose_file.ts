/**
 * Trajectories in structured files, as text that the engine reads: a 4 x 4 matrix a frame in JSON (a list, a list of
 * objects, or an object by the frames' names), nerfstudio's transforms.json, Open3D's PinholeCameraTrajectory, Record3D's
 * metadata, matrices in OpenCV's YAML and XML; tables in other conventions.
 */
import { inverted } from '../base/matrices.js';
import { compareNaturally } from '../base/natural_order.js';
import { inUtf8 } from '../base/utf16.js';
import { readDocument } from './documents.js';
import { posesOfLines, turned } from './pose_lines.js';
import { posesOfTable } from './pose_tables.js';

/** matrix: 16 numbers, row by row */
type NamedMatrix = { name: string; matrix: number[] };

/** Longer ones are annotations or other data: they are read as a whole, and ten thousand matrices fit. */
export const MAX_POSE_DOCUMENT_BYTES = 16 * 2 ** 20;
const STRUCTURED = /\.(json|ya?ml|xml)$/i;
/** Under these names stand poses of the world in the camera, which are to be turned round. */
const INVERSE = /extrinsic|world_?to_?(cam|camera|sensor)|w2c|view_?matrix/i;
/** A list of poses is longer than what a calibration holds. */
const MIN_POSES = 2;

/** Whether poses may lie in a file of this name that are not lines of text. */
export function isPoseDocument(path: string) {
  return STRUCTURED.test(path);
}

/** The poses of a structured file as lines of 16 numbers, or of x y z qw qx qy qz; null where it holds none. */
export function posesOfDocument(bytes: Uint8Array): { text: string; count: number } | null {
  const tree = readDocument(new TextDecoder().decode(bytes));
  if (typeof tree !== 'object' || tree === null) return null;
  const matrices = matricesOf(tree);
  if (matrices.length >= MIN_POSES) {
    const isNamed = new Set(matrices.map(({ name }) => name)).size === matrices.length;
    const ordered = isNamed ? matrices.toSorted((a, b) => compareNaturally(a.name, b.name)) : matrices;
    return { text: lines(ordered.map(({ matrix }) => matrix)), count: matrices.length };
  }
  const rows = quaternionRows(tree) ?? objectRows(tree);
  return rows && { text: lines(rows), count: rows.length };
}

function lines(rows: number[][]) {
  return rows.map((row) => `${row.join(' ')}\n`).join('');
}

/** The line of a structured text with one pose, as those have that are one a frame; null where it is none. */
export function poseOfFrame(text: string) {
  const tree = readDocument(text);
  const [only, ...others] = typeof tree === 'object' && tree !== null ? matricesOf(tree) : [];
  return only && others.length === 0 ? lines([only.matrix]) : null;
}

/** Files with one pose each, joined to one that the engine reads. */
export function joinPoses(files: readonly Uint8Array[]) {
  const texts = files.map((bytes) => new TextDecoder().decode(bytes)).map((text) => poseOfFrame(text) ?? text);
  return new TextEncoder().encode(`${texts.map((text) => text.trim()).join('\n')}\n`);
}

/** The bytes of a trajectory as the engine takes them: those of structured files are rewritten. */
export function trajectoryBytes(path: string, written: Uint8Array) {
  const bytes = inUtf8(written);
  const found = isPoseDocument(path) ? posesOfDocument(bytes) : null;
  if (found) return new TextEncoder().encode(found.text);
  if (/\.traj$/i.test(path)) return ofArKit(bytes) ?? bytes;
  const rewrite = /(^|\/)images\.txt$|\.g2o$/i.test(path)
    ? posesOfLines
    : /\.(csv|tsv|txt)$/i.test(path)
      ? posesOfTable
      : null;
  const lines = rewrite?.(new TextDecoder().decode(bytes)) ?? null;
  return lines === null ? bytes : new TextEncoder().encode(lines);
}

/**
 * ARKitScenes' `.traj` as TUM's lines: time, the rotation as axis times angle, the translation, of the world in the
 * camera. Null where
 * its numbers are quaternions.
 */
function ofArKit(bytes: Uint8Array) {
  const rows = new TextDecoder()
    .decode(bytes)
    .trim()
    .split(/\r?\n/)
    .map((line) => line.trim().split(/\s+/).map(Number));
  const isUnit = (row: number[]) =>
    [1, 3].some((start) => Math.abs(Math.hypot(...row.slice(start, start + 4)) - 1) < 0.01);
  if (!rows.every((row) => row.length === 7 && row.every(Number.isFinite)) || rows.every(isUnit)) return null;
  const lines = rows.map(([time = 0, a = 0, b = 0, c = 0, ...translation]) => {
    const angle = Math.hypot(a, b, c);
    const half = angle > 0 ? Math.sin(angle / 2) / angle : 0.5;
    // Of the inverse rotation.
    const [w, x, y, z] = [Math.cos(angle / 2), -a * half, -b * half, -c * half];
    const position = turned([w, x, y, z], translation).map((value) => -value);
    return `${[time, ...position, x, y, z, w].join(' ')}\n`;
  });
  return new TextEncoder().encode(lines.join(''));
}

/** All poses, each with what names it: the frame's file, the key, or its place in the list. */
function matricesOf(tree: object): NamedMatrix[] {
  const found: NamedMatrix[] = [];
  const visit = (value: unknown, name: string, isInverse: boolean) => {
    const matrix = matrixOf(value) ?? matrixOfFields(value);
    if (matrix) {
      found.push({ name, matrix: isInverse ? inverted(matrix) : matrix });
      return;
    }
    if (typeof value !== 'object' || value === null) return;
    const file = fileOf(value);
    for (const [key, inner] of Object.entries(value))
      visit(inner, file ?? `${name}/${key}`, isInverse || INVERSE.test(key));
  };
  visit(tree, '', false);
  return found;
}

/** The name of the image that an entry is about. */
function fileOf(value: object) {
  const entry = Object.entries(value).find(([key]) =>
    /^(file_?path|file_?name|image(_?name|_?path)?|name|frame(_?id)?)$/i.test(key),
  );
  const name = entry?.[1];
  return typeof name === 'string' || typeof name === 'number' ? `${name}` : null;
}

/** The 16 numbers of a pose, row by row, in whatever lists they lie; null where it is none. */
function matrixOf(value: unknown): number[] | null {
  const list = typeof value === 'object' && value !== null && 'data' in value ? value.data : value;
  if (!Array.isArray(list) || (list.length !== 16 && list.length !== 12 && list.length !== 4 && list.length !== 3))
    return null;
  const rows = list.length < 12 && list.every((row) => Array.isArray(row) && row.length === 4);
  const flat = rows ? list.flat() : list;
  if (flat.length < 12 || !flat.every((number) => typeof number === 'number')) return null;
  const full = flat.length === 12 ? [...flat, 0, 0, 0, 1] : flat;
  const isLast = (last: number[]) => last.every((number, index) => Math.abs(number - (index === 3 ? 1 : 0)) < 1e-6);
  if (isLast(full.slice(12)) && isRotation(full)) return [...full.slice(0, 12), 0, 0, 0, 1];
  const turned = full.map((_, index) => full[(index % 4) * 4 + Math.floor(index / 4)] ?? 0);
  return isLast(turned.slice(12)) && isRotation(turned) ? [...turned.slice(0, 12), 0, 0, 0, 1] : null;
}

/**
 * The pose whose numbers are fields of their own: `t_00` to `t_23` as Polycam writes its rows, or BOP's rotation and translation (mm) of
 * the world in the camera. Null: it has none.
 */
function matrixOfFields(value: unknown): number[] | null {
  if (typeof value !== 'object' || value === null) return null;
  const fields = value as Record<string, unknown>;
  const rows = [0, 1, 2].map((row) => [0, 1, 2, 3].map((column) => fields[`t_${row}${column}`]));
  const named = matrixOf(rows.flat());
  const { cam_R_w2c: rotation, cam_t_w2c: translation } = fields;
  if (named || !isOf(9, rotation) || !isOf(3, translation)) return named;
  const inCamera = matrixOf(translation.map((t, row) => [...rotation.slice(3 * row, 3 * row + 3), t / 1000]));
  return inCamera && inverted(inCamera);
}

function isOf(count: number, list: unknown): list is number[] {
  return Array.isArray(list) && list.length === count && list.every((number) => typeof number === 'number');
}

/** Whether the rows have length 1, about: a camera's matrix has not. */
function isRotation(matrix: number[]) {
  return [0, 4, 8].every((row) => Math.abs(Math.hypot(...matrix.slice(row, row + 3)) - 1) < 0.01);
}

/**
 * A list of seven numbers each, as Record3D and others write them: qx qy qz qw x y z, or x y z qx qy qz qw. What has
 * length 1 in all of them is the quaternion.
 * @returns x y z qw qx qy qz
 */
function quaternionRows(tree: unknown): number[][] | null {
  if (typeof tree !== 'object' || tree === null) return null;
  if (Array.isArray(tree) && tree.length >= MIN_POSES && tree.every((row) => isOf(7, row))) {
    const starts = [0, 3].filter((start) =>
      tree.every((row) => Math.abs(Math.hypot(...row.slice(start, start + 4)) - 1) < 0.01),
    );
    const [start] = starts;
    if (start === undefined) return null;
    return tree.map((row) => {
      const [x = 0, y = 0, z = 0, w = 1] = row.slice(start, start + 4);
      const position = start === 0 ? row.slice(4) : row.slice(0, 3);
      return [...position, w, x, y, z];
    });
  }
  for (const inner of Object.values(tree)) {
    const rows = quaternionRows(inner);
    if (rows) return rows;
  }
  return null;
}

const POSITION = /^(position|translation|pos|location|t)$/i;
const ORIENTATION = /^(orientation|rotation|quaternion|quat|rot|q)$/i;
const TIME = /^(timestamp|time|stamp|t)$/i;

/**
 * A list of objects with a position `{x, y, z}` and an orientation `{x, y, z, w}` each, as in ROS's messages and in engines for games.
 * @returns x y z qw qx qy qz, or t x y z qx qy qz qw where all have a time
 */
function objectRows(tree: object): number[][] | null {
  const rows: { time: number | null; position: number[]; orientation: number[] }[] = [];
  const visit = (value: unknown, time: number | null) => {
    if (typeof value !== 'object' || value === null) return;
    const entries = Object.entries(value);
    const numbers = (name: RegExp, axes: string) => {
      const inner = entries.find(([key]) => name.test(key))?.[1] as Record<string, unknown> | null | undefined;
      const found = typeof inner === 'object' && inner !== null ? [...axes].map((axis) => inner[axis]) : [];
      return found.length > 0 && found.every((number) => typeof number === 'number') ? found : null;
    };
    const own = entries.find(([key, number]) => TIME.test(key) && typeof number === 'number')?.[1] ?? time;
    const [position, orientation] = [numbers(POSITION, 'xyz'), numbers(ORIENTATION, 'xyzw')];
    if (position && orientation) rows.push({ time: own, position, orientation });
    else entries.forEach(([, inner]) => visit(inner, own));
  };
  visit(tree, null);
  if (rows.length < MIN_POSES) return null;
  const areTimed = rows.every(({ time }) => time !== null);
  return rows.map(({ time, position, orientation: [x = 0, y = 0, z = 0, w = 1] }) =>
    areTimed ? [time ?? 0, ...position, x, y, z, w] : [...position, w, x, y, z],
  );
}
