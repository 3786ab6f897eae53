/**
 * A bag of ROS 1, version 2.0. Where the recorder closed it, its index section and the indexes behind its chunks are read,
 * a small part of the file; otherwise, or where they do not hold, the file is walked record by record from its beginning.
 */
import { unpackBzip2 } from '../archive/bzip2.js';
import { mustBePlausible, unpackLz4 } from '../archive/decompress.js';
import type { ByteSource } from '../archive/window.js';
import { fileError, lost, type Note } from '../base/errors.js';
import { ChunkCache } from './chunk_cache.js';
import type { Container, OnWalk, StoredTopic } from './container.js';
import { MessageIndex } from './message_index.js';
import {
  type Connection,
  MAGIC_2_0,
  MAX_HEADER_BYTES,
  OP,
  placeOf,
  readConnection,
  readIndex,
  readMessage,
  readRecordHead,
  type RecordHead,
  recordsIn,
  textOf,
  u32,
} from './ros1_records.js';

/** its data in the file; size: unpacked */
type Chunk = { start: number; length: number; size: number; compression: string };

/** Most record heads fit into so many bytes. */
const HEAD_BYTES = 512;
/** So many small parts of the file are read at a time. */
const READ_AT_ONCE = 32;
const REMEDY = 'Copy the bag again, or repair it (rosbag reindex)';

/**
 * @param name for messages
 * @returns rejects with a ScanstitchError
 */
export async function openRos1(name: string, source: ByteSource, onWalk: OnWalk): Promise<Container> {
  const magic = new TextDecoder('latin1').decode(await source.read(0, Math.min(source.size, MAGIC_2_0.length)));
  if (magic !== MAGIC_2_0) {
    const remedy = 'Convert it with ROS 1: rosbag fix OLD.bag NEW.bag';
    throw fileError(name, `This bag is of the version ${magic.slice(8).trim()}, and 2.0 is read`, remedy);
  }
  const file = new Ros1File(name, source);
  if (!(await file.readIndexes())) await file.walk(onWalk);
  return {
    topics: file.topics(),
    notes: file.notes,
    read: (place) => file.read(place),
    readHead: (place, length) => file.readHead(place, length),
  };
}

class Ros1File {
  notes: Note[] = [];
  #name;
  #source;
  #chunks: Chunk[] = [];
  #records = new ChunkCache((chunk) => this.#unpack(chunk));
  #connections: Map<number, Connection> = new Map();
  #messages: Map<number, MessageIndex> = new Map();

  constructor(name: string, source: ByteSource) {
    this.#name = name;
    this.#source = source;
  }

  /** Connections of one name and type are one topic. */
  topics(): StoredTopic[] {
    const topics: Map<string, StoredTopic> = new Map();
    for (const { id, topic, type } of this.#connections.values()) {
      const key = JSON.stringify([topic, type]);
      const known = topics.get(key) ?? { name: topic, type, format: 'ros1', messages: new MessageIndex() };
      const messages = this.#messages.get(id) ?? new MessageIndex();
      for (let i = 0; i < messages.length; i += 1) known.messages.push(messages.time(i), ...messages.place(i));
      topics.set(key, known);
    }
    for (const { messages } of topics.values()) messages.sort();
    const strays = [...this.#messages].filter(([id]) => !this.#connections.has(id));
    const count = strays.reduce((sum, [, { length }]) => sum + length, 0);
    if (count > 0) this.notes.push(lost(this.#name, `${count} messages belong to no topic and are left out`));
    return [...topics.values()];
  }

  /** Whether the indexes told where every message lies. */
  async readIndexes() {
    try {
      const { fields } = await this.#headAt(MAGIC_2_0.length);
      const start = placeOf(fields, 'index_pos');
      if (start === 0) return this.#forget('its recorder was not closed, so it was read from its beginning');
      const places: number[] = [];
      for (const { op, fields, data } of recordsIn(await this.#readRegion(start, this.#source.size - start))) {
        if (op === OP.connection) this.#define(readConnection(fields, data));
        if (op === OP.chunkInfo) places.push(placeOf(fields, 'chunk_pos'));
      }
      if (places.length !== u32(fields, 'chunk_count')) throw new RangeError('chunks are missing');
      places.sort((a, b) => a - b);
      for (let first = 0; first < places.length; first += READ_AT_ONCE) {
        const batch = places.slice(first, first + READ_AT_ONCE);
        const ends = batch.map((_, index) => places[first + index + 1] ?? start);
        const read = await Promise.all(batch.map((place, index) => this.#readChunk(place, ends[index] ?? start)));
        for (const { chunk, indexes } of read) {
          const number = this.#chunks.push(chunk) - 1;
          for (const { id, entries } of indexes) {
            for (const { time, offset } of entries) this.#messagesOf(id).push(time, number, offset);
          }
        }
      }
      return true;
    } catch (error) {
      if (!isDamage(error)) throw error;
      return this.#forget('its indexes are damaged, so it was read from its beginning');
    }
  }

  /** A chunk, and the indexes between it and the next one. */
  async #readChunk(place: number, end: number) {
    const head = await this.#headAt(place);
    const records = recordsIn(await this.#readRegion(place + head.end, end - place - head.end));
    const indexes = [...records].filter(({ op }) => op === OP.index);
    return { chunk: chunkOf(head, place), indexes: indexes.map(({ fields, data }) => readIndex(fields, data)) };
  }

  /** Reads record after record from the beginning. */
  async walk(onWalk: OnWalk) {
    const { size } = this.#source;
    let place = MAGIC_2_0.length;
    try {
      while (place < size) {
        const head = await this.#headAt(place);
        if (place + head.end > size) break;
        if (head.op === OP.connection) {
          this.#define(readConnection(head.fields, await this.#readRegion(place + head.dataStart, head.dataLength)));
        }
        if (head.op === OP.chunk) await this.#walkChunk(head, place);
        place += head.end;
        onWalk(place, size);
      }
    } catch (error) {
      if (!isDamage(error)) throw error;
    }
    if (place < size) {
      const reason = `cut off or damaged at byte ${place} of ${size}; the messages before that are used`;
      this.notes.push(lost(this.#name, reason));
    }
  }

  async #walkChunk(head: RecordHead, place: number) {
    const chunk = this.#chunks.length;
    try {
      this.#chunks.push(chunkOf(head, place));
      for (const { op, fields, data, start } of recordsIn(await this.#records.get(chunk))) {
        if (op === OP.connection) this.#define(readConnection(fields, data));
        if (op !== OP.message) continue;
        const { id, time } = readMessage(fields);
        this.#messagesOf(id).push(time, chunk, start);
      }
    } catch (error) {
      if (!isDamage(error)) throw error;
      const { problem } = error as { problem?: string };
      const reason = `left out: ${problem ?? `what follows in the chunk at byte ${place}, which is damaged`}`;
      this.notes.push(lost(this.#name, reason));
    }
  }

  /** The data of a message. */
  async read([chunk, offset]: [number, number]) {
    const records = await this.#records.get(chunk);
    const { op, dataStart, end } = this.#checked(() => readRecordHead(records, offset), chunk, offset);
    if (op !== OP.message || end > records.length) throw this.#noMessage(chunk, offset);
    return records.subarray(dataStart, end);
  }

  /** Its first bytes, without unpacking what is not packed. */
  async readHead([chunk, offset]: [number, number], length: number) {
    const { start = 0, compression } = this.#chunks[chunk] ?? {};
    if (compression !== 'none' || this.#records.has(chunk))
      return (await this.read([chunk, offset])).subarray(0, length);
    const place = start + offset;
    const bytes = await this.#source.read(place, Math.min(this.#source.size, place + HEAD_BYTES + length));
    const { op, dataStart, end } = this.#checked(() => readRecordHead(bytes), chunk, offset);
    if (op !== OP.message) throw this.#noMessage(chunk, offset);
    if (dataStart + length > bytes.length && end > bytes.length) return this.read([chunk, offset]);
    return bytes.subarray(dataStart, Math.min(end, dataStart + length));
  }

  /** Places are those of the bytes from there on. */
  async #headAt(place: number): Promise<RecordHead> {
    const { size } = this.#source;
    const head = await this.#source.read(place, Math.min(size, place + HEAD_BYTES));
    try {
      return readRecordHead(head);
    } catch {
      return readRecordHead(await this.#source.read(place, Math.min(size, place + MAX_HEADER_BYTES + 8)));
    }
  }

  #define(connection: Connection) {
    this.#connections.set(connection.id, connection);
  }

  /** @param id of a connection */
  #messagesOf(id: number) {
    const known = this.#messages.get(id) ?? new MessageIndex();
    this.#messages.set(id, known);
    return known;
  }

  #forget(reason: string) {
    this.notes.push({ file: this.#name, reason });
    this.#chunks = [];
    this.#connections.clear();
    this.#messages.clear();
    return false;
  }

  async #unpack(chunk: number) {
    const { start, length, size, compression } = this.#chunks[chunk] as Chunk;
    const packed = await this.#readRegion(start, length);
    let records;
    try {
      mustBePlausible(length, size);
      if (compression === 'none') records = packed;
      else if (compression === 'bz2') records = await unpackBzip2(packed, size);
      else if (compression === 'lz4') records = unpackLz4(packed, size);
      else throw new RangeError(`packed with ${compression}, which is not read`);
    } catch (error) {
      throw this.#broken(`The chunk at byte ${start} cannot be unpacked (${(error as Error).message})`);
    }
    if (records.length !== size) {
      throw this.#broken(`The chunk at byte ${start} unpacks to ${records.length} bytes, not the ${size} it says`);
    }
    return records;
  }

  #checked<T>(read: () => T, chunk: number, offset: number) {
    try {
      return read();
    } catch (error) {
      throw isDamage(error) ? this.#noMessage(chunk, offset) : error;
    }
  }

  async #readRegion(start: number, length: number) {
    const isInside = length >= 0 && start + length <= this.#source.size;
    const bytes = isInside ? await this.#source.read(start, start + length) : new Uint8Array();
    if (!isInside || bytes.length < length)
      throw this.#broken(`Byte ${start} of the file is needed, but the file ends before it`);
    return bytes;
  }

  #noMessage(chunk: number, offset: number) {
    const start = this.#chunks[chunk]?.start ?? 0;
    return this.#broken(`There is no message ${offset} bytes into the chunk at byte ${start}, where its index has one`);
  }

  #broken(problem: string) {
    return fileError(this.#name, problem, REMEDY);
  }
}

/** @param place of the record in the file */
function chunkOf({ op, fields, dataStart, dataLength }: RecordHead, place: number): Chunk {
  if (op !== OP.chunk) throw new RangeError('there is no chunk');
  const [size, compression] = [u32(fields, 'size'), textOf(fields, 'compression')];
  return { start: place + dataStart, length: dataLength, size, compression };
}

/** Whether the file is what is wrong. */
function isDamage(error: unknown) {
  return error instanceof RangeError || (error as Error).name === 'ScanstitchError';
}
