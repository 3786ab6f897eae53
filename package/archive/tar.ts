/**
 * Tar archives, read in place: the headers first, then each file when it is needed. Headers are not trusted: paths, sizes
 * and kinds are checked as those of a ZIP archive are.
 *
 * Not nanotar 0.3: it takes the whole archive into memory and knows neither links nor paths that lead out.
 *
 * Source of the layout: POSIX.1-2017, pax, "ustar Interchange Format" and "pax Header Block"; GNU tar's manual, "Basic
 * Tar Format" (long names, numbers in base 256).
 */
import { fileError, lost, type Note } from '../base/errors.js';
import type { Archive } from './archive.js';
import { decodeName, LIMITS, type Limits, megabytes, pathFault, refuseTotal } from './directory.js';
import { type ByteSource, Window } from './window.js';

/** start: of the file's bytes */
type Header = { path: string; size: number; kind: string; start: number };
type Entry = { path: string; size: number; start: number };

const BLOCK = 512;
/** Fields of a header: where they begin and end. */
const [NAME, SIZE, CHECKSUM, MAGIC, PREFIX] = [
  [0, 100],
  [124, 136],
  [148, 156],
  [257, 262],
  [345, 500],
] as const;
const KIND_AT = 156;
/** Headers that describe the next file: its long name, or a pax header; or all that follow, or somebody's own. */
const LONG_NAME = 'L';
const PAX = 'x';
const DESCRIPTIONS = 'KLxgXNVDA';
/** A description is a path and a few numbers. */
const MAX_DESCRIPTION = 2 ** 16;
/** Headers are read so many bytes at a time. */
const WINDOW_BYTES = 2 ** 18;
/** Kinds of entries that are no files, and what they are. */
const OTHERS: Record<string, string> = {
  1: 'a link to another file',
  2: 'a link to another file',
  3: 'a device',
  4: 'a device',
  6: 'a pipe',
};

/**
 * Reads the headers of an archive.
 * @param name for messages
 * @returns rejects with a ScanstitchError
 */
export async function openTar(name: string, source: ByteSource, limits: Limits = LIMITS): Promise<Archive> {
  const byPath: Map<string, Entry> = new Map();
  const notes: Note[] = [];
  let count = 0;
  for await (const { path, size, kind, start } of headersOf(name, source, notes)) {
    if ((count += 1) > limits.entries) {
      throw fileError(name, `It holds more than ${limits.entries} files`, 'Unpack what is needed');
    }
    if (kind === '5' || path.endsWith('/')) continue;
    const fault = pathFault(name, path, false) ?? faultOf(kind, size, limits);
    if (fault !== null) notes.push(lost(path, `not used: ${fault}`));
    else if (start + size > source.size) {
      notes.push(lost(path, `not used: it is cut off at the end of ${name}`));
    } else byPath.set(path, { path, size, start }); // The last one of a name counts: tar appends.
  }
  const entries = [...byPath.values()];
  refuseTotal(name, entries, limits);
  const read = (path: string, length: number) => {
    const entry = byPath.get(path);
    if (!entry) throw fileError(path, `There is no such file in ${name}`);
    return source.read(entry.start, entry.start + Math.min(length, entry.size));
  };
  return {
    files: entries.map(({ path, size }) => ({ path, size })),
    notes,
    read: async (path) => read(path, Number.POSITIVE_INFINITY),
    readHead: async (path, length) => read(path, length),
  };
}

function faultOf(kind: string, size: number, limits: Limits) {
  if (kind in OTHERS) return OTHERS[kind] ?? null;
  if (kind !== '0' && kind !== '\0' && kind !== '7') return `an entry of the kind ${JSON.stringify(kind)}, not a file`;
  return size > limits.fileBytes
    ? `it has ${megabytes(size)}, and at most ${megabytes(limits.fileBytes)} are read`
    : null;
}

/** The entries one after the other, with the paths and sizes that descriptions before them give. */
async function* headersOf(name: string, source: ByteSource, notes: Note[]): AsyncGenerator<Header> {
  const window = new Window(source, WINDOW_BYTES);
  let described: { path?: string; size?: number } = {};
  for (let place = 0; place + BLOCK <= source.size;) {
    const block = await window.read(place, BLOCK);
    if (block.every((byte) => byte === 0)) return;
    if (!isHeader(block) || !Number.isSafeInteger(headerAt(block, place).size)) {
      if (place === 0) throw fileError(name, 'This is not a tar archive', 'Download or pack it again');
      notes.push(lost(name, `what follows byte ${place} is damaged and is left out`));
      return;
    }
    const header = { ...headerAt(block, place), ...described };
    const size = described.size ?? header.size;
    const next = header.start + Math.ceil(size / BLOCK) * BLOCK;
    if (!DESCRIPTIONS.includes(header.kind)) {
      described = {};
      yield { ...header, size };
    } else if (header.kind === LONG_NAME || header.kind === PAX) {
      const length = Math.min(header.size, MAX_DESCRIPTION);
      const bytes = await window.read(header.start, length);
      described =
        header.kind === PAX ? { ...described, ...paxOf(bytes) } : { ...described, path: withoutDot(textOf(bytes)) };
    }
    place = next;
  }
  if (source.size % BLOCK !== 0) notes.push(lost(name, 'the archive is cut off; what it held after that is missing'));
}

/** Whether the checksum is that of the block with spaces in place of it. */
function isHeader(block: Uint8Array) {
  if (block.length < BLOCK) return false;
  const [start, end] = CHECKSUM;
  const sum = block.subarray(0, BLOCK).reduce((total, byte, at) => total + (at >= start && at < end ? 32 : byte), 0);
  return numberOf(block.subarray(start, end)) === sum;
}

function headerAt(block: Uint8Array, place: number): Header {
  const field = ([start, end]: readonly [number, number]) => block.subarray(start, end);
  const prefix = textOf(field(MAGIC)) === 'ustar' && block[MAGIC[1]] === 0 ? textOf(field(PREFIX)) : '';
  const path = prefix === '' ? textOf(field(NAME)) : `${prefix}/${textOf(field(NAME))}`;
  const kind = String.fromCharCode(block[KIND_AT] ?? 0);
  return { path: withoutDot(path), size: numberOf(field(SIZE)), kind, start: place + BLOCK };
}

/** `./a` is `a`: who packs a folder from inside writes it so. */
function withoutDot(path: string) {
  return path.replace(/^(\.\/)+/, '');
}

/** Up to the first zero. */
function textOf(bytes: Uint8Array) {
  const end = bytes.indexOf(0);
  return decodeName(end < 0 ? bytes : bytes.subarray(0, end));
}

/** Octal digits, or base 256 where the first bit is set. */
function numberOf(bytes: Uint8Array) {
  const [first = 0] = bytes;
  if (first & 0x80) return bytes.subarray(1).reduce((value, byte) => value * 256 + byte, first & 0x7f);
  const digits = textOf(bytes).trim();
  return /^[0-7]+$/.test(digits) ? Number.parseInt(digits, 8) : digits === '' ? 0 : Number.NaN;
}

/** `LENGTH KEY=VALUE\n`, again and again; the length counts bytes. */
function paxOf(bytes: Uint8Array) {
  const described: { path?: string; size?: number } = {};
  for (let place = 0; place < bytes.length;) {
    const [head = ''] = new TextDecoder('latin1').decode(bytes.subarray(place, place + 12)).match(/^\d+ /) ?? [];
    const length = Number(head);
    if (!(length > head.length)) break;
    const record = decodeName(bytes.subarray(place + head.length, place + length - 1));
    const [, key = '', value = ''] = record.match(/^([^=]*)=([^]*)$/) ?? [];
    if (key === 'path') described.path = withoutDot(value);
    if (key === 'size' && /^\d+$/.test(value)) described.size = Number(value);
    place += length;
  }
  return described;
}
