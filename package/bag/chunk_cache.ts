/** Unpacked chunks of a bag, of which the last used ones are kept: consecutive frames lie in the same chunk. */

/** Largest total size of the kept chunks, unless only the last {@link KEPT_CHUNKS} are kept (bytes). */
const KEPT_BYTES = 2 ** 24;
/** Number of chunks that are kept even if they exceed `KEPT_BYTES`. */
const KEPT_CHUNKS = 4;
/** Largest total size of those (bytes). A larger chunk that is not compressed is never read as a whole. */
export const MAX_KEPT_BYTES = 2 ** 26;

export class ChunkCache {
  /** The last one used last. */
  #unpacked: Map<number, Promise<Uint8Array>> = new Map();
  #sizes: Map<number, number> = new Map();
  #unpack;

  constructor(unpack: (chunk: number) => Promise<Uint8Array>) {
    this.#unpack = unpack;
  }

  has(chunk: number) {
    return this.#unpacked.has(chunk);
  }

  /** What a chunk holds. */
  async get(chunk: number) {
    const reading = this.#unpacked.get(chunk) ?? this.#unpack(chunk);
    this.#unpacked.delete(chunk);
    this.#unpacked.set(chunk, reading);
    const bytes = await reading;
    this.#sizes.set(chunk, bytes.length);
    let total = 0;
    for (const [place, kept] of [...this.#unpacked.keys()].reverse().entries()) {
      total += this.#sizes.get(kept) ?? 0;
      if (total > (place < KEPT_CHUNKS ? MAX_KEPT_BYTES : KEPT_BYTES) && kept !== chunk) this.#unpacked.delete(kept);
    }
    return bytes;
  }
}
