/** Small helpers for bytes, and in which pieces files are read and unpacked. */

/** So much is unpacked in one go: no more than 16 MB come of it. */
export const PIECE_BYTES = 2 ** 14;
/** So much of a file that is wanted as a whole is read at a time. */
export const PART_BYTES = 2 ** 22;

export function viewOf(bytes: Uint8Array) {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Chunks as one array. */
export function joined(chunks: readonly Uint8Array[]) {
  const bytes = new Uint8Array(chunks.reduce((sum, { length }) => sum + length, 0));
  let filled = 0;
  for (const chunk of chunks) {
    bytes.set(chunk, filled);
    filled += chunk.length;
  }
  return bytes;
}
