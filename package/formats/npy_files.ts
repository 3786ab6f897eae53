/**
 * What a file of NumPy arrays is: depth images and colours (one, or a stack of them), points, bearings and ranges, a scan, a table of
 * scans. Shapes tell, and names where a shape may be two things.
 */
import { colorFile, depthFile } from '../bag/images.js';
import { baseOf, folderOf, hintOf } from '../files/names.js';
import type { Numbers } from './mat.js';
import { cutOff, type Header, npyHeader, readNpy } from './npy.js';
import { pointsFile } from './ply.js';
import { polarTable } from './polar.js';

/** suffix: what its name ends with, in place of `.npy`; make: of the bytes of the array */
type Part = { suffix: string; isCloud?: true; make: (bytes: Uint8Array, name: string) => Uint8Array };

/** Images are no smaller, and no laser has fewer readings. */
const MIN_SIDE = 24;
/** So many arrays of one shape are images, whatever their names say. */
const MIN_IMAGES = 3;
/** Of one array of three columns alone, fewer rows may be a path. */
const MIN_POINTS = 1000;
const PATHS = /traj|pose|odom|path|truth|gt|ref|calib|time|extrin|intrin/i;
/** Encodings of ROS of the values that depth has. */
const ENCODINGS: Readonly<Record<string, string>> = { u1: '8UC1', u2: '16UC1', i2: '16SC1', f4: '32FC1', f8: '64FC1' };

/**
 * The files that an array becomes; none where it is no image, no points and no single scan.
 * @param size of the file (bytes)
 * @param numAlike arrays of this shape in its folder
 * @param bytes of the array; of images its beginning is enough
 */
export function partsOf(path: string, header: Header, size: number, numAlike: number, bytes: Uint8Array): Part[] {
  const { dims, code } = header;
  const images = imagesOf(path, header, size, numAlike);
  const [first = 0, second = 0] = dims;
  // A point a column, as of Open3D's and PyTorch's tensors; a table of so few scans of so many readings is none.
  if (dims.length === 2 && isPoint(first) && second >= MIN_POINTS && /^f/.test(code) && !PATHS.test(baseOf(path))) {
    return [{ suffix: '.npy', isCloud: true, make: (bytes, name) => points(inColumns(readNpy(name, bytes)), 3) }];
  }
  const [, , third = 0] = dims;
  const areClouds = dims.length === 3 && second >= MIN_SIDE && (third === 2 || isPoint(third)) && /^f/.test(code);
  if (areClouds && !header.isByColumn && !PATHS.test(baseOf(path))) return stackOfPoints(header, size, path);
  if (images.length > 0 || first < MIN_SIDE || PATHS.test(baseOf(path)) || !/^[fiu]/.test(code)) return images;
  if (dims.length === 1) return [{ suffix: '.txt', make: oneScan }];
  if (dims.length !== 2) return [];
  if (second === 2) return [planar(readNpy(path, bytes))];
  const isCloud = isPoint(second) && (numAlike > 1 || first >= MIN_POINTS);
  return isCloud ? [{ suffix: '.npy', isCloud: true, make: (bytes, name) => points(readNpy(name, bytes), 3) }] : [];
}

/** Whether so many numbers may be those of a point: x y z with or without its brightness or colour. */
function isPoint(count: number) {
  return count >= 3 && count <= 6;
}

function imagesOf(path: string, { dims, code, isByColumn, start }: Header, size: number, numAlike: number): Part[] {
  const isDepth = [baseOf(path), ...folderOf(path).split('/').slice(-2)].some((name) => hintOf(name) === 'depth');
  const isColor = code === 'u1' && (dims.at(-1) === 3 || dims.at(-1) === 4);
  // A single channel may be an axis of its own.
  const sides = isColor || dims.at(-1) === 1 ? dims.slice(0, -1) : dims;
  const [count, height = 0, width = 0] = sides.length === 3 ? sides : [1, ...sides];
  const isKnown = isColor || ENCODINGS[code] !== undefined;
  if (isByColumn || !isKnown || sides.length > 3 || Math.min(height, width) < MIN_SIDE) return [];
  if (sides.length === 2 && !isColor && !isDepth && numAlike < MIN_IMAGES) return [];
  const valueBytes = Number(code.slice(1));
  if (start + valueBytes * dims.reduce((product, dim) => product * dim, 1) > size) throw cutOff(path, dims);
  const ending = isColor ? 'ppm' : code.startsWith('f') ? 'pfm' : 'pgm';
  return Array.from({ length: count ?? 1 }, (_, at) => ({
    suffix: `${sides.length === 3 ? `_${String(at).padStart(6, '0')}` : ''}.${ending}`,
    make: (bytes, name) => imageFile(bytes, name, at, { height, width, isColor }),
  }));
}

/**
 * @param bytes of the array
 * @param at of the image in the stack
 */
function imageFile(
  bytes: Uint8Array,
  name: string,
  at: number,
  { height, width, isColor }: { height: number; width: number; isColor: boolean },
) {
  const header = npyHeader(bytes);
  const valueBytes = Number(header?.code.slice(1));
  const channels = isColor ? (header?.dims.at(-1) ?? 3) : 1;
  const step = width * channels * valueBytes;
  const start = (header?.start ?? 0) + at * height * step;
  const data = bytes.subarray(start, start + height * step);
  if (!header || data.length < height * step) {
    throw cutOff(name, header?.dims ?? []);
  }
  const image = { stamp: { sec: 0, nsec: 0 }, frame: '', width, height, bigEndian: header.isBigEndian, step, data };
  if (isColor) return colorFile({ ...image, encoding: channels === 4 ? 'rgba8' : 'rgb8' });
  return depthFile({ ...image, encoding: ENCODINGS[header.code] ?? '' });
}

/** A cloud, or a planar scan, for each list of points in a stack. */
function stackOfPoints(
  { dims: [count = 0, length = 0, columns = 0], code, start, isBigEndian }: Header,
  size: number,
  path: string,
): Part[] {
  const bytesOfOne = length * columns * Number(code.slice(1));
  if (start + count * bytesOfOne > size) throw cutOff(path, [count, length, columns]);
  const one = `{'descr': '${isBigEndian ? '>' : '<'}${code}', 'fortran_order': False, 'shape': (${length}, ${columns}), }`;
  const head = Uint8Array.of(
    0x93,
    ...new TextEncoder().encode('NUMPY'),
    1,
    0,
    one.length & 255,
    one.length >> 8,
    ...new TextEncoder().encode(one),
  );
  const isPlanar = columns === 2;
  return Array.from({ length: count }, (_, at) => ({
    suffix: `_${String(at).padStart(6, '0')}.${isPlanar ? 'ply' : 'npy'}`,
    ...(isPlanar ? {} : { isCloud: true as const }),
    make: (bytes, name) => {
      const begin = start + at * bytesOfOne;
      const list = new Uint8Array(head.length + bytesOfOne);
      list.set(head);
      list.set(bytes.subarray(begin, begin + bytesOfOne), head.length);
      return points(readNpy(name, list), isPlanar ? 2 : 3);
    },
  }));
}

/** A depth image of numbers in metres or millimetres, row by row. */
export function depthOfNumbers(values: Float32Array, width: number) {
  const bigEndian = new Uint8Array(Uint16Array.of(1).buffer)[0] === 0;
  const size = { width, height: values.length / width, step: 4 * width };
  const data = new Uint8Array(values.buffer);
  return depthFile({ stamp: { sec: 0, nsec: 0 }, frame: '', ...size, bigEndian, data, encoding: '32FC1' });
}

/** One scan's ranges, as a table of one line. */
function oneScan(bytes: Uint8Array, name: string) {
  return new TextEncoder().encode(`${readNpy(name, bytes).values.join(',')}\n`);
}

/** Points of the plane, or bearings and ranges. */
function planar(numbers: Numbers): Part {
  const count = numbers.values.length / 2;
  const rows = Array.from({ length: count }, (_, row) => [numbers.values[row] ?? 0, numbers.values[count + row] ?? 0]);
  const table = polarTable(rows);
  return table ? { suffix: '.txt', make: () => table } : { suffix: '.ply', make: () => points(numbers, 2) };
}

/**
 * The first columns as points: of two, z = 0.
 * @param numbers a point a row
 */
export function points({ dims: [count = 0], values }: Numbers, columns: 2 | 3) {
  const list = new Float64Array(3 * count);
  for (let row = 0; row < count; row += 1) {
    for (let column = 0; column < columns; column += 1) list[3 * row + column] = values[column * count + row] ?? 0;
  }
  return pointsFile(list);
}

/** A point a column, turned to a point a row. */
function inColumns({ dims: [rows = 0, columns = 0], values, ...rest }: Numbers): Numbers {
  const turned = values.map((_, at) => values[(at % columns) * rows + Math.floor(at / columns)] ?? 0);
  return { ...rest, dims: [columns, rows], values: turned };
}
