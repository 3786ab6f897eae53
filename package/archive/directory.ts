/**
 * The directory of a ZIP archive: which files can be taken from it. One that cannot is named and left out; the others are
 * none the worse for it.
 *
 * Source of the layout: PKWARE, APPNOTE.TXT 6.3.10, sections 4.3 and 4.5.3 (ZIP64).
 */
import { viewOf } from '../base/bytes.js';
import { fileError, lost, type Note } from '../base/errors.js';
import { isPointer } from '../files/heads.js';
import type { ByteSource } from './window.js';

export interface Limits {
  /** Files in an archive. */
  entries: number;
  /** Of one file, unpacked. */
  fileBytes: number;
  /** Of all files, unpacked. */
  totalBytes: number;
  /** Of one file, unpacked, however few it is packed in; beyond that ... */
  freeBytes: number;
  /** ... so many times the packed ones. */
  ratio: number;
}
/** start: of its local header */
export type Entry = { path: string; size: number; packed: number; method: number; checksum: number; start: number };

export const LIMITS: Limits = Object.freeze({
  entries: 200_000,
  fileBytes: 2 ** 30,
  totalBytes: 2 ** 34,
  freeBytes: 2 ** 26,
  ratio: 20,
});

export const STORED = 0;
export const DEFLATED = 8;
/** Other methods of packing, which are not read, by their numbers. */
const OTHER_METHODS: Readonly<Record<number, string>> = {
  9: 'Deflate64',
  12: 'bzip2',
  14: 'LZMA',
  93: 'Zstandard',
  95: 'xz',
  98: 'PPMd',
};
/** Deflate cannot make more of a byte than this (zlib's technical details). */
const MAX_RATIO = 1032;
/** Characters of a path: what Linux allows (PATH_MAX). */
const MAX_PATH_LENGTH = 4096;
const MAX_DIRECTORY_BYTES = 2 ** 26;
const END_SIGNATURE = 0x06054b50;
const END_BYTES = 22;
const ZIP64_LOCATOR_BYTES = 20;
export const LOCAL_HEADER_BYTES = 30;
const UNPACK_YOURSELF = 'If the archive is sound, unpack it and give the folder';
export const DAMAGED = 'The archive is damaged: download or pack it again';

/**
 * The files that can be unpacked, and why the others are left out.
 * @param name for messages
 * @returns rejects with a ScanstitchError where the archive as a whole is refused
 */
export async function listEntries(
  name: string,
  source: ByteSource,
  limits: Limits,
): Promise<{ entries: Entry[]; notes: Note[] }> {
  const { entries, notes } = readDirectory(name, await findDirectory(name, source), limits);
  const byPath: Map<string, Entry> = new Map();
  for (const entry of entries) {
    const fault = entryFault(entry, source.size, limits);
    if (fault !== null) notes.push(lost(entry.path, `not used: ${fault}`));
    else if (byPath.has(entry.path)) notes.push({ file: entry.path, reason: 'not used: in the archive twice' });
    else byPath.set(entry.path, entry);
  }
  const taken = [...byPath.values()];
  refuseBombs(name, taken, limits);
  return { entries: taken, notes };
}

/** The bytes of the central directory, and how many entries it has. */
async function findDirectory(name: string, source: ByteSource) {
  // The end record lies before a comment of at most 65,535 bytes.
  const tailStart = Math.max(0, source.size - END_BYTES - 0xffff);
  const tail = viewOf(await source.read(tailStart, source.size));
  // What looks like the record may be a part of the comment; something may have been appended to the archive.
  let end = lastEnd(tail, (rest, comment) => comment === rest);
  if (end < 0) end = lastEnd(tail, (rest, comment) => comment <= rest);
  if (end < 0 && isPointer(new Uint8Array(tail.buffer, tail.byteOffset, tail.byteLength))) {
    throw fileError(name, 'This is a Git LFS pointer, not the archive itself', 'Fetch it: git lfs pull');
  }
  if (end < 0) {
    throw fileError(name, 'This is not a ZIP archive, or its end is missing', 'Download or pack it again');
  }
  const plain = {
    count: tail.getUint16(end + 10, true),
    length: tail.getUint32(end + 12, true),
    start: tail.getUint32(end + 16, true),
    directoryEnd: tailStart + end,
  };
  const isLarge = plain.count === 0xffff || plain.length === 0xffffffff || plain.start === 0xffffffff;
  const zip64 = isLarge ? await readZip64(name, source, tail, end - ZIP64_LOCATOR_BYTES) : null;
  const { count, length, start, directoryEnd } = zip64 ?? plain;
  // An archive may have been appended to something else: then all its offsets are short by as much.
  const shift = directoryEnd - length - start;
  if (shift < 0) throw fileError(name, 'The directory of this archive is not where it should be', DAMAGED);
  if (length > MAX_DIRECTORY_BYTES) {
    throw fileError(name, `Its directory alone has ${megabytes(length)}`, 'Unpack it and give the folder');
  }
  return { bytes: await source.read(start + shift, start + shift + length), count, shift };
}

/**
 * What the end record of ZIP64 says of the central directory; null where there is none.
 * @param tail of the archive
 * @param locator where its locator begins in the tail
 */
async function readZip64(name: string, source: ByteSource, tail: DataView, locator: number) {
  if (locator < 0 || tail.getUint32(locator, true) !== 0x07064b50) return null;
  const place = Number(tail.getBigUint64(locator + 8, true));
  const record = viewOf(await source.read(place, place + 56));
  if (record.byteLength < 56 || record.getUint32(0, true) !== 0x06064b50) {
    throw fileError(name, 'The directory of this archive is not where it should be', DAMAGED);
  }
  const number = (at: number) => Number(record.getBigUint64(at, true));
  return { count: number(32), length: number(40), start: number(48), directoryEnd: place };
}

/**
 * Where the last end record begins whose comment fits to the `rest` of the file behind it; -1 without one.
 * @param fits in bytes
 */
function lastEnd(tail: DataView, fits: (rest: number, comment: number) => boolean) {
  const isEnd = (end: number) =>
    tail.getUint32(end, true) === END_SIGNATURE &&
    fits(tail.byteLength - end - END_BYTES, tail.getUint16(end + 20, true));
  let end = tail.byteLength - END_BYTES;
  while (end >= 0 && !isEnd(end)) end -= 1;
  return Math.max(end, -1);
}

function readDirectory(
  name: string,
  { bytes, count, shift }: Awaited<ReturnType<typeof findDirectory>>,
  limits: Limits,
) {
  if (count > limits.entries) {
    throw fileError(name, `It holds ${count} files, and at most ${limits.entries} are read`, 'Unpack what is needed');
  }
  const entries: Entry[] = [];
  const notes: Note[] = [];
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
    const isLocked = (flags & 1) === 1;
    const fault =
      pathFault(name, path, isLink) ?? (isLocked ? 'protected by a password; unpack the archive with it' : null);
    if (fault !== null) notes.push(lost(path, `not used: ${fault}`));
    else entries.push({ ...sizes, path, method, checksum, start: sizes.start + shift });
  }
  return { entries, notes };
}

/** Sizes and offset of an entry; those that do not fit into 32 bits lie in an extra field. */
function readSizes(view: DataView, record: number, extra: number, extraEnd: number) {
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

/** Why a file is not taken, by its path alone. */
export function pathFault(name: string, path: string, isLink: boolean) {
  if (path.length > MAX_PATH_LENGTH)
    return `its path has ${path.length} characters, and at most ${MAX_PATH_LENGTH} are read`;
  if (leavesFolder(path)) return `its path leads out of ${name}`;
  return isLink ? 'a link to another file' : null;
}

function leavesFolder(path: string) {
  return /^(\/|[a-z]:)/i.test(path) || path.includes('\0') || path.split('/').includes('..');
}

export function decodeName(bytes: Uint8Array) {
  try {
    return new TextDecoder('utf-8', { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder('latin1').decode(bytes);
  }
}

/** Why a file is not unpacked, by what the archive says of it; null where nothing speaks against it. */
function entryFault({ size, packed, method, start }: Entry, archiveBytes: number, limits: Limits) {
  if (method !== STORED && method !== DEFLATED) {
    const packer = OTHER_METHODS[method] ?? `method ${method}`;
    return `packed by ${packer}, which is not read; pack it as an ordinary ZIP archive, or give the folder`;
  }
  if (size > limits.fileBytes)
    return `it would unpack to ${megabytes(size)}, and at most ${megabytes(limits.fileBytes)} are read`;
  if (start + LOCAL_HEADER_BYTES + packed > archiveBytes || (method === STORED && size !== packed)) {
    return 'the archive claims that it lies outside the archive';
  }
  if (size > packed * MAX_RATIO + 1024) {
    return `it claims to unpack from ${packed} bytes to ${megabytes(size)}, which is not possible`;
  }
  const most = limits.freeBytes + limits.ratio * packed;
  if (size > most) {
    return `it would unpack from ${megabytes(packed)} to ${megabytes(size)}, and at most ${megabytes(most)} are accepted of so little; if the archive is sound, unpack it yourself`;
  }
  return null;
}

/** Files that together, or by their places, can only be meant to do harm. */
function refuseBombs(name: string, entries: Entry[], limits: Limits) {
  refuseTotal(name, entries, limits);
  const ordered = entries.toSorted((a, b) => a.start - b.start);
  ordered.forEach(({ path, start, packed }, index) => {
    const next = ordered[index + 1];
    if (next && start + LOCAL_HEADER_BYTES + packed > next.start) {
      throw fileError(name, `${path} and ${next.path} overlap in it, as in archives made to do harm`, UNPACK_YOURSELF);
    }
  });
}

export function refuseTotal(name: string, entries: readonly { size: number }[], limits: Limits) {
  const total = entries.reduce((sum, { size }) => sum + size, 0);
  if (total <= limits.totalBytes) return;
  const problem = `It would unpack to ${megabytes(total)}, and at most ${megabytes(limits.totalBytes)} are read`;
  throw fileError(name, problem, UNPACK_YOURSELF);
}

export function megabytes(bytes: number) {
  return bytes < 2 ** 30 ? `${Math.ceil(bytes / 2 ** 20)} MB` : `${(bytes / 2 ** 30).toFixed(1)} GB`;
}
