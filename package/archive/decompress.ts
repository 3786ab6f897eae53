/** What may come of packed bytes, and LZ4; for Zstandard see zstd.js. */

/** So much may come of however few packed bytes; ... */
const FREE_BYTES = 2 ** 23;
/** ... beyond that, so many times the packed ones. */
const MOST_RATIO = 20;
const LZ4_MAGIC = 0x184d2204;

/**
 * Refuses what is packed so densely that it can only be meant to fill the memory.
 * @param packed bytes
 * @param size bytes, unpacked
 */
export function mustBePlausible(packed: number, size: number) {
  const most = FREE_BYTES + MOST_RATIO * packed;
  if (size > most) {
    throw new RangeError(`${packed} bytes claim to unpack to ${size}, and at most ${most} are accepted of so few`);
  }
}

/**
 * Frames of LZ4; their checksums are left to the container's own.
 *
 * Source of the layout: Y. Collet, "LZ4 Frame Format Description" 1.6.4 and "LZ4 Block Format Description".
 * @param size of what comes out
 * @param take memory to unpack into, of at least so many bytes
 */
export function unpackLz4(
  packed: Uint8Array,
  size: number,
  take: (size: number) => Uint8Array = (size) => new Uint8Array(size),
) {
  mustBePlausible(packed.length, size);
  // Memory that is not written to is not taken.
  const output = take(size).subarray(0, size);
  const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
  let filled = 0;
  for (let place = 0; place < packed.length;) {
    const magic = view.getUint32(place, true);
    place += 4;
    if (magic >>> 4 === 0x184d2a5) {
      place += 4 + view.getUint32(place, true); // a frame to be skipped
      continue;
    }
    if (magic !== LZ4_MAGIC) throw new RangeError('it does not begin with the signature of LZ4');
    const flags = view.getUint8(place);
    place += 3 + (flags & 8 ? 8 : 0) + (flags & 1 ? 4 : 0);
    for (;;) {
      const header = view.getUint32(place, true);
      place += 4;
      if (header === 0) break;
      const length = header & 0x7fffffff;
      if (place + length > packed.length) throw new RangeError('it is cut off');
      const block = packed.subarray(place, place + length);
      if (header >>> 31) {
        if (filled + length > size) throw new RangeError('it unpacks to more than its header says');
        output.set(block, filled);
        filled += length;
      } else filled = unpackLz4Block(block, output, filled);
      place += length + (flags & 16 ? 4 : 0);
    }
    place += flags & 4 ? 4 : 0;
  }
  return output.subarray(0, filled);
}

/** Literals, then a copy of what came before, again and again. */
function unpackLz4Block(block: Uint8Array, output: Uint8Array, filled: number) {
  let place = 0;
  let end = filled;
  const lengthOf = (nibble: number) => {
    let length = nibble;
    for (let byte = 255; nibble === 15 && byte === 255;) {
      byte = block[place] ?? 0;
      place += 1;
      length += byte;
    }
    return length;
  };
  while (place < block.length) {
    const token = block[place] ?? 0;
    place += 1;
    const literals = lengthOf(token >> 4);
    if (place + literals > block.length || end + literals > output.length) {
      throw new RangeError('it is damaged');
    }
    output.set(block.subarray(place, place + literals), end);
    place += literals;
    end += literals;
    if (place >= block.length) break; // the last sequence has no copy
    const distance = (block[place] ?? 0) | ((block[place + 1] ?? 0) << 8);
    place += 2;
    const length = lengthOf(token & 15) + 4;
    if (distance === 0 || distance > end || end + length > output.length) throw new RangeError('it is damaged');
    // The copy may reach into itself.
    if (distance >= length) output.copyWithin(end, end - distance, end - distance + length);
    else for (let index = 0; index < length; index += 1) output[end + index] = output[end + index - distance] ?? 0;
    end += length;
  }
  return end;
}
