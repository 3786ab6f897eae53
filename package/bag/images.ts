/**
 * Images of ROS as files of standard formats: depth as PGM (whole numbers) or PFM (metres), colours as PPM or PGM.
 *
 * Source of the encodings: sensor_msgs/image_encodings.hpp; of depth: REP 118; of the files: netpbm (pgm, ppm), P. Debevec
 * (pfm).
 */
import { takeBytes } from '../base/buffers.js';
import { lookUp } from '../base/look_up.js';
import { MessageError } from './cdr.js';
import type { ImageMessage } from './messages.js';

/** Depth by encoding: bytes of a value, and how it is read. */
const DEPTH = {
  '16UC1': { bytes: 2, kind: 'whole' },
  mono16: { bytes: 2, kind: 'whole' },
  '16SC1': { bytes: 2, kind: 'signed' },
  '8UC1': { bytes: 1, kind: 'whole' },
  mono8: { bytes: 1, kind: 'whole' },
  '32FC1': { bytes: 4, kind: 'float' },
  '64FC1': { bytes: 8, kind: 'float' },
} as Record<string, { bytes: number; kind: 'whole' | 'signed' | 'float' }>;
/** Colours by encoding: bytes of a pixel, and where red, green and blue lie in it. */
const COLOR = {
  rgb8: { bytes: 3, channels: [0, 1, 2] },
  '8UC3': { bytes: 3, channels: [2, 1, 0] },
  bgr8: { bytes: 3, channels: [2, 1, 0] },
  rgba8: { bytes: 4, channels: [0, 1, 2] },
  bgra8: { bytes: 4, channels: [2, 1, 0] },
  '8UC4': { bytes: 4, channels: [2, 1, 0] },
  rgb16: { bytes: 6, channels: [0, 1, 2], wide: true },
  bgr16: { bytes: 6, channels: [2, 1, 0], wide: true },
  rgba16: { bytes: 8, channels: [0, 1, 2], wide: true },
  bgra16: { bytes: 8, channels: [2, 1, 0], wide: true },
} as Record<string, { bytes: number; channels: [number, number, number]; wide?: boolean }>;
/** Two pixels in four bytes: where the two shades and the two colour values lie. */
const YUV = {
  yuv422: { y: [1, 3], u: 0, v: 2 },
  uyvy: { y: [1, 3], u: 0, v: 2 },
  yuv422_yuy2: { y: [0, 2], u: 1, v: 3 },
  yuyv: { y: [0, 2], u: 1, v: 3 },
} as Record<string, { y: [number, number]; u: number; v: number }>;
const OTHER_RECORDING = 'Record it as rgb8 or bgr8 (image_proc makes image_color), or choose another topic';

/** What an image of this encoding can be used as. */
export function usesOf(encoding: string): ('depth' | 'color')[] {
  if (encoding === 'mono8' || encoding === '8UC1') return ['depth', 'color'];
  if (encoding === 'mono16') return ['depth', 'color'];
  if (lookUp(DEPTH, encoding)) return ['depth'];
  return lookUp(COLOR, encoding) || lookUp(YUV, encoding) ? ['color'] : [];
}

/** Ending of the file that a depth image becomes. */
export function depthEnding(encoding: string) {
  return lookUp(DEPTH, encoding)?.kind === 'float' ? 'pfm' : 'pgm';
}

/** Ending of the file that a colour image becomes. */
export function colorEnding(encoding: string) {
  return lookUp(DEPTH, encoding) ? 'pgm' : 'ppm';
}

/** A depth image as PGM, or as PFM in metres where its values are fractions. */
export function depthFile(image: ImageMessage) {
  const kind = lookUp(DEPTH, image.encoding);
  if (!kind) throw new MessageError(`An image of the encoding ${image.encoding} is not a depth image`, OTHER_RECORDING);
  const rows = rowsOf(image, image.width * kind.bytes);
  if (kind.kind === 'float') return floatFile(image, rows, kind.bytes === 8);
  return wholeFile(image, rows, kind.bytes === 2, kind.kind === 'signed');
}

/** A colour image as PPM, or as PGM where it is grey. */
export function colorFile(image: ImageMessage) {
  const { encoding, width, height } = image;
  const [grey, color, yuv] = [lookUp(DEPTH, encoding), lookUp(COLOR, encoding), lookUp(YUV, encoding)];
  if (grey && grey.kind === 'whole') {
    const rows = rowsOf(image, width * grey.bytes);
    if (grey.bytes === 1) return wholeFile(image, rows, false, false);
    return greyFile(image, rows);
  }
  if (!color && !yuv) {
    throw new MessageError(`Colours of the encoding ${encoding} are not read`, OTHER_RECORDING);
  }
  // First of all, whether the message holds so many pixels.
  const rows = rowsOf(image, color ? width * color.bytes : 4 * Math.ceil(width / 2));
  const { bytes: file, body } = startFile(`P6\n${width} ${height}\n255\n`, 3 * width * height);
  if (color) {
    const [red, green, blue] = color.channels.map((channel) => {
      return color.wide ? 2 * channel + (image.bigEndian ? 0 : 1) : channel;
    });
    let out = body;
    for (let v = 0; v < height; v += 1) {
      let place = v * rows.stride;
      for (let u = 0; u < width; u += 1, place += color.bytes, out += 3) {
        file[out] = rows.bytes[place + (red ?? 0)] ?? 0;
        file[out + 1] = rows.bytes[place + (green ?? 0)] ?? 0;
        file[out + 2] = rows.bytes[place + (blue ?? 0)] ?? 0;
      }
    }
  } else if (yuv) writeYuv(file, body, image, rows, yuv);
  return file;
}

/**
 * Where the rows lie, which may be padded.
 * @param least bytes of a row
 */
function rowsOf({ width, height, step, data }: ImageMessage, least: number) {
  if (width === 0 || height === 0) throw new MessageError(`The image has ${width} x ${height} pixels`);
  // Some drivers leave the step at zero.
  const stride = step === 0 ? least : step;
  if (stride < least) {
    throw new MessageError(`The image's rows are said to have ${step} bytes, and ${width} pixels take ${least}`);
  }
  const needed = stride * (height - 1) + least;
  if (data.length < needed) {
    throw new MessageError(
      `The image is shorter than its header says: ${width} x ${height} pixels take ${needed} bytes, and it has ${data.length}`,
    );
  }
  return { bytes: data, stride };
}

/** What comes after the header is to be written, all of it. */
function startFile(header: string, bodyBytes: number) {
  const head = new TextEncoder().encode(header);
  const bytes = takeBytes(head.length + bodyBytes);
  bytes.set(head);
  return { bytes, body: head.length };
}

/**
 * @param isWide 16 bits, which PGM has with the high byte first
 * @param isSigned values below zero mean nothing
 */
function wholeFile(
  { width, height, bigEndian }: ImageMessage,
  { bytes, stride }: { bytes: Uint8Array; stride: number },
  isWide: boolean,
  isSigned: boolean,
) {
  const { bytes: file, body } = startFile(
    `P5\n${width} ${height}\n${isWide ? 65535 : 255}\n`,
    width * height * (isWide ? 2 : 1),
  );
  const rowBytes = isWide ? 2 * width : width;
  for (let v = 0, out = body; v < height; v += 1, out += rowBytes) {
    const row = bytes.subarray(v * stride, v * stride + rowBytes);
    file.set(row, out);
    if (!isWide) continue;
    for (let place = out; place < out + rowBytes; place += 2) {
      const [first, second] = [file[place] ?? 0, file[place + 1] ?? 0];
      const [high, low] = bigEndian ? [first, second] : [second, first];
      const isLost = isSigned && high > 127;
      file[place] = isLost ? 0 : high;
      file[place + 1] = isLost ? 0 : low;
    }
  }
  return file;
}

/** Shades of 16 bits, of which 8 are seen. */
function greyFile(
  { width, height, bigEndian }: ImageMessage,
  { bytes, stride }: { bytes: Uint8Array; stride: number },
) {
  const { bytes: file, body } = startFile(`P5\n${width} ${height}\n255\n`, width * height);
  for (let v = 0, out = body; v < height; v += 1) {
    let place = v * stride + (bigEndian ? 0 : 1);
    for (let u = 0; u < width; u += 1, place += 2, out += 1) file[out] = bytes[place] ?? 0;
  }
  return file;
}

/** Metres; the last row comes first, the low byte of a value too. */
function floatFile(
  { width, height, bigEndian }: ImageMessage,
  { bytes, stride }: { bytes: Uint8Array; stride: number },
  isDouble: boolean,
) {
  const { bytes: file, body } = startFile(`Pf\n${width} ${height}\n-1.0\n`, 4 * width * height);
  const source = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const target = new DataView(file.buffer);
  for (let v = 0, out = body; v < height; v += 1) {
    const start = (height - 1 - v) * stride;
    if (!isDouble && !bigEndian) {
      file.set(bytes.subarray(start, start + 4 * width), out);
      out += 4 * width;
      continue;
    }
    for (let u = 0; u < width; u += 1, out += 4) {
      const value = isDouble
        ? source.getFloat64(start + 8 * u, !bigEndian)
        : source.getFloat32(start + 4 * u, !bigEndian);
      target.setFloat32(out, value, true);
    }
  }
  return file;
}

/** ITU-R BT.601 with shades of 16 to 235, as cameras send them. */
function writeYuv(
  file: Uint8Array,
  body: number,
  { width, height }: ImageMessage,
  { bytes, stride }: { bytes: Uint8Array; stride: number },
  layout: { y: [number, number]; u: number; v: number },
) {
  const clamp = (value: number) => Math.max(0, Math.min(255, Math.round(value)));
  let out = body;
  for (let v = 0; v < height; v += 1) {
    for (let u = 0; u < width; u += 1, out += 3) {
      const place = v * stride + 4 * (u >> 1);
      const shade = 1.164 * ((bytes[place + layout.y[u & 1 ? 1 : 0]] ?? 0) - 16);
      const [blue, red] = [(bytes[place + layout.u] ?? 0) - 128, (bytes[place + layout.v] ?? 0) - 128];
      file[out] = clamp(shade + 1.596 * red);
      file[out + 1] = clamp(shade - 0.392 * blue - 0.813 * red);
      file[out + 2] = clamp(shade + 2.017 * blue);
    }
  }
}
