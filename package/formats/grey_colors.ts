/**
 * PNG images of colours that hold shades alone, as libraries save a grey picture that they keep with three channels.
 *
 * Source: PNG specification (third edition), 9 and 10: a row is filtered channel by channel, so that channels are equal exactly where
 * their filtered bytes are.
 */
import { unzlibSync } from 'fflate';
import { joined, viewOf } from '../base/bytes.js';

/** Color types of 8 bits with their channels: colours, and colours with transparency. */
const CHANNELS: Record<number, number> = { 2: 3, 6: 4 };
/** More pixels than that are not looked at. */
const MAX_PIXELS = 2 ** 25;

/** Whether all pixels of a PNG of 8 bits a channel, not interlaced, have equal red, green and blue. */
export function holdsShades(png: Uint8Array): boolean {
  const view = viewOf(png);
  const parts: Uint8Array[] = [];
  for (let at = 8; at + 12 <= png.length; at += 12 + view.getUint32(at)) {
    const type = String.fromCharCode(...png.subarray(at + 4, at + 8));
    if (type === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const [width, height, channels] = [view.getUint32(16), view.getUint32(20), CHANNELS[png[25] ?? 0] ?? 0];
  const isInterlaced = png[28] !== 0;
  if (channels === 0 || png[24] !== 8 || isInterlaced || width * height > MAX_PIXELS) return false;
  const stride = 1 + width * channels;
  try {
    const rows = unzlibSync(joined(parts), { out: new Uint8Array(stride * height) });
    return rows.every((value, at) => {
      const channel = ((at % stride) - 1) % channels;
      return channel <= 0 || channel === 3 || value === rows[at - 1];
    });
  } catch {
    return false;
  }
}
