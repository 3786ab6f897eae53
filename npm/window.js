// @ts-check
/** @typedef {import('./archive.js').ByteSource} ByteSource */

/** A part of a file that moves along with what is read: small pieces that lie near each other are read in one go. */
export class Window {
  #source;
  #size;
  #end;
  #start = 0;
  /** @type {Uint8Array} */
  #bytes = new Uint8Array();

  /** @param {ByteSource} source @param {number} size bytes that are read at a time @param {number} [end] of what may be read */
  constructor(source, size, end = source.size) {
    this.#source = source;
    this.#size = size;
    this.#end = end;
  }

  /** So many bytes, or as many as there are. @param {number} start @param {number} length */
  async read(start, length) {
    if (start < this.#start || start + length > this.#start + this.#bytes.length) {
      this.#bytes = await this.#source.read(start, Math.min(this.#end, start + Math.max(length, this.#size)));
      this.#start = start;
    }
    return this.#bytes.subarray(start - this.#start, start - this.#start + length);
  }
}
