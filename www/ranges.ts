/// <reference types="node" />
/** Puts scans into scripts as ranges, from which the page makes the same bytes again: `import text from './0.ply?ranges'`. */
import { readFileSync } from 'node:fs';
import type { Plugin } from 'vite';
import { scanText } from './src/datasets/scan-text.js';

const RANGES = /\?ranges$/;
/** What is left of a coordinate with four decimals (m). */
const ROUNDING = 0.5e-4;
/** Further from a change of the last digit than the cosines of browsers differ by (m). */
const MARGIN = 1e-9;
const MOST_DECIMALS = 9;

export const scansAsRanges: Plugin = {
  name: 'scans-as-ranges',
  enforce: 'pre',
  load(id) {
    if (!RANGES.test(id)) return null;
    const text = readFileSync(id.replace(RANGES, ''), 'utf8');
    const rows = text
      .slice(text.indexOf('end_header\n') + 'end_header\n'.length)
      .trimEnd()
      .split('\n');
    const ranges = rows.map((row, beam) => rangeOf(row, (Math.PI * beam) / (rows.length - 1))).join(' ');
    if (scanText(ranges) !== text) this.error(`${id} is no scan over half a turn with four decimals.`);
    return `export default ${JSON.stringify(ranges)};`;
  },
};

/** The shortest number of metres that gives the coordinates of the row at this angle. */
function rangeOf(row: string, angle: number): string {
  const [x = 0, y = 0] = row.split(' ').map(Number);
  const bounds = [
    [x, Math.cos(angle)],
    [y, Math.sin(angle)],
  ].flatMap(([value = 0, share = 0]) => {
    const [middle, reach] = [value / share, ROUNDING / Math.abs(share)];
    return share === 0 ? [] : [{ low: middle - reach, high: middle + reach }];
  });
  const low = Math.max(...bounds.map((bound) => bound.low)) + MARGIN;
  const high = Math.min(...bounds.map((bound) => bound.high)) - MARGIN;
  const candidates = Array.from({ length: MOST_DECIMALS }, (_, decimals) => ((low + high) / 2).toFixed(decimals));
  return candidates.find((range) => Number(range) > low && Number(range) < high)?.replace(/^0\./, '.') ?? '';
}
