/**
 * An MCAP file as a bag. Where it has a summary, that and the indexes behind its chunks are read, a small part of the
 * file; where it has none, or none that holds, the file is walked record by record from its beginning.
 *
 * Why not the reader that MCAP's authors give: it cannot read a single message by where it lies, and a chunk that is
 * damaged ends its reading; here it is named and passed over.
 */
import { type ByteSource, Window } from '../archive/window.js';
import { crc32 } from '../base/crc32.js';
import { fileError, lost, type Note } from '../base/errors.js';
import type { Container, OnWalk, StoredTopic } from './container.js';
import { Chunks, CUT_OFF } from './mcap_chunks.js';
import {
  type Channel,
  type ChunkIndex,
  FOOTER_BYTES,
  isMcap,
  MAGIC,
  MESSAGE_HEADER_BYTES,
  OPCODE,
  readChannel,
  readChunkIndex,
  readMessageCount,
  readMessageIndex,
  readSchema,
  RECORD_HEADER_BYTES,
  recordsIn,
  TAIL_BYTES,
} from './mcap_records.js';
import { MessageIndex } from './message_index.js';

/** Where a message lies: the number of its chunk, and the offset in that; or this, and the offset in the file. */
const OUTSIDE = -1;
/** So many small parts of the file are read at a time. */
const READ_AT_ONCE = 32;
/** When the file is walked, so much of it is read at a time. */
const WINDOW_BYTES = 2 ** 16;
/** So many damaged chunks are named one by one. */
const MOST_NAMED = 5;
/** Number of messages that a bag may have beyond one for each of its bytes. */
const FREE_MESSAGES = 2 ** 21;

/**
 * @param name for messages
 * @returns rejects with a ScanstitchError
 */
export async function openMcap(name: string, source: ByteSource, onWalk: OnWalk): Promise<Container> {
  const file = new McapFile(name, source);
  if (!isMcap(await source.read(0, MAGIC.length))) throw fileError(name, 'This is not an MCAP file', CUT_OFF);
  if (!(await file.readIndexes())) await file.walk(onWalk);
  return {
    topics: file.topics(),
    notes: file.notes,
    read: (place) => file.read(place, Infinity),
    readHead: (place, length) => file.read(place, length),
  };
}

class McapFile {
  notes: Note[] = [];
  #name;
  #source;
  #chunks;
  #types: Map<number, string> = new Map();
  #channels: Map<number, Channel> = new Map();
  #messages: Map<number, MessageIndex> = new Map();
  #numMessages = 0;
  /** Chunks that cannot be read. */
  #numDamaged = 0;
  /** Messages that belong to no topic. */
  #numStrays = 0;
  /** It does not end as MCAP files do. */
  #isCut = false;

  constructor(name: string, source: ByteSource) {
    this.#name = name;
    this.#source = source;
    this.#chunks = new Chunks(name, source);
  }

  /** Channels of one name, type and encoding are one topic. */
  topics(): StoredTopic[] {
    const topics: Map<string, StoredTopic> = new Map();
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
    const indexes: ChunkIndex[] = [];
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
    try {
      // Regions that lie over one another would be read again and again.
      const total = indexes.reduce((sum, { indexLength }) => sum + indexLength, 0);
      if (total > this.#source.size) throw new RangeError('more indexes than there is room for');
      for (const index of indexes) this.#chunks.add(index);
      for (let first = 0; first < indexes.length; first += READ_AT_ONCE) {
        const batch = indexes.slice(first, first + READ_AT_ONCE);
        const regions = await Promise.all(
          batch.map((index) => this.#chunks.region(index.indexStart ?? 0, index.indexLength)),
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
  async walk(onWalk: OnWalk) {
    const { size } = this.#source;
    const end = await this.#walkRecords(MAGIC.length, size, OUTSIDE, 0, (place) => onWalk(place, size));
    if (end < size) {
      this.notes.push(
        lost(this.#name, `cut off or damaged at byte ${end} of ${size}; the messages before that are used`),
      );
    } else if (this.#isCut) {
      this.notes.push({ file: this.#name, reason: 'cut off behind its last message; all messages are used' });
    }
    if (this.#numDamaged > MOST_NAMED) {
      this.notes.push(lost(this.#name, `left out: ${this.#numDamaged - MOST_NAMED} more chunks`));
    }
    if (this.#numStrays > 0) {
      this.notes.push(lost(this.#name, `${this.#numStrays} messages belong to no topic and are left out`));
    }
  }

  /**
   * Takes the records of a part of the file, a window at a time, as far as they are whole.
   * @param chunk that they belong to
   * @param origin from where the places of its messages count
   * @returns where the last one ends, or `end`
   */
  async #walkRecords(
    start: number,
    end: number,
    chunk: number,
    origin: number,
    onRecord: (place: number) => void = () => {},
  ): Promise<number> {
    const window = new Window(this.#source, WINDOW_BYTES, end);
    for (let place = start; ;) {
      const head = await window.read(place, RECORD_HEADER_BYTES);
      if (head.length < RECORD_HEADER_BYTES) return place;
      const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
      const opcode = view.getUint8(0);
      const length = RECORD_HEADER_BYTES + Number(view.getBigUint64(1, true));
      if (chunk === OUTSIDE && (opcode === OPCODE.dataEnd || opcode === OPCODE.footer)) return end;
      if (place + length > end || opcode === 0) return place;
      if (opcode === OPCODE.message) {
        const fields = await window.read(place + RECORD_HEADER_BYTES, Math.min(MESSAGE_HEADER_BYTES, length));
        this.#takeMessage(fields, chunk, place - origin);
      } else if (opcode === OPCODE.chunk && chunk === OUTSIDE) await this.#walkChunk(place, length);
      else if (opcode === OPCODE.schema || opcode === OPCODE.channel) {
        this.#takeDefinition(opcode, (await window.read(place, length)).subarray(RECORD_HEADER_BYTES));
      }
      place += length;
      onRecord(place);
    }
  }

  /** The data of a message, or its beginning. */
  async read([chunk, offset]: [number, number], length: number) {
    const start = chunk === OUTSIDE ? offset : await this.#chunks.placeInFile(chunk, offset, length < Infinity);
    if (start === null) {
      const records = await this.#chunks.records(chunk);
      return this.#dataOf(records.subarray(offset), offset).subarray(0, length);
    }
    const least = RECORD_HEADER_BYTES + MESSAGE_HEADER_BYTES;
    // In one go: in a browser each read of a file costs a millisecond.
    const wanted = length === Infinity ? least : least + length;
    const bytes = await this.#source.read(start, Math.min(this.#source.size, start + wanted));
    if (bytes.length < least)
      throw this.#chunks.broken(`Byte ${start} of the file is needed, but the file ends before it`);
    const size = RECORD_HEADER_BYTES + Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(1, true));
    if (start + size > this.#source.size) {
      throw this.#chunks.broken(`The message at byte ${start} claims to be larger than the file`);
    }
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

  /** @param reason null: nothing to tell */
  #forget(error: unknown, reason: string | null) {
    if (error instanceof Error && !(error instanceof RangeError) && error.name !== 'ScanstitchError') throw error;
    if (reason !== null) this.notes.push({ file: this.#name, reason });
    this.#chunks.clear();
    this.#messages.clear();
    this.#numMessages = 0;
    return false;
  }

  #takeDefinition(opcode: number, content: Uint8Array) {
    if (opcode === OPCODE.schema) {
      const { id, name } = readSchema(content);
      this.#types.set(id, name);
    } else if (opcode === OPCODE.channel) {
      const channel = readChannel(content);
      this.#channels.set(channel.id, channel);
    }
  }

  #takeIndexes(chunk: number, region: Uint8Array) {
    for (const { opcode, content } of recordsIn(region)) {
      if (opcode !== OPCODE.messageIndex) throw new RangeError('no message index');
      const { channel, entries } = readMessageIndex(content);
      if (entries.length === 0) continue;
      const messages = this.#messagesOf(channel);
      if (!messages) throw new RangeError('an unknown channel');
      for (const { time, offset } of entries) this.#push(messages, time, chunk, offset);
    }
  }

  /** @param content or its beginning */
  #takeMessage(content: Uint8Array, chunk: number, offset: number) {
    const view = new DataView(content.buffer, content.byteOffset, content.byteLength);
    const isWhole = content.length >= MESSAGE_HEADER_BYTES;
    const messages = isWhole ? this.#messagesOf(view.getUint16(0, true)) : null;
    if (messages) this.#push(messages, view.getBigInt64(6, true), chunk, offset);
    else this.#numStrays += 1;
  }

  #push(messages: MessageIndex, time: bigint, chunk: number, offset: number) {
    const most = FREE_MESSAGES + this.#source.size;
    this.#numMessages += 1;
    if (this.#numMessages > most) {
      throw this.#chunks.broken(`It has more than ${most} messages, too many for its size`);
    }
    messages.push(time, chunk, offset);
  }

  #messagesOf(channel: number): MessageIndex | null {
    if (!this.#channels.has(channel)) return null;
    const known = this.#messages.get(channel) ?? new MessageIndex();
    this.#messages.set(channel, known);
    return known;
  }

  async #walkChunk(start: number, length: number) {
    const chunk = this.#chunks.add({ start, length, compression: 'unknown' });
    try {
      const stored = await this.#chunks.storedRecords(chunk);
      if (stored) {
        const end = await this.#walkRecords(stored.start, stored.end, chunk, stored.start);
        if (end < stored.end) throw this.#chunks.broken(`The chunk at byte ${start} is damaged at byte ${end}`);
        return;
      }
      for (const { opcode, content, start: offset } of recordsIn(await this.#chunks.recordsForIndex(chunk))) {
        if (opcode === OPCODE.message) this.#takeMessage(content, chunk, offset);
        else this.#takeDefinition(opcode, content);
      }
    } catch (error) {
      const { problem } = error as { problem?: string };
      if (problem === undefined && !(error instanceof RangeError)) throw error;
      this.#numDamaged += 1;
      if (this.#numDamaged > MOST_NAMED) return;
      this.notes.push(lost(this.#name, `left out: ${problem ?? 'a chunk that is damaged'}`));
    }
  }

  /**
   * @param record of a message and what comes after
   * @param place for messages
   */
  #dataOf(record: Uint8Array, place: number) {
    if (record[0] !== OPCODE.message || record.length < RECORD_HEADER_BYTES) {
      throw this.#chunks.broken(`There is no message at byte ${place}, where its index has one`);
    }
    const length = Number(new DataView(record.buffer, record.byteOffset).getBigUint64(1, true));
    const content = record.subarray(RECORD_HEADER_BYTES, RECORD_HEADER_BYTES + length);
    if (content.length < length) throw this.#chunks.broken(`The message at byte ${place} is cut off`);
    return content.subarray(MESSAGE_HEADER_BYTES);
  }
}
