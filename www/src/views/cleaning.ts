/** What was left out of scans before they were registered. */
import { formatCount } from './format.js';

export interface Cleaning {
  num_read: number;
  non_finite: number;
  too_near: number;
  at_range_limit: number;
  duplicates: number;
  num_kept: number;
}

export function cleaningParts(cleaning: Cleaning): string[] {
  const parts: [number, string][] = [
    [cleaning.non_finite, 'not a number'],
    [cleaning.too_near, 'too near'],
    [cleaning.at_range_limit, 'at the range limit'],
    [cleaning.duplicates, cleaning.duplicates === 1 ? 'duplicate' : 'duplicates'],
  ];
  return parts.filter(([count]) => count > 0).map(([count, what]) => `${formatCount(count)} ${what}`);
}

/** All scans' cleaning in one. */
export function sumCleaning(reports: readonly Cleaning[]): Cleaning {
  const sum: Cleaning = { num_read: 0, non_finite: 0, too_near: 0, at_range_limit: 0, duplicates: 0, num_kept: 0 };
  for (const report of reports) {
    for (const name of Object.keys(sum) as (keyof Cleaning)[]) sum[name] += report[name];
  }
  return sum;
}
