/** A whole number with its thousands apart, by a thin space that does not break (ISO 80000-1). */
export function formatCount(count: number) {
  return Math.round(count)
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, '\u202f');
}
