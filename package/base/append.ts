/** Puts items behind those of a list, however many: `push(...more)` overflows the stack beyond some 100,000. */
export function append<T>(list: T[], more: Iterable<T>) {
  for (const item of more) list.push(item);
}
