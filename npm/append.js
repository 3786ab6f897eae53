// @ts-check

/**
 * Puts items behind those of a list, however many: `push(...more)` overflows the stack beyond some 100,000.
 * @template T
 * @param {T[]} list
 * @param {Iterable<T>} more
 */
export function append(list, more) {
  for (const item of more) list.push(item);
}
