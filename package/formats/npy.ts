/**
 * Arrays of NumPy, of numbers.
 *
 * Source of the layout: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".
 */
import { viewOf } from '../base/bytes.js';
import { fileError } from '../base/errors.js';
import { latin1 } from '../files/heads.js';
import type { Numbers } from './mat.js';
import { NUMBER_TYPES } from './number_types.js';

/** code: of the type of a value, such as f4; start: where the values begin (bytes) */
export type Header = { dims: number[]; code: string; isBigEndian: boolean; isByColumn: boolean; start: number };

/** What an array is, by the beginning of its file; null where it holds no plain numbers. */
export function npyHeader(bytes: Uint8Array): Header | null {
  const head = latin1(bytes.subarray(0, 1024));
  const [, order = '', code = ''] = head.match(/'descr':\s*'([<>|=])(\w\d)'/) ?? [];
  const [, shape = ''] = head.match(/'shape':\s*\(([\d,\s]*)\)/) ?? [];
  if (!head.startsWith('\x93NUMPY') || !NUMBER_TYPES[code]) return null;
  const view = viewOf(bytes);
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
  const type = header && NUMBER_TYPES[header.code];
  if (!header || !type) {
    throw fileError(
      name,
      'This array of NumPy does not hold plain numbers',
      "Save them: numpy.save('ranges.npy', ranges)",
    );
  }
  const { dims, start } = header;
  const view = viewOf(bytes);
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

/** The numbers as they lie in memory. */
export function rowByRow({ dims: [rows = 1], values }: Numbers) {
  const columns = values.length / rows;
  return Array.from(values, (_, at) => values[(at % columns) * rows + Math.floor(at / columns)] ?? Number.NaN);
}

export function cutOff(name: string, dims: readonly number[]) {
  return fileError(name, `This array of ${dims.join(' x ')} numbers is cut off`, 'Copy or save it again');
}
