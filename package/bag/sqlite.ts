/**
 * Tables of an SQLite file, read page by page where they lie: on the disk or in a file of the page, never as a whole. It
 * only walks tables from the first row to the last and reads rows again; nothing is ever written.
 *
 * Why not SQLite itself: its WebAssembly builds take the whole file into memory in Node, and in the page need a worker
 * with blocking reads and a megabyte of code. A bag needs two tables, walked once.
 *
 * Source of the layout: sqlite.org, "Database File Format", sections 1.3, 1.6, 2.1.
 */
import type { ByteSource } from '../archive/window.js';
import { fileError, lost, type Note } from '../base/errors.js';

export type Value = null | number | bigint | string | Uint8Array;
/** Of a row. */
type Place = { page: number; cell: number };
/** What a page holds of a row: the beginning of its record, and where the rest lies. */
type Cell = { rowid: number; size: number; local: Uint8Array; overflow: number };
/** values: as far as its page holds them */
type Row = { place: Place; cell: Cell; values: Value[] };

const MAGIC = 'SQLite format 3\0';
const LEAF = 0x0d;
const INTERIOR = 0x05;
/** Pages are read together in blocks of so many bytes, and so many blocks are kept. */
const BLOCK_BYTES = 2 ** 16;
const KEPT_BLOCKS = 64;
/** Pages that are read before they are needed, when a table is walked. */
const READ_AHEAD = 16;
/** No table is deeper: each level multiplies the rows. */
const MAX_DEPTH = 20;
const CUT_OFF = 'Copy the bag again';
const CUT_ROWS = 'cut off: messages that lay behind its end are left out';

export function isSqlite(head: Uint8Array) {
  return new TextDecoder('latin1').decode(head.subarray(0, 16)) === MAGIC;
}

export class SqliteFile {
  #name;
  #source;
  #pageSize;
  /** Bytes of a page that hold data. */
  #usable;
  #blocks: Map<number, Promise<Uint8Array>> = new Map();
  /** Pages that are missing or are not what they should be, each told once. */
  #faults: Map<string, { count: number; page: number }> = new Map();
  /** Root page and names of the columns of each table. */
  #tables: Map<string, { root: number; columns: string[] }> = new Map();

  constructor(name: string, source: ByteSource, pageSize: number, usable: number) {
    this.#name = name;
    this.#source = source;
    this.#pageSize = pageSize;
    this.#usable = usable;
  }

  /** @param name for messages */
  static async open(name: string, source: ByteSource) {
    const head = await source.read(0, 100);
    if (head.length < 100 || !isSqlite(head)) {
      throw fileError(name, 'This is not an SQLite file, as the bags of ROS 2 that end in .db3 are', CUT_OFF);
    }
    const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
    const pageSize = view.getUint16(16) === 1 ? 65_536 : view.getUint16(16);
    if (pageSize < 512 || (pageSize & (pageSize - 1)) !== 0) {
      throw fileError(name, `Its header announces pages of ${pageSize} bytes, which is not possible`, CUT_OFF);
    }
    const file = new SqliteFile(name, source, pageSize, pageSize - (head[20] ?? 0));
    const announced = view.getUint32(24) === view.getUint32(92) ? view.getUint32(28) * pageSize : 0;
    if (announced > source.size) {
      file.#note(`cut off after ${source.size} of ${announced} bytes; the messages before that are used`, 0);
    }
    for await (const { cell } of file.#rowsUnder(1)) {
      const [type, table, , root, sql] = file.#values(await file.record(cell));
      if (type === 'table') {
        file.#tables.set(String(table), { root: Number(root), columns: columnsOf(String(sql)) });
      }
    }
    return file;
  }

  /** What was found missing so far. */
  get notes(): Note[] {
    return [...this.#faults].map(([fault, { count, page }]) => {
      const pages = count > 1 ? ` (${count} pages, the first is ${page})` : page > 0 ? ` (page ${page})` : '';
      return lost(this.#name, `${fault}${pages}`);
    });
  }

  has(table: string) {
    return this.#tables.has(table);
  }

  /** Place of a column in the rows of a table. */
  column(table: string, column: string) {
    return this.#tables.get(table)?.columns.indexOf(column) ?? -1;
  }

  /** All rows of a table; what is missing or damaged is noted and left out. */
  rows(table: string) {
    return this.#rowsUnder(this.#tables.get(table)?.root ?? 0);
  }

  /** A row that `rows` has told of. */
  async row({ page, cell }: Place) {
    return this.#cell(page, await this.#page(page), cell);
  }

  /** Values of a row as far as its page holds them; a blob that goes on elsewhere comes with its beginning alone. */
  valuesInPage(cell: Cell) {
    return this.#values(cell.local);
  }

  /** The values of a whole record. */
  async valuesOf(cell: Cell) {
    return this.#values(await this.record(cell));
  }

  /** The whole record of a row. */
  async record({ size, local, overflow }: Cell) {
    if (local.length >= size) return local;
    if (size > this.#source.size) throw this.#broken('A row claims to be larger than the file');
    const bytes = new Uint8Array(size);
    bytes.set(local);
    let filled = local.length;
    const room = this.#usable - 4;
    let run: Uint8Array = new Uint8Array();
    let runStart = 0;
    for (let page = overflow; filled < size;) {
      if (page < 1) throw this.#broken('A message ends before it should');
      // Pages that belong together were mostly written one after the other.
      if (page < runStart || (page - runStart + 1) * this.#pageSize > run.length) {
        run = await this.#pages(page, Math.ceil((size - filled) / room));
        runStart = page;
      }
      const start = (page - runStart) * this.#pageSize;
      const part = run.subarray(start + 4, start + 4 + Math.min(room, size - filled));
      bytes.set(part, filled);
      filled += part.length;
      page = readU32(run, start);
    }
    return bytes;
  }

  async *#rowsUnder(root: number): AsyncGenerator<Row> {
    const seen = new Set();
    /** Pages to come, the next one last. */
    const waiting: { page: number; depth: number }[] = [{ page: root, depth: 0 }];
    for (let next = waiting.pop(); next; next = waiting.pop()) {
      const { page, depth } = next;
      // In a browser each read of a file costs a millisecond, several at a time hardly more.
      for (const { page: soon } of waiting.slice(-READ_AHEAD)) this.#page(soon).catch(() => {});
      if (seen.has(page) || depth > MAX_DEPTH) {
        this.#note('damaged: its pages lead back to one another', page);
        continue;
      }
      seen.add(page);
      let bytes;
      try {
        bytes = await this.#page(page);
      } catch {
        this.#note(CUT_ROWS, page);
        continue;
      }
      const kind = bytes[headerAt(page)];
      if (kind === LEAF) yield* this.#rowsIn(page, bytes);
      else if (kind === INTERIOR) {
        const children = this.#childrenOf(page, bytes);
        waiting.push(...children.reverse().map((child) => ({ page: child, depth: depth + 1 })));
      } else this.#note('damaged: some of its pages are not what they should be and are left out', page);
    }
  }

  /** The rows of a leaf; those that are damaged are noted and left out. */
  *#rowsIn(page: number, bytes: Uint8Array): Generator<Row> {
    for (let index = 0; index < countOf(page, bytes); index += 1) {
      try {
        const cell = this.#cell(page, bytes, index);
        yield { place: { page, cell: index }, cell, values: this.valuesInPage(cell) };
      } catch (error) {
        if (!(error instanceof RangeError)) throw error;
        this.#note('damaged: some of its rows cannot be read and are left out', page);
      }
    }
  }

  /** The pages below an interior one, in the order of their rows. */
  #childrenOf(page: number, bytes: Uint8Array) {
    const header = headerAt(page);
    const children = Array.from({ length: countOf(page, bytes) }, (_, cell) => {
      return readU32(bytes, readU16(bytes, header + 12 + 2 * cell));
    });
    children.push(readU32(bytes, header + 8));
    // Noted here, and not read: of a damaged page all children may lie beyond the end.
    const isThere = (child: number) => child >= 1 && child <= this.#numPages;
    const missing = children.filter((child) => !isThere(child));
    if (missing.length > 0) this.#note(CUT_ROWS, missing[0] ?? 0, missing.length);
    return children.filter(isThere);
  }

  #cell(page: number, bytes: Uint8Array, index: number): Cell {
    const start = readU16(bytes, (page === 1 ? 108 : 8) + 2 * index);
    const [size, afterSize] = readVarint(bytes, start);
    const [rowid, body] = readVarint(bytes, afterSize);
    const local = this.#localSize(size);
    if (body + local > bytes.length) throw new RangeError('a row beyond its page');
    return {
      rowid,
      size,
      local: bytes.slice(body, body + local),
      overflow: local < size ? readU32(bytes, body + local) : 0,
    };
  }

  /** How much of a record of this size lies in its page (section 1.6). */
  #localSize(size: number) {
    const most = this.#usable - 35;
    if (size <= most) return size;
    const least = Math.floor(((this.#usable - 12) * 32) / 255) - 23;
    const tail = least + ((size - least) % (this.#usable - 4));
    return tail <= most ? tail : least;
  }

  #values(record: Uint8Array): Value[] {
    const [headerSize, first] = readVarint(record, 0);
    const values: Value[] = [];
    let body = headerSize;
    for (let place = first; place < headerSize;) {
      const [type, next] = readVarint(record, place);
      place = next;
      const size = sizeOf(type);
      values.push(readValue(record, body, type, size));
      body += size;
    }
    return values;
  }

  async #page(page: number) {
    const perBlock = Math.max(1, BLOCK_BYTES / this.#pageSize);
    const block = Math.floor((page - 1) / perBlock);
    let reading = this.#blocks.get(block);
    if (reading) this.#blocks.delete(block);
    else {
      const start = block * perBlock * this.#pageSize;
      reading = this.#source.read(start, Math.min(this.#source.size, start + perBlock * this.#pageSize));
    }
    this.#blocks.set(block, reading); // the last one used comes last
    const [oldest] = this.#blocks.keys();
    if (this.#blocks.size > KEPT_BLOCKS && oldest !== undefined) this.#blocks.delete(oldest);
    const bytes = await reading;
    const offset = (page - 1 - block * perBlock) * this.#pageSize;
    if (page < 1 || offset + this.#pageSize > bytes.length)
      throw this.#broken(`Page ${page} is needed, but the file ends before it`);
    return bytes.subarray(offset, offset + this.#pageSize);
  }

  /** Whole pages from one on, as many of `count` as there are. */
  async #pages(page: number, count: number) {
    const start = (page - 1) * this.#pageSize;
    const end = Math.min(this.#source.size, start + count * this.#pageSize);
    const bytes = start < end ? await this.#source.read(start, end) : new Uint8Array();
    if (bytes.length < this.#pageSize) throw this.#broken(`Page ${page} is needed, but the file ends before it`);
    return bytes;
  }

  #broken(problem: string) {
    return fileError(this.#name, `${problem}: the bag is cut off or damaged`, CUT_OFF);
  }

  /** Pages that begin before the end. */
  get #numPages() {
    return Math.ceil(this.#source.size / this.#pageSize);
  }

  /** @param count of pages that have it */
  #note(fault: string, page: number, count = 1) {
    const known = this.#faults.get(fault);
    if (known) known.count += count;
    else this.#faults.set(fault, { count, page });
  }
}

/** Where the header of a page begins: the first page begins with that of the file. */
function headerAt(page: number) {
  return page === 1 ? 100 : 0;
}

/** Cells of a page, at most as many as it has room for. */
function countOf(page: number, bytes: Uint8Array) {
  const header = headerAt(page);
  return Math.min(readU16(bytes, header + 3), Math.floor((bytes.length - header - 8) / 2));
}

/** Names of the columns in `CREATE TABLE name(...)`. */
function columnsOf(sql: string) {
  const [, inside = ''] = sql.match(/\(([^]*)\)/) ?? [];
  return inside
    .replaceAll(/\([^)]*\)/g, '')
    .split(',')
    .map((column) => (column.trim().split(/\s+/)[0] ?? '').replaceAll(/["'`[\]]/g, ''));
}

function readU16(bytes: Uint8Array, place: number) {
  return ((bytes[place] ?? 0) << 8) | (bytes[place + 1] ?? 0);
}

function readU32(bytes: Uint8Array, place: number) {
  return readU16(bytes, place) * 0x10000 + readU16(bytes, place + 2);
}

/** Seven bits a byte, the high ones first; of a ninth byte all eight (section 1.6). */
function readVarint(bytes: Uint8Array, place: number): [value: number, next: number] {
  let value = 0;
  for (let index = 0; index < 9; index += 1) {
    const byte = bytes[place + index];
    if (byte === undefined) throw new RangeError('a number beyond its page');
    if (index === 8) return [value * 256 + byte, place + 9];
    value = value * 128 + (byte & 0x7f);
    if (byte < 0x80) return [value, place + index + 1];
  }
  return [value, place + 9];
}

/** Bytes of a value of this serial type (section 2.1). */
function sizeOf(type: number) {
  if (type >= 12) return Math.floor((type - 12) / 2);
  return [0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0][type] ?? 0;
}

function readValue(record: Uint8Array, place: number, type: number, size: number): Value {
  if (type >= 12) {
    const bytes = record.subarray(place, place + size);
    return type % 2 === 0 ? bytes : new TextDecoder().decode(bytes);
  }
  if (type === 0) return null;
  if (type === 8 || type === 9) return type - 8;
  if (place + size > record.length) throw new RangeError('a value beyond its row');
  const view = new DataView(record.buffer, record.byteOffset + place, size);
  if (type === 7) return view.getFloat64(0);
  if (type === 6) return view.getBigInt64(0);
  let value = view.getInt8(0);
  for (let index = 1; index < size; index += 1) value = value * 256 + view.getUint8(index);
  return value;
}
