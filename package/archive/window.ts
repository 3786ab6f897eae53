/** Bytes that lie elsewhere: in a File of the page, on the disk. */
export type ByteSource = { size: number; read(start: number, end: number): Promise<Uint8Array> };

/** A part of a file that moves along with what is read: small pieces that lie near each other are read in one go. */
export class Window {
  #source;
  #size;
  #end;
  #start = 0;
  #bytes: Uint8Array = new Uint8Array();

  /**
   * @param size bytes that are read at a time
   * @param end of what may be read
   */
  constructor(source: ByteSource, size: number, end: number = source.size) {
    this.#source = source;
    this.#size = size;
    this.#end = end;
  }

  /** So many bytes, or as many as there are. */
  async read(start: number, length: number) {
    if (start < this.#start || start + length > this.#start + this.#bytes.length) {
      this.#bytes = await this.#source.read(start, Math.min(this.#end, start + Math.max(length, this.#size)));
      this.#start = start;
    }
    return this.#bytes.subarray(start - this.#start, start - this.#start + length);
  }
}
