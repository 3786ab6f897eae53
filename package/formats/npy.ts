/**
 * Arrays of NumPy, of numbers.
 *
 * Source of the layout: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".
 */
import { fileError } from '../base/errors.js';
import { latin1 } from '../files/heads.js';
import type { Numbers } from './mat.js';

const TYPES: Record<string, [number, (view: DataView, at: number, little: boolean) => number]> = {
  f8: [8, (view, at, little) => view.getFloat64(at, little)],
  f4: [4, (view, at, little) => view.getFloat32(at, little)],
  i8: [8, (view, at, little) => Number(view.getBigInt64(at, little))],
  u8: [8, (view, at, little) => Number(view.getBigUint64(at, little))],
  i4: [4, (view, at, little) => view.getInt32(at, little)],
  u4: [4, (view, at, little) => view.getUint32(at, little)],
  i2: [2, (view, at, little) => view.getInt16(at, little)],
  u2: [2, (view, at, little) => view.getUint16(at, little)],
  i1: [1, (view, at) => view.getInt8(at)],
  u1: [1, (view, at) => view.getUint8(at)],
};

/** code: of the type of a value, such as f4; start: where the values begin (bytes) */
export type Header = { dims: number[]; code: string; isBigEndian: boolean; isByColumn: boolean; start: number };

/** What an array is, by the beginning of its file; null where it holds no plain numbers. */
export function npyHeader(bytes: Uint8Array): Header | null {
  const head = latin1(bytes.subarray(0, 1024));
  const [, order = '', code = ''] = head.match(/'descr':\s*'([<>|=])(\w\d)'/) ?? [];
  const [, shape = ''] = head.match(/'shape':\s*\(([\d,\s]*)\)/) ?? [];
  if (!head.startsWith('\x93NUMPY') || !TYPES[code]) return null;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const dims = shape
    .split(',')
    .map((part) => part.trim())
    .filter((part) => part !== '')
    .map(Number);
  return {
    ...{ dims, code, isBigEndian: order === '>', isByColumn: head.includes("'fortran_order': True") },
    start: bytes[6] === 1 ? 10 + view.getUint16(8, true) : 12 + view.getUint32(8, true),
  };
}

/**
 * The numbers of an array, column by column as those of MATLAB.
 * @param name for messages
 * @returns throws a ScanstitchError
 */
export function readNpy(name: string, bytes: Uint8Array): Numbers {
  const header = npyHeader(bytes);
  const type = header && TYPES[header.code];
  if (!header || !type) {
    throw fileError(
      name,
      'This array of NumPy does not hold plain numbers',
      "Save them: numpy.save('ranges.npy', ranges)",
    );
  }
  const { dims, start } = header;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [size, read] = type;
  const count = dims.reduce((product, length) => product * length, 1);
  if (!(start + count * size <= bytes.length)) {
    throw cutOff(name, dims);
  }
  const [rows = 1] = dims;
  const columns = count / rows;
  const isByColumn = header.isByColumn || dims.length < 2;
  const values = new Float64Array(count);
  for (let at = 0; at < count; at += 1) {
    const value = read(view, start + at * size, !header.isBigEndian);
    values[isByColumn ? at : (at % columns) * rows + Math.floor(at / columns)] = value;
  }
  return { kind: 'numbers', dims: dims.length < 2 ? [rows, 1] : dims, values };
}

export function cutOff(name: string, dims: readonly number[]) {
  return fileError(name, `This array of ${dims.join(' x ')} numbers is cut off`, 'Copy or save it again');
}
