/** Pictures as browsers show them: PNG and JPEG as they are, pixmaps as bitmaps. */
import type { Content } from '../../../package/recording_reader.js';

const HEADER_BYTES = 54;

/** For an image element. */
export async function pictureOf({ path, blob, read }: Content): Promise<Blob> {
  if (/\.(ppm|pgm)$/i.test(path)) return new Blob([bitmapOf(await read())], { type: 'image/bmp' });
  if (blob) return blob;
  const type = /\.jpe?g$/i.test(path) ? 'image/jpeg' : /\.png$/i.test(path) ? 'image/png' : '';
  return new Blob([new Uint8Array(await read())], { type });
}

/** A BMP of 24 bits (Microsoft, BITMAPINFOHEADER) of a PPM or PGM of 8 bits; empty where it is none. */
function bitmapOf(pixmap: Uint8Array): Uint8Array<ArrayBuffer> {
  const head = new TextDecoder('latin1').decode(pixmap.subarray(0, 64));
  const [header = '', kind, columns, rows] = head.match(/^P([56])\s+(\d+)\s+(\d+)\s+255\s/) ?? [];
  const [width, height, channels] = [Number(columns), Number(rows), kind === '6' ? 3 : 1];
  const body = pixmap.subarray(header.length);
  if (header === '' || body.length < width * height * channels) return new Uint8Array();
  const stride = (3 * width + 3) & ~3;
  const bytes = new Uint8Array(HEADER_BYTES + stride * height);
  const view = new DataView(bytes.buffer);
  bytes.set([0x42, 0x4d]);
  view.setUint32(2, bytes.length, true);
  view.setUint32(10, HEADER_BYTES, true);
  view.setUint32(14, 40, true);
  view.setInt32(18, width, true);
  view.setInt32(22, height, true);
  view.setUint16(26, 1, true);
  view.setUint16(28, 24, true);
  for (let v = 0; v < height; v++) {
    // From the bottom up, blue first.
    let out = HEADER_BYTES + (height - 1 - v) * stride;
    for (let place = v * width * channels; place < (v + 1) * width * channels; place += channels, out += 3) {
      for (let c = 0; c < 3; c++) bytes[out + c] = body[place + (channels === 3 ? 2 - c : 0)] ?? 0;
    }
  }
  return bytes;
}
