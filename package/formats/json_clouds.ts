/** Clouds as JSON: lists of points, `[x, y, z]` or `{"x": ..., "y": ..., "z": ...}` each, in whatever they lie. */
import { pointsFile } from './ply.js';

/** Fewer points are no cloud. */
const MIN_POINTS = 24;
/** The same number of points at the beginning of a list, as lists and as objects; a third coordinate that is not zero is that of space. */
const NUMBER = String.raw`\s*-?[\d.]+(?:[eE][-+]?\d+)?\s*`;
/** What follows the third number begins with a comma: digits that could be of either would be tried in all ways, of each list. */
const LISTS = new RegExp(String.raw`\[(?:\s*\[${NUMBER},${NUMBER},${NUMBER}(?:,[^[\]]*)?\]\s*,){${MIN_POINTS - 1}}`);
const OBJECTS = new RegExp(String.raw`\[(?:\s*\{[^{}]*["'][zZ]["']\s*:[^{}]*\}\s*,){${MIN_POINTS - 1}}`);

type Point = [number, number, number];

/** Whether a document begins with a cloud: the height of its points varies. */
export function isCloudJson(head: string) {
  const first = LISTS.exec(head)?.[0] ?? OBJECTS.exec(head)?.[0];
  if (!/^\s*[[{]/.test(head) || first === undefined) return false;
  const points = pointsOf(parsed(`${first.replace(/,\s*$/, '')}]`));
  return points !== null && new Set(points.map(([, , z]) => z)).size > 1;
}

/** The clouds of a document as PLY, in their order. */
export function cloudsOfJson(text: string): Uint8Array[] {
  const clouds: Uint8Array[] = [];
  const visit = (value: unknown) => {
    if (typeof value !== 'object' || value === null) return;
    const points = pointsOf(value);
    if (points) clouds.push(pointsFile(Float64Array.from(points.flat())));
    else Object.values(value).forEach(visit);
  };
  visit(parsed(text));
  return clouds;
}

function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}

/** The points of a list; null where it is none. Those that have no numbers are left out. */
function pointsOf(list: unknown): Point[] | null {
  if (!Array.isArray(list) || list.length < MIN_POINTS - 1) return null;
  const points = list.map((item: unknown): unknown[] => {
    if (typeof item !== 'object' || item === null) return [];
    if (Array.isArray(item)) return item.slice(0, 3);
    const named = new Map(Object.entries(item).map(([key, value]) => [key.toLowerCase(), value as unknown]));
    return ['x', 'y', 'z'].map((name) => named.get(name));
  });
  if (!points.every(({ length }) => length === 3)) return null;
  const isPoint = (point: unknown[]): point is Point => point.every((value) => Number.isFinite(value));
  const known = points.filter(isPoint);
  return known.length > 0 ? known : null;
}
