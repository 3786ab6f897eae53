/**
 * Records of an MCAP file, from their bytes to plain values.
 *
 * Source of the layout: "MCAP Format Specification", version 0.
 */

export const OPCODE = Object.freeze({
  header: 0x01,
  footer: 0x02,
  schema: 0x03,
  channel: 0x04,
  message: 0x05,
  chunk: 0x06,
  messageIndex: 0x07,
  chunkIndex: 0x08,
  statistics: 0x0b,
  dataEnd: 0x0f,
});
/** An opcode and the length of what follows. */
export const RECORD_HEADER_BYTES = 9;
/** Of a message before its data: channel, sequence, two times. */
export const MESSAGE_HEADER_BYTES = 22;
/** Of a chunk before the name of its compression, and between that and its records. */
export const CHUNK_HEADER_BYTES = 32;
export const MAGIC = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);
/** The footer's content, and with its opcode and length and the closing magic. */
export const FOOTER_BYTES = 20;
export const TAIL_BYTES = RECORD_HEADER_BYTES + FOOTER_BYTES + MAGIC.length;

/** name: of the message type */
type Schema = { id: number; name: string };
export type Channel = { id: number; schema: number; topic: string; encoding: string };
/** sizes in bytes; size: unpacked; recordsStart: from the beginning of the record's content */
type ChunkHeader = { size: number; crc: number; compression: string; recordsStart: number; recordsSize: number };
export interface ChunkIndex {
  /** Where the chunk's record begins in the file. */
  start: number;
  /** Of that record. */
  length: number;
  /** Where its message indexes begin; null without. */
  indexStart: number | null;
  indexLength: number;
  /** empty: none */
  compression: string;
}

export function isMcap(bytes: Uint8Array) {
  return MAGIC.every((byte, index) => bytes[index] === byte);
}

/** Little-endian values, one after the other; a RangeError where they reach beyond the end. */
export class Fields {
  #bytes;
  #view;
  place = 0;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  #take(size: number) {
    const start = this.place;
    if (size < 0 || start + size > this.#bytes.length) throw new RangeError('a record ends before its fields do');
    this.place += size;
    return start;
  }

  u16() {
    return this.#view.getUint16(this.#take(2), true);
  }

  u32() {
    return this.#view.getUint32(this.#take(4), true);
  }

  u64() {
    return this.#view.getBigUint64(this.#take(8), true);
  }

  /** An offset or a length: no file has more than 2 ** 53 bytes. */
  size() {
    return Number(this.u64());
  }

  string() {
    const length = this.u32();
    const start = this.#take(length);
    return new TextDecoder().decode(this.#bytes.subarray(start, start + length));
  }

  skip(length: number) {
    this.#take(length);
  }
}

export function readSchema(content: Uint8Array): Schema {
  const fields = new Fields(content);
  return { id: fields.u16(), name: fields.string() };
}

export function readChannel(content: Uint8Array): Channel {
  const fields = new Fields(content);
  return { id: fields.u16(), schema: fields.u16(), topic: fields.string(), encoding: fields.string() };
}

/** @param content or its beginning, as far as the records */
export function readChunkHeader(content: Uint8Array): ChunkHeader {
  const fields = new Fields(content);
  fields.skip(16);
  const [size, crc, compression, recordsSize] = [fields.size(), fields.u32(), fields.string(), fields.size()];
  return { size, crc, compression, recordsStart: fields.place, recordsSize };
}

export function readChunkIndex(content: Uint8Array): ChunkIndex {
  const fields = new Fields(content);
  fields.skip(16);
  const [start, length] = [fields.size(), fields.size()];
  let indexStart: number | null = null;
  for (const end = fields.u32() + fields.place; fields.place < end;) {
    fields.skip(2);
    const place = fields.size();
    indexStart = indexStart === null ? place : Math.min(indexStart, place);
  }
  return { start, length, indexStart, indexLength: fields.size(), compression: fields.string() };
}

/** @returns offset: in the unpacked records */
export function readMessageIndex(content: Uint8Array): {
  channel: number;
  entries: { time: bigint; offset: number }[];
} {
  const fields = new Fields(content);
  const channel = fields.u16();
  const entries = [];
  for (const end = fields.u32() + fields.place; fields.place < end;) {
    entries.push({ time: fields.u64(), offset: fields.size() });
  }
  return { channel, entries };
}

/** Messages of the whole file. */
export function readMessageCount(content: Uint8Array) {
  return new Fields(content).size();
}

/**
 * Records that lie one after the other in memory; it ends where the next one is not whole.
 * @returns start: of the record
 */
export function* recordsIn(bytes: Uint8Array): Generator<{ opcode: number; start: number; content: Uint8Array }> {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  for (let place = 0; place + RECORD_HEADER_BYTES <= bytes.length;) {
    const length = Number(view.getBigUint64(place + 1, true));
    const end = place + RECORD_HEADER_BYTES + length;
    if (end > bytes.length) return;
    if (bytes[place] === 0) throw new RangeError('a record of no kind');
    yield { opcode: view.getUint8(place), start: place, content: bytes.subarray(place + RECORD_HEADER_BYTES, end) };
    place = end;
  }
}
