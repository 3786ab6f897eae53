/**
 * The chunks of an MCAP file: their records, unpacked and checked, and a few of them kept. What a chunk says about itself is
 * not believed: memory and work are bounded by the bytes that are there.
 */
import { unpackLz4 } from '../archive/decompress.js';
import type { ByteSource } from '../archive/window.js';
import { unpackZstd } from '../archive/zstd.js';
import { crc32 } from '../base/crc32.js';
import { fileError } from '../base/errors.js';
import { ChunkCache, MAX_KEPT_BYTES } from './chunk_cache.js';
import { CHUNK_HEADER_BYTES, OPCODE, readChunkHeader, RECORD_HEADER_BYTES } from './mcap_records.js';

/** Where its record lies in the file. */
type Chunk = { start: number; length: number; compression: string };

/** The beginning of a chunk's record, with the name of its compression. */
const HEAD_BYTES = 256;
/** To find where messages lie, so much is unpacked of however small a bag; ... */
const FREE_WORK_BYTES = 2 ** 30;
/** ... and so many times its size more. */
const WORK_RATIO = 100;
export const CUT_OFF = 'Copy the bag again, or repair it with the mcap tool (mcap recover)';

export class Chunks {
  #name;
  #source;
  #chunks: Chunk[] = [];
  #unpacked = this.#newCache();
  /** For chunks that are looked through one after the other. */
  #scratch = new Uint8Array();
  /** Bytes that were unpacked to find where messages lie. */
  #work = 0;

  constructor(name: string, source: ByteSource) {
    this.#name = name;
    this.#source = source;
  }

  /** Its number. */
  add(chunk: Chunk) {
    return this.#chunks.push(chunk) - 1;
  }

  clear() {
    this.#chunks = [];
    this.#unpacked = this.#newCache();
  }

  /**
   * Where a record of a chunk lies in the file, if it can be read there: in a chunk that is not packed. A whole one is
   * read with its chunk, whose checksum is tested, unless the chunk is too large for that.
   * @param isHead whether its beginning is wanted alone
   */
  async placeInFile(chunk: number, offset: number, isHead: boolean) {
    const known = this.#chunks[chunk];
    if (this.#unpacked.has(chunk)) return null;
    if (isHead && known?.compression === '') {
      return known.start + RECORD_HEADER_BYTES + CHUNK_HEADER_BYTES + 8 + offset;
    }
    const stored = await this.storedRecords(chunk);
    return stored && stored.start + offset;
  }

  /** Where the records lie of a chunk that is not packed and too large to be read as a whole; null of others. */
  async storedRecords(chunk: number) {
    const { start, length } = this.#chunks[chunk] ?? { start: 0, length: 0 };
    if (length <= MAX_KEPT_BYTES) return null;
    const { compression, recordsStart, recordsSize } = this.#headerOf(start, await this.region(start, HEAD_BYTES));
    if (compression !== '') return null;
    const first = start + RECORD_HEADER_BYTES + recordsStart;
    if (recordsSize > length - (first - start)) throw this.broken(`The chunk at byte ${start} is cut off`);
    return { start: first, end: first + recordsSize };
  }

  /** The same as `records`, where a bag is looked through for its messages: they stand until the next call. */
  async recordsForIndex(chunk: number) {
    const most = FREE_WORK_BYTES + WORK_RATIO * this.#source.size;
    if (this.#work > most) throw this.broken(`Its chunks unpack to more than ${most} bytes, too much for its size`);
    const records = await this.#unpack(chunk, (size) => {
      if (this.#scratch.length < size) this.#scratch = new Uint8Array(size);
      return this.#scratch;
    });
    this.#work += records.length;
    return records;
  }

  /** The records of a chunk, unpacked and checked. */
  records(chunk: number) {
    return this.#unpacked.get(chunk);
  }

  #newCache() {
    return new ChunkCache((chunk) => this.#unpack(chunk));
  }

  /** @param record of a chunk, or its beginning */
  #headerOf(start: number, record: Uint8Array) {
    if (record[0] !== OPCODE.chunk) throw this.broken(`There is no chunk at byte ${start}, where its index has one`);
    try {
      return readChunkHeader(record.subarray(RECORD_HEADER_BYTES));
    } catch {
      throw this.broken(`The chunk at byte ${start} ends within its header`);
    }
  }

  /** @param take memory to unpack into */
  async #unpack(chunk: number, take?: (size: number) => Uint8Array) {
    const { start, length } = this.#chunks[chunk] ?? { start: 0, length: 0 };
    const record = await this.region(start, length);
    const { size, crc, compression, recordsStart, recordsSize } = this.#headerOf(start, record);
    const first = RECORD_HEADER_BYTES + recordsStart;
    const packed = record.subarray(first, first + recordsSize);
    if (packed.length < recordsSize) throw this.broken(`The chunk at byte ${start} is cut off`);
    const records = await this.#decompress(start, compression, packed, size, take);
    if (crc !== 0 && crc32(records) !== crc) {
      throw this.broken(`The chunk at byte ${start} has another checksum than the one written in it`);
    }
    return records;
  }

  async #decompress(
    start: number,
    compression: string,
    packed: Uint8Array,
    size: number,
    take?: (size: number) => Uint8Array,
  ) {
    let records = packed;
    try {
      if (compression === 'zstd') records = await unpackZstd(packed, size, take);
      else if (compression === 'lz4') records = unpackLz4(packed, size, take);
      else if (compression !== '') {
        const remedy = 'Convert the bag to zstd with the mcap tool (mcap compress)';
        const problem = `The chunk at byte ${start} is packed with ${compression}, which is not read`;
        throw fileError(this.#name, problem, remedy);
      }
    } catch (error) {
      if ((error as Error).name === 'ScanstitchError') throw error;
      throw this.broken(`The chunk at byte ${start} cannot be unpacked (${(error as Error).message})`);
    }
    if (records.length !== size) {
      throw this.broken(`The chunk at byte ${start} unpacks to ${records.length} bytes, not the ${size} it says`);
    }
    return records;
  }

  async region(start: number, length: number) {
    const bytes =
      start + length <= this.#source.size ? await this.#source.read(start, start + length) : new Uint8Array();
    if (bytes.length < length) throw this.broken(`Byte ${start} of the file is needed, but the file ends before it`);
    return bytes;
  }

  broken(problem: string) {
    return fileError(this.#name, problem, CUT_OFF);
  }
}
