/** Reads what somebody's own ICP wrote: one 3 x 3 or 4 x 4 matrix an iteration, as CSV, JSON or npy. */
import { npyHeader, readNpy, rowByRow } from '../formats/npy.js';

/** Poses that cannot be used; the message says why and what would be right. */
export class OwnPosesError extends Error {}

/** How far a rotation may be from orthonormal: the rounding of a file with six digits. */
const MAX_DEFECT = 1e-4;

/**
 * Reads the poses of an own ICP, a 3 x 3 or 4 x 4 matrix per iteration, from CSV, JSON or npy (by the file extension). Throws an
 * Error with the reason: not rigid, transposed, a reflection, matrices of other lengths.
 */
export function read_own_poses(bytes: Uint8Array, name: string): number[][] {
  const fail = (problem: string) => new OwnPosesError(`${name}: ${problem}`);
  const matrices = /\.npy$/i.test(name)
    ? fromNpy(bytes, name, fail)
    : /\.json$/i.test(name)
      ? fromJson(new TextDecoder().decode(bytes), fail)
      : fromText(new TextDecoder().decode(bytes), fail);
  if (matrices.length === 0) throw fail('there is no matrix in it. Write one 3 x 3 or 4 x 4 matrix an iteration.');
  const size = matrices[0]?.length;
  return matrices.map((matrix, index) => {
    const which = `matrix ${index + 1} of ${matrices.length}`;
    if (matrix.length !== size) throw fail(`${which} has ${matrix.length} numbers, the first has ${size}.`);
    return rigid(matrix, (problem) => fail(`${which} ${problem}`));
  });
}

type Fail = (problem: string) => OwnPosesError;

/** A matrix as a motion in space, or why it is none. */
function rigid(matrix: number[], fail: Fail) {
  const n = matrix.length === 9 ? 3 : matrix.length === 16 ? 4 : 0;
  if (n === 0) throw fail(`has ${matrix.length} numbers. Write 3 x 3 (plane) or 4 x 4 (space) matrices.`);
  const m = (row: number, column: number) => matrix[n * row + column] ?? Number.NaN;
  if (!matrix.every(Number.isFinite)) throw fail('holds a number that is not finite.');
  const d = n - 1;
  const axes = Array.from({ length: d }, (_, i) => i);
  const bottom = axes.every((i) => Math.abs(m(d, i)) < MAX_DEFECT) && Math.abs(m(d, d) - 1) < MAX_DEFECT;
  const right = axes.every((i) => Math.abs(m(i, d)) < MAX_DEFECT) && Math.abs(m(d, d) - 1) < MAX_DEFECT;
  if (!bottom && right) {
    throw fail(
      'is transposed: its translation stands in the last row. Write the translation in the last column (in NumPy: T.T).',
    );
  }
  if (!bottom) throw fail(`is not a motion: its last row is not ${'0 '.repeat(d)}1.`);
  const gram = axes.flatMap((i) => axes.map((j) => axes.reduce((sum, k) => sum + m(k, i) * m(k, j), 0)));
  const scale = axes.reduce((sum, i) => sum + (gram[(d + 1) * i] ?? 0), 0) / d;
  const off = Math.hypot(...gram.map((x, i) => x - (i % (d + 1) === 0 ? scale : 0)));
  if (off > MAX_DEFECT * Math.max(scale, 1))
    throw fail('is not rigid: its columns are not unit vectors at right angles.');
  if (Math.abs(scale - 1) > MAX_DEFECT)
    throw fail(`scales by ${Math.sqrt(scale).toPrecision(4)}: a rigid motion does not.`);
  if (determinant(m, d) < 0)
    throw fail('is a reflection: its determinant is -1. Flip the sign of the last singular vector (Umeyama 1991).');
  if (n === 4) return [...matrix];
  return [m(0, 0), m(0, 1), 0, m(0, 2), m(1, 0), m(1, 1), 0, m(1, 2), 0, 0, 1, 0, 0, 0, 0, 1];
}

function determinant(m: (row: number, column: number) => number, d: number) {
  if (d === 2) return m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
  const minor = (a: number, b: number) => m(1, a) * m(2, b) - m(1, b) * m(2, a);
  return m(0, 0) * minor(1, 2) - m(0, 1) * minor(0, 2) + m(0, 2) * minor(0, 1);
}

/** Rows of 9 or 16 numbers, or blocks of three rows of three or four of four. */
function fromText(text: string, fail: Fail) {
  const rows = text
    .split('\n')
    .map((line) => line.replace(/#.*/, '').trim())
    .filter((line) => line !== '' && !/[a-df-z]/i.test(line.replace(/nan|inf(inity)?/gi, '')))
    .map((line) =>
      line
        .split(/[\s,;]+/)
        .filter(Boolean)
        .map(Number),
    );
  const width = rows[0]?.length ?? 0;
  if (!rows.every((row) => row.length === width)) throw fail('its rows are not equally long.');
  if (width === 9 || width === 16 || rows.length === 0) return rows;
  if (width !== 3 && width !== 4)
    throw fail(`its rows have ${width} numbers. Write 9 or 16 a row, or matrices of 3 x 3 or 4 x 4.`);
  return blocks(rows.flat(), width * width, fail);
}

/** Arrays of numbers, however nested; the trace of `scanstitch icp --trace` too. */
function fromJson(text: string, fail: Fail) {
  let data;
  try {
    data = JSON.parse(text);
  } catch (error) {
    throw fail(`it is not JSON: ${(error as Error).message}.`);
  }
  if (!Array.isArray(data)) {
    data = data?.poses ?? data?.T_target_source ?? Object.values(data ?? {}).find(Array.isArray);
  }
  if (!Array.isArray(data)) throw fail('there is no list of matrices in it.');
  const matrix = (item: unknown) => (Array.isArray(item) ? item.flat(3).map(Number) : [Number(item)]);
  return data.map(matrix);
}

/** NumPy's own format. */
function fromNpy(bytes: Uint8Array, name: string, fail: Fail) {
  const header = npyHeader(bytes);
  if (!header) throw fail('it is not an npy file of plain numbers. Save with numpy.save(path, poses.astype(float)).');
  if (header.isByColumn) throw fail('it is in Fortran order. Save numpy.ascontiguousarray(poses).');
  const { dims } = header;
  const last = dims.at(-1) ?? 0;
  const lengthOfOne = dims.length === 2 && (last === 9 || last === 16) ? last : last * last;
  if (dims.length < 2 || (lengthOfOne !== 9 && lengthOfOne !== 16)) {
    throw fail(`its shape is (${dims.join(', ')}). Save an array of n x 3 x 3 or n x 4 x 4.`);
  }
  return blocks(rowByRow(readNpy(name, bytes)), lengthOfOne, fail);
}

function blocks(values: number[], length: number, fail: Fail) {
  if (values.length % length !== 0) throw fail(`${values.length} numbers are not whole matrices of ${length}.`);
  return Array.from({ length: values.length / length }, (_, i) => values.slice(length * i, length * (i + 1)));
}
