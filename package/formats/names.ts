/** Which files may have to be converted, by their names: all that has to be known of them where there are none. */

/** Packed, or of a format that the engine does not read. */
export const FOREIGN = /\.(mat|npy|npz|bin|las|laz|pcd|xyz|pts|ptx|asc|gz|bz2|zst|zstd)$/i;
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
