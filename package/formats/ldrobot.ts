/**
 * What an LD06, LD19 or STL-06P sends over its line, as bytes or as hexadecimal text: packets of 47 bytes, 54 2C, the speed (degrees a
 * second), the first angle (0.01 degrees, clockwise), twelve readings of a distance (mm) and a confidence, the last angle, a clock
 * (ms), and a checksum; numbers have the low byte first.
 *
 * Source: LDROBOT, "LD19 Development Manual", communication protocol (CRC-8, polynomial 4D).
 */

import { DEGREE } from '../base/units.js';
import { ReadingScans, type Scan } from './scan.js';

const [HEADER, LENGTH_CODE] = [0x54, 0x2c];
const PACKET = 47;
const READINGS = 12;
/** The clock begins anew (ms). */
const CLOCK = 30_000;
/** So many bytes at the beginning may belong to a packet that began before. */
const MOST_LEADING = 2 * PACKET;
const HEX = /^\s*(?:(?:0x)?[0-9a-f]{2}[\s,:-]*){94}/i;

const TABLE = Uint8Array.from({ length: 256 }, (_, byte) => {
  let sum = byte;
  for (let bit = 0; bit < 8; bit += 1) sum = sum & 0x80 ? ((sum << 1) ^ 0x4d) & 0xff : (sum << 1) & 0xff;
  return sum;
});

/** Where a whole packet with its checksum lies, from there on; -1 where none does. */
function nextPacket(bytes: Uint8Array, from: number, most: number = Infinity) {
  const last = Math.min(bytes.length - PACKET, from + most);
  for (let at = from; at <= last; at += 1) {
    if (bytes[at] === HEADER && bytes[at + 1] === LENGTH_CODE) {
      const sum = bytes.subarray(at, at + PACKET - 1).reduce((crc, byte) => TABLE[crc ^ byte] ?? 0, 0);
      if (sum === bytes[at + PACKET - 1]) return at;
    }
  }
  return -1;
}

/** Whether a file begins with two packets, one behind the other. */
export function isLdrobot(head: Uint8Array) {
  const first = nextPacket(head, 0, MOST_LEADING);
  return first >= 0 && nextPacket(head, first + PACKET, 0) === first + PACKET;
}

/** The bytes of a hexadecimal text; null where it is none. */
export function bytesOfHex(text: string) {
  if (!HEX.test(text)) return null;
  const digits = text.match(/[0-9a-f]{2}/gi) ?? [];
  return Uint8Array.from(digits, (pair) => Number.parseInt(pair, 16));
}

/**
 * A scan a turn; the first and the last, which are parts of one, only where there is no other.
 * @returns numBroken: bytes that belong to no whole packet, in packets
 */
export function readLdrobot(bytes: Uint8Array): { scans: Scan[]; numBroken: number } {
  const scans = new ReadingScans();
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let [last, turns, before, numRead] = [Infinity, 0, 0, 0];
  for (let at = nextPacket(bytes, 0); at >= 0; at = nextPacket(bytes, at + PACKET)) {
    numRead += 1;
    const [start, end] = [view.getUint16(at + 4, true), view.getUint16(at + 42, true)];
    const clock = view.getUint16(at + 44, true);
    if (clock < before) turns += 1;
    before = clock;
    const step = ((end - start + 36_000) % 36_000) / (READINGS - 1);
    for (let reading = 0; reading < READINGS; reading += 1) {
      const angle = ((start + step * reading) % 36_000) / 100;
      if (angle < last - 180) scans.begin({ time: 1e-3 * (clock + CLOCK * turns) });
      last = angle;
      scans.add(-DEGREE * angle, 1e-3 * view.getUint16(at + 6 + 3 * reading, true));
    }
  }
  const isPart = ({ angles }: { angles: number[] }) =>
    angles.length < 2 || Math.abs((angles.at(-1) ?? 0) - (angles[0] ?? 0)) < 330 * DEGREE;
  const whole = scans.all.filter((scan) => !isPart(scan));
  const numBroken = Math.floor(bytes.length / PACKET) - numRead;
  return { scans: whole.length > 0 ? whole : scans.all, numBroken };
}
