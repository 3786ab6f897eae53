/**
 * Readings as small sensors and students' programs print them, an angle and a distance at a time, as a table of two columns: its
 * unit, the laser's sense and where a scan ends are found as of any other table.
 *
 * | what | example |
 * |---|---|
 * | a dictionary a scan, as the Python packages of YDLIDARs print it | `{0: 1234, 1: 1230, ...}` |
 * | an angle and a distance a line, behind a colon | `15:1234` |
 * | the radar of the Arduino tutorials: angle, distance, a point | `15,34.16,33.17,33.` |
 * | letters before the numbers | `a:15.50 r:1.234` |
 */
import { DEGREE } from '../base/units.js';
import { evenShare, extent, MAX_RADIANS, median, stepsOf } from './angles.js';

const NUMBER = String.raw`-?\d+(?:\.\d+)?`;
/** So many readings have to stand at the beginning. */
const FIRST = 8;
/** Narrower views (degrees) are those of no sensor that sweeps. */
const MIN_VIEW = 45;
/** A step is even within this share of the median step. */
const EVEN = 0.5;
/** At least this share of the steps is even. */
const MIN_EVEN = 0.9;
const PAIR = new RegExp(String.raw`["']?(${NUMBER})["']?\s*:\s*(${NUMBER}|nan|inf|None|null)\s*(?=[,}])`, 'gi');
const DICTIONARY = new RegExp(
  String.raw`^\s*\{\s*(?:["']?${NUMBER}["']?\s*:\s*(?:${NUMBER}|nan|inf|None|null)\s*,\s*){${FIRST}}`,
  'i',
);
const COLON_LINE = new RegExp(String.raw`^\s*(${NUMBER})\s*:\s*(${NUMBER})\s*(?:m|cm|mm)?\s*$`);
const RADAR = /(\d{1,3}),(\d{1,5})\./g;
/** Behind each point the next angle and its comma follow, which they do in no table. */
const RADAR_ALONE = new RegExp(String.raw`^(?:\s*\d{1,3},\d{1,5}\.){${FIRST},}\s*(?:\d{1,3}(?:,\d{0,5})?)?\s*$`);
const LETTERS = new RegExp(String.raw`\ba\s*[:=]\s*(${NUMBER})[\s,;]+(?:r|d)\s*[:=]\s*(${NUMBER})`, 'i');

type Readings = [angle: string, distance: string][];

const KINDS: readonly { is: (head: string) => boolean; read: (text: string) => Readings }[] = [
  { is: (head) => DICTIONARY.test(head), read: (text) => [...text.matchAll(PAIR)].map(pairOf) },
  { is: (head) => RADAR_ALONE.test(head), read: (text) => [...text.matchAll(RADAR)].map(pairOf) },
  { is: (head) => areMost(head, COLON_LINE), read: (text) => linesOf(text, COLON_LINE) },
  { is: (head) => areMost(head, LETTERS), read: (text) => linesOf(text, LETTERS) },
];

/** What reads a text that begins like this as a table; null where it is none of these. */
export function angleDistanceReader(head: string): ((text: string) => string) | null {
  const kind = KINDS.find(({ is }) => is(head));
  if (!kind) return null;
  return (text) => {
    const readings = kind.read(text);
    const rows = readings.map(([angle, range]) => `${angle},${Number.isFinite(Number(range)) ? range : 'nan'}\n`);
    return `angle,range\n${rows.join('')}`;
  };
}

function pairOf([, angle = '', distance = '']: RegExpMatchArray): [string, string] {
  return [angle, distance];
}

/**
 * Whether most of the first lines are readings: their angles go on evenly over a view that a sensor has. Clocks have
 * colons, too.
 */
function areMost(head: string, line: RegExp) {
  const lines = head.split(/\r?\n/).filter((text) => text.trim() !== '');
  const readings = linesOf(head, line);
  if (readings.length < 3 * FIRST || 4 * readings.length < 3 * lines.length) return false;
  if (readings.every((words) => words.every((word) => /^[0-5]?\d$/.test(word)))) return false;
  const angles = readings.map(([angle]) => Number(angle));
  const steps = stepsOf(angles).map(Math.abs);
  const [least, most] = extent(angles);
  const view = most - least;
  const isView = view > MIN_VIEW || (Math.max(most, -least) < MAX_RADIANS && view > MIN_VIEW * DEGREE);
  return median(steps) > 0 && isView && evenShare(steps, EVEN) >= MIN_EVEN;
}

function linesOf(text: string, line: RegExp): Readings {
  return text.split(/\r?\n/).flatMap((given) => {
    const match = line.exec(given);
    return match ? [pairOf(match)] : [];
  });
}
