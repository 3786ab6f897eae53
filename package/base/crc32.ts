/** The checksum of ZIP, PNG and MCAP. */

/** Tables for eight bytes in one step, one after the other. */
let tables: Uint32Array | undefined;

/**
 * CRC-32 of ISO 3309. Eight bytes a step: bags are gigabytes.
 *
 * Source: M. E. Kounavis, F. L. Berry, "A Systematic Approach to Building High Performance Software-based CRC
 * Generators", ISCC 2005 (slicing by eight).
 */
export function crc32(bytes: Uint8Array) {
  const table = (tables ??= makeTables());
  const at = (index: number) => table[index] as number;
  let crc = 0xffffffff;
  let place = 0;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  for (; place + 8 <= bytes.length; place += 8) {
    const low = crc ^ view.getUint32(place, true);
    const high = view.getUint32(place + 4, true);
    crc =
      at(7 * 256 + (low & 0xff)) ^
      at(6 * 256 + ((low >>> 8) & 0xff)) ^
      at(5 * 256 + ((low >>> 16) & 0xff)) ^
      at(4 * 256 + (low >>> 24)) ^
      at(3 * 256 + (high & 0xff)) ^
      at(2 * 256 + ((high >>> 8) & 0xff)) ^
      at(256 + ((high >>> 16) & 0xff)) ^
      at(high >>> 24);
  }
  for (; place < bytes.length; place += 1) {
    crc = (crc >>> 8) ^ at((crc ^ (bytes[place] as number)) & 0xff);
  }
  return ~crc >>> 0;
}

function makeTables() {
  const made = new Uint32Array(8 * 256);
  for (let index = 0; index < 256; index += 1) {
    let value = index;
    for (let bit = 0; bit < 8; bit += 1) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
    made[index] = value;
  }
  for (let index = 256; index < made.length; index += 1) {
    const before = made[index - 256] ?? 0;
    made[index] = (before >>> 8) ^ (made[before & 0xff] ?? 0);
  }
  return made;
}
