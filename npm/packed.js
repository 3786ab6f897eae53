// @ts-check
/**
 * Files that are packed as a whole: by gzip, bzip2 or Zstandard. They can only be unpacked from their beginning, so the
 * whole of what comes out is in memory, and no more of it than LIMITS allow.
 */
import { LIMITS, megabytes } from './archive_directory.js';
import { joined, PART_BYTES, PIECE_BYTES, viewOf } from './bytes.js';
import { fileError, TooLarge } from './errors.js';

/** @typedef {import('./archive.js').ByteSource} ByteSource */
/** @typedef {import('./archive_directory.js').Limits} Limits */
/** @typedef {{ bytes: Uint8Array, fault: string | null }} Unpacked fault: why there is no more of it; null where it is whole */

/** How a name ends, and what it ends with when unpacked. @type {readonly [RegExp, string][]} */
const ENDINGS = [
  [/\.tgz$/i, '.tar'],
  [/\.tbz2?$/i, '.tar'],
  [/\.tzst$/i, '.tar'],
  [/\.(gz|bz2|zst|zstd)$/i, ''],
];

/** The name of what comes out; null where a file is not packed. @param {string} path */
export function unpackedName(path) {
  const ending = ENDINGS.find(([packed]) => packed.test(path));
  return ending ? path.replace(...ending) : null;
}

/**
 * What comes out of a packed file; of one that is damaged or cut off, what comes before that.
 * @param {string} name for messages
 * @param {ByteSource} source
 * @param {Limits} [limits]
 * @returns {Promise<Unpacked>} rejects with a ScanstitchError where nothing comes out, or too much
 */
export async function unpackWhole(name, source, limits = LIMITS) {
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

/** @param {Uint8Array} head @param {ByteSource} source @param {number} most @returns {Promise<Unpacked>} */
async function unpackBy(head, source, most) {
  const [first, second, third] = head;
  if (first === 0x1f && second === 0x8b) return gunzip(source, most);
  if (first === 0x42 && second === 0x5a && third === 0x68) {
    const { unpackBzip2 } = await import('./bag/bzip2.js');
    return { bytes: unpackBzip2(await source.read(0, source.size), most), fault: null };
  }
  if (first === 0x28 && second === 0xb5 && third === 0x2f) {
    const { unpackZstd } = await import('./bag/zstd.js');
    const check = (/** @type {number} */ _packed, /** @type {number} */ size) => {
      if (size > most) throw new TooLarge();
    };
    return { bytes: await unpackZstd(await source.read(0, source.size), null, undefined, check), fault: null };
  }
  throw new RangeError('it is packed neither by gzip nor by bzip2 nor by Zstandard, whatever its name says');
}

/** Members one after the other; the checksum of the last one is compared. @param {ByteSource} source @param {number} most */
async function gunzip(source, most) {
  const { Gunzip } = await import('fflate');
  /** @type {Uint8Array[]} */
  const chunks = [];
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
  /** @type {string | null} */
  let fault = null;
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
      fault = `it is damaged (${/** @type {Error} */ (error).message})`;
    }
  }
  const bytes = joined(chunks);
  return { bytes, fault: fault ?? (await sumFault(bytes.subarray(lastMember), trailer)) };
}

/** @param {Uint8Array} bytes of the last member @param {Uint8Array} trailer its checksum and size */
async function sumFault(bytes, trailer) {
  const { crc32 } = await import('./crc32.js');
  const view = viewOf(trailer);
  if (trailer.length < 8) return 'it is cut off';
  if (view.getUint32(4, true) !== bytes.length % 2 ** 32) return 'it is cut off, or something follows it';
  return view.getUint32(0, true) === crc32(bytes) ? null : 'its checksum is wrong: it is damaged';
}
