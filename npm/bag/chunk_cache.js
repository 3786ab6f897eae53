// @ts-check
/** Unpacked chunks of a bag: frames that follow one another lie in the same ones. */

/** Those that are kept, together; most chunks are small. ... */
const KEPT_BYTES = 2 ** 24;
/** ... Of larger ones, so many are kept, ... */
const KEPT_CHUNKS = 4;
/** ... where they take no more than this. */
const MAX_KEPT_BYTES = 2 ** 26;

export class ChunkCache {
  /** The last one used last. @type {Map<number, Promise<Uint8Array>>} */
  #unpacked = new Map();
  /** @type {Map<number, number>} */
  #sizes = new Map();
  #unpack;

  /** @param {(chunk: number) => Promise<Uint8Array>} unpack */
  constructor(unpack) {
    this.#unpack = unpack;
  }

  /** @param {number} chunk */
  has(chunk) {
    return this.#unpacked.has(chunk);
  }

  /** What a chunk holds. @param {number} chunk */
  async get(chunk) {
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
