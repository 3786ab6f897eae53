/**
 * Large buffers that go round: made in one thread, read in another, and back. Left to the garbage collector, those of a
 * recording that is read quickly come to hundreds of megabytes, for a browser keeps what was posted to a thread until it
 * collects the message.
 */

/** Spare buffers of one size that are kept at most: as many frames as are on their way. */
const MOST_SPARE = 8;
/** By their size, for every size that was asked for. */
const spare: Map<number, Uint8Array<ArrayBuffer>[]> = new Map();
/** So many sizes are known: a recording has two or three. */
const MOST_SIZES = 4;

/** So many bytes, which may hold anything: of a buffer that was given back, where there is one. */
export function takeBytes(size: number) {
  const known = spare.get(size);
  if (!known) {
    for (const oldest of spare.keys()) if (spare.size >= MOST_SIZES) spare.delete(oldest);
    spare.set(size, []);
  }
  return known?.pop() ?? new Uint8Array(size);
}

/** Bytes that nobody reads any more. Those that `takeBytes` did not make are left alone. */
export function giveBack(bytes: Uint8Array) {
  const known = spare.get(bytes.byteLength);
  if (!known || known.length >= MOST_SPARE || bytes.byteLength !== bytes.buffer.byteLength) return;
  known.push(bytes as Uint8Array<ArrayBuffer>);
}

/** These bytes in a buffer of their own, which can be given to another thread. */
export function owned(bytes: Uint8Array) {
  return bytes.byteLength === bytes.buffer.byteLength ? bytes : new Uint8Array(bytes);
}
