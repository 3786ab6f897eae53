// @ts-check
/**
 * Bags for the tests and for measuring: MCAP and SQLite, message by message onto the disk, so that they may be larger than
 * the memory.
 */
import { closeSync, openSync, writeSync } from 'node:fs';
import { crc32 } from '../../npm/base/crc32.js';

/** @typedef {{ name: string, type: string, format?: string }} TopicToWrite */
/** @typedef {{ topic: string, time: bigint, data: Uint8Array }} MessageToWrite */

const MAGIC = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);

/** @param {...(number | bigint | string | Uint8Array | [number, number | bigint])} parts numbers: [bytes, value] @returns {Uint8Array} */
export function pack(...parts) {
  const chunks = parts.map((part) => {
    if (part instanceof Uint8Array) return part;
    if (typeof part === 'string') {
      const text = new TextEncoder().encode(part);
      return Buffer.concat([pack([4, text.length]), text]);
    }
    const [size, value] = Array.isArray(part) ? part : [1, part];
    const bytes = Buffer.alloc(size);
    if (size === 8) bytes.writeBigUInt64LE(BigInt(value));
    else bytes.writeUIntLE(Number(value), 0, size);
    return bytes;
  });
  return new Uint8Array(Buffer.concat(chunks));
}

/** @param {number} opcode @param {Uint8Array} content */
export function record(opcode, content) {
  return pack(opcode, [8, content.length], content);
}

/**
 * @typedef {object} McapOptions
 * @property {boolean} [isIndexed] with message indexes and a summary (default: true)
 * @property {boolean} [hasChunks] (default: true)
 * @property {number} [chunkBytes] (default: 1 MB)
 */

/** @param {string} path @param {TopicToWrite[]} topics @param {Iterable<MessageToWrite>} messages @param {McapOptions} [options] */
export function writeMcap(path, topics, messages, { isIndexed = true, hasChunks = true, chunkBytes = 2 ** 20 } = {}) {
  const file = openSync(path, 'w');
  let place = 0;
  const put = (/** @type {Uint8Array} */ bytes) => {
    writeSync(file, bytes);
    place += bytes.length;
  };
  put(MAGIC);
  put(record(1, pack('ros2', 'scanstitch tests')));
  const definitions = topics.flatMap(({ name, type, format = 'cdr' }, id) => [
    record(3, pack([2, id + 1], type, 'ros2msg', [4, 0])),
    record(4, pack([2, id], [2, id + 1], name, format, [4, 0])),
  ]);
  for (const definition of definitions) put(definition);
  /** @type {Uint8Array[]} */
  const chunkIndexes = [];
  const counts = topics.map(() => 0);
  let [first, last] = [2n ** 63n, 0n];
  /** @type {{ bytes: Uint8Array, id: number, time: bigint }[]} */
  let waiting = [];
  const flush = () => {
    if (waiting.length === 0) return;
    const records = Buffer.concat(waiting.map(({ bytes }) => bytes));
    const times = waiting.map(({ time }) => time);
    const [start, end] = [times.reduce((a, b) => (b < a ? b : a)), times.reduce((a, b) => (b > a ? b : a))];
    const sum = [4, crc32(records)];
    const head = pack([8, start], [8, end], [8, records.length], /** @type {[number, number]} */ (sum), '', [
      8,
      records.length,
    ]);
    const chunkStart = place;
    put(record(6, pack(head, records)));
    const chunkLength = place - chunkStart;
    const indexStart = place;
    /** @type {Uint8Array[]} */
    const offsets = [];
    if (isIndexed) {
      topics.forEach((_, id) => {
        let offset = 0;
        const entries = waiting.flatMap(({ bytes, id: other, time }) => {
          const entry = other === id ? [pack([8, time], [8, offset])] : [];
          offset += bytes.length;
          return entry;
        });
        if (entries.length === 0) return;
        offsets.push(pack([2, id], [8, place]));
        const list = Buffer.concat(entries);
        put(record(7, pack([2, id], [4, list.length], list)));
      });
      const map = Buffer.concat(offsets);
      chunkIndexes.push(
        record(
          8,
          pack(
            ...[start, end, chunkStart, chunkLength].map(
              (value) => /** @type {[number, bigint]} */ ([8, BigInt(value)]),
            ),
            [4, map.length],
            map,
            [8, place - indexStart],
            '',
            [8, records.length],
            [8, records.length],
          ),
        ),
      );
    }
    waiting = [];
  };
  let waitingBytes = 0;
  for (const { topic, time, data } of messages) {
    const id = topics.findIndex(({ name }) => name === topic);
    const bytes = record(5, pack([2, id], [4, counts[id] ?? 0], [8, time], [8, time], data));
    counts[id] = (counts[id] ?? 0) + 1;
    if (time < first) first = time;
    if (time > last) last = time;
    if (!hasChunks) {
      put(bytes);
      continue;
    }
    waiting.push({ bytes, id, time });
    waitingBytes += bytes.length;
    if (waitingBytes >= chunkBytes) {
      flush();
      waitingBytes = 0;
    }
  }
  flush();
  put(record(15, pack([4, 0])));
  const summaryStart = isIndexed ? place : 0;
  if (isIndexed) {
    const total = counts.reduce((sum, count) => sum + count, 0);
    const map = Buffer.concat(counts.map((count, id) => pack([2, id], [8, count])));
    const statistics = record(
      11,
      pack(
        [8, total],
        [2, topics.length],
        [4, topics.length],
        [4, 0],
        [4, 0],
        [4, chunkIndexes.length],
        [8, first],
        [8, last],
        [4, map.length],
        map,
      ),
    );
    const summary = Buffer.concat([...definitions, statistics, ...chunkIndexes]);
    const footer = pack(2, [8, 20], [8, summaryStart], [8, 0]);
    put(summary);
    put(pack(footer, [4, crc32(Buffer.concat([summary, footer]))]));
  } else put(record(2, pack([8, 0], [8, 0], [4, 0])));
  put(MAGIC);
  closeSync(file);
}

const PAGE = 4096;

/** As few bytes as hold it, the high ones first (SQLite's file format, 1.6). @param {number} value */
function varint(value) {
  const bytes = [value % 128];
  for (let rest = Math.floor(value / 128); rest > 0; rest = Math.floor(rest / 128)) bytes.unshift(128 + (rest % 128));
  return Uint8Array.from(bytes);
}

/** @param {(null | number | bigint | string | Uint8Array)[]} values */
function row(values) {
  const types = [];
  const bodies = [];
  for (const value of values) {
    if (value === null) types.push(varint(0));
    else if (typeof value === 'string' || value instanceof Uint8Array) {
      const bytes = typeof value === 'string' ? new TextEncoder().encode(value) : value;
      types.push(varint(2 * bytes.length + (typeof value === 'string' ? 13 : 12)));
      bodies.push(bytes);
    } else {
      types.push(varint(6));
      const bytes = Buffer.alloc(8);
      bytes.writeBigInt64BE(BigInt(value));
      bodies.push(bytes);
    }
  }
  const size = types.reduce((sum, { length }) => sum + length, 0);
  const header = varint(size + 1);
  return Buffer.concat([varint(size + header.length), ...types, ...bodies]);
}

/** @param {string} path @param {TopicToWrite[]} topics @param {Iterable<MessageToWrite>} messages */
export function writeDb3(path, topics, messages) {
  const file = openSync(path, 'w');
  let numPages = 3; // the schema, and the roots of two tables
  const putPage = (/** @type {number} */ number, /** @type {Uint8Array} */ bytes) => {
    const page = Buffer.alloc(PAGE);
    page.set(bytes);
    writeSync(file, page, 0, PAGE, (number - 1) * PAGE);
  };
  /** A cell of a leaf; what does not fit in lies on pages of its own. @param {number} rowid @param {Uint8Array} payload */
  const leafCell = (rowid, payload) => {
    const head = Buffer.concat([varint(payload.length), varint(rowid)]);
    const [most, least] = [PAGE - 35, Math.floor(((PAGE - 12) * 32) / 255) - 23];
    if (payload.length <= most) return Buffer.concat([head, payload]);
    const tail = least + ((payload.length - least) % (PAGE - 4));
    const local = tail <= most ? tail : least;
    const next = Buffer.alloc(4);
    next.writeUInt32BE(numPages + 1);
    for (let place = local; place < payload.length; place += PAGE - 4) {
      numPages += 1;
      const link = Buffer.alloc(4);
      link.writeUInt32BE(place + PAGE - 4 < payload.length ? numPages + 1 : 0);
      putPage(numPages, Buffer.concat([link, payload.subarray(place, place + PAGE - 4)]));
    }
    return Buffer.concat([head, payload.subarray(0, local), next]);
  };
  /** @param {number} kind @param {Uint8Array[]} cells @param {number} last @param {number} [start] */
  const treePage = (kind, cells, last, start = 0) => {
    const page = Buffer.alloc(PAGE);
    const headerBytes = kind === 5 ? 12 : 8;
    page[start] = kind;
    page.writeUInt16BE(cells.length, start + 3);
    if (kind === 5) page.writeUInt32BE(last, start + 8);
    let end = PAGE;
    cells.forEach((cell, index) => {
      end -= cell.length;
      page.set(cell, end);
      page.writeUInt16BE(end, start + headerBytes + 2 * index);
    });
    page.writeUInt16BE(end, start + 5);
    return page;
  };
  /** @param {number} root @param {Iterable<Uint8Array>} rows */
  const table = (root, rows) => {
    /** @type {{ page: number, rowid: number }[]} */
    let children = [];
    /** @type {Uint8Array[]} */
    let cells = [];
    let room = PAGE - 8;
    let rowid = 0;
    const flush = () => {
      numPages += 1;
      putPage(numPages, treePage(13, cells, 0));
      children.push({ page: numPages, rowid });
      [cells, room] = [[], PAGE - 8];
    };
    for (const payload of rows) {
      const cell = leafCell(rowid + 1, payload);
      if (cell.length + 2 > room) flush();
      rowid += 1;
      cells.push(cell);
      room -= cell.length + 2;
    }
    if (children.length === 0) {
      putPage(root, treePage(13, cells, 0));
      return;
    }
    flush();
    while (children.length > 0) {
      /** @type {typeof children} */
      const parents = [];
      for (let first = 0; first < children.length; first += 250) {
        const group = children.slice(first, first + 250);
        const last = /** @type {typeof children[0]} */ (group.pop());
        const inner = group.map(({ page, rowid }) => {
          const link = Buffer.alloc(4);
          link.writeUInt32BE(page);
          return Buffer.concat([link, varint(rowid)]);
        });
        const isRoot = children.length <= 250;
        if (!isRoot) numPages += 1;
        putPage(isRoot ? root : numPages, treePage(5, inner, last.page));
        if (!isRoot) parents.push({ page: numPages, rowid: last.rowid });
      }
      children = parents;
    }
  };
  const topicRows = topics.map(({ name, type, format = 'cdr' }) => row([null, name, type, format, '']));
  table(2, topicRows);
  table(
    3,
    (function* () {
      for (const { topic, time, data } of messages) {
        yield row([null, topics.findIndex(({ name }) => name === topic) + 1, time, data]);
      }
    })(),
  );
  const tables = [
    [
      'topics',
      2,
      'CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)',
    ],
    [
      'messages',
      3,
      'CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)',
    ],
  ].map(([name, root, sql], index) =>
    leafCell(index + 1, row(['table', String(name), String(name), Number(root), String(sql)])),
  );
  const page = treePage(13, tables, 0, 100);
  page.write('SQLite format 3\0', 0, 'latin1');
  page.writeUInt16BE(PAGE, 16);
  page.set([1, 1, 0, 64, 32, 32], 18);
  page.writeUInt32BE(1, 24);
  page.writeUInt32BE(numPages, 28);
  page.writeUInt32BE(4, 44);
  page.writeUInt32BE(1, 56);
  page.writeUInt32BE(1, 92);
  putPage(1, page);
  closeSync(file);
}
