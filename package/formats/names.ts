/** Which files may have to be converted, by their names: all that has to be known of them where there are none. */
import type { Convert } from './reader.js';

/**
 * Formats that are known by their ending alone, each with the module that makes such a file into what the engine reads,
 * by a function `convert`: a new one takes a line here and that module. It is loaded with the first file of its kind.
 */
export const READERS: Record<string, () => Promise<{ convert: Convert }>> = {
  las: () => import('./las.js'),
  laz: () => import('./las.js'),
  e57: () => import('./packed_clouds.js'),
  obj: () => import('./obj.js'),
};

/** Packed, or of a format that the engine does not read. */
export const FOREIGN = new RegExp(
  `\\.(mat|npy|npz|bin|pcd|xyz|pts|ptx|asc|gz|bz2|zst|zstd|${Object.keys(READERS).join('|')})$`,
  'i',
);
/** Text that may be scans as a program prints them. */
export const SCAN_TEXTS = /\.(ya?ml|json|jsonl|ndjson|txt|log|msg|ubh|dat|2d|hex)$/i;
/** Tables whose columns may be those of points. */
export const SCAN_TABLES = /\.(csv|tsv)$/i;
/** Text that may be points. */
export const POINT_TABLES = /\.(csv|txt|xyz|dat)$/i;
/** Text that may be a depth image. */
export const DEPTH_TABLES = /\.(csv|txt)$/i;

/** Text of any kind: what a shell or an editor of Windows has written may be UTF-16. */
export const TEXTS = /\.(ya?ml|jsonl?|ndjson|txt|log|clf|msg|ubh|dat|2d|hex|csv|tsv|tum|xyz|pts|asc)$/i;

/** Whether anything among these files may have to be converted. */
export function needsConversion(files: readonly { path: string }[]) {
  return files.some(({ path }) => FOREIGN.test(path) || TEXTS.test(path));
}
