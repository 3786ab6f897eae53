/**
 * Scans as JSON: a message, a list of them, one a line, within others (rosbridge); objects with an angle and a distance each; lists
 * of numbers alone, as Python writes them, too.
 */
import { fileError } from '../base/errors.js';
import { lookUp } from '../base/look_up.js';
import { ticksPerSecond } from '../base/units.js';
import { inRadians, mayBeMirrored } from './angles.js';
import { isPointJson, pointsOfList, scanOfPoints } from './point_scans.js';
import { numberOf, type Scan, scanOf } from './scan.js';
import type { Tell } from './scan_checks.js';

/** Nesting of JSON that is looked into. */
const MAX_DEPTH = 8;
/** Readings of a scan, at least, where nothing names them. */
const MIN_BEAMS = 24;
/** Lists of so many numbers, as JSON or as Python prints them. */
const LISTS = /\[(\s*(-?[\d.]+([eE][-+]?\d+)?|nan|inf|NaN|Infinity|null)\s*,){23}/;

/** Arrays as NumPy prints them, with blanks between the numbers: of so many numbers, or with an ellipsis in place of some. */
const PRINTED =
  /^\s*\[+\s*((-?\d+\.?\d*(e[-+]?\d+)?|nan|inf)\s+){3}(((-?\d+\.?\d*(e[-+]?\d+)?|nan|inf)\s+){20}|\.\.\. )/;

/** Whether it begins with lists of numbers that nothing names. */
export function isNumberLists(head: string) {
  return PRINTED.test(head) || (/^\s*[[{]/.test(head) && LISTS.test(head));
}

export function isJson(head: string) {
  if (!/^\s*[[{]/.test(head) || /"readings"|"nrays"/.test(head)) return false;
  const has = (names: string) => new RegExp(`["'](${names})["']\\s*:\\s*-?[\\d.[]`, 'i').test(head);
  return (
    isPointJson(head) ||
    has('ranges') ||
    has('angle_min') ||
    (has('angle|theta|bearing') && has('range|dist|distance|r'))
  );
}

export function readJson(text: string, name: string, tell: Tell) {
  const scans: Scan[] = [];
  const lists = PRINTED.test(text) ? ofNumPy(text, name) : text;
  // Python's words for what is no number are none of JSON's.
  const documents = documentsOf(inJson(lists), name, tell);
  for (const document of documents) collect(document, {}, 0, scans);
  if (scans.length === 0) for (const document of documents) collectLists(document, {}, 0, scans);
  return scans;
}

/** Printed arrays as one list of lists. */
function ofNumPy(text: string, name: string) {
  if (text.includes('...')) {
    const remedy = "Save them whole: numpy.savetxt('scans.txt', ranges)";
    throw fileError(name, 'Most numbers of these arrays were left out ("...") when NumPy printed them', remedy);
  }
  return `[${text.replaceAll(/(\d)\.(?=[\s\]e])/g, '$1').replaceAll(/([\d\]nf])\s+(?=[-\d[ni])/g, '$1,')}]`;
}

/** Python's quotes and words, and what is no number, as JSON has them. */
function inJson(text: string) {
  const numbers = text.replaceAll(/([[,]\s*)-?(?:nan|inf|NaN|Infinity)(?=\s*[,\]])/g, '$1null');
  if (numbers.includes('"')) return numbers;
  const words = { True: 'true', False: 'false', None: 'null' };
  return numbers.replaceAll("'", '"').replaceAll(/\b(True|False|None)\b/g, (word) => lookUp(words, word) ?? word);
}

/** One document, or one a line. */
function documentsOf(text: string, name: string, tell: Tell): unknown[] {
  try {
    return [JSON.parse(text)];
  } catch {
    const lines = text.split(/\r?\n/).filter((line) => line.trim() !== '');
    const known = lines.flatMap((line) => {
      try {
        return [JSON.parse(line.replace(/,\s*$/, ''))];
      } catch {
        return [];
      }
    });
    // A recorder that was stopped leaves half a line behind, or a document without its end.
    const ended = known.length === 0 ? withEnd(text) : null;
    if (ended !== null) {
      tell('it has no end; what comes before is used', true);
      return [ended];
    }
    if (known.length === 0 || known.length < lines.length - 1) {
      throw fileError(name, 'This is neither one JSON document nor one a line', 'Correct the JSON: one scan a line');
    }
    if (known.length < lines.length) tell('one of its lines is not JSON, and is left out', true);
    return known;
  }
}

/** A document that is cut off, up to the last list or object that is whole; null where there is none. */
function withEnd(text: string): unknown {
  const open: string[] = [];
  let [end, closing, isText] = [0, '', false];
  for (let at = 0; at < text.length; at += 1) {
    const letter = text[at];
    if (isText && letter === '\\') at += 1;
    else if (letter === '"') isText = !isText;
    else if (!isText && (letter === '{' || letter === '[')) open.push(letter === '{' ? '}' : ']');
    else if (!isText && (letter === '}' || letter === ']')) {
      if (open.pop() !== letter) return null;
      [end, closing] = [at + 1, open.toReversed().join('')];
    }
  }
  try {
    return JSON.parse(text.slice(0, end) + closing);
  } catch {
    return null;
  }
}

/** The entries of an object, by their times where all keys are numbers: JavaScript puts whole ones first. */
function entriesOf(object: object) {
  const entries = Object.entries(object);
  const areNumbers = entries.every(([key]) => key.trim() !== '' && Number.isFinite(Number(key)));
  return areNumbers ? entries.sort(([a], [b]) => Number(a) - Number(b)) : entries;
}

/** What is known of the item of a key: a number that it is filed under is its time. */
function under(known: Readonly<Record<string, unknown>>, key: string) {
  const number = key.trim() === '' ? Number.NaN : Number(key);
  if (!Number.isFinite(number)) return known;
  return { ...known, time: number / (ticksPerSecond(number) ?? 1) };
}

/** The scans within a document; fields of what holds them (a time, for one) belong to them. */
function collect(value: unknown, around: Readonly<Record<string, unknown>>, depth: number, scans: Scan[]) {
  if (typeof value !== 'object' || value === null || depth > MAX_DEPTH) return;
  if (Array.isArray(value)) {
    const points = pointsOfList(value);
    const readings = points ? scanOfPoints(points) : readingsOf(value);
    if (readings) scans.push({ ...scanOf((key) => around[key], []), ...readings });
    else value.forEach((item) => collect(item, around, depth + 1, scans));
    return;
  }
  const own = value as Record<string, unknown>;
  const known = { ...around, ...flat(own) };
  const ranges = Object.entries(own).find(([key]) => /^ranges$/i.test(key))?.[1];
  if (Array.isArray(ranges) && ranges.every((range) => typeof range !== 'object' || range === null)) {
    const angles = own['angles'];
    const listed =
      Array.isArray(angles) && angles.length === ranges.length ? { angles: inRadians(angles.map(Number)) } : {};
    scans.push({ ...scanOf((key) => known[key], ranges), ...listed });
    return;
  }
  entriesOf(own).forEach(([key, item]) => collect(item, under(known, key), depth + 1, scans));
}

/** The lists of numbers within a document, where nothing in it is called ranges. */
function collectLists(value: unknown, around: Readonly<Record<string, unknown>>, depth: number, scans: Scan[]) {
  if (typeof value !== 'object' || value === null || depth > MAX_DEPTH) return;
  const isNumber = (item: unknown) => typeof item === 'number' || item === null;
  if (Array.isArray(value) && value.length >= MIN_BEAMS && value.every(isNumber)) {
    scans.push(scanOf((key) => around[key], value));
    return;
  }
  if (Array.isArray(value)) {
    for (const item of value) collectLists(item, around, depth + 1, scans);
    return;
  }
  const known = { ...around, ...flat(value as Record<string, unknown>) };
  for (const [key, item] of entriesOf(value)) collectLists(item, under(known, key), depth + 1, scans);
}

/** Numbers and texts of an object, and those of its header and stamp. */
function flat(object: Record<string, unknown>): Record<string, unknown> {
  const nested = ['header', 'stamp'].map((key) => object[key]);
  const below = nested.flatMap((item) =>
    typeof item === 'object' && item !== null && !Array.isArray(item) ? [flat(item as Record<string, unknown>)] : [],
  );
  const plain = Object.entries(object).filter(([, value]) => typeof value !== 'object');
  return Object.assign(Object.fromEntries(plain), ...below);
}

/** A list of objects with an angle and a distance each. */
function readingsOf(list: readonly unknown[]): Pick<Scan, 'ranges' | 'angles' | 'mayBeMirrored'> | null {
  const [first] = list;
  if (list.length < 2 || typeof first !== 'object' || first === null || Array.isArray(first)) return null;
  const keys = Object.keys(first);
  const angle = keys.find((key) => /^(angle|theta|bearing|azimuth)(_?(deg|rad|degrees|radians))?$/i.test(key));
  const distance = keys.find((key) => /^(range|dist|distance|r)(_?(m|cm|mm))?$/i.test(key));
  if (angle === undefined || distance === undefined) return null;
  const values = (key: string) => list.map((item) => numberOf(((item ?? {}) as Record<string, unknown>)[key]));
  const angles = inRadians(values(angle));
  return { angles, ranges: metres(values(distance)), ...(mayBeMirrored(angles) && { mayBeMirrored: true }) };
}

/** Distances whose median is beyond 60 are millimetres: no laser for the plane sees that far. */
function metres(distances: readonly number[]) {
  const sorted = distances.filter((distance) => distance > 0).sort((a, b) => a - b);
  const unit = (sorted[Math.floor(sorted.length / 2)] ?? 0) > 60 ? 1e-3 : 1;
  return distances.map((distance) => (distance > 0 ? unit * distance : null));
}
