/** Numbers as people read them: lengths with their unit, angles in degrees. */
import { formatCount } from '../../../package/base/format_count.js';

export { formatCount };

export const DEGREES = 180 / Math.PI;

const MINUS = '\u2212';
const THIN_SPACE = '\u202f';

/** A fixed number of decimals with a real minus sign and no "-0.00". */
export function formatFixed(value: number, decimals: number): string {
  if (!Number.isFinite(value)) return 'not a number';
  const text = value.toFixed(decimals);
  const isZero = Number(text) === 0;
  return isZero ? text.replace('-', '') : text.replace('-', MINUS);
}

/** A length in the unit that suits it: 0.4 mm, 15.7 mm, 121 mm, 1.23 m. */
export function formatLength(metres: number): string {
  const size = Math.abs(metres);
  if (size < 0.0995) return `${formatFixed(metres * 1000, 1)}${THIN_SPACE}mm`;
  if (size < 0.9995) return `${formatFixed(metres * 1000, 0)}${THIN_SPACE}mm`;
  return `${formatFixed(metres, 2)}${THIN_SPACE}m`;
}

/** A duration given in milliseconds: 0.8 ms, 43 ms, 2.1 s, 1 min 12 s. */
export function formatDuration(milliseconds: number): string {
  if (milliseconds < 9.95) return `${formatFixed(milliseconds, 1)}${THIN_SPACE}ms`;
  if (milliseconds < 999.5) return `${formatFixed(milliseconds, 0)}${THIN_SPACE}ms`;
  const seconds = milliseconds / 1000;
  if (seconds < 59.95) return `${formatFixed(seconds, 1)}${THIN_SPACE}s`;
  const whole = Math.round(seconds);
  return `${Math.floor(whole / 60)}${THIN_SPACE}min ${whole % 60}${THIN_SPACE}s`;
}

export function formatPercent(share: number): string {
  return `${formatFixed(share * 100, 0)}${THIN_SPACE}%`;
}

/** "1 scan", "10 scans". */
export function plural(count: number, one: string, many = `${one}s`): string {
  return `${formatCount(count)} ${count === 1 ? one : many}`;
}

/** The last part of a path: what a table has room for. */
export function baseName(path: string): string {
  return path.slice(path.lastIndexOf('/') + 1);
}

/** With a capital at the start and a full stop at the end. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  return `${trimmed.charAt(0).toUpperCase()}${trimmed.slice(1)}${/[.!?…]$/.test(trimmed) ? '' : '.'}`;
}
