/**
 * Files that are packed as a whole: by gzip, bzip2 or Zstandard. They can only be unpacked from their beginning, so the
 * whole of what comes out is in memory, and no more of it than LIMITS allow.
 */
import { joined, PART_BYTES, PIECE_BYTES, viewOf } from '../base/bytes.js';
import { fileError, TooLarge } from '../base/errors.js';
import { LIMITS, type Limits, megabytes } from './directory.js';
import type { ByteSource } from './window.js';

/** fault: why there is no more of it; null where it is whole */
type Unpacked = { bytes: Uint8Array; fault: string | null };

/** How a name ends, and what it ends with when unpacked. */
const ENDINGS: readonly [RegExp, string][] = [
  [/\.tgz$/i, '.tar'],
  [/\.tbz2?$/i, '.tar'],
  [/\.tzst$/i, '.tar'],
  [/\.(gz|bz2|zst|zstd)$/i, ''],
];

/** The name of what comes out; null where a file is not packed. */
export function unpackedName(path: string) {
  const ending = ENDINGS.find(([packed]) => packed.test(path));
  return ending ? path.replace(...ending) : null;
}

/**
 * What comes out of a packed file; of one that is damaged or cut off, what comes before that.
 * @param name for messages
 * @returns rejects with a ScanstitchError where nothing comes out, or too much
 */
export async function unpackWhole(name: string, source: ByteSource, limits: Limits = LIMITS): Promise<Unpacked> {
  const most = Math.min(limits.fileBytes, limits.freeBytes + limits.ratio * source.size);
  const unpacked = await unpackBy(await source.read(0, 6), source, most).catch((error) => {
    if (error instanceof TooLarge) {
      const remedy = 'If the file is sound, unpack it yourself';
      throw fileError(
        name,
        `It unpacks to more than ${megabytes(most)}, the limit for a packed file of its size`,
        remedy,
      );
    }
    if (!(error instanceof RangeError)) throw error;
    // What reads beyond the end of a view says so in its own words.
    const reason = error.message.includes('outside the bounds') ? 'it is cut off' : error.message;
    throw fileError(name, `It cannot be unpacked: ${reason}`, 'Download or pack it again');
  });
  if (unpacked.bytes.length === 0 && unpacked.fault !== null) {
    throw fileError(name, `It cannot be unpacked: ${unpacked.fault}`, 'Download or pack it again');
  }
  return unpacked;
}

async function unpackBy(head: Uint8Array, source: ByteSource, most: number): Promise<Unpacked> {
  const [first, second, third] = head;
  if (first === 0x1f && second === 0x8b) return gunzip(source, most);
  if (first === 0x42 && second === 0x5a && third === 0x68) {
    const { unpackBzip2 } = await import('./bzip2.js');
    return { bytes: await unpackBzip2(await source.read(0, source.size), most), fault: null };
  }
  if (first === 0x28 && second === 0xb5 && third === 0x2f) {
    const { unpackZstd } = await import('./zstd.js');
    const check = (_packed: number, size: number) => {
      if (size > most) throw new TooLarge();
    };
    return { bytes: await unpackZstd(await source.read(0, source.size), null, undefined, check), fault: null };
  }
  throw new RangeError('it is packed neither by gzip nor by bzip2 nor by Zstandard, whatever its name says');
}

/** Members one after the other; the checksum of the last one is compared. */
async function gunzip(source: ByteSource, most: number) {
  const { Gunzip } = await import('fflate');
  const chunks: Uint8Array[] = [];
  let length = 0;
  let lastMember = 0;
  const stream = new Gunzip((chunk) => {
    length += chunk.length;
    if (length > most) throw new TooLarge();
    chunks.push(chunk);
  });
  stream.onmember = () => {
    lastMember = length;
  };
  let fault: string | null = null;
  let trailer = new Uint8Array();
  for (let place = 0; place < source.size && fault === null; place += PART_BYTES) {
    const part = await source.read(place, Math.min(source.size, place + PART_BYTES));
    trailer = part.length >= 8 ? part.slice(-8) : Uint8Array.of(...trailer, ...part).slice(-8);
    try {
      for (let at = 0; at < part.length; at += PIECE_BYTES) {
        stream.push(part.subarray(at, at + PIECE_BYTES), place + at + PIECE_BYTES >= source.size);
      }
    } catch (error) {
      if (error instanceof TooLarge) throw error;
      fault = `it is damaged (${(error as Error).message})`;
    }
  }
  const bytes = joined(chunks);
  return { bytes, fault: fault ?? (await sumFault(bytes.subarray(lastMember), trailer)) };
}

/**
 * @param bytes of the last member
 * @param trailer its checksum and size
 */
async function sumFault(bytes: Uint8Array, trailer: Uint8Array) {
  const { crc32 } = await import('../base/crc32.js');
  const view = viewOf(trailer);
  if (trailer.length < 8) return 'it is cut off';
  if (view.getUint32(4, true) !== bytes.length % 2 ** 32) return 'it is cut off, or something follows it';
  return view.getUint32(0, true) === crc32(bytes) ? null : 'its checksum is wrong: it is damaged';
}
