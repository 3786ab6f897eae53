// @ts-check
/**
 * ZIP archives, read in place: the directory first, then each file when it is asked for. At any time no more is in
 * memory than the directory and the file being read. What an archive says about itself is not believed: an archive can
 * be made to claim, or to unpack to, far more than it holds.
 *
 * Not zip.js 2.24, compared in Node 20: its reader alone adds 25 kB (gzip) to the page, this one 4 kB. Of 200 images of
 * 300 kB it reads the beginnings, which is all that is read of most files, in 1.1 to 1.8 s, and the whole in 1.1 to 1.8 s;
 * here it is 0.1 to 0.3 s and 0.7 to 0.8 s. What refuses bombs and paths that lead out would still stand here.
 *
 * Source of the layout: PKWARE, APPNOTE.TXT 6.3.10, sections 4.3 and 4.5.3 (ZIP64).
 */
import { crc32 } from './crc32.js';
import { fileError } from './errors.js';

/** @typedef {import('./recording.js').ListedFile} ListedFile */
/** @typedef {import('./recording.js').Note} Note */
/** Bytes that lie elsewhere: in a File of the page, on the disk. */
/** @typedef {{ size: number, read(start: number, end: number): Promise<Uint8Array> }} ByteSource */
/**
 * @typedef {object} Limits
 * @property {number} entries files in an archive
 * @property {number} fileBytes of one file, unpacked
 * @property {number} totalBytes of all files, unpacked
 */
/**
 * @typedef {object} Archive
 * @property {ListedFile[]} files
 * @property {Note[]} notes what was left out
 * @property {(path: string) => Promise<Uint8Array>} read a whole file, checked against its checksum
 * @property {(path: string, length: number) => Promise<Uint8Array>} readHead its beginning
 */
/** @typedef {{ path: string, size: number, packed: number, method: number, checksum: number, start: number }} Entry start: of its
 *    local header */

/** @type {Limits} */
export const LIMITS = Object.freeze({ entries: 200_000, fileBytes: 2 ** 30, totalBytes: 2 ** 34 });

const STORED = 0;
const DEFLATED = 8;
/** Deflate cannot make more of a byte than this (zlib's technical details). */
const MAX_RATIO = 1032;
const MAX_DIRECTORY_BYTES = 2 ** 26;
/** So much is unpacked in one go: no more than 16 MB come of it. */
const PIECE_BYTES = 2 ** 14;
/** So much of a file that is wanted as a whole is read at a time. */
const PART_BYTES = 2 ** 22;
const END_SIGNATURE = 0x06054b50;
const END_BYTES = 22;
const ZIP64_LOCATOR_BYTES = 20;
const LOCAL_HEADER_BYTES = 30;
const DAMAGED = 'The archive is damaged: download or pack it again';

/**
 * A file of the page as a source of bytes.
 * @param {Blob} blob
 * @returns {ByteSource}
 */
export function bytesOfBlob(blob) {
  return {
    size: blob.size,
    read: async (start, end) => new Uint8Array(await blob.slice(start, end).arrayBuffer()),
  };
}

/**
 * Reads the directory of an archive.
 * @param {string} name for messages
 * @param {ByteSource} source
 * @param {Limits} [limits]
 * @returns {Promise<Archive>} rejects with a ScanstitchError
 */
export async function openArchive(name, source, limits = LIMITS) {
  const { entries, notes } = readDirectory(name, await findDirectory(name, source), limits);
  refuseBombs(name, entries, source.size, limits);
  /** @type {Map<string, Entry>} */
  const byPath = new Map();
  for (const entry of entries) {
    if (byPath.has(entry.path)) notes.push({ file: entry.path, reason: 'left aside: in the archive twice' });
    else byPath.set(entry.path, entry);
  }
  const entryOf = (/** @type {string} */ path) => {
    const entry = byPath.get(path);
    if (!entry) throw fileError(path, `There is no such file in ${name}`);
    return entry;
  };
  return {
    files: [...byPath.values()].map(({ path, size }) => ({ path, size })),
    notes,
    read: async (path) => {
      const entry = entryOf(path);
      const whole = await unpackNatively(source, entry);
      if (whole) return whole;
      const bytes = await unpack(source, entry, entry.size);
      if (bytes.length < entry.size) {
        throw fileError(path, `Cut off in ${name} after ${bytes.length} of ${entry.size} bytes`, DAMAGED);
      }
      if (crc32(bytes) !== entry.checksum) {
        throw fileError(path, `Its checksum is not the one that ${name} has for it`, DAMAGED);
      }
      return bytes;
    },
    readHead: async (path, length) => unpack(source, entryOf(path), length),
  };
}

/**
 * The bytes of the central directory, and how many entries it has.
 * @param {string} name
 * @param {ByteSource} source
 */
async function findDirectory(name, source) {
  // The end record lies before a comment of at most 65,535 bytes.
  const tailStart = Math.max(0, source.size - END_BYTES - 0xffff);
  const tail = viewOf(await source.read(tailStart, source.size));
  let end = tail.byteLength - END_BYTES;
  while (end >= 0 && !(tail.getUint32(end, true) === END_SIGNATURE && commentFits(tail, end))) end -= 1;
  if (end < 0) {
    throw fileError(name, 'This is no ZIP archive, or its end is missing', 'Download or pack it again');
  }
  let [count, length, start] = [
    tail.getUint16(end + 10, true),
    tail.getUint32(end + 12, true),
    tail.getUint32(end + 16, true),
  ];
  let directoryEnd = tailStart + end;
  if (count === 0xffff || length === 0xffffffff || start === 0xffffffff) {
    const locator = end - ZIP64_LOCATOR_BYTES;
    if (locator >= 0 && tail.getUint32(locator, true) === 0x07064b50) {
      const place = Number(tail.getBigUint64(locator + 8, true));
      const record = viewOf(await source.read(place, place + 56));
      if (record.byteLength < 56 || record.getUint32(0, true) !== 0x06064b50) {
        throw fileError(name, 'The directory of this archive is not where it should be', DAMAGED);
      }
      count = Number(record.getBigUint64(32, true));
      length = Number(record.getBigUint64(40, true));
      start = Number(record.getBigUint64(48, true));
      directoryEnd = place;
    }
  }
  // An archive may have been appended to something else: then all its offsets are short by as much.
  const shift = directoryEnd - length - start;
  if (shift < 0) throw fileError(name, 'The directory of this archive is not where it should be', DAMAGED);
  if (length > MAX_DIRECTORY_BYTES) {
    throw fileError(name, `Its directory alone has ${megabytes(length)}`, 'Unpack it and give the folder');
  }
  return { bytes: await source.read(start + shift, start + shift + length), count, shift };
}

/** @param {DataView} tail @param {number} end */
function commentFits(tail, end) {
  return end + END_BYTES + tail.getUint16(end + 20, true) <= tail.byteLength;
}

/**
 * @param {string} name
 * @param {Awaited<ReturnType<typeof findDirectory>>} directory
 * @param {Limits} limits
 */
function readDirectory(name, { bytes, count, shift }, limits) {
  if (count > limits.entries) {
    throw fileError(name, `It holds ${count} files, and at most ${limits.entries} are read`, 'Unpack what is needed');
  }
  /** @type {Entry[]} */
  const entries = [];
  /** @type {Note[]} */
  const notes = [];
  const view = viewOf(bytes);
  let place = 0;
  for (let index = 0; index < count; index += 1) {
    if (place + 46 > view.byteLength || view.getUint32(place, true) !== 0x02014b50) {
      throw fileError(name, `The directory of this archive ends after ${index} of ${count} files`, DAMAGED);
    }
    const [nameLength, extraLength, commentLength] = [28, 30, 32].map((field) => view.getUint16(place + field, true));
    const nameEnd = place + 46 + (nameLength ?? 0);
    const flags = view.getUint16(place + 8, true);
    const rawPath = decodeName(bytes.subarray(place + 46, nameEnd));
    const path = rawPath.replaceAll('\\', '/');
    const sizes = readSizes(view, place, nameEnd, nameEnd + (extraLength ?? 0));
    const method = view.getUint16(place + 10, true);
    const checksum = view.getUint32(place + 16, true);
    const isLink = view.getUint16(place + 4, true) >> 8 === 3 && view.getUint16(place + 40, true) >> 12 === 0o12;
    place = nameEnd + (extraLength ?? 0) + (commentLength ?? 0);
    if (path.endsWith('/')) continue;
    if (flags & 1) {
      throw fileError(name, `${path} is protected by a password`, 'Unpack the archive with it and give the folder');
    }
    if (leavesFolder(path)) notes.push({ file: path, reason: `left aside: its path leads out of ${name}` });
    else if (isLink) notes.push({ file: path, reason: 'left aside: a link to another file' });
    else entries.push({ ...sizes, path, method, checksum, start: sizes.start + shift });
  }
  return { entries, notes };
}

/**
 * Sizes and offset of an entry; those that do not fit into 32 bits lie in an extra field.
 * @param {DataView} view
 * @param {number} record
 * @param {number} extra
 * @param {number} extraEnd
 */
function readSizes(view, record, extra, extraEnd) {
  const values = [24, 20, 42].map((field) => view.getUint32(record + field, true));
  const end = Math.min(extraEnd, view.byteLength);
  for (let field = extra; field + 4 <= end; field += 4 + view.getUint16(field + 2, true)) {
    if (view.getUint16(field, true) !== 1) continue;
    let place = field + 4;
    values.forEach((value, index) => {
      if (value !== 0xffffffff || place + 8 > end) return;
      values[index] = Number(view.getBigUint64(place, true));
      place += 8;
    });
  }
  const [size = 0, packed = 0, start = 0] = values;
  return { size, packed, start };
}

/** @param {string} path */
function leavesFolder(path) {
  return /^(\/|[a-z]:)/i.test(path) || path.includes('\0') || path.split('/').includes('..');
}

/** @param {Uint8Array} bytes */
function decodeName(bytes) {
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('latin1').decode(bytes);
  }
}

/**
 * @param {string} name
 * @param {Entry[]} entries
 * @param {number} archiveBytes
 * @param {Limits} limits
 */
function refuseBombs(name, entries, archiveBytes, limits) {
  const remedy = 'If it is what it should be, unpack it and give the folder';
  for (const { path, size, packed, method, start } of entries) {
    if (size > limits.fileBytes) {
      throw fileError(
        name,
        `${path} would unpack to ${megabytes(size)}, and at most ${megabytes(limits.fileBytes)} are read`,
        remedy,
      );
    }
    if (start + LOCAL_HEADER_BYTES + packed > archiveBytes || (method === STORED && size !== packed)) {
      throw fileError(name, `What it says about ${path} cannot be: it would lie outside the archive`, DAMAGED);
    }
    if (size > packed * MAX_RATIO + 1024) {
      throw fileError(
        name,
        `${path} claims to unpack from ${packed} bytes to ${megabytes(size)}, which cannot be`,
        DAMAGED,
      );
    }
  }
  const total = entries.reduce((sum, { size }) => sum + size, 0);
  if (total > limits.totalBytes) {
    throw fileError(
      name,
      `It would unpack to ${megabytes(total)}, and at most ${megabytes(limits.totalBytes)} are read`,
      remedy,
    );
  }
  const ordered = entries.toSorted((a, b) => a.start - b.start);
  ordered.forEach(({ path, start, packed }, index) => {
    const next = ordered[index + 1];
    if (next && start + LOCAL_HEADER_BYTES + packed > next.start) {
      throw fileError(
        name,
        `${path} and ${next.path} lie over one another in it, as in archives made to do harm`,
        remedy,
      );
    }
  });
}

/**
 * Where the packed bytes of a file begin.
 * @param {ByteSource} source
 * @param {Entry} entry
 */
async function findData(source, { path, start }) {
  const header = viewOf(await source.read(start, start + LOCAL_HEADER_BYTES));
  if (header.byteLength < LOCAL_HEADER_BYTES || header.getUint32(0, true) !== 0x04034b50) {
    throw fileError(path, 'It does not lie where the archive says', DAMAGED);
  }
  return start + LOCAL_HEADER_BYTES + header.getUint16(26, true) + header.getUint16(28, true);
}

/**
 * A whole file, unpacked by the platform; null where the platform cannot, or where anything is wrong with the file: the
 * slower way then tells what.
 * @param {ByteSource} source
 * @param {Entry} entry
 */
async function unpackNatively(source, entry) {
  const { method, size, packed, checksum } = entry;
  const stream = method === DEFLATED ? inflateStream() : null;
  if (!stream) return null;
  const [writer, reader] = [stream.writable.getWriter(), stream.readable.getReader()];
  const write = async () => {
    const start = await findData(source, entry);
    for (let place = 0; place < packed; place += PART_BYTES) {
      const part = await source.read(start + place, start + Math.min(packed, place + PART_BYTES));
      for (let piece = 0; piece < part.length; piece += PIECE_BYTES) {
        const bytes = part.subarray(piece, piece + PIECE_BYTES);
        await writer.write(/** @type {Uint8Array<ArrayBuffer>} */ (bytes));
      }
    }
    await writer.close();
  };
  const bytes = new Uint8Array(size);
  const read = async () => {
    let filled = 0;
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      bytes.set(part.value, filled); // throws where it is more than the archive claims
      filled += part.value.length;
    }
    return filled;
  };
  try {
    const [filled] = await Promise.all([read(), write()]);
    return filled === size && crc32(bytes) === checksum ? bytes : null;
  } catch (error) {
    await Promise.allSettled([writer.abort(error), reader.cancel(error)]);
    return null;
  }
}

/** Null where the platform has none, as Node before 20.12. */
function inflateStream() {
  try {
    return new DecompressionStream('deflate-raw');
  } catch {
    return null;
  }
}

/**
 * The beginning of a file, unpacked; all of it where length is its size. More than its size is refused.
 * @param {ByteSource} source
 * @param {Entry} entry
 * @param {number} length
 */
async function unpack(source, entry, length) {
  const { path, method, size, packed } = entry;
  const dataStart = await findData(source, entry);
  const wanted = Math.min(length, size);
  if (method === STORED) return source.read(dataStart, dataStart + wanted);
  if (method !== DEFLATED) {
    throw fileError(path, `Packed by method ${method}, which is not read`, 'Pack it as an ordinary ZIP archive');
  }
  const { Inflate } = await import('fflate');
  const bytes = new Uint8Array(wanted);
  let filled = 0;
  const inflate = new Inflate((chunk) => {
    if (filled + chunk.length > size) {
      throw fileError(path, `It unpacks to more than the ${size} bytes that the archive claims`, DAMAGED);
    }
    bytes.set(chunk.subarray(0, wanted - filled), filled);
    filled += chunk.length;
    if (filled > wanted) filled = wanted;
  });
  // Small files come in one piece from the disk; of large ones no more than needed.
  const readAhead = length < size ? 4 * PIECE_BYTES : PART_BYTES;
  for (let place = 0; place < packed && filled < wanted; place += readAhead) {
    const part = await source.read(dataStart + place, dataStart + Math.min(packed, place + readAhead));
    for (let piece = 0; piece < part.length && filled < wanted; piece += PIECE_BYTES) {
      const isLast = place + piece + PIECE_BYTES >= packed;
      try {
        inflate.push(part.subarray(piece, piece + PIECE_BYTES), isLast);
      } catch (error) {
        if (/** @type {Error} */ (error).name === 'ScanstitchError') throw error;
        throw fileError(path, `It cannot be unpacked (${/** @type {Error} */ (error).message})`, DAMAGED);
      }
    }
  }
  return bytes.subarray(0, filled);
}

/** @param {Uint8Array} bytes */
function viewOf(bytes) {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** @param {number} bytes */
function megabytes(bytes) {
  return bytes < 2 ** 30 ? `${(bytes / 2 ** 20).toFixed(0)} MB` : `${(bytes / 2 ** 30).toFixed(1)} GB`;
}
