/** An animated PNG from single ones (the APNG specification of Mozilla, part of PNG since its third edition). */
import { crc32 } from '../../../package/base/crc32.js';

const SIGNATURE = 8;
/** Chunks of the first picture that hold for all. */
const HEADERS = new Set(['IHDR', 'PLTE', 'tRNS', 'sRGB', 'gAMA']);

interface Chunk {
  type: string;
  data: Uint8Array;
}

/** `frames`: PNG files of one size and colour type, each with its duration (ms); the animation repeats endlessly. */
export function animatedPng(frames: readonly { png: Uint8Array; milliseconds: number }[]): Blob {
  const [first] = frames;
  if (!first) throw new Error('An animation needs a picture.');
  const chunks = frames.map(({ png }) => chunksOf(png));
  const header = chunks[0]?.find(({ type }) => type === 'IHDR')?.data ?? new Uint8Array(13);
  const parts: Uint8Array[] = [first.png.slice(0, SIGNATURE)];
  const put = (type: string, ...data: readonly Uint8Array[]): void => void parts.push(chunk(type, data));
  for (const { type, data } of chunks[0] ?? []) if (HEADERS.has(type)) put(type, data);
  put('acTL', words(frames.length, 0));
  let sequence = 0;
  frames.forEach(({ milliseconds }, i) => {
    put('fcTL', words(sequence++), header.subarray(0, 8), words(0, 0), control(milliseconds));
    for (const { type, data } of chunks[i] ?? []) {
      if (type !== 'IDAT') continue;
      if (i === 0) put('IDAT', data);
      else put('fdAT', words(sequence++), data);
    }
  });
  put('IEND');
  return new Blob(
    parts.map((part) => new Uint8Array(part)),
    { type: 'image/apng' },
  );
}

function chunksOf(png: Uint8Array): Chunk[] {
  const view = new DataView(png.buffer, png.byteOffset, png.byteLength);
  const chunks: Chunk[] = [];
  for (let at = SIGNATURE; at + 12 <= png.length;) {
    const length = view.getUint32(at);
    const type = String.fromCharCode(...png.subarray(at + 4, at + 8));
    chunks.push({ type, data: png.subarray(at + 8, at + 8 + length) });
    at += 12 + length;
  }
  return chunks;
}

function chunk(type: string, data: readonly Uint8Array[]): Uint8Array {
  const length = data.reduce((sum, { length }) => sum + length, 0);
  const bytes = new Uint8Array(12 + length);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, length);
  for (let i = 0; i < 4; i++) bytes[4 + i] = type.charCodeAt(i);
  let at = 8;
  for (const part of data) {
    bytes.set(part, at);
    at += part.length;
  }
  view.setUint32(8 + length, crc32(bytes.subarray(4, 8 + length)));
  return bytes;
}

function words(...values: readonly number[]): Uint8Array {
  const bytes = new Uint8Array(4 * values.length);
  const view = new DataView(bytes.buffer);
  values.forEach((value, i) => view.setUint32(4 * i, value));
  return bytes;
}

/** The duration of a frame, which replaces the one before. */
function control(milliseconds: number): Uint8Array {
  const bytes = new Uint8Array(6);
  const view = new DataView(bytes.buffer);
  view.setUint16(0, Math.round(milliseconds));
  view.setUint16(2, 1000);
  return bytes;
}
