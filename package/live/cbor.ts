/**
 * What rosbridge packs as CBOR: maps, lists, texts, bytes and numbers.
 *
 * Source: RFC 8949, sections 3 and 3.3. Lengths that are not known in advance and halves of floats are not written by rosbridge.
 */

export type Value = number | string | boolean | null | Uint8Array | Value[] | { [key: string]: Value };

/** Maps and lists within one another. */
const MOST_DEPTH = 16;

/** @returns throws a RangeError where the bytes are no CBOR, or end early */
export function readCbor(bytes: Uint8Array): Value {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let place = 0;
  const take = (size: number) => {
    const start = place;
    if (start + size > bytes.length) throw new RangeError(`it ends after ${bytes.length} bytes`);
    place += size;
    return start;
  };
  const argument = (info: number) => {
    if (info < 24) return info;
    if (info === 24) return view.getUint8(take(1));
    if (info === 25) return view.getUint16(take(2));
    if (info === 26) return view.getUint32(take(4));
    if (info === 27) return Number(view.getBigUint64(take(8)));
    throw new RangeError(`it has a length of the kind ${info}`);
  };
  const simple = (info: number) => {
    if (info === 20 || info === 21) return info === 21;
    if (info === 26) return view.getFloat32(take(4));
    return info === 27 ? view.getFloat64(take(8)) : null;
  };
  const read = (depth: number): Value => {
    if (depth > MOST_DEPTH) throw new RangeError('its lists lie too deep within one another');
    const head = view.getUint8(take(1));
    const [kind, info] = [head >> 5, head & 31];
    if (kind === 7) return simple(info);
    const size = argument(info);
    if (kind === 0) return size;
    if (kind === 1) return -1 - size;
    if (kind === 6) return read(depth + 1); // a tag
    if (kind === 2 || kind === 3) {
      const start = take(size);
      const part = bytes.subarray(start, start + size);
      return kind === 2 ? part : new TextDecoder().decode(part);
    }
    if (size > bytes.length) throw new RangeError(`it claims to have ${size} entries`);
    if (kind === 4) return Array.from({ length: size }, () => read(depth + 1));
    return Object.fromEntries(Array.from({ length: size }, () => [String(read(depth + 1)), read(depth + 1)]));
  };
  return read(0);
}
