/** What the numbers of a text are in, by a name or by their size, and whether they have decimal commas. */

/** Names of units of length, as a pattern, and how many of each a metre has. */
const LENGTHS: readonly (readonly [names: string, perMetre: number])[] = [
  ['m|met(?:re|er)s?', 1],
  ['cm|centimet(?:re|er)s?', 100],
  ['mm|millimet(?:re|er)s?', 1e3],
  ['ft|foot|feet', 1 / 0.3048],
  ['in|inch(?:es)?', 1 / 0.0254],
];
/** A unit of length within a pattern. */
export const LENGTH_UNIT = `(?:${LENGTHS.map(([names]) => names).join('|')})`;

/** How many of the unit a metre has; 1 of what is no unit of length. @param unit in lower case */
export function perMetre(unit: string) {
  return LENGTHS.find(([names]) => new RegExp(`^(?:${names})$`).test(unit))?.[1] ?? 1;
}

/** The least times since 1970 that are nano-, micro- and milliseconds, and what they are divided by to be seconds. */
const SINCE_1970 = [
  [1e17, 1e9],
  [1e14, 1e6],
  [1e11, 1e3],
] as const;

/** What a time is divided by to be in seconds, where its size tells; null where it may be in seconds. */
export function ticksPerSecond(time: number) {
  return SINCE_1970.find(([least]) => time >= least)?.[1] ?? null;
}

/** Whether commas stand within the numbers of these lines: something else stands between them, and no number has a point. */
export function haveDecimalCommas(lines: readonly string[]) {
  const has = (text: string) => lines.some((line) => line.includes(text));
  const isDecimal = has(',') && (has(';') || has(' ') || has('\t')) && !lines.some((line) => /\.\d/.test(line));
  return isDecimal && !lines.some((line) => /,\s|,\d*,/.test(line));
}

/** One degree (rad). */
export const DEGREE = Math.PI / 180;
