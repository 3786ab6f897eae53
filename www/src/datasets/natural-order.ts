const collator = new Intl.Collator('en', { numeric: true, sensitivity: 'base' });

/** The order people expect of numbered files: 2.ply before 10.ply, folder by folder. */
export function compareNatural(a: string, b: string): number {
  const parts_a = a.split('/');
  const parts_b = b.split('/');
  for (let i = 0; i < Math.min(parts_a.length, parts_b.length); i++) {
    const order = collator.compare(parts_a[i] as string, parts_b[i] as string);
    if (order !== 0) return order;
  }
  return parts_a.length - parts_b.length || (a < b ? -1 : a > b ? 1 : 0);
}
