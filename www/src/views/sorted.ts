/** Rows by a value, smallest first or last; what has no value comes at the end. */
export function sorted<Row>(rows: readonly Row[], value: (row: Row) => number | null, isDescending: boolean): Row[] {
  const sign = isDescending ? -1 : 1;
  return [...rows].sort((a, b) => {
    const [x, y] = [value(a), value(b)];
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return sign * (x - y);
  });
}
