// @ts-check
/** Made-up files of recordings: the beginnings of images, trajectories, clouds, and what is understood of them. */
import { understand } from '../../npm/recording/understand.js';
import { asciiPly } from './support.mjs';

/** @typedef {Record<string, string | Uint8Array>} Contents */

/** Understands made-up files, of which no more than the asked-for beginnings are read. @param {Contents} contents */
export function understandAll(contents) {
  const bytes = new Map(
    Object.entries(contents).map(([path, content]) => [path, typeof content === 'string' ? encode(content) : content]),
  );
  const files = [...bytes].map(([path, { length }]) => ({ path, size: length }));
  return understand(files, async (path, length) => (bytes.get(path) ?? new Uint8Array()).subarray(0, length));
}

/** @param {string} text */
export function encode(text) {
  return new TextEncoder().encode(text);
}

/** The beginning of a PNG of 640 x 480. @param {number} bits @param {0 | 2 | 3 | 4 | 6} colourType */
export function png(bits, colourType) {
  const head = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, 0x49, 0x48, 0x44, 0x52, 0, 0, 2, 128, 0, 0, 1, 224,
  ];
  return Uint8Array.of(...head, bits, colourType, 0, 0, 0);
}

export const DEPTH8 = png(8, 0);
export const DEPTH16 = png(16, 0);
export const RGB = png(8, 2);
export const PALETTE = png(8, 3);
export const JPEG = Uint8Array.of(0xff, 0xd8, 0xff, 0xe0, 0, 16);
export const PGM = encode('P5\n# made by hand\n640 480\n65535\n');

/** Files `name(i)` of the same content. @param {number[]} numbers @param {(i: number) => string} name @param {string | Uint8Array} content */
export function many(numbers, name, content) {
  return Object.fromEntries(numbers.map((i) => [name(i), content]));
}

/** @param {number} from @param {number} to */
export function count(from, to) {
  return Array.from({ length: to - from + 1 }, (_, i) => from + i);
}

/** @param {import('../../npm/files/recording.js').Recording} recording */
export function pairsOf({ depth_frames }) {
  return depth_frames.map(({ depth, color }) => [depth, color]);
}

/** A NumPy array's header and nothing else. @param {string} shape */
export function npy(shape) {
  const header = `{'descr': '<f8', 'fortran_order': False, 'shape': (${shape}), }`.padEnd(117) + '\n';
  return Uint8Array.of(0x93, ...encode('NUMPY'), 1, 0, 118, 0, ...encode(header));
}

/** @param {number} rows */
export function tum(rows, from = 0) {
  return count(0, rows - 1)
    .map((i) => `${from + i} ${i} 0 0 0 0 0 1\n`)
    .join('');
}

export const MATRIX = '1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n';

/** A cloud in space. */
export const SPACE = asciiPly([
  [1, 2, 0],
  [1, 2, 0.5],
]);
