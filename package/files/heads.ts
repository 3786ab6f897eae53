/** What the first bytes of a file tell about it. Each answers null, or 'unknown', where they tell nothing. */
import { lookUp } from '../base/look_up.js';

/** As many bytes as everything here needs: most of all a table with a thousand named columns, and its first row. */
export const HEAD_BYTES = 32_768;
/** Of an image, less is enough. */
export const IMAGE_HEAD_BYTES = 8192;

/** Largest |z| of a point of a planar scan (m), as the engine has it. */
export const MAX_OFF_PLANE = 1e-6;

/** What can be seen in an image's pixels: shades, or colours. */
export type ImageFacts = {
  format: 'PNG' | 'PGM' | 'PPM' | 'PFM' | 'JPEG' | 'other';
  channels: 'grey' | 'color' | 'palette';
  bits: number;
};

const PNG_SIGNATURE = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
/** Where in the file, and which there are (PNG specification, 11.2.2). */
const COLOR_TYPE_AT = 25;
const PNG_CHANNELS = { 0: 'grey', 2: 'color', 3: 'palette', 4: 'grey', 6: 'color' } as const;

export function readImage(head: Uint8Array): ImageFacts | null {
  if (startsAsPng(head)) {
    const channels = PNG_CHANNELS[(head[COLOR_TYPE_AT] ?? -1) as keyof typeof PNG_CHANNELS];
    return channels ? { format: 'PNG', channels, bits: head[24] ?? 0 } : null;
  }
  if (head[0] === 0xff && head[1] === 0xd8) return { format: 'JPEG', channels: 'color', bits: 8 };
  const magic = latin1(head.subarray(0, 512));
  if (/^P[fF]\s/.test(magic)) return { format: 'PFM', channels: magic[1] === 'f' ? 'grey' : 'color', bits: 32 };
  const [, kind, values = ''] = magic.match(/^P([2356])\s([^]*)/) ?? [];
  if (kind) {
    // Width, height and the largest value; comments may stand between them.
    const numbers = values.replaceAll(/#.*/g, ' ').trim().split(/\s+/);
    const bits = Number(numbers[2]) > 255 ? 16 : 8;
    const isGrey = kind === '2' || kind === '5';
    return { format: isGrey ? 'PGM' : 'PPM', channels: isGrey ? 'grey' : 'color', bits };
  }
  if (/^(BM|RIFF....WEBP)/s.test(magic)) return { format: 'other', channels: 'color', bits: 8 };
  return null;
}

/** Pixels. */
export type Size = { width: number; height: number };

/** Pixels of a PNG, PGM, PPM or PFM; null where its beginning does not say. */
export function imageSize(head: Uint8Array): Size | null {
  if (startsAsPng(head) && head.length >= 24) {
    const view = new DataView(head.buffer, head.byteOffset);
    return { width: view.getUint32(16), height: view.getUint32(20) };
  }
  const text = latin1(head.subarray(0, 512)).replaceAll(/#.*/g, ' ');
  const [, width, height] = text.match(/^P[2356fF]\s+(\d+)\s+(\d+)\s/) ?? [];
  return width === undefined ? null : { width: Number(width), height: Number(height) };
}

/**
 * Why a file that is named as an image cannot be read as one, and what to do; null where its beginning is one.
 * Completes "3.png: ...".
 */
export function brokenImage(path: string, head: Uint8Array): string | null {
  if (readImage(head)) return null;
  const kind = (path.match(/\.(\w+)$/)?.[1] ?? '').toUpperCase().replace('JPG', 'JPEG');
  return `${faultOfImage(kind, head)}; copy or export it again`;
}

/** @param kind as the name says it */
function faultOfImage(kind: string, head: Uint8Array) {
  if (head.length === 0) return `this ${kind} cannot be read: the file is empty`;
  if (isPointer(head)) return 'this is a Git LFS pointer, not the image itself; fetch it with git lfs pull';
  if (/^P[14]\s/.test(latin1(head.subarray(0, 3))))
    return `this ${kind} is a bitmap: black and white alone are no depth`;
  if (!startsAsPng(head)) {
    const words = JSON.stringify(latin1(head.subarray(0, 8)).replaceAll(/[^ -~]/g, '?'));
    return `this ${kind} cannot be read: at byte 0 it begins with ${words}, which no ${kind} does`;
  }
  if (head.length <= COLOR_TYPE_AT) return `this PNG cannot be read: it is cut off at byte ${head.length}`;
  return `this PNG cannot be read: at byte ${COLOR_TYPE_AT} its header names the colour type ${head[COLOR_TYPE_AT]}, which no PNG has`;
}

/** Whether it is the text that stands in the place of a file in a clone without Git LFS. */
export function isPointer(head: Uint8Array) {
  return latin1(head.subarray(0, 64)).startsWith('version https://git-lfs.github.com/spec/');
}

function startsAsPng(head: Uint8Array) {
  return PNG_SIGNATURE.every((byte, index) => head[index] === byte);
}

/** Where the points of a cloud lie, as far as its first bytes hold them: in the plane z = 0, or in space; unseen: all are NaN there. */
export function readPlyExtent(head: Uint8Array): 'plane' | 'space' | 'unseen' | 'unknown' {
  const [header] = latin1(head).match(/^ply\s[^]*?end_header[^\n]*\n/) ?? [];
  if (header === undefined) return 'unknown';
  const [, format = ''] = header.match(/^format (\w+)/m) ?? [];
  const elements = header.split(/^element /m).slice(1);
  const place = elements.findIndex((element) => element.startsWith('vertex'));
  const before = elements.slice(0, Math.max(place, 0)).map(propertiesOf);
  if (place < 0) return 'unknown';
  const { count, properties } = propertiesOf(elements[place] ?? '');
  const z = properties.findIndex(({ name }) => name === 'z');
  if (z < 0) return properties.some(({ name }) => name === 'x') ? 'plane' : 'unknown';
  const body = head.subarray(header.length);
  const heights =
    format === 'ascii'
      ? asciiColumn(body, z, count, sum(before.map((element) => element.count)))
      : binaryColumn(
          behind(body, before, format.endsWith('little_endian')),
          properties,
          z,
          count,
          format.endsWith('little_endian'),
        );
  const finite = heights.filter(Number.isFinite);
  if (finite.length === 0) return heights.length > 0 ? 'unseen' : 'unknown';
  // A scan may have the height of its laser; of a cloud the beginning may be flat.
  const isHeight = finite.length === count && finite.every((height) => height === finite[0]);
  const isFlat = isHeight || finite.every((height) => Math.abs(height) <= MAX_OFF_PLANE);
  return isFlat ? 'plane' : 'space';
}

/** list: the types of a list's count and of its items */
type Properties = { type: string; name: string; list: string[] }[];

/** @param element of a header, from its name on */
function propertiesOf(element: string): { count: number; properties: Properties } {
  const properties = [...element.matchAll(/^property (?:list (\w+) (\w+)|(\w+)) (\w+)/gm)];
  return {
    count: Number(element.match(/^\w+ (\d+)/)?.[1]),
    properties: properties.map(([, count = '', item = '', type = 'list', name = '']) => {
      return { type, name, list: type === 'list' ? [count, item] : [] };
    }),
  };
}

/** What comes behind these elements of a binary body; nothing where that is further than is known. */
function behind(body: Uint8Array, elements: { count: number; properties: Properties }[], littleEndian: boolean) {
  let at = 0;
  for (const { count, properties } of elements) {
    if (properties.every(({ type }) => type !== 'list')) at += count * strideOf(properties);
    else {
      // Each row has a length of its own.
      for (let row = 0; row < count && at < body.length; row += 1)
        at = ends(body, at, properties, littleEndian)?.at(-1) ?? body.length;
    }
  }
  return body.subarray(at);
}

/** Where each property of a row ends; null where one is cut off or of an unknown type. */
function ends(body: Uint8Array, start: number, properties: Properties, littleEndian: boolean) {
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  const found: number[] = [];
  let at = start;
  for (const { type, list } of properties) {
    const [size = 0, read] = lookUp(PLY_TYPES, type === 'list' ? (list[0] ?? '') : type) ?? [];
    if (size === 0 || read === undefined || at + size > body.length) return null;
    const number = Number(view[read as 'getFloat32'](at, littleEndian));
    const items = type === 'list' ? number * (lookUp(PLY_TYPES, list[1] ?? '')?.[0] ?? Number.NaN) : 0;
    if (!(items >= 0)) return null;
    at += size + items;
    found.push(at);
  }
  return found;
}

function sum(numbers: number[]) {
  return numbers.reduce((total, number) => total + number, 0);
}

/** Bytes of a row. */
function strideOf(properties: Properties) {
  return sum(properties.map(({ type }) => lookUp(PLY_TYPES, type)?.[0] ?? 0));
}

/**
 * @param count rows there are at the most
 * @param skipped rows that come before
 */
function asciiColumn(body: Uint8Array, column: number, count: number, skipped: number) {
  const lines = latin1(body).split('\n').slice(skipped, -1); // the last one may be cut off
  return lines.slice(0, count).map((line) => Number(line.trim().split(/\s+/)[column] ?? Number.NaN));
}

const PLY_TYPES: Record<string, [size: number, read: keyof DataView]> = {
  ...{ char: [1, 'getInt8'], int8: [1, 'getInt8'], uchar: [1, 'getUint8'], uint8: [1, 'getUint8'] },
  ...{ short: [2, 'getInt16'], int16: [2, 'getInt16'], ushort: [2, 'getUint16'], uint16: [2, 'getUint16'] },
  ...{ int: [4, 'getInt32'], int32: [4, 'getInt32'], uint: [4, 'getUint32'], uint32: [4, 'getUint32'] },
  ...{ float: [4, 'getFloat32'], float32: [4, 'getFloat32'], double: [8, 'getFloat64'], float64: [8, 'getFloat64'] },
};

/** @param count rows there are at the most */
function binaryColumn(body: Uint8Array, properties: Properties, column: number, count: number, littleEndian: boolean) {
  const [size = 0, name] = lookUp(PLY_TYPES, properties[column]?.type ?? '') ?? [];
  if (name === undefined) return [];
  const read = name as 'getFloat32';
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  const values: number[] = [];
  for (let at = 0; values.length < count && at < body.length;) {
    const places = ends(body, at, properties, littleEndian);
    if (places === null) break;
    values.push(view[read]((places[column] ?? 0) - size, littleEndian));
    at = places.at(-1) ?? body.length;
  }
  return values;
}

export function isPly(head: Uint8Array) {
  return /^ply\s/.test(latin1(head.subarray(0, 4)));
}

/** Shape of a NumPy array, from its header. */
export function readNpyShape(head: Uint8Array) {
  const [, shape] = latin1(head.subarray(0, 1024)).match(/^\x93NUMPY[^]*?'shape':\s*\(([\d,\s]*)\)/) ?? [];
  return shape === undefined
    ? null
    : shape
        .split(',')
        .filter((part) => part.trim() !== '')
        .map(Number);
}

/** One character a byte, so that positions in the text are positions in the file. */
export function latin1(bytes: Uint8Array) {
  let text = '';
  for (let start = 0; start < bytes.length; start += 4096) {
    text += String.fromCharCode(...bytes.subarray(start, start + 4096));
  }
  return text;
}
