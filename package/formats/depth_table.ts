/** Depth images as text: a row of the image a line, in metres or millimetres, as RealSense's tools and `numpy.savetxt` write them. */
import { fileError } from '../base/errors.js';
import { haveDecimalCommas } from '../base/units.js';
import { depthOfNumbers } from './npy_files.js';

/** Smaller images are none of a depth camera; a laser's log with so many readings is not called depth. */
const [MIN_WIDTH, MIN_HEIGHT] = [64, 24];

/** The numbers of a line; null where one is none. */
function numbersOf(line: string, hasDecimalCommas: boolean) {
  const text = hasDecimalCommas ? line.replaceAll(',', '.') : line;
  const words = text.split(/[\s,;]+/).filter((word) => word !== '');
  const numbers = words.map((word) => (/^[+-]?(nan|inf)$/i.test(word) ? Number.NaN : Number(word)));
  return numbers.some((number, at) => Number.isNaN(number) && !/nan|inf/i.test(words[at] ?? '')) ? null : numbers;
}

/** Whether the beginning of a text that is called depth is rows of an image. */
export function isDepthTable(head: string) {
  const [first = '', second] = head.split(/\r?\n/, 2);
  const hasDecimalCommas = haveDecimalCommas([first]);
  const row = numbersOf(first, hasDecimalCommas);
  // One row may be longer than the beginning.
  return (
    row !== null &&
    row.length >= MIN_WIDTH &&
    (second === undefined || second === '' || numbersOf(second, hasDecimalCommas) !== null)
  );
}

/**
 * The image as PFM, or as PGM in millimetres.
 * @param name for messages
 */
export function depthOfTable(name: string, bytes: Uint8Array) {
  const rows = new TextDecoder()
    .decode(bytes)
    .split(/\r?\n/)
    .filter((line) => line.trim() !== '');
  const hasDecimalCommas = haveDecimalCommas(rows.slice(0, 1));
  const width = numbersOf(rows[0] ?? '', hasDecimalCommas)?.length ?? 0;
  const values = new Float32Array(width * rows.length);
  for (const [at, line] of rows.entries()) {
    const row = numbersOf(line, hasDecimalCommas);
    if (row?.length !== width) {
      const problem = `Line ${at + 1} has ${row === null ? 'a word' : `${row.length} numbers`} where the image has ${width} columns`;
      throw fileError(name, problem, 'Save the image again, a row a line');
    }
    values.set(row, at * width);
  }
  if (rows.length < MIN_HEIGHT) {
    throw fileError(
      name,
      `This has ${rows.length} rows, too few for a depth image`,
      'Save the image as PNG of 16 bits',
    );
  }
  return depthOfNumbers(values, width);
}
