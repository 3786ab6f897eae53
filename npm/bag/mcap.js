// @ts-check
/**
 * An MCAP file as a bag. Where it has a summary, that and the indexes behind its chunks are read, a small part of the
 * file; where it has none, or none that holds, the file is walked record by record from its beginning.
 *
 * Why not the reader that MCAP's authors give: it cannot read a single message by where it lies, and a chunk that is
 * damaged ends its reading; here it is named and passed over.
 */
import { crc32 } from '../crc32.js';
import { fileError, lost } from '../errors.js';
import { MAX_UNPACKED_BYTES, unpackLz4, unpackZstd } from './decompress.js';
import {
  CHUNK_HEADER_BYTES,
  FOOTER_BYTES,
  isMcap,
  MAGIC,
  MESSAGE_HEADER_BYTES,
  OPCODE,
  readChannel,
  readChunkHeader,
  readChunkIndex,
  readMessageCount,
  readMessageIndex,
  readSchema,
  recordsIn,
  RECORD_HEADER_BYTES,
  TAIL_BYTES,
} from './mcap_records.js';
import { MessageIndex } from './message_index.js';

/** @typedef {import('../archive.js').ByteSource} ByteSource */
/** @typedef {import('../recording.js').Note} Note */
/** @typedef {import('./mcap_records.js').Channel} Channel */
/** @typedef {import('./mcap_records.js').ChunkIndex} ChunkIndex */
/** @typedef {import('./open.js').StoredTopic} StoredTopic */
/** @typedef {{ start: number, length: number, compression: string }} Chunk where its record lies in the file */

/** Where a message lies: the number of its chunk, and the offset in that; or this, and the offset in the file. */
const OUTSIDE = -1;
/** Unpacked chunks that are kept, together: frames that follow one another lie in the same ones. Most chunks are small; ... */
const KEPT_BYTES = 2 ** 24;
/** ... of larger ones, so many are kept, ... */
const KEPT_CHUNKS = 4;
/** ... where they take no more than this. */
const MOST_KEPT_BYTES = 2 ** 26;
/** So many small parts of the file are read at a time. */
const READ_AT_ONCE = 32;
/** When the file is walked, so much of it is read at a time. */
const WINDOW_BYTES = 2 ** 16;
const CUT_OFF = 'Copy the bag again, or mend it with the mcap tool (mcap recover)';

/**
 * @param {string} name for messages
 * @param {ByteSource} source
 * @returns {Promise<import('./open.js').Container>} rejects with a ScanstitchError
 */
export async function openMcap(name, source) {
  const file = new McapFile(name, source);
  if (!isMcap(await source.read(0, MAGIC.length))) throw fileError(name, 'This is no MCAP file', CUT_OFF);
  if (!(await file.readIndexes())) await file.walk();
  return {
    topics: file.topics(),
    notes: file.notes,
    read: (place) => file.read(place, Infinity),
    readHead: (place, length) => file.read(place, length),
  };
}

class McapFile {
  /** @type {Note[]} */
  notes = [];
  #name;
  #source;
  /** @type {Chunk[]} */
  #chunks = [];
  /** Unpacked, the last one used last. @type {Map<number, Promise<Uint8Array>>} */
  #unpacked = new Map();
  #unpackedBytes = new Map();
  /** @type {Map<number, string>} */
  #types = new Map();
  /** @type {Map<number, Channel>} */
  #channels = new Map();
  /** @type {Map<number, MessageIndex>} */
  #messages = new Map();
  /** It does not end as MCAP files do. */
  #isCut = false;

  /** @param {string} name @param {ByteSource} source */
  constructor(name, source) {
    this.#name = name;
    this.#source = source;
  }

  /** Channels of one name, type and encoding are one topic. @returns {StoredTopic[]} */
  topics() {
    /** @type {Map<string, StoredTopic>} */
    const topics = new Map();
    for (const { id, topic, schema, encoding } of this.#channels.values()) {
      const type = this.#types.get(schema) ?? '';
      const key = JSON.stringify([topic, type, encoding]);
      const known = topics.get(key);
      const messages = this.#messages.get(id) ?? new MessageIndex();
      if (!known) topics.set(key, { name: topic, type, format: encoding, messages });
      else for (let i = 0; i < messages.length; i += 1) known.messages.push(messages.time(i), ...messages.place(i));
    }
    for (const { messages } of topics.values()) messages.sort();
    return [...topics.values()];
  }

  /** Whether the summary told where every message lies. */
  async readIndexes() {
    const summary = await this.#readSummary();
    if (!summary) return false;
    /** @type {ChunkIndex[]} */
    const indexes = [];
    let count = null;
    try {
      for (const { opcode, content } of recordsIn(summary)) {
        this.#takeDefinition(opcode, content);
        if (opcode === OPCODE.chunkIndex) indexes.push(readChunkIndex(content));
        if (opcode === OPCODE.statistics) count = readMessageCount(content);
      }
    } catch (error) {
      return this.#forget(error, 'its summary is damaged, so it was read from its beginning');
    }
    // Messages may lie outside chunks, or chunks may have no index behind them.
    if (indexes.length === 0 ? count !== 0 : indexes.some(({ indexStart }) => indexStart === null)) {
      return this.#forget(null, null);
    }
    this.#chunks = indexes;
    try {
      for (let first = 0; first < indexes.length; first += READ_AT_ONCE) {
        const batch = indexes.slice(first, first + READ_AT_ONCE);
        const regions = await Promise.all(
          batch.map((index) => this.#readRegion(index.indexStart ?? 0, index.indexLength)),
        );
        regions.forEach((region, index) => this.#takeIndexes(first + index, region));
      }
    } catch (error) {
      return this.#forget(error, 'its indexes are damaged, so it was read from its beginning');
    }
    const found = [...this.#messages.values()].reduce((sum, { length }) => sum + length, 0);
    const isWhole = count === null || found === count;
    return (
      isWhole || this.#forget(null, `its indexes name ${found} of ${count} messages, so it was read from its beginning`)
    );
  }

  /** Reads record after record from the beginning. */
  async walk() {
    const { size } = this.#source;
    /** @type {Uint8Array} */
    let window = new Uint8Array();
    let windowStart = 0;
    const peek = async (/** @type {number} */ start, /** @type {number} */ length) => {
      if (start < windowStart || start + length > windowStart + window.length) {
        window = await this.#source.read(start, Math.min(size, start + Math.max(length, WINDOW_BYTES)));
        windowStart = start;
      }
      return window.subarray(start - windowStart, Math.min(window.length, start - windowStart + length));
    };
    let strays = 0;
    let place = MAGIC.length;
    for (;;) {
      const head = await peek(place, RECORD_HEADER_BYTES);
      if (head.length < RECORD_HEADER_BYTES) break;
      const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
      const opcode = view.getUint8(0);
      const length = RECORD_HEADER_BYTES + Number(view.getBigUint64(1, true));
      if (opcode === OPCODE.dataEnd || opcode === OPCODE.footer) {
        place = size;
        break;
      }
      if (place + length > size) break;
      if (opcode === OPCODE.message) {
        const fields = await peek(place + RECORD_HEADER_BYTES, Math.min(MESSAGE_HEADER_BYTES, length));
        if (!this.#takeMessage(fields, OUTSIDE, place)) strays += 1;
      } else if (opcode === OPCODE.chunk) strays += await this.#walkChunk(place, length);
      else if (opcode === OPCODE.schema || opcode === OPCODE.channel) {
        this.#takeDefinition(opcode, (await peek(place, length)).subarray(RECORD_HEADER_BYTES));
      }
      place += length;
    }
    if (place < size) {
      const reason = `cut off or damaged at byte ${place} of ${size}; the messages before that are used`;
      this.notes.push(lost(this.#name, reason));
    } else if (this.#isCut) {
      this.notes.push({ file: this.#name, reason: 'cut off behind its last message; all messages are used' });
    }
    if (strays > 0) this.notes.push(lost(this.#name, `${strays} messages belong to no topic and are left out`));
  }

  /**
   * The data of a message, or its beginning.
   * @param {[number, number]} place
   * @param {number} length
   */
  async read([chunk, offset], length) {
    const known = this.#chunks[chunk];
    if (chunk !== OUTSIDE && (length === Infinity || known?.compression !== '' || this.#unpacked.has(chunk))) {
      const records = await this.#records(chunk);
      return this.#dataOf(records.subarray(offset), offset).subarray(0, length);
    }
    const recordsStart = known ? known.start + RECORD_HEADER_BYTES + CHUNK_HEADER_BYTES + 8 : 0;
    const start = recordsStart + offset;
    const least = RECORD_HEADER_BYTES + MESSAGE_HEADER_BYTES;
    // In one go: in a browser each read of a file costs a millisecond.
    const wanted = length === Infinity ? least : least + length;
    const bytes = await this.#source.read(start, Math.min(this.#source.size, start + wanted));
    if (bytes.length < least) throw this.#broken(`What should lie at byte ${start} lies behind its end`);
    const size = RECORD_HEADER_BYTES + Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(1, true));
    if (size > this.#source.size) throw this.#broken(`The message at byte ${start} is said to be larger than the file`);
    if (length === Infinity) return this.#dataOf(await this.#source.read(start, start + size), start);
    return bytes.subarray(least, Math.max(least, size));
  }

  /** Between the last data and the footer; null without. */
  async #readSummary() {
    const { size } = this.#source;
    const tail = await this.#source.read(Math.max(0, size - TAIL_BYTES), size);
    const view = new DataView(tail.buffer, tail.byteOffset, tail.byteLength);
    const isWhole = tail.length === TAIL_BYTES && tail[0] === OPCODE.footer && isMcap(tail.subarray(-MAGIC.length));
    this.#isCut = !isWhole;
    if (!isWhole) return null;
    const start = Number(view.getBigUint64(RECORD_HEADER_BYTES, true));
    if (start === 0) return null;
    const end = size - TAIL_BYTES;
    const crc = view.getUint32(RECORD_HEADER_BYTES + FOOTER_BYTES - 4, true);
    // The checksum covers the summary and the footer up to the checksum itself.
    const bytes = start < end ? await this.#source.read(start, size - MAGIC.length - 4) : new Uint8Array();
    if (bytes.length === 0 || (crc !== 0 && crc32(bytes) !== crc)) {
      this.notes.push({ file: this.#name, reason: 'its summary is damaged, so it was read from its beginning' });
      return null;
    }
    return bytes.subarray(0, end - start);
  }

  /** @param {unknown} error @param {string | null} reason null: nothing to tell */
  #forget(error, reason) {
    if (error instanceof Error && !(error instanceof RangeError) && error.name !== 'ScanstitchError') throw error;
    if (reason !== null) this.notes.push({ file: this.#name, reason });
    this.#chunks = [];
    this.#messages.clear();
    return false;
  }

  /** @param {number} opcode @param {Uint8Array} content */
  #takeDefinition(opcode, content) {
    if (opcode === OPCODE.schema) {
      const { id, name } = readSchema(content);
      this.#types.set(id, name);
    } else if (opcode === OPCODE.channel) {
      const channel = readChannel(content);
      this.#channels.set(channel.id, channel);
    }
  }

  /** @param {number} chunk @param {Uint8Array} region */
  #takeIndexes(chunk, region) {
    for (const { opcode, content } of recordsIn(region)) {
      if (opcode !== OPCODE.messageIndex) throw new RangeError('no message index');
      const { channel, entries } = readMessageIndex(content);
      if (entries.length === 0) continue;
      const messages = this.#messagesOf(channel);
      if (!messages) throw new RangeError('an unknown channel');
      for (const { time, offset } of entries) messages.push(time, chunk, offset);
    }
  }

  /** Whether its channel is known. @param {Uint8Array} content or its beginning @param {number} chunk @param {number} offset */
  #takeMessage(content, chunk, offset) {
    if (content.length < MESSAGE_HEADER_BYTES) return false;
    const view = new DataView(content.buffer, content.byteOffset, content.byteLength);
    const messages = this.#messagesOf(view.getUint16(0, true));
    messages?.push(view.getBigInt64(6, true), chunk, offset);
    return messages !== null;
  }

  /** @param {number} channel @returns {MessageIndex | null} */
  #messagesOf(channel) {
    if (!this.#channels.has(channel)) return null;
    const known = this.#messages.get(channel) ?? new MessageIndex();
    this.#messages.set(channel, known);
    return known;
  }

  /** How many of its messages belong to no topic. @param {number} start @param {number} length */
  async #walkChunk(start, length) {
    const chunk = this.#chunks.length;
    this.#chunks.push({ start, length, compression: 'unknown' });
    let strays = 0;
    try {
      for (const { opcode, content, start: offset } of recordsIn(await this.#records(chunk))) {
        this.#takeDefinition(opcode, content);
        if (opcode === OPCODE.message && !this.#takeMessage(content, chunk, offset)) strays += 1;
      }
    } catch (error) {
      const { problem } = /** @type {{ problem?: string }} */ (error);
      if (problem === undefined && !(error instanceof RangeError)) throw error;
      this.notes.push(lost(this.#name, `left out: ${problem ?? 'a chunk that is damaged'}`));
    }
    return strays;
  }

  /** The records of a chunk, unpacked and checked. @param {number} chunk */
  async #records(chunk) {
    const reading = this.#unpacked.get(chunk) ?? this.#unpack(chunk);
    this.#unpacked.delete(chunk);
    this.#unpacked.set(chunk, reading);
    const records = await reading;
    this.#unpackedBytes.set(chunk, records.length);
    let total = 0;
    for (const [place, kept] of [...this.#unpacked.keys()].reverse().entries()) {
      total += this.#unpackedBytes.get(kept) ?? 0;
      if (total > (place < KEPT_CHUNKS ? MOST_KEPT_BYTES : KEPT_BYTES) && kept !== chunk) this.#unpacked.delete(kept);
    }
    return records;
  }

  /** @param {number} chunk */
  async #unpack(chunk) {
    const { start, length } = this.#chunks[chunk] ?? { start: 0, length: 0 };
    const record = await this.#readRegion(start, length);
    if (record[0] !== OPCODE.chunk) throw this.#broken(`There is no chunk at byte ${start}, where its index has one`);
    const content = record.subarray(RECORD_HEADER_BYTES);
    let header;
    try {
      header = readChunkHeader(content);
    } catch {
      throw this.#broken(`The chunk at byte ${start} ends within its header`);
    }
    const { size, crc, compression, recordsStart, recordsSize } = header;
    const packed = content.subarray(recordsStart, recordsStart + recordsSize);
    if (packed.length < recordsSize) throw this.#broken(`The chunk at byte ${start} is cut off`);
    if (size > MAX_UNPACKED_BYTES) throw this.#broken(`The chunk at byte ${start} would unpack to ${size} bytes`);
    const records = await this.#decompress(start, compression, packed, size);
    if (crc !== 0 && crc32(records) !== crc) {
      throw this.#broken(`The chunk at byte ${start} has another checksum than the one written in it`);
    }
    return records;
  }

  /** @param {number} start @param {string} compression @param {Uint8Array} packed @param {number} size */
  async #decompress(start, compression, packed, size) {
    let records = packed;
    try {
      if (compression === 'zstd') records = await unpackZstd(packed, size);
      else if (compression === 'lz4') records = unpackLz4(packed, size);
      else if (compression !== '') {
        const remedy = 'Convert the bag to zstd with the mcap tool (mcap compress)';
        throw fileError(
          this.#name,
          `The chunk at byte ${start} is packed with ${compression}, which is not read`,
          remedy,
        );
      }
    } catch (error) {
      if (/** @type {Error} */ (error).name === 'ScanstitchError') throw error;
      throw this.#broken(`The chunk at byte ${start} cannot be unpacked (${/** @type {Error} */ (error).message})`);
    }
    if (records.length !== size) {
      throw this.#broken(`The chunk at byte ${start} unpacks to ${records.length} bytes, not the ${size} it says`);
    }
    return records;
  }

  /** @param {Uint8Array} record of a message and what comes after @param {number} place for messages */
  #dataOf(record, place) {
    if (record[0] !== OPCODE.message || record.length < RECORD_HEADER_BYTES) {
      throw this.#broken(`There is no message at byte ${place}, where its index has one`);
    }
    const length = Number(new DataView(record.buffer, record.byteOffset).getBigUint64(1, true));
    const content = record.subarray(RECORD_HEADER_BYTES, RECORD_HEADER_BYTES + length);
    if (content.length < length) throw this.#broken(`The message at byte ${place} is cut off`);
    return content.subarray(MESSAGE_HEADER_BYTES);
  }

  /** @param {number} start @param {number} length */
  async #readRegion(start, length) {
    const bytes =
      start + length <= this.#source.size ? await this.#source.read(start, start + length) : new Uint8Array();
    if (bytes.length < length) throw this.#broken(`What should lie at byte ${start} lies behind its end`);
    return bytes;
  }

  /** @param {string} problem */
  #broken(problem) {
    return fileError(this.#name, problem, CUT_OFF);
  }
}
