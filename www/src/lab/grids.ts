/** Grids of poses: which unknowns, how far, how finely, and in which parts workers do them. */
import { fromVectors, inverted, multiplied, rotationVector } from './poses.js';
import type { Grid, GridPart, Pose } from './protocol.js';

export const isTurn = (axis: number, is_planar: boolean): boolean => axis < (is_planar ? 1 : 3);

/** Offsets of a pose from another in all unknowns, as the engine counts them: turns first (rad), then metres. */
export function offsetsOf(T_center: Pose, T: Pose, is_planar: boolean): number[] {
  const turn = rotationVector(multiplied(T, inverted(T_center)));
  const moved = [3, 7, 11].map((i) => (T[i] ?? 0) - (T_center[i] ?? 0));
  return is_planar ? [turn[2], moved[0] ?? 0, moved[1] ?? 0] : [...turn, ...moved];
}

/** The pose at offsets in some of the unknowns. */
export function poseAtOffsets({ T_center, axes }: Grid, offsets: readonly number[], is_planar: boolean): number[] {
  const all = new Array<number>(is_planar ? 3 : 6).fill(0);
  axes.forEach((axis, i) => {
    all[axis] = offsets[i] ?? 0;
  });
  const [turn, shift]: [[number, number, number], number[]] = is_planar
    ? [
        [0, 0, all[0] ?? 0],
        [all[1] ?? 0, all[2] ?? 0, 0],
      ]
    : [[all[0] ?? 0, all[1] ?? 0, all[2] ?? 0], all.slice(3)];
  const T = multiplied(fromVectors(turn, [0, 0, 0]), T_center);
  // The source turns about its own origin.
  for (const row of [0, 1, 2]) T[4 * row + 3] = (T_center[4 * row + 3] ?? 0) + (shift[row] ?? 0);
  return T;
}

/** Offsets of a node, counted along rows, row by row, layer by layer. */
export function offsetsOfNode({ half_widths, size }: Grid, node: readonly number[]): number[] {
  return size.map((count, i) => (2 * ((node[i] ?? 0) / Math.max(count - 1, 1)) - 1) * (half_widths[i] ?? 0));
}

/** The node nearest to offsets; null outside. */
export function nodeAt({ half_widths, size }: Grid, offsets: readonly number[]): number[] | null {
  const node = size.map((count, i) => {
    const share = ((offsets[i] ?? 0) / (half_widths[i] || 1) + 1) / 2;
    return Math.round(share * (count - 1));
  });
  return node.every((place, i) => place >= 0 && place < (size[i] ?? 0)) ? node : null;
}

export const numRows = ({ size }: Grid): number => size.slice(1).reduce((product, count) => product * count, 1);

/** All rows in about `about` parts, those of the centre first. */
export function parts(grid: Grid, about: number): GridPart[] {
  const rows = numRows(grid);
  const length = Math.max(Math.ceil(rows / about), 1);
  const all: GridPart[] = [];
  for (let from = 0; from < rows; from += length) all.push({ ...grid, rows: [from, Math.min(from + length, rows)] });
  const away = ({ rows: [from, to] }: GridPart): number => Math.abs((from + to) / 2 - rows / 2);
  return all.sort((a, b) => away(a) - away(b));
}

/**
 * The finest grid, up to `most` nodes an axis, that takes no longer than `milliseconds` where a node takes `ofNode`. The number
 * of nodes is odd: one of them stands in the middle.
 */
export function finest(most: readonly number[], ofNode: number, milliseconds: number): number[] {
  const wanted = most.reduce((product, count) => product * count, 1) * ofNode;
  const factor = Math.min((milliseconds / Math.max(wanted, 1e-9)) ** (1 / most.length), 1);
  return most
    .map((count) => Math.max(2 * Math.floor((count * factor) / 2) + 1, 5))
    .map((n, i) => Math.min(n, most[i] ?? n));
}
