/**
 * A table's format as the fields of a form, and as the text that the engine and `--table` read: `name=value` pairs separated by
 * commas, columns counted from 1. What the text means is the engine's to judge; here it is only taken apart.
 */
import type { Address } from '../views/address.js';

export type FormatParts = ReadonlyMap<string, string>;

/** Who says where the robot was. */
export const POSE_KINDS = ['odometry', 'poses', 'reference'] as const;

export function partsOf(text: string): FormatParts {
  const pairs = text.split(',').map((pair) => pair.split('='));
  return new Map(pairs.flatMap(([name = '', value]) => (value === undefined ? [] : [[name.trim(), value.trim()]])));
}

export function textOf(parts: FormatParts): string {
  return [...parts].map(([name, value]) => `${name}=${value}`).join(',');
}

/** With other values; those that are null go. */
export function changed(parts: FormatParts, changes: Readonly<Record<string, string | null>>): FormatParts {
  const next = new Map(parts);
  for (const [name, value] of Object.entries(changes)) {
    if (value === null) next.delete(name);
    else next.set(name, value);
  }
  return next;
}

/** The columns that a part names, from 1; empty without. */
export function columnsOf(parts: FormatParts, name: string): string[] {
  return parts.get(name)?.split(':') ?? [];
}

/** An angle without its unit: the form has degrees. */
export function degreesOf(parts: FormatParts, name: string): string {
  const text = parts.get(name) ?? '';
  const degrees = text.endsWith('deg') ? Number(text.slice(0, -3)) : (Number(text) * 180) / Math.PI;
  return text === '' || !Number.isFinite(degrees) ? '' : String(Number(degrees.toFixed(4)));
}

/** What each column is used as: a word for the head of the preview. */
export function usesOf(parts: FormatParts): (column: number) => string {
  const [first = 0, last = first] = columnsOf(parts, 'ranges').map(Number);
  const single = new Map([
    [Number(parts.get('range')), 'range'],
    [Number(columnsOf(parts, 'angle')[0]), 'angle'],
    [Number(columnsOf(parts, 'time')[0]), 'time'],
    ...POSE_KINDS.flatMap((kind) =>
      columnsOf(parts, kind).map((column, at): [number, string] => [Number(column), ['x', 'y', 'heading'][at] ?? '']),
    ),
  ]);
  return (column) => single.get(column) ?? (column >= first && column <= last ? 'range' : '');
}

/** The format that the page's address holds; empty without. */
export function tableOfLink(fragment: string): string {
  return new URLSearchParams(fragment.replace(/^#/, '')).get('table') ?? '';
}

/** Writes the format into the page's address, beside the settings; null takes it out. */
export function rememberTable(address: Address, format: string | null): void {
  const values = new URLSearchParams(address.fragment.replace(/^#/, ''));
  if (format === null) values.delete('table');
  else values.set('table', format);
  address.write(values.toString().replaceAll('%3A', ':').replaceAll('%2C', ','));
}

/** Units, and what they are called. */
export const LENGTHS = { m: 'metres', cm: 'centimetres', mm: 'millimetres', in: 'inches', ft: 'feet' };
export const ANGLE_UNITS = {
  deg: 'degrees',
  rad: 'radians',
  '0.9deg': 'gon',
  '-1deg': 'degrees, clockwise',
  '-1': 'radians, clockwise',
  '-0.9deg': 'gon, clockwise',
};
/** One radian in degrees, as the engine writes it. */
const RADIAN = '57.2958';
export const TIME_UNITS = { s: 'seconds', ms: 'milliseconds', us: 'microseconds', ns: 'nanoseconds' };

/** The choice that an angle's unit is; another one is a choice of its own. */
export function unitOfAngles(unit: string): string {
  if (!unit.endsWith('deg')) return unit === 'gon' ? '0.9deg' : unit;
  if (unit === 'deg') return unit;
  const degrees = String(Number(unit.slice(0, -3)));
  const known: Record<string, string> = { '1': 'deg', [RADIAN]: 'rad', [`-${RADIAN}`]: '-1' };
  return known[degrees] ?? `${degrees}deg`;
}

/** Of a table whose columns are not known. */
export function firstGuess(num_columns: number): string {
  return num_columns < 24 ? `range=${Math.min(2, num_columns)},unit=m,start=0deg,step=1deg` : `ranges=1:${num_columns}`;
}

export function cellWords(value: number | null | undefined): string {
  return value === null || value === undefined ? '–' : String(Number(value.toPrecision(6)));
}
