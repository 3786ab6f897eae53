/** Trajectories in lines that are none of the engine's forms, as lines of `t x y z qx qy qz qw` or `number x y theta`. */
import { compareNaturally } from '../base/natural_order.js';

/** How far the norm of a rounded quaternion may be from 1. */
const NORM_TOLERANCE = 1e-2;

/**
 * The poses of COLMAP's `images.txt`, where the world stands in the camera, in the order of the images' names, under the numbers in these;
 * or of the vertices of a pose graph (g2o). Null where a text is neither.
 */
export function posesOfLines(text: string): string | null {
  const rows = text
    .split(/\r?\n/)
    .filter((line) => line.trim() !== '' && !line.startsWith('#'))
    .map((line) => line.trim().split(/\s+/));
  return ofColmap(rows) ?? ofGraph(rows);
}

/** `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, before a line of points each. */
function ofColmap(rows: string[][]): string | null {
  const isImage = (row: string[]) =>
    row.length >= 10 && row.slice(0, 9).every(isNumber) && !isNumber(row[9] ?? '') && isUnit(row.slice(1, 5));
  if (!rows[0] || !isImage(rows[0])) return null;
  const images = rows
    .filter(isImage)
    .map((row) => ({ name: row.slice(9).join(' '), numbers: row.slice(0, 8).map(Number) }));
  images.sort((a, b) => compareNaturally(a.name, b.name));
  const numbers = images.map(({ name }) => /(\d+)\D*$/.exec(name)?.[1]);
  const areDistinct = numbers.every((number) => number !== undefined) && new Set(numbers).size === numbers.length;
  const lines = images.map(({ numbers: [, w = 1, x = 0, y = 0, z = 0, ...translation] }, at) => {
    const position = turned([w, -x, -y, -z], translation).map((value) => -value);
    return [areDistinct ? Number(numbers[at]) : at, ...position, -x, -y, -z, w].join(' ');
  });
  return `${lines.join('\n')}\n`;
}

function ofGraph(rows: string[][]): string | null {
  const poses = rows.filter(([word, ...numbers]) => {
    const count = word === 'VERTEX_SE3:QUAT' ? 8 : word === 'VERTEX_SE2' ? 4 : 0;
    return count > 0 && numbers.length === count && numbers.every(isNumber);
  });
  if (poses.length === 0 || new Set(poses.map(([word]) => word)).size > 1) return null;
  return `${poses.map(([, ...numbers]) => numbers.join(' ')).join('\n')}\n`;
}

function isNumber(word: string) {
  return word !== '' && Number.isFinite(Number(word));
}

function isUnit(words: string[]) {
  return Math.abs(Math.hypot(...words.map(Number)) - 1) < NORM_TOLERANCE;
}

/** A vector turned by the quaternion w x y z. */
export function turned([w = 1, x = 0, y = 0, z = 0]: readonly number[], [vx = 0, vy = 0, vz = 0]: readonly number[]) {
  // v + 2 w (u x v) + 2 u x (u x v)
  const [px, py, pz] = [y * vz - z * vy, z * vx - x * vz, x * vy - y * vx];
  return [
    vx + 2 * (w * px + y * pz - z * py),
    vy + 2 * (w * py + z * px - x * pz),
    vz + 2 * (w * pz + x * py - y * px),
  ];
}
