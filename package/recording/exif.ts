/** The focal length that a picture's EXIF tells (JPEG, PNG with an eXIf chunk), in pixels of an image of any size. */
import { latin1 } from '../files/heads.js';

/** What is read of EXIF data stands within so many bytes of a picture. */
export const EXIF_BYTES = 2 ** 13;

const EXIF_IFD = 0x8769;
const FOCAL_LENGTH = 0x920a;
const FOCAL_LENGTH_35MM = 0xa405;
const [PLANE_X_RESOLUTION, PLANE_RESOLUTION_UNIT, PIXEL_X_DIMENSION] = [0xa20e, 0xa210, 0xa002];
/** Diagonal of a picture on 35 mm film (mm), by which cameras compare their focal lengths (CIPA DCG-001). */
const FILM_DIAGONAL = 43.27;
/** Of a unit of the focal plane's resolution (mm): inch, centimetre, millimetre, micrometre. */
const UNITS = { 2: 25.4, 3: 10, 4: 1, 5: 1e-3 } as Readonly<Record<number, number>>;
/** Bytes of a value of each type: byte, text, short, long, ratio, ..., signed long, signed ratio. */
const SIZES = [0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8];

/**
 * The focal length over the diagonal of the picture; null where it does not say.
 * @param head the first bytes of the picture's file
 */
export function focalShare(head: Uint8Array) {
  const start = exifStart(head);
  if (start === null) return null;
  try {
    const tags = readTags(new DataView(head.buffer, head.byteOffset + start, head.length - start));
    const film = tags.get(FOCAL_LENGTH_35MM) ?? 0;
    if (film > 0) return film / FILM_DIAGONAL;
    // Without: by the size of a pixel on the sensor.
    const [focal = 0, resolution = 0] = [tags.get(FOCAL_LENGTH), tags.get(PLANE_X_RESOLUTION)];
    const unit = UNITS[tags.get(PLANE_RESOLUTION_UNIT) ?? 2] ?? 0;
    const [width = 0, height = 0] = [tags.get(PIXEL_X_DIMENSION), tags.get(PIXEL_X_DIMENSION + 1)];
    const pixels = (focal * resolution) / unit;
    return pixels > 0 && width > 0 && height > 0 && Number.isFinite(pixels) ? pixels / Math.hypot(width, height) : null;
  } catch {
    return null; // it points beyond its end
  }
}

/** Where the TIFF header of the EXIF data stands. */
function exifStart(head: Uint8Array) {
  const text = latin1(head);
  const jpeg = head[0] === 0xff && head[1] === 0xd8 ? text.indexOf('Exif\0\0') : -1;
  if (jpeg >= 0) return jpeg + 6;
  const png = text.startsWith('\x89PNG') ? text.indexOf('eXIf') : -1;
  return png >= 0 ? png + 4 : null;
}

/** The first number of each tag, of the picture and of its EXIF part. */
function readTags(view: DataView) {
  const isLittle = view.getUint16(0) === 0x4949;
  const tags: Map<number, number> = new Map();
  const readTable = (start: number) => {
    const count = Math.min(view.getUint16(start, isLittle), 200);
    for (let i = 0; i < count; i += 1) {
      const at = start + 2 + 12 * i;
      const [tag, type] = [view.getUint16(at, isLittle), view.getUint16(at + 2, isLittle)];
      const isInside = (SIZES[type] ?? 8) * view.getUint32(at + 4, isLittle) <= 4;
      const place = isInside ? at + 8 : view.getUint32(at + 8, isLittle);
      if (type === 3) tags.set(tag, view.getUint16(place, isLittle));
      if (type === 4) tags.set(tag, view.getUint32(place, isLittle));
      if (type === 5) tags.set(tag, view.getUint32(place, isLittle) / view.getUint32(place + 4, isLittle));
    }
  };
  readTable(view.getUint32(4, isLittle));
  const exif = tags.get(EXIF_IFD);
  if (exif !== undefined) readTable(exif);
  return tags;
}
