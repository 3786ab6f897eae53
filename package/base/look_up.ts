/**
 * The value under a name that comes from outside; undefined where the table itself has none: `constructor` and
 * `__proto__` are in no table.
 */
export function lookUp<T>(table: Readonly<Record<string | number, T>>, name: string | number): T | undefined {
  return Object.hasOwn(table, name) ? table[name] : undefined;
}
