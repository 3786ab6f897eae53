// @ts-check
/**
 * The value under a name that comes from outside; undefined where the table itself has none: `constructor` and
 * `__proto__` are in no table.
 * @template T
 * @param {Readonly<Record<string | number, T>>} table
 * @param {string | number} name
 * @returns {T | undefined}
 */
export function lookUp(table, name) {
  return Object.hasOwn(table, name) ? table[name] : undefined;
}
