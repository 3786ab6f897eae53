/**
 * What a recorder that was not closed left beside its SQLite file: pages in a write-ahead log, which take the place of those
 * in the file.
 *
 * Source of the layout: sqlite.org, "WAL-mode File Format".
 */
import type { ByteSource } from '../archive/window.js';
import { viewOf } from '../base/bytes.js';
import { fileError } from '../base/errors.js';

/** The last bit tells the order of the bytes that checksums are of. */
const MAGIC = 0x377f0682;
const HEADER_BYTES = 32;
const FRAME_BYTES = 24;
/** So many bytes are read at a time, about. */
const BLOCK_BYTES = 2 ** 20;

/**
 * An SQLite file with the pages of its log, up to the last one that was committed.
 * @param name of the log, for messages
 * @returns the file itself where nothing was committed
 */
export async function withLog(name: string, file: ByteSource, log: ByteSource): Promise<ByteSource> {
  if (log.size < HEADER_BYTES) return file;
  const head = viewOf(await log.read(0, HEADER_BYTES));
  const pageSize = head.getUint32(8);
  if (
    (head.getUint32(0) & ~1) >>> 0 !== MAGIC ||
    pageSize < 512 ||
    pageSize > 65_536 ||
    (pageSize & (pageSize - 1)) !== 0
  ) {
    throw fileError(name, 'This is no write-ahead log of SQLite', 'Copy the bag again, or leave this file out');
  }
  const { places, numPages } = await committedPages(log, head, pageSize);
  if (numPages === 0) return file;
  return {
    size: numPages * pageSize,
    read: async (start, end) => {
      const bytes = new Uint8Array(Math.max(0, Math.min(end, numPages * pageSize) - start));
      bytes.set((await file.read(start, Math.min(start + bytes.length, file.size))).subarray(0, bytes.length));
      for (let page = Math.floor(start / pageSize); page * pageSize < start + bytes.length; page += 1) {
        const place = places.get(page);
        if (place === undefined) continue;
        const [from, to] = [Math.max(start, page * pageSize), Math.min(start + bytes.length, (page + 1) * pageSize)];
        const inside = place - page * pageSize;
        bytes.set(await log.read(from + inside, to + inside), from - start);
      }
      return bytes;
    },
  };
}

/**
 * Where the newest committed form of each page lies, counted from 0, and how many pages the file then has. A frame that
 * was not
 * written whole, or is left over from before, ends the log.
 */
async function committedPages(log: ByteSource, head: DataView, pageSize: number) {
  const isLittle = (head.getUint32(0) & 1) === 0;
  const salts = [head.getUint32(16), head.getUint32(20)];
  let sums: [number, number] = checksum([0, 0], head, 0, 24, isLittle);
  const places: Map<number, number> = new Map();
  let pending: Map<number, number> = new Map();
  let numPages = 0;
  const length = FRAME_BYTES + pageSize;
  const perBlock = Math.max(1, Math.floor(BLOCK_BYTES / length));
  for (let start = HEADER_BYTES; start + length <= log.size; start += perBlock * length) {
    const block = viewOf(await log.read(start, Math.min(log.size, start + perBlock * length)));
    for (let at = 0; at + length <= block.byteLength; at += length) {
      sums = checksum(sums, block, at, 8, isLittle);
      sums = checksum(sums, block, at + FRAME_BYTES, pageSize, isLittle);
      const isWhole = [...salts, ...sums].every((value, k) => block.getUint32(at + 8 + 4 * k) === value);
      if (!isWhole) return { places, numPages };
      pending.set(block.getUint32(at) - 1, start + at + FRAME_BYTES);
      const committed = block.getUint32(at + 4);
      if (committed === 0) continue;
      numPages = committed;
      for (const [page, place] of pending) places.set(page, place);
      pending = new Map();
    }
  }
  return { places, numPages };
}

/** @param length a multiple of 8 */
function checksum(
  [a, b]: [number, number],
  view: DataView,
  start: number,
  length: number,
  isLittle: boolean,
): [number, number] {
  for (let at = start; at < start + length; at += 8) {
    a = (a + view.getUint32(at, isLittle) + b) >>> 0;
    b = (b + view.getUint32(at + 4, isLittle) + a) >>> 0;
  }
  return [a, b];
}
