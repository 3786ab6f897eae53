/** Rigid motions as 4 x 4 matrices, row by row, and the best one between pairs of points. */

/** 16 numbers. */
type Pose = ArrayLike<number>;

export const IDENTITY = Object.freeze([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

const at = (values: ArrayLike<number>, index: number) => values[index] ?? 0;

/** A B. */
export function multiplied(A: Pose, B: Pose) {
  return Array.from({ length: 16 }, (_, i) => {
    const [row, column] = [i - (i % 4), i % 4];
    return [0, 1, 2, 3].reduce((sum, k) => sum + at(A, row + k) * at(B, 4 * k + column), 0);
  });
}

/** The motion back. */
export function inverted(T: Pose) {
  const t = [0, 1, 2].map((row) => -[0, 1, 2].reduce((sum, k) => sum + at(T, 4 * k + row) * at(T, 4 * k + 3), 0));
  return [0, 1, 2].flatMap((row) => [at(T, row), at(T, 4 + row), at(T, 8 + row), at(t, row)]).concat([0, 0, 0, 1]);
}

export function moved(T: Pose, p: number[]) {
  return [0, 4, 8].map(
    (row) => at(T, row) * at(p, 0) + at(T, row + 1) * at(p, 1) + at(T, row + 2) * at(p, 2) + at(T, row + 3),
  );
}

/** From rows of a rotation (nine numbers) and a translation. */
export function poseOf(R: ArrayLike<number>, t: number[]) {
  return [0, 1, 2]
    .flatMap((row) => [at(R, 3 * row), at(R, 3 * row + 1), at(R, 3 * row + 2), at(t, row)])
    .concat([0, 0, 0, 1]);
}

/** The rotation of a pose: nine numbers. */
export function rotationOf(T: Pose) {
  return [0, 4, 8].flatMap((row) => [at(T, row), at(T, row + 1), at(T, row + 2)]);
}

/** How far two poses are apart: the turn (rad) and the way of the source's origin (m). */
export function difference(A: Pose, B: Pose) {
  const D = rotationOf(multiplied(B, inverted(A)));
  const axis = [at(D, 7) - at(D, 5), at(D, 2) - at(D, 6), at(D, 3) - at(D, 1)];
  const rotation = Math.atan2(Math.hypot(...axis) / 2, (at(D, 0) + at(D, 4) + at(D, 8) - 1) / 2);
  return { rotation, translation: Math.hypot(...[3, 7, 11].map((i) => at(B, i) - at(A, i))) };
}

/** Sums of weighted pairs: their mean points, and sum w (q - q0) (p - p0)^T over `centers` p0 and q0. */
export function sumsOf(p: number[][], q: number[][], w: ArrayLike<number>) {
  const total = p.reduce((sum, _, i) => sum + at(w, i), 0);
  const mean = (points: number[][]) =>
    [0, 1, 2].map((axis) => points.reduce((sum, point, i) => sum + at(w, i) * at(point, axis), 0) / total);
  const covariance = (p0: number[], q0: number[]) => {
    const C = Array.from({ length: 9 }, () => 0);
    p.forEach((point, i) => {
      for (let row = 0; row < 3; row++) {
        for (let column = 0; column < 3; column++) {
          const product = (at(q[i] ?? [], row) - at(q0, row)) * (at(point, column) - at(p0, column));
          C[3 * row + column] = at(C, 3 * row + column) + at(w, i) * product;
        }
      }
    });
    return C;
  };
  return { p0: mean(p), q0: mean(q), covariance };
}

/**
 * The rotation R with the largest trace(R^T C): by the eigenvector of the largest eigenvalue of a symmetric 4 x 4
 * matrix (Horn,
 * "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4, 1987). Points in the plane z = 0
 * turn in it.
 * @param C nine numbers, row by row
 */
export function bestRotation(C: ArrayLike<number>) {
  const c = (row: number, column: number) => at(C, 3 * row + column);
  if ([2, 5, 6, 7, 8].every((i) => at(C, i) === 0)) {
    const angle = Math.atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1));
    return [Math.cos(angle), -Math.sin(angle), 0, Math.sin(angle), Math.cos(angle), 0, 0, 0, 1];
  }
  const N = [
    [c(0, 0) + c(1, 1) + c(2, 2), c(2, 1) - c(1, 2), c(0, 2) - c(2, 0), c(1, 0) - c(0, 1)],
    [c(2, 1) - c(1, 2), c(0, 0) - c(1, 1) - c(2, 2), c(0, 1) + c(1, 0), c(0, 2) + c(2, 0)],
    [c(0, 2) - c(2, 0), c(0, 1) + c(1, 0), c(1, 1) - c(0, 0) - c(2, 2), c(1, 2) + c(2, 1)],
    [c(1, 0) - c(0, 1), c(0, 2) + c(2, 0), c(1, 2) + c(2, 1), c(2, 2) - c(0, 0) - c(1, 1)],
  ];
  const [w = 1, x = 0, y = 0, z = 0] = largestEigenvector(N);
  return [
    ...[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    ...[2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    ...[2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/**
 * The unit eigenvector of the largest eigenvalue, by Jacobi's rotations.
 * @param matrix symmetric
 */
function largestEigenvector(matrix: number[][]) {
  const n = matrix.length;
  const A = matrix.map((row) => [...row]);
  const V = A.map((_, i) => A.map((_, j) => (i === j ? 1 : 0)));
  const get = (M: number[][], i: number, j: number) => at(M[i] ?? [], j);
  const turn = (row: number[], p: number, q: number, cos: number, sin: number) => {
    const [a, b] = [at(row, p), at(row, q)];
    [row[p], row[q]] = [cos * a - sin * b, sin * a + cos * b];
  };
  for (let sweep = 0; sweep < 30; sweep++) {
    for (let p = 0; p < n; p++) {
      for (let q = p + 1; q < n; q++) {
        if (get(A, p, q) === 0) continue;
        const tau = (get(A, q, q) - get(A, p, p)) / (2 * get(A, p, q));
        const tan = (tau < 0 ? -1 : 1) / (Math.abs(tau) + Math.hypot(1, tau));
        const cos = 1 / Math.hypot(1, tan);
        const sin = tan * cos;
        A.forEach((row) => turn(row, p, q, cos, sin));
        const [rowP = [], rowQ = []] = [A[p], A[q]];
        for (let k = 0; k < n; k++)
          [rowP[k], rowQ[k]] = [cos * at(rowP, k) - sin * at(rowQ, k), sin * at(rowP, k) + cos * at(rowQ, k)];
        V.forEach((row) => turn(row, p, q, cos, sin));
      }
    }
  }
  const largest = A.reduce((best, _, i) => (get(A, i, i) > get(A, best, best) ? i : best), 0);
  return V.map((row) => at(row, largest));
}
