// @ts-check
/** Small helpers for bytes, and in which pieces files are read and unpacked. */

/** So much is unpacked in one go: no more than 16 MB come of it. */
export const PIECE_BYTES = 2 ** 14;
/** So much of a file that is wanted as a whole is read at a time. */
export const PART_BYTES = 2 ** 22;

/** @param {Uint8Array} bytes */
export function viewOf(bytes) {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Chunks as one array. @param {readonly Uint8Array[]} chunks */
export function joined(chunks) {
  const bytes = new Uint8Array(chunks.reduce((sum, { length }) => sum + length, 0));
  let filled = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, filled);
    filled += chunk.length;
  }
  return bytes;
}
