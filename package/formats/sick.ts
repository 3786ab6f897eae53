/**
 * SICK's telegrams with LMDscandata, as text (CoLa A) or as a socket delivers the binary ones (CoLa B): four bytes 02, the length,
 * the telegram, a checksum over it; numbers have the high byte first.
 *
 * Source of the layout: SICK, "Telegram listing: ranging sensors LMS1xx, LMS5xx, TiM5xx, ...".
 */
import { viewOf } from '../base/bytes.js';
import { DEGREE } from '../base/units.js';
import type { Scan } from './scan.js';

const START = 0x02020202;
/** What a telegram with a scan begins with, asked for once or sent again and again. */
const NAME = /^s(SN|RA) LMDscandata /;
const NAME_BYTES = 16;
/** From the version to the frequency of the measurements. */
const FIXED_BYTES = 36;
/** A position and a speed. */
const ENCODER_BYTES = 6;
const HEAD_BYTES = 8;

/** Whether a file begins so. */
export function isSickBinary(head: Uint8Array) {
  return (
    head.length > HEAD_BYTES + NAME_BYTES && viewOf(head).getUint32(0) === START && NAME.test(textOf(head, HEAD_BYTES))
  );
}

function textOf(bytes: Uint8Array, start: number) {
  return String.fromCharCode(...bytes.subarray(start, start + NAME_BYTES));
}

/**
 * The scans of all whole telegrams.
 * @returns numBroken: telegrams that are cut off or whose checksum is wrong
 */
export function readSickBinary(bytes: Uint8Array): { scans: Scan[]; numBroken: number } {
  const view = viewOf(bytes);
  // What a checksum is over is the difference of two of these: each byte counts once, whatever lengths claim.
  const sums = new Uint8Array(bytes.length + 1);
  bytes.forEach((byte, index) => (sums[index + 1] = (sums[index] ?? 0) ^ byte));
  const scans: Scan[] = [];
  let numBroken = 0;
  for (let at = 0; at + HEAD_BYTES < bytes.length;) {
    if (view.getUint32(at) !== START) {
      at += 1;
      continue;
    }
    const start = at + HEAD_BYTES;
    const end = start + view.getUint32(at + 4);
    const body = bytes.subarray(start, end);
    const isWhole = end < bytes.length && ((sums[end] ?? 0) ^ (sums[start] ?? 0)) === bytes[end];
    const scan = isWhole && NAME.test(textOf(body, 0)) ? scanOf(viewOf(body)) : null;
    if (scan) scans.push(scan);
    else if (!isWhole) numBroken += 1;
    // After a damaged one, the next may begin anywhere.
    at = isWhole ? end + 1 : at + 4;
  }
  return { scans, numBroken };
}

/** The first channel of 16 bits, if it holds distances. */
function scanOf(body: DataView): Scan | null {
  let at = NAME_BYTES + FIXED_BYTES;
  if (body.byteLength < at + 2) return null;
  at += 2 + ENCODER_BYTES * body.getUint16(at);
  if (body.byteLength < at + 23 || body.getUint16(at) === 0) return null;
  const channel = at + 2;
  const name = String.fromCharCode(...new Uint8Array(body.buffer, body.byteOffset + channel, 5));
  const [scale, offset] = [body.getFloat32(channel + 5), body.getFloat32(channel + 9)];
  const [start, step, count] = [
    body.getInt32(channel + 13),
    body.getUint16(channel + 17),
    body.getUint16(channel + 19),
  ];
  if (!name.startsWith('DIST') || body.byteLength < channel + 21 + 2 * count || count < 2 || step === 0) return null;
  const ranges = Array.from({ length: count }, (_, reading) => body.getUint16(channel + 21 + 2 * reading));
  return {
    ranges: ranges.map((range) => (range > 0 ? 1e-3 * (scale * range + offset) : null)),
    // In 1/10000 degrees; 90 degrees lie ahead.
    start: DEGREE * (start / 10000 - 90),
    step: (DEGREE * step) / 10000,
    // Since the device was switched on, in µs.
    time: 1e-6 * body.getUint32(NAME_BYTES + 14),
  };
}

/**
 * The first measured channel of each telegram: `DIST1 scale offset start step count values`, hexadecimal; the start in
 * 1/10000
 * degrees, 90 degrees ahead for the LMS and TiM (SICK, "Telegram listing: ranging sensors").
 * @returns numBroken: telegrams that are cut off or damaged
 */
export function readSickText(text: string): { scans: Scan[]; numBroken: number } {
  let numBroken = 0;
  const scans = text.split(/(?=\bLMDscandata )/).flatMap((telegram) => {
    const words = telegram.trim().split(/\s+/);
    const at = words.indexOf('DIST1');
    const number = (index: number) => Number.parseInt(words[at + index] ?? '', 16);
    const count = number(5);
    if (at < 0 || !(count > 1) || at + 6 + count > words.length) {
      numBroken += telegram.startsWith('LMDscandata') ? 1 : 0;
      return [];
    }
    const factor = words[at + 1] === '40000000' ? 2 : 1;
    // Signed, in 32 bits.
    const start = (number(3) | 0) / 10000;
    const ranges = Array.from({ length: count }, (_, i) => number(6 + i));
    return [
      {
        ranges: ranges.map((range) => (range > 0 ? 1e-3 * factor * range : null)),
        start: DEGREE * (start - 90),
        step: (DEGREE * number(4)) / 10000,
        ...timeOfTelegram(words),
      },
    ];
  });
  return { scans, numBroken };
}

/** Since the device was switched on (s), from µs. */
function timeOfTelegram(words: readonly string[]) {
  const microseconds = Number.parseInt(words[words.indexOf('LMDscandata') + 8] ?? '', 16);
  return Number.isFinite(microseconds) ? { time: 1e-6 * microseconds } : {};
}
