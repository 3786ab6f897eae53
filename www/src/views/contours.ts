/** Lines of equal height of a grid of values, by marching squares (Maple, 2003, "Geometric design and space planning using the marching squares and marching cube algorithms"). */

/** Ends of the pieces of a line, x1 y1 x2 y2 ..., in cells: node (column, row) lies at (column, row). NaN are holes. */
export function contour(values: ArrayLike<number>, width: number, level: number): number[] {
  const height = Math.floor(values.length / width);
  const ends: number[] = [];
  for (let row = 0; row + 1 < height; row++) {
    for (let column = 0; column + 1 < width; column++) {
      const at = row * width + column;
      const corners = [values[at], values[at + 1], values[at + width + 1], values[at + width]] as number[];
      if (!corners.some(Number.isNaN)) ends.push(...ofCell(corners, column, row, level));
    }
  }
  return ends;
}

const CORNERS = [
  [0, 0],
  [1, 0],
  [1, 1],
  [0, 1],
] as const;

function ofCell(corners: readonly number[], column: number, row: number, level: number): number[] {
  const crossings: number[] = [];
  for (let i = 0; i < 4; i++) {
    const [a, b] = [corners[i] as number, corners[(i + 1) % 4] as number];
    if (a < level === b < level) continue;
    const share = (level - a) / (b - a);
    const [from, to] = [CORNERS[i] ?? [0, 0], CORNERS[(i + 1) % 4] ?? [0, 0]];
    crossings.push(column + from[0] + share * (to[0] - from[0]), row + from[1] + share * (to[1] - from[1]));
  }
  // Two crossings are a piece; four, at a saddle, are two of them.
  return crossings;
}
