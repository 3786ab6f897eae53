/**
 * Zstandard, by a decoder that is loaded when it is needed. Before anything is unpacked the blocks are looked through: how
 * much can come of them is known by then, whatever the header claims.
 *
 * Source of the layout: RFC 8878, 3.1.1.
 */
import { mustBePlausible } from './decompress.js';

const MAGIC = 0xfd2fb528;
const RAW = 0;
const RUN = 1;
const COMPRESSED = 2;
/** Bytes that come of one block at the most. */
const MAX_BLOCK_BYTES = 2 ** 17;
/** The last block, raw and without contents. */
const EMPTY_BLOCK = [1, 0, 0];

/**
 * where it begins, its last block begins, its blocks end, and what comes after it begins; most: bytes that can come of
 * it
 */
type Frame = { start: number; lastBlock: number; end: number; next: number; most: number };

/**
 * @param size of what comes out, where it is known
 * @param take memory to unpack into, of at least so many bytes
 * @param check throws where so many packed bytes may not unpack to that size
 * @returns rejects where it cannot be unpacked
 */
export async function unpackZstd(
  packed: Uint8Array,
  size: number | null,
  take: (size: number) => Uint8Array = (size) => new Uint8Array(size),
  check: (packed: number, size: number) => void = mustBePlausible,
): Promise<Uint8Array> {
  const frames = framesIn(packed);
  const most = frames.reduce((sum, frame) => sum + frame.most, 0);
  if (size !== null && size > most) throw new RangeError(`no more than ${most} bytes can come of it, not ${size}`);
  check(packed.length, size ?? most);
  // Memory that is not written to is not taken.
  const output = take(size ?? most).subarray(0, size ?? most);
  const { decompress } = await import('fzstd');
  let filled = 0;
  for (const { start, lastBlock, end } of frames) {
    // The decoder does not tell how far it has come: an empty block behind the last one does.
    const frame = new Uint8Array(end - start + EMPTY_BLOCK.length);
    frame.set(packed.subarray(start, end));
    frame[lastBlock - start] = (frame[lastBlock - start] ?? 0) & ~1;
    frame.set(EMPTY_BLOCK, end - start);
    let length = 0;
    const rest = output.subarray(filled);
    rest.set = (part, place = 0) => {
      Uint8Array.prototype.set.call(rest, part, place);
      length = place + part.length;
    };
    // The decoder compares the buffer with a number (`w == 1`, fzstd 0.1.1), which would write all of it out as text.
    rest.toString = () => '';
    decompress(frame, rest);
    filled += length;
  }
  return output.subarray(0, filled);
}

function framesIn(packed: Uint8Array): Frame[] {
  const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
  const frames = [];
  for (let place = 0; place < packed.length;) {
    const magic = view.getUint32(place, true);
    if (magic >>> 4 === 0x184d2a5) {
      place += 8 + view.getUint32(place + 4, true); // a frame to be skipped
      continue;
    }
    if (magic !== MAGIC) throw new RangeError('it does not begin with the signature of Zstandard');
    const frame = frameAt(view, place);
    frames.push(frame);
    place = frame.next;
  }
  return frames;
}

function frameAt(view: DataView, start: number): Frame {
  const flags = view.getUint8(start + 4);
  const isWhole = (flags >> 5) & 1;
  const sizeBytes = flags >> 6 === 0 ? isWhole : 1 << (flags >> 6);
  if ((flags & 3) !== 0) throw new RangeError('it needs a dictionary');
  let place = start + 5 + (1 - isWhole) + sizeBytes;
  let most = 0;
  for (;;) {
    const header = view.getUint8(place) | (view.getUint16(place + 1, true) << 8);
    const [kind, length] = [(header >> 1) & 3, header >> 3];
    if (kind > COMPRESSED || length > MAX_BLOCK_BYTES) throw new RangeError('it is damaged');
    const lastBlock = place;
    place += 3 + (kind === RUN ? 1 : length);
    if (place > view.byteLength) throw new RangeError('it is cut off');
    most += kind === RAW || kind === RUN ? length : MAX_BLOCK_BYTES;
    if (header & 1) return { start, lastBlock, end: place, next: place + (flags & 4), most };
  }
}
