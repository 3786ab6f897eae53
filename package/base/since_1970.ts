/** What times since 1970 are divided by to be seconds, from this value on: seconds have twelve digits from the year 5138 on. */
const DIVISORS = [
  [1e17, 1e9],
  [1e14, 1e6],
  [1e11, 1e3],
] as const;

/** What a time since 1970 is divided by to be seconds; null where it is none of a smaller unit. */
export function divisorSince1970(time: number) {
  return DIVISORS.find(([least]) => time >= least)?.[1] ?? null;
}
