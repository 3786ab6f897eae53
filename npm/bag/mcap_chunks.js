// @ts-check
/**
 * The chunks of an MCAP file: their records, unpacked and checked, and a few of them kept. What a chunk says about itself is
 * not believed: memory and work are bounded by the bytes that are there.
 */
import { crc32 } from '../crc32.js';
import { fileError } from '../errors.js';
import { ChunkCache, MAX_KEPT_BYTES } from './chunk_cache.js';
import { unpackLz4 } from './decompress.js';
import { CHUNK_HEADER_BYTES, OPCODE, readChunkHeader, RECORD_HEADER_BYTES } from './mcap_records.js';
import { unpackZstd } from './zstd.js';

/** @typedef {import('../archive.js').ByteSource} ByteSource */
/** @typedef {{ start: number, length: number, compression: string }} Chunk where its record lies in the file */

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
  /** @type {Chunk[]} */
  #chunks = [];
  #unpacked = this.#newCache();
  /** For chunks that are looked through one after the other. */
  #scratch = new Uint8Array();
  /** Bytes that were unpacked to find where messages lie. */
  #work = 0;

  /** @param {string} name @param {ByteSource} source */
  constructor(name, source) {
    this.#name = name;
    this.#source = source;
  }

  /** Its number. @param {Chunk} chunk */
  add(chunk) {
    return this.#chunks.push(chunk) - 1;
  }

  clear() {
    this.#chunks = [];
    this.#unpacked = this.#newCache();
  }

  /**
   * Where a record of a chunk lies in the file, if it can be read there: in a chunk that is not packed. A whole one is
   * read with its chunk, whose checksum is tested, unless the chunk is too large for that.
   * @param {number} chunk
   * @param {number} offset
   * @param {boolean} isHead whether its beginning is wanted alone
   */
  async placeInFile(chunk, offset, isHead) {
    const known = this.#chunks[chunk];
    if (this.#unpacked.has(chunk)) return null;
    if (isHead && known?.compression === '') {
      return known.start + RECORD_HEADER_BYTES + CHUNK_HEADER_BYTES + 8 + offset;
    }
    const stored = await this.storedRecords(chunk);
    return stored && stored.start + offset;
  }

  /** Where the records lie of a chunk that is not packed and too large to be read as a whole; null of others. @param {number} chunk */
  async storedRecords(chunk) {
    const { start, length } = this.#chunks[chunk] ?? { start: 0, length: 0 };
    if (length <= MAX_KEPT_BYTES) return null;
    const { compression, recordsStart, recordsSize } = this.#headerOf(start, await this.region(start, HEAD_BYTES));
    if (compression !== '') return null;
    const first = start + RECORD_HEADER_BYTES + recordsStart;
    if (recordsSize > length - (first - start)) throw this.broken(`The chunk at byte ${start} is cut off`);
    return { start: first, end: first + recordsSize };
  }

  /** The same as `records`, where a bag is looked through for its messages: they stand until the next call. @param {number} chunk */
  async recordsForIndex(chunk) {
    const most = FREE_WORK_BYTES + WORK_RATIO * this.#source.size;
    if (this.#work > most) throw this.broken(`Its chunks unpack to more than ${most} bytes, too much for its size`);
    const records = await this.#unpack(chunk, (size) => {
      if (this.#scratch.length < size) this.#scratch = new Uint8Array(size);
      return this.#scratch;
    });
    this.#work += records.length;
    return records;
  }

  /** The records of a chunk, unpacked and checked. @param {number} chunk */
  records(chunk) {
    return this.#unpacked.get(chunk);
  }

  #newCache() {
    return new ChunkCache((chunk) => this.#unpack(chunk));
  }

  /** @param {number} start @param {Uint8Array} record of a chunk, or its beginning */
  #headerOf(start, record) {
    if (record[0] !== OPCODE.chunk) throw this.broken(`There is no chunk at byte ${start}, where its index has one`);
    try {
      return readChunkHeader(record.subarray(RECORD_HEADER_BYTES));
    } catch {
      throw this.broken(`The chunk at byte ${start} ends within its header`);
    }
  }

  /** @param {number} chunk @param {(size: number) => Uint8Array} [take] memory to unpack into */
  async #unpack(chunk, take) {
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

  /**
   * @param {number} start
   * @param {string} compression
   * @param {Uint8Array} packed
   * @param {number} size
   * @param {(size: number) => Uint8Array} [take]
   */
  async #decompress(start, compression, packed, size, take) {
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
      if (/** @type {Error} */ (error).name === 'ScanstitchError') throw error;
      throw this.broken(`The chunk at byte ${start} cannot be unpacked (${/** @type {Error} */ (error).message})`);
    }
    if (records.length !== size) {
      throw this.broken(`The chunk at byte ${start} unpacks to ${records.length} bytes, not the ${size} it says`);
    }
    return records;
  }

  /** @param {number} start @param {number} length */
  async region(start, length) {
    const bytes =
      start + length <= this.#source.size ? await this.#source.read(start, start + length) : new Uint8Array();
    if (bytes.length < length) throw this.broken(`Byte ${start} of the file is needed, but the file ends before it`);
    return bytes;
  }

  /** @param {string} problem */
  broken(problem) {
    return fileError(this.#name, problem, CUT_OFF);
  }
}
