/** One language for everybody, so that the same files come in the same order on every machine. */
const makeCollator = () => new Intl.Collator('en', { numeric: true, sensitivity: 'base' });
/** Made when it is first needed: that takes as long as a scan or two. */
let collator: Intl.Collator | undefined;

/**
 * Orders file names as people number them, folder by folder: `2.ply` before `10.ply`, `scan2/1.ply` before
 * `scan10/0.ply`.
 * @returns negative where `a` comes first, 0 only for equal names
 */
export function compareNaturally(a: string, b: string): number {
  const [partsA, partsB] = [a.split(/[/\\]/), b.split(/[/\\]/)];
  collator ??= makeCollator();
  for (const [index, part] of partsA.entries()) {
    const order = collator.compare(part, partsB[index] ?? '');
    if (order !== 0) return order;
  }
  return partsA.length - partsB.length || (a < b ? -1 : Number(a > b));
}
