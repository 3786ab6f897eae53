/**
 * Values of a serialised ROS message, one after the other. What lies beyond the message's end is never read: the error
 * names the field.
 *
 * Source of the layout: OMG, DDS-XTypes 1.3, 7.4.3 (XCDR1 and plain XCDR2); OMG, DDSI-RTPS 2.5, 10.2 (encapsulation). ROS 1
 * writes the same values, low byte first, without alignment and without an encapsulation (roscpp's serialization.h).
 */

/** Second byte of the header that a message of ROS 1 is given here; DDS has no such encapsulation. */
const ROS1 = 0x52;

/** By the second byte of a message: whether the low byte comes first, and what values are aligned to at most (bytes). */
const ENCAPSULATIONS = {
  0: { littleEndian: false, widest: 8 },
  1: { littleEndian: true, widest: 8 },
  6: { littleEndian: false, widest: 4 },
  7: { littleEndian: true, widest: 4 },
  [ROS1]: { littleEndian: true, widest: 1 },
} as Record<number, { littleEndian: boolean; widest: number }>;
const HEADER_BYTES = 4;
const DAMAGED = 'It was damaged or cut off when it was recorded; leave it out';

/** What is wrong with a message; where it lies is for others to say. */
export class MessageError extends Error {
  /**
   * @param problem a sentence without its full stop
   * @param remedy likewise
   */
  constructor(
    readonly problem: string,
    readonly remedy: string = DAMAGED,
  ) {
    super(`${problem}. ${remedy}.`);
  }
}

/** A message of ROS 1 with a header that tells a {@link CdrReader} what it is. */
export function encapsulateRos1(message: Uint8Array) {
  const bytes = new Uint8Array(HEADER_BYTES + message.length);
  bytes[1] = ROS1;
  bytes.set(message, HEADER_BYTES);
  return bytes;
}

export class CdrReader {
  #view;
  #bytes;
  #place = HEADER_BYTES;
  #littleEndian;
  #widest;

  /** @param bytes a message with its encapsulation header, or its beginning */
  constructor(bytes: Uint8Array) {
    if (bytes.length < HEADER_BYTES)
      throw new MessageError(`The message has ${bytes.length} bytes, fewer than its header`);
    const kind = ENCAPSULATIONS[bytes[1] ?? 0];
    if (bytes[0] !== 0 || !kind) {
      const [first, second] = [bytes[0], bytes[1]].map((byte) => (byte ?? 0).toString(16).padStart(2, '0'));
      throw new MessageError(
        `The message begins with ${first} ${second}, which is not the plain CDR that ROS 2 writes`,
        'Record it with the default middleware',
      );
    }
    this.#bytes = bytes;
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.#littleEndian = kind.littleEndian;
    this.#widest = kind.widest;
  }

  /** Where the next value begins, before alignment. */
  get place() {
    return this.#place;
  }

  /** Whether ROS 1 wrote it. */
  get isRos1() {
    return this.#widest === 1;
  }

  get littleEndian() {
    return this.#littleEndian;
  }

  u8(field: string) {
    return this.#view.getUint8(this.#take(1, 1, field));
  }

  u32(field: string) {
    return this.#view.getUint32(this.#take(4, 4, field), this.#littleEndian);
  }

  i32(field: string) {
    return this.#view.getInt32(this.#take(4, 4, field), this.#littleEndian);
  }

  f32(field: string) {
    return this.#view.getFloat32(this.#take(4, 4, field), this.#littleEndian);
  }

  f64(field: string) {
    return this.#view.getFloat64(this.#take(8, 8, field), this.#littleEndian);
  }

  string(field: string) {
    const length = this.u32(field);
    const start = this.#take(length, 1, field);
    const text = this.#bytes.subarray(start, start + length);
    // In ROS 2 the terminating zero counts.
    return new TextDecoder().decode(text.at(-1) === 0 ? text.subarray(0, -1) : text);
  }

  /** A sequence of bytes, not copied. */
  bytes(field: string) {
    const length = this.u32(field);
    const start = this.#take(length, 1, field);
    return this.#bytes.subarray(start, start + length);
  }

  f64s(count: number, field: string) {
    const start = this.#take(8 * count, 8, field);
    return Array.from({ length: count }, (_, index) => this.#view.getFloat64(start + 8 * index, this.#littleEndian));
  }

  /** A sequence of f64. */
  f64Sequence(field: string) {
    const count = this.u32(field);
    return count === 0 ? [] : this.f64s(count, field);
  }

  /** A sequence of f32. */
  f32Sequence(field: string) {
    const count = this.u32(field);
    const values = new Float32Array(this.#fits(4 * count, field) ? count : 0);
    const start = this.#take(4 * count, 4, field);
    for (let index = 0; index < count; index += 1) {
      values[index] = this.#view.getFloat32(start + 4 * index, this.#littleEndian);
    }
    return values;
  }

  /**
   * As many values as a sequence announces, each of at least so many bytes: a count that cannot be is refused before
   * anything is made of it.
   */
  count(leastBytes: number, field: string) {
    const count = this.u32(field);
    this.#fits(count * leastBytes, field);
    return count;
  }

  #fits(length: number, field: string) {
    if (this.#place + length > this.#bytes.length) this.#refuse(length, field);
    return true;
  }

  #take(length: number, alignment: number, field: string) {
    // Alignment counts from behind the encapsulation header.
    const start = this.#place + ((HEADER_BYTES - this.#place) & (Math.min(alignment, this.#widest) - 1));
    if (start + length > this.#bytes.length) this.#refuse(length, field);
    this.#place = start + length;
    return start;
  }

  #refuse(length: number, field: string): never {
    throw new MessageError(
      `The message is shorter than its header says: its ${field} of ${length} bytes begins at byte ${this.#place}, and it has ${this.#bytes.length}`,
    );
  }
}
