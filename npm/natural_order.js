// @ts-check

/** Runs of digits, and the single characters between them. */
const PARTS = /\d+|\D/gu;

/**
 * Orders file names as people number them: `2.ply` before `10.ply`, `scan2/1.ply` before `scan10/0.ply`.
 *
 * Runs of digits compare as numbers, everything else by character code, so that the order is the same on every
 * machine and in every language. Equal numbers written differently (`07`, `7`): the shorter first.
 *
 * @param {string} a
 * @param {string} b
 * @returns {number} negative where `a` comes first, 0 only for equal names
 */
export function compareNaturally(a, b) {
  const partsA = a.match(PARTS) ?? [];
  const partsB = b.match(PARTS) ?? [];
  for (let i = 0; i < Math.min(partsA.length, partsB.length); i += 1) {
    const order = compareParts(partsA[i] ?? '', partsB[i] ?? '');
    if (order !== 0) return order;
  }
  return partsA.length - partsB.length || a.length - b.length || comparePlainly(a, b);
}

/** @param {string} a @param {string} b */
function compareParts(a, b) {
  if (!isDigit(a) || !isDigit(b)) return comparePlainly(a, b);
  const [trimmedA, trimmedB] = [a.replace(/^0+/, ''), b.replace(/^0+/, '')];
  return trimmedA.length - trimmedB.length || comparePlainly(trimmedA, trimmedB);
}

/** @param {string} a @param {string} b */
function comparePlainly(a, b) {
  return a < b ? -1 : Number(a > b);
}

/** @param {string} part */
function isDigit(part) {
  return /^\d/.test(part);
}
