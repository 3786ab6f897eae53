/**
 * Packed images of ROS as files: PNG and JPEG as they are, and depth as image_transport packs it.
 *
 * Source: compressed_depth_image_transport (codec.cpp): a header of 12 bytes (what it is, and two parameters A and B),
 * then a PNG of 16 bits, whose values are millimetres, or, of depth in metres, A / depth + B; or else RVL (A. D. Wilson,
 * "Fast Lossless Depth Image Compression", ISS 2017).
 */
import { unzlibSync } from 'fflate';
import { joined } from '../base/bytes.js';
import { MessageError } from './cdr.js';
import { depthFile } from './images.js';
import type { CompressedMessage } from './messages.js';

const CONFIG_BYTES = 12;
const PNG = [0x89, 0x50, 0x4e, 0x47];
/** No depth camera has more pixels. */
const MAX_PIXELS = 2 ** 26;
/** Pixels of an image of any size in bytes, and beyond that the most a byte, as the engine has it for PNG. */
const [FREE_PIXELS, PIXELS_A_BYTE] = [2 ** 23, 20];
/** A byte of deflate can unfold to this many at the most. */
const MAX_INFLATION = 1032;

/**
 * What a packed image of this format can be used as. A PNG may hold either; its header says which.
 * @param data the beginning of the image
 */
export function useOfPacked(format: string, data: Uint8Array): 'depth' | 'color' | null {
  if (/compressedDepth/i.test(format)) return 'depth';
  if (startsAsPng(data)) return data[24] === 16 && data[25] === 0 ? 'depth' : 'color';
  return data[0] === 0xff && data[1] === 0xd8 ? 'color' : null;
}

/**
 * Ending of the file that it becomes.
 * @param data its beginning
 */
export function packedEnding(format: string, data: Uint8Array) {
  if (/compressedDepth/i.test(format)) return isFloat(format) ? 'pfm' : /rvl/i.test(format) ? 'pgm' : 'png';
  return startsAsPng(data) ? 'png' : 'jpg';
}

export function packedFile(image: CompressedMessage) {
  const { format, data } = image;
  if (!/compressedDepth/i.test(format)) {
    if (startsAsPng(data) || (data[0] === 0xff && data[1] === 0xd8)) return data.slice();
    throw new MessageError(`The image is packed as "${format}", which is not read`, 'Record it as PNG or JPEG');
  }
  const body = data.subarray(CONFIG_BYTES);
  const isRvl = /rvl/i.test(format);
  if (!isRvl && !startsAsPng(body)) {
    throw new MessageError('The packed depth holds no PNG behind its header of 12 bytes');
  }
  if (!isFloat(format) && !isRvl) return body.slice();
  const { width, height, values } = isRvl ? readRvl(body) : readGreyPng(body);
  const pixels = isFloat(format) ? toMetres(values, data) : values;
  return depthFile({
    stamp: image.stamp,
    frame: image.frame,
    width,
    height,
    encoding: isFloat(format) ? '32FC1' : '16UC1',
    // As this machine has them: typed arrays are written as they lie.
    bigEndian: new Uint8Array(Uint16Array.of(1).buffer)[0] === 0,
    step: 0,
    data: new Uint8Array(pixels.buffer),
  });
}

function isFloat(format: string) {
  return /^\s*32FC1/.test(format);
}

function startsAsPng(bytes: Uint8Array) {
  return PNG.every((byte, index) => bytes[index] === byte);
}

/** depth = A / (value - B); zero means that nothing was measured. */
function toMetres(values: Uint16Array, data: Uint8Array) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const [a, b] = [view.getFloat32(4, true), view.getFloat32(8, true)];
  return Float32Array.from(values, (value) => (value === 0 ? Number.NaN : a / (value - b)));
}

/** @param bytes of the packed image */
function checkSize(width: number, height: number, bytes: number) {
  const most = Math.min(MAX_PIXELS, Math.max(FREE_PIXELS, PIXELS_A_BYTE * bytes));
  if (!(width > 0 && height > 0 && width * height <= most)) {
    throw new MessageError(`The packed depth claims ${width} x ${height} pixels, in ${bytes} bytes`);
  }
}

/** A grey PNG of 16 bits, not interlaced (PNG specification, 9 and 11.2). */
function readGreyPng(file: Uint8Array) {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const parts: Uint8Array[] = [];
  for (let place = 8; place + 12 <= file.length;) {
    const length = view.getUint32(place);
    if (view.getUint32(place + 4) === 0x49444154) parts.push(file.subarray(place + 8, place + 8 + length)); // IDAT
    place += 12 + length;
  }
  const isGrey16 = file.length > 33 && file[24] === 16 && file[25] === 0 && file[28] === 0;
  if (!isGrey16 || parts.length === 0) throw new MessageError('The packed depth is not a grey PNG of 16 bits');
  const [width, height] = [view.getUint32(16), view.getUint32(20)];
  checkSize(width, height, file.length);
  const rowBytes = 2 * width;
  const rows = unpackPng(parts, (rowBytes + 1) * height);
  const values = new Uint16Array(width * height);
  let before = new Uint8Array(rowBytes);
  for (let v = 0; v < height; v += 1) {
    const start = v * (rowBytes + 1);
    const row = rows.subarray(start + 1, start + 1 + rowBytes);
    unfilter(rows[start] ?? 0, row, before);
    for (let u = 0; u < width; u += 1) values[v * width + u] = ((row[2 * u] ?? 0) << 8) | (row[2 * u + 1] ?? 0);
    before = row;
  }
  return { width, height, values };
}

function unpackPng(parts: Uint8Array[], size: number) {
  const packed = joined(parts);
  if (size > MAX_INFLATION * packed.length) throw new MessageError('The PNG of the packed depth is cut off');
  let rows;
  try {
    rows = unzlibSync(packed, { out: new Uint8Array(size) });
  } catch (error) {
    throw new MessageError(`The PNG of the packed depth is damaged (${(error as Error).message})`);
  }
  if (rows.length < size) throw new MessageError('The PNG of the packed depth is cut off');
  return rows;
}

/** Undoes what a row was made smaller with, in place. */
function unfilter(filter: number, row: Uint8Array, above: Uint8Array) {
  const pixelBytes = 2;
  for (let index = 0; index < row.length; index += 1) {
    const left = index < pixelBytes ? 0 : (row[index - pixelBytes] ?? 0);
    const up = above[index] ?? 0;
    const corner = index < pixelBytes ? 0 : (above[index - pixelBytes] ?? 0);
    const guess = [0, left, up, (left + up) >> 1, paeth(left, up, corner)][filter] ?? 0;
    row[index] = (row[index] ?? 0) + guess;
  }
}

function paeth(left: number, up: number, corner: number) {
  const guess = left + up - corner;
  const [toLeft, toUp, toCorner] = [Math.abs(guess - left), Math.abs(guess - up), Math.abs(guess - corner)];
  if (toLeft <= toUp && toLeft <= toCorner) return left;
  return toUp <= toCorner ? up : corner;
}

/**
 * Runs of zeros and of differences, in numbers of three bits and a bit that says whether more follow.
 * @param body width and height, then the code
 */
function readRvl(body: Uint8Array) {
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  if (body.length < 8) throw new MessageError('The packed depth ends within its header');
  const [width, height] = [view.getUint32(0, true), view.getUint32(4, true)];
  checkSize(width, height, body.length);
  const next = numbersOfRvl(view);
  const count = width * height;
  // Grows as it is filled: what a header claims is taken only where the code goes so far.
  let values = new Uint16Array(Math.min(count, 2 * body.length));
  let previous = 0;
  for (let filled = 0; filled < count;) {
    const [zeros, run] = [next(), next()];
    const end = filled + zeros + run;
    if (end > count) throw new MessageError(`The packed depth is damaged: a run leads beyond its ${count} pixels`);
    if (end > values.length) values = grown(values, Math.min(count, 2 * end));
    for (filled += zeros; filled < end; filled += 1) {
      const code = next();
      previous = (previous + ((code >>> 1) ^ -(code & 1))) & 0xffff;
      values[filled] = previous;
    }
  }
  return { width, height, values };
}

function grown(values: Uint16Array, length: number) {
  const longer = new Uint16Array(length);
  longer.set(values);
  return longer;
}

/**
 * The numbers of a code, one after the other.
 * @param view of width and height, then the code
 */
function numbersOfRvl(view: DataView) {
  let [place, word, left] = [8, 0, 0];
  return () => {
    let value = 0;
    for (let shift = 0; shift < 30; shift += 3) {
      if (left === 0) {
        if (place + 4 > view.byteLength) throw new MessageError('The packed depth is cut off');
        word = view.getUint32(place, true);
        place += 4;
        left = 8;
      }
      const nibble = word >>> 28;
      word <<= 4;
      left -= 1;
      value |= (nibble & 7) << shift;
      if (!(nibble & 8)) break;
    }
    return value;
  };
}
