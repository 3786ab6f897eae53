/** Messages of ROS 2 as they are serialised: CDR of the first version, little endian (OMG, "Common Object Request Broker Architecture", 15.3). */

/** Before the values: the representation. */
const HEADER = [0, 1, 0, 0];

export class CdrWriter {
  #bytes = Uint8Array.of(...HEADER, ...new Uint8Array(252));
  #length = HEADER.length;

  u8(...values: number[]): this {
    for (const value of values) this.#view(1).setUint8(this.#take(1), value);
    return this;
  }

  u32(...values: number[]): this {
    for (const value of values) this.#view(4).setUint32(this.#take(4), value, true);
    return this;
  }

  f32(...values: number[]): this {
    for (const value of values) this.#view(4).setFloat32(this.#take(4), value, true);
    return this;
  }

  f64(...values: number[]): this {
    for (const value of values) this.#view(8).setFloat64(this.#take(8), value, true);
    return this;
  }

  string(text: string): this {
    return this.bytes(new TextEncoder().encode(`${text}\0`));
  }

  /** With their number before them. */
  bytes(bytes: Uint8Array): this {
    this.u32(bytes.length);
    this.#room(bytes.length);
    this.#bytes.set(bytes, this.#length);
    this.#length += bytes.length;
    return this;
  }

  /** @param time ns */
  time(time: bigint): this {
    return this.u32(Number(time / 1_000_000_000n), Number(time % 1_000_000_000n));
  }

  done(): Uint8Array {
    return this.#bytes.slice(0, this.#length);
  }

  /** Of the bytes, with room for a value of this size where that is aligned. */
  #view(size: number) {
    this.#room(2 * size);
    return new DataView(this.#bytes.buffer);
  }

  /** Where a value of this size comes. */
  #take(size: number) {
    const start = HEADER.length + Math.ceil((this.#length - HEADER.length) / size) * size;
    this.#length = start + size;
    return start;
  }

  #room(size: number) {
    if (this.#length + size <= this.#bytes.length) return;
    const larger = new Uint8Array(Math.max(2 * this.#bytes.length, this.#length + size));
    larger.set(this.#bytes);
    this.#bytes = larger;
  }
}
