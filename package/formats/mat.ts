/**
 * Files of MATLAB: level 5 (what `save` writes with -v6 and -v7) and level 4. Not mat-for-js 1.1: it inflates whatever it is
 * given, and takes sizes from the file before it knows that they are there.
 *
 * Source of the layout: The MathWorks, "MAT-File Format" (R2024a), chapters 1 (level 5) and 2 (level 4).
 */
import { LIMITS } from '../archive/directory.js';
import { joined, PIECE_BYTES, viewOf } from '../base/bytes.js';
import { fileError } from '../base/errors.js';
import { latin1 } from '../files/heads.js';
import { NUMBER_TYPES, type NumberType } from './number_types.js';

/** Column by column. */
export type Numbers = { kind: 'numbers'; dims: number[]; values: Float64Array };
/** Each field with a value an element. */
export type Struct = { kind: 'struct'; dims: number[]; fields: Map<string, Value[]> };
type Cell = { kind: 'cell'; dims: number[]; items: Value[] };
/** Something that is not read. */
type Other = { kind: 'other'; dims: number[]; what: string };
export type Value = Numbers | Struct | Cell | Other;
/** By their names. */
export type Variables = Map<string, Value>;

const HEADER_BYTES = 128;
const [MATRIX, COMPRESSED] = [14, 15];
/** How the numbers of an element are stored, by its type. */
const NUMBERS: Readonly<Record<number, NumberType | undefined>> = Object.fromEntries(
  Object.entries({ 1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 9: 'f8', 12: 'i8', 13: 'u8' }).map(
    ([type, code]) => [type, NUMBER_TYPES[code]],
  ),
);
/** Classes of arrays. */
const [CELL, STRUCT, OBJECT, CHAR, SPARSE, FIRST_NUMERIC, LAST_NUMERIC, OPAQUE] = [1, 2, 3, 4, 5, 6, 15, 17];
/** The types of numbers in files of level 4, as the types above. */
const LEVEL4_TYPES = [9, 7, 5, 3, 4, 2];
/** Numbers of all variables: 512 MB. */
const MAX_NUMBERS = 2 ** 26;
/** Cells and structs lie in one another no deeper. */
const MAX_DEPTH = 16;
/** Cells and fields. */
const MAX_ITEMS = 2 ** 20;
const DAMAGED = 'Copy the file, or save it again';

/**
 * @param name for messages
 * @returns rejects with a ScanstitchError
 */
export async function readMat(name: string, bytes: Uint8Array): Promise<Variables> {
  const text = latin1(bytes.subarray(0, 19));
  if (text.startsWith('MATLAB 7.3') || text.startsWith('\x89HDF')) {
    const stem = (name.split('/').at(-1) ?? name).replace(/\.mat$/i, '');
    const command = `s = load('${stem}.mat'); save('${stem}_v7.mat', '-struct', 's', '-v7')`;
    throw fileError(name, 'A file of MATLAB 7.3 (HDF5), which is not read', `Save it as version 7: ${command}`);
  }
  try {
    if (!text.startsWith('MATLAB 5.0')) return readLevel4(bytes);
    const little = bytes[126] === 0x49 && bytes[127] === 0x4d;
    return await new Level5(little).read(bytes.subarray(HEADER_BYTES));
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    throw fileError(name, `This file of MATLAB cannot be read: ${error.message}`, DAMAGED);
  }
}

function countOf(dims: readonly number[]) {
  const count = dims.reduce((product, length) => product * length, 1);
  if (!Number.isSafeInteger(count) || count < 0) throw new RangeError(`an array of ${dims.join(' x ')} cannot be`);
  return count;
}

/** next: where what follows begins */
type Element = { type: number; data: Uint8Array; next: number };

class Level5 {
  #little;
  #numNumbers = 0;
  #numItems = 0;

  /** @param little whether the lowest byte of a number comes first */
  constructor(little: boolean) {
    this.#little = little;
  }

  async read(bytes: Uint8Array): Promise<Variables> {
    const variables: Variables = new Map();
    for (let place = 0; place + 8 <= bytes.length;) {
      const element = this.#element(bytes, place, true);
      place = element.next;
      const inner = element.type === COMPRESSED ? this.#element(await inflate(element.data), 0, false) : element;
      if (inner.type !== MATRIX) continue;
      const { name, value } = this.#matrix(inner.data, 0);
      if (name !== '') variables.set(name, value);
    }
    return variables;
  }

  /** @param isOuter of the file: packed ones are not padded */
  #element(bytes: Uint8Array, place: number, isOuter: boolean): Element {
    const view = viewOf(bytes);
    if (place + 8 > bytes.length) throw new RangeError('it is cut off');
    const first = view.getUint32(place, this.#little);
    if (first >>> 16) {
      const size = first >>> 16;
      if (size > 4) throw new RangeError(`a small element has ${size} bytes`);
      return { type: first & 0xffff, data: bytes.subarray(place + 4, place + 4 + size), next: place + 8 };
    }
    const size = view.getUint32(place + 4, this.#little);
    const end = place + 8 + size;
    if (end > bytes.length) throw new RangeError(`it is cut off: an element has ${size} bytes, and fewer follow`);
    const isPadded = !(isOuter && first === COMPRESSED);
    return {
      type: first,
      data: bytes.subarray(place + 8, end),
      next: isPadded ? place + 8 + 8 * Math.ceil(size / 8) : end,
    };
  }

  #matrix(bytes: Uint8Array, depth: number): { name: string; value: Value } {
    if (bytes.length === 0) return { name: '', value: { kind: 'numbers', dims: [0, 0], values: new Float64Array() } };
    if (depth > MAX_DEPTH) throw new RangeError(`its cells lie more than ${MAX_DEPTH} deep in one another`);
    const flags = this.#element(bytes, 0, false);
    const kind = viewOf(flags.data).getUint32(0, this.#little) & 0xff;
    if (kind === OPAQUE) return this.#opaque(bytes, flags.next);
    const dimensions = this.#element(bytes, flags.next, false);
    const dims = [...this.#numbers(dimensions)];
    const title = this.#element(bytes, dimensions.next, false);
    const name = nameOf(title.data);
    const rest = bytes.subarray(title.next);
    if (kind === CELL) return { name, value: { kind: 'cell', dims, items: this.#items(rest, countOf(dims), depth) } };
    if (kind === STRUCT || kind === OBJECT) return { name, value: this.#struct(rest, kind, dims, depth) };
    if (kind < FIRST_NUMERIC || kind > LAST_NUMERIC) {
      const what = kind === CHAR ? 'text' : kind === SPARSE ? 'a sparse matrix' : 'an object';
      return { name, value: { kind: 'other', dims, what } };
    }
    const values = this.#numbers(this.#element(rest, 0, false));
    if (values.length !== countOf(dims)) {
      throw new RangeError(`${name} has ${values.length} numbers where it should be ${dims.join(' x ')}`);
    }
    return { name, value: { kind: 'numbers', dims, values } };
  }

  /** An object of a class: its data lie elsewhere. */
  #opaque(bytes: Uint8Array, place: number) {
    const name = this.#element(bytes, place, false);
    const system = this.#element(bytes, name.next, false);
    const kind = this.#element(bytes, system.next, false);
    const value: Other = { kind: 'other', dims: [], what: `an object of the class ${nameOf(kind.data)}` };
    return { name: nameOf(name.data), value };
  }

  #struct(bytes: Uint8Array, kind: number, dims: number[], depth: number): Struct {
    const start = kind === OBJECT ? this.#element(bytes, 0, false).next : 0;
    const width = this.#element(bytes, start, false);
    const [length = 0] = this.#numbers(width);
    const titles = this.#element(bytes, width.next, false);
    if (!(length > 0)) throw new RangeError('a struct has fields without names');
    const count = Math.floor(titles.data.length / length);
    // A struct without fields has no bytes for its elements, and yet so many as it claims.
    if (count === 0 && countOf(dims) > 1) throw new RangeError(`a struct of ${dims.join(' x ')} has no fields`);
    const names = Array.from({ length: count }, (_, i) => nameOf(titles.data.subarray(i * length, (i + 1) * length)));
    const items = this.#items(bytes.subarray(titles.next), countOf(dims) * count, depth);
    const fields = names.map((name, i) => [name, items.filter((_, at) => at % count === i)] as const);
    return { kind: 'struct', dims, fields: new Map(fields) };
  }

  #items(bytes: Uint8Array, count: number, depth: number): Value[] {
    if ((this.#numItems += count) > MAX_ITEMS) throw new RangeError(`it has more than ${MAX_ITEMS} cells and fields`);
    const items: Value[] = [];
    for (let place = 0; items.length < count;) {
      const element = this.#element(bytes, place, false);
      items.push(this.#matrix(element.data, depth + 1).value);
      place = element.next;
    }
    return items;
  }

  #numbers({ type, data }: Element) {
    const values = numbersOf(type, data, this.#little);
    if ((this.#numNumbers += values.length) > MAX_NUMBERS)
      throw new RangeError(`it has more than ${MAX_NUMBERS} numbers`);
    return values;
  }
}

function numbersOf(type: number, data: Uint8Array, little: boolean) {
  const [bytes, read] = NUMBERS[type] ?? [];
  if (bytes === undefined || read === undefined)
    throw new RangeError(`an element of the type ${type} does not hold numbers`);
  const view = viewOf(data);
  const count = Math.floor(data.length / bytes);
  if (count > MAX_NUMBERS) throw new RangeError(`it has more than ${MAX_NUMBERS} numbers`);
  const values = new Float64Array(count);
  for (let at = 0; at < count; at += 1) values[at] = read(view, at * bytes, little);
  return values;
}

/** Up to the first zero. */
function nameOf(bytes: Uint8Array) {
  const end = bytes.indexOf(0);
  return new TextDecoder('latin1').decode(end < 0 ? bytes : bytes.subarray(0, end));
}

/** @param packed by zlib */
async function inflate(packed: Uint8Array) {
  const { Unzlib } = await import('fflate');
  const most = LIMITS.freeBytes + LIMITS.ratio * packed.length;
  const chunks: Uint8Array[] = [];
  let length = 0;
  const stream = new Unzlib((chunk) => {
    length += chunk.length;
    if (length > most) throw new RangeError(`a variable unpacks to more than ${most} bytes`);
    chunks.push(chunk);
  });
  try {
    for (let place = 0; place < packed.length; place += PIECE_BYTES) {
      stream.push(packed.subarray(place, place + PIECE_BYTES), place + PIECE_BYTES >= packed.length);
    }
  } catch (error) {
    throw error instanceof RangeError
      ? error
      : new RangeError(`a variable cannot be unpacked (${(error as Error).message})`);
  }
  return joined(chunks);
}

/** Matrices one after the other, without a header of the file. */
function readLevel4(bytes: Uint8Array): Variables {
  const view = viewOf(bytes);
  const variables: Variables = new Map();
  for (let place = 0; place < bytes.length;) {
    if (place + 20 > bytes.length) throw new RangeError('it is cut off');
    // The type is below 5000 in the order of bytes that is the right one.
    const little = view.getUint32(place, true) < 5000;
    const [type = 0, rows = 0, columns = 0, isComplex = 0, length = 0] = Array.from({ length: 5 }, (_, i) =>
      view.getUint32(place + 4 * i, little),
    );
    const [order, reserved, precision, form] = [1000, 100, 10, 1].map((unit) => Math.floor(type / unit) % 10);
    const stored = LEVEL4_TYPES[precision ?? -1];
    if (
      type >= 5000 ||
      order !== (little ? 0 : 1) ||
      reserved !== 0 ||
      stored === undefined ||
      length === 0 ||
      length > 256
    ) {
      throw new RangeError(
        `at byte ${place} there is no matrix of level 4, and the file does not begin as one of level 5`,
      );
    }
    const start = place + 20 + length;
    const size = countOf([rows, columns]) * (NUMBERS[stored]?.[0] ?? 0);
    place = start + size * (isComplex ? 2 : 1);
    if (place > bytes.length) throw new RangeError('it is cut off');
    const dims = [rows, columns];
    const values = numbersOf(stored, bytes.subarray(start, start + size), little);
    const name = nameOf(bytes.subarray(start - length, start));
    variables.set(name, form === 0 ? { kind: 'numbers', dims, values } : { kind: 'other', dims, what: 'text' });
  }
  return variables;
}
