/** bzip2, which chunks of ROS 1 bags, whole bags and archives may be packed with. */
import { joined, PIECE_BYTES } from '../base/bytes.js';
import { TooLarge } from '../base/errors.js';
import { byFormatsEngine, type FormatsEngine } from './formats_engine.js';

/**
 * @param packed one stream or several, one behind the other
 * @param size bytes that come out
 * @returns at most `size` bytes; rejects with a RangeError where the stream is damaged, a TooLarge where it holds more
 */
export async function unpackBzip2(packed: Uint8Array, size: number): Promise<Uint8Array> {
  const damaged = (reason: string) => new RangeError(reason);
  const { chunks, left, isComplete } = await byFormatsEngine((engine) => unpack(engine, packed, size), damaged);
  if (left < 0) throw new TooLarge('it unpacks to more than its header says');
  if (!isComplete) throw damaged('it is cut off');
  return joined(chunks);
}

/** Ends soon after `size` bytes. */
function unpack({ Bzip2 }: FormatsEngine, packed: Uint8Array, size: number) {
  const unpacker = new Bzip2();
  const chunks: Uint8Array[] = [];
  let left = size;
  try {
    for (let place = 0; place < packed.length && left >= 0; place += PIECE_BYTES) {
      const chunk = unpacker.push(packed.subarray(place, place + PIECE_BYTES), left);
      chunks.push(chunk);
      left -= chunk.length;
    }
    return { chunks, left, isComplete: unpacker.is_complete };
  } finally {
    unpacker.free();
  }
}
