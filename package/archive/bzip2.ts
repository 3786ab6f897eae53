/**
 * Decoder of bzip2, which chunks of ROS 1 bags may be packed with. Its libraries for JavaScript need Node's Buffer.
 *
 * Source of the layout: J. Tsai, "BZIP2: Format Specification" (2016); J. Seward's bzip2 1.0.8.
 */
import { TooLarge } from '../base/errors.js';

const BLOCK_MAGIC = 0x314159265359;
const END_MAGIC = 0x177245385090;
/** Symbols that one Huffman table codes before the next selector. */
const GROUP_SYMBOLS = 50;
const MAX_CODE_LENGTH = 20;
/** Bytes of a block for each level. */
const LEVEL_BYTES = 100_000;
/** Room for what comes out, to begin with: a chunk of a bag as rosbag writes it. */
const FIRST_BYTES = 2 ** 20;

/**
 * @param packed one stream or several, one behind the other
 * @param size bytes that come out
 * @returns at most `size` bytes; throws a RangeError where the stream is damaged, a TooLarge where it holds more
 */
export function unpackBzip2(packed: Uint8Array, size: number): Uint8Array {
  const bits = new BitReader(packed);
  const output = new Output(size);
  do {
    const [magic, level] = [bits.take(24), bits.take(8) - 0x30];
    if (magic !== 0x425a68 || level < 1 || level > 9)
      throw new RangeError('it does not begin with the signature of bzip2');
    const block = new Uint32Array(level * LEVEL_BYTES);
    for (;;) {
      const kind = bits.take(24) * 2 ** 24 + bits.take(24);
      const crc = bits.take(32);
      if (kind === END_MAGIC) break;
      if (kind !== BLOCK_MAGIC) throw new RangeError('a block does not begin as it must');
      readBlock(bits, block, output, crc);
    }
    bits.skipToByte();
  } while (!bits.isAtEnd);
  return output.bytes.subarray(0, output.length);
}

/** Bits from the most significant one on. */
class BitReader {
  #bytes;
  #place = 0;
  #kept = 0;
  #numKept = 0;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
  }

  get isAtEnd() {
    return this.#place >= this.#bytes.length;
  }

  /** @param count at most 32 */
  take(count: number): number {
    if (count > 24) return this.take(count - 16) * 2 ** 16 + this.take(16);
    while (this.#numKept < count) {
      if (this.#place >= this.#bytes.length) throw new RangeError('it is cut off');
      this.#kept = (this.#kept << 8) | (this.#bytes[this.#place] ?? 0);
      this.#place += 1;
      this.#numKept += 8;
    }
    this.#numKept -= count;
    const value = this.#kept >>> this.#numKept;
    this.#kept &= (1 << this.#numKept) - 1;
    return value;
  }

  skipToByte() {
    this.#numKept -= this.#numKept % 8;
    this.#place -= this.#numKept / 8;
    this.#kept = 0;
    this.#numKept = 0;
  }
}

/** What comes out, with the run lengths of the first stage undone and its checksum. */
class Output {
  bytes: Uint8Array;
  length = 0;
  #crc = 0xffffffff;
  #size;

  /** @param size most bytes that may come; room is made as they do */
  constructor(size: number) {
    this.#size = size;
    this.bytes = new Uint8Array(Math.min(size, FIRST_BYTES));
  }

  write(byte: number, count: number) {
    const end = this.length + count;
    if (end > this.#size) throw new TooLarge('it unpacks to more than its header says');
    if (end > this.bytes.length) {
      const grown = new Uint8Array(Math.min(this.#size, Math.max(end, 2 * this.bytes.length)));
      grown.set(this.bytes);
      this.bytes = grown;
    }
    for (let i = 0; i < count; i += 1) {
      this.bytes[this.length + i] = byte;
      this.#crc = (this.#crc << 8) ^ (CRC_TABLE[(this.#crc >>> 24) ^ byte] ?? 0);
    }
    this.length += count;
  }

  /** Of what was written since the last call. */
  takeCrc() {
    const crc = ~this.#crc >>> 0;
    this.#crc = 0xffffffff;
    return crc;
  }
}

/** Most significant bit first, which zip's is not. */
const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let value = byte << 24;
  for (let bit = 0; bit < 8; bit += 1) value = (value << 1) ^ (value < 0 ? 0x04c11db7 : 0);
  return value >>> 0;
});

function readBlock(bits: BitReader, block: Uint32Array, output: Output, crc: number) {
  if (bits.take(1) === 1) throw new RangeError('it is of a version before 1995 (randomised blocks)');
  const origin = bits.take(24);
  const symbols = readSymbols(bits);
  const { selectors, numTables } = readSelectors(bits);
  const tables = Array.from({ length: numTables }, () => readTable(bits, symbols.length + 2));
  const counts = new Uint32Array(256);
  const length = readSequence(bits, symbols, selectors, tables, block, counts);
  if (origin >= length) throw new RangeError('a block is damaged');
  invertTransform(block, length, counts);
  writeBlock(block, length, origin, output);
  if (output.takeCrc() !== crc) throw new RangeError('a block has another checksum than the one written in it');
}

/** The bytes that a block holds. */
function readSymbols(bits: BitReader) {
  const groups = bits.take(16);
  const symbols: number[] = [];
  for (let group = 0; group < 16; group += 1) {
    if (!(groups & (0x8000 >>> group))) continue;
    const members = bits.take(16);
    for (let i = 0; i < 16; i += 1) if (members & (0x8000 >>> i)) symbols.push(16 * group + i);
  }
  if (symbols.length === 0) throw new RangeError('a block holds no bytes');
  return symbols;
}

/** Which table codes each group of symbols. */
function readSelectors(bits: BitReader) {
  const numTables = bits.take(3);
  const count = bits.take(15);
  if (numTables < 2 || numTables > 6 || count === 0) throw new RangeError('a block is damaged');
  const recent = Array.from({ length: numTables }, (_, index) => index);
  const selectors = Array.from({ length: count }, () => {
    let place = 0;
    while (bits.take(1) === 1) place += 1;
    if (place >= numTables) throw new RangeError('a block is damaged');
    return moveToFront(recent, place);
  });
  return { selectors, numTables };
}

function moveToFront(recent: number[], place: number) {
  const [value = 0] = recent.splice(place, 1);
  recent.unshift(value);
  return value;
}

/** Canonical Huffman codes of a table: by length, the first code, and where its symbols begin. */
type Table = { limits: Int32Array; offsets: Int32Array; order: Uint16Array };

function readTable(bits: BitReader, numSymbols: number): Table {
  const lengths = new Uint8Array(numSymbols);
  let length = bits.take(5);
  for (let symbol = 0; symbol < numSymbols; symbol += 1) {
    while (bits.take(1) === 1) length += bits.take(1) === 1 ? -1 : 1;
    if (length < 1 || length > MAX_CODE_LENGTH) throw new RangeError('a block is damaged');
    lengths[symbol] = length;
  }
  const [limits, offsets] = [new Int32Array(MAX_CODE_LENGTH + 2).fill(-1), new Int32Array(MAX_CODE_LENGTH + 2)];
  const order = new Uint16Array(numSymbols);
  let [code, filled] = [0, 0];
  for (let bitsOf = 1; bitsOf <= MAX_CODE_LENGTH; bitsOf += 1) {
    offsets[bitsOf] = filled - code;
    for (let symbol = 0; symbol < numSymbols; symbol += 1) {
      if (lengths[symbol] !== bitsOf) continue;
      order[filled] = symbol;
      filled += 1;
      code += 1;
    }
    limits[bitsOf] = code - 1;
    code *= 2;
  }
  return { limits, offsets, order };
}

function readSymbol(bits: BitReader, { limits, offsets, order }: Table) {
  let code = 0;
  for (let length = 1; length <= MAX_CODE_LENGTH; length += 1) {
    code = 2 * code + bits.take(1);
    const place = code + (offsets[length] ?? 0);
    if (code <= (limits[length] ?? -1) && place >= 0 && place < order.length) return order[place] ?? 0;
  }
  throw new RangeError('a block is damaged');
}

/**
 * The last column of the sorted rotations: Huffman codes, runs of the latest byte and places in the list of recent bytes.
 * @param block takes the bytes
 * @param counts takes how many of each byte there are
 * @returns bytes of the block
 */
function readSequence(
  bits: BitReader,
  symbols: number[],
  selectors: number[],
  tables: Table[],
  block: Uint32Array,
  counts: Uint32Array,
): number {
  const recent = [...symbols];
  const end = symbols.length + 1;
  let [length, run, weight] = [0, 0, 1];
  const append = (byte: number, count: number) => {
    if (length + count > block.length) throw new RangeError('a block is larger than it may be');
    block.fill(byte, length, length + count);
    counts[byte] = (counts[byte] ?? 0) + count;
    length += count;
  };
  for (const selector of selectors) {
    const table = tables[selector];
    if (!table) break;
    for (let i = 0; i < GROUP_SYMBOLS; i += 1) {
      const symbol = readSymbol(bits, table);
      if (symbol <= 1) {
        run += weight << symbol; // bijective base 2, the lowest digit first
        weight *= 2;
        if (run > block.length) throw new RangeError('a block is larger than it may be');
        continue;
      }
      if (run > 0) append(recent[0] ?? 0, run);
      [run, weight] = [0, 1];
      if (symbol === end) return length;
      append(moveToFront(recent, symbol - 1), 1);
    }
  }
  throw new RangeError('a block does not end');
}

/** Adds to each byte where the one that follows it lies, in the upper 24 bits. */
function invertTransform(block: Uint32Array, length: number, counts: Uint32Array) {
  const starts = new Uint32Array(256);
  for (let byte = 1; byte < 256; byte += 1) starts[byte] = (starts[byte - 1] ?? 0) + (counts[byte - 1] ?? 0);
  for (let i = 0; i < length; i += 1) {
    const byte = (block[i] ?? 0) & 0xff;
    const start = starts[byte] ?? 0;
    block[start] = ((block[start] ?? 0) | (i << 8)) >>> 0;
    starts[byte] = start + 1;
  }
}

/** Four equal bytes are followed by how many more there are. */
function writeBlock(block: Uint32Array, length: number, origin: number, output: Output) {
  let place = (block[origin] ?? 0) >>> 8;
  let [last, repeats] = [-1, 0];
  for (let i = 0; i < length; i += 1) {
    const entry = block[place] ?? 0;
    const byte = entry & 0xff;
    place = entry >>> 8;
    if (repeats === 4) {
      output.write(last, byte);
      [last, repeats] = [-1, 0];
      continue;
    }
    output.write(byte, 1);
    repeats = byte === last ? repeats + 1 : 1;
    last = byte;
  }
}
