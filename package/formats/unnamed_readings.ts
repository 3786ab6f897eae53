/** Tables of a reading a line without names: which column is the angle, as it turns again and again, and which the range. */
import { DEGREE } from '../base/units.js';
import { areDegrees, extent, stepsOf } from './angles.js';

/** So many lines tell. */
const MIN_LINES = 60;
/** A reading has so many numbers: an angle and a range, a quality, a time. */
const [MIN_COLUMNS, MAX_COLUMNS] = [2, 6];
/** Smallest view of a sensor that turns, and largest step of it (degrees). */
const [MIN_VIEW, MAX_STEP] = [45, 10];
/** Smallest share of the steps that go on in one sense. */
const MIN_STEADY = 0.9;

/** What reads a text that begins like this: with names above its columns. Null where it is none. */
export function unnamedReader(head: string): ((text: string) => string) | null {
  const rows = rowsOf(head);
  const [first] = rows;
  if (!first || rows.length < MIN_LINES || first.length < MIN_COLUMNS || first.length > MAX_COLUMNS) return null;
  if (rows.some((row) => row.length !== first.length || !row.every(Number.isFinite))) return null;
  const columns = first.map((_, at) => rows.map((row) => row[at] ?? Number.NaN));
  const angle = columns.findIndex(isTurning);
  const range = angle < 0 ? -1 : rangeAmong(columns, angle);
  if (range < 0) return null;
  const names = columns.map((values, at) =>
    at === angle ? 'angle' : at === range ? 'distance' : isGrowing(values) ? 'timestamp' : `other${at}`,
  );
  return (text) =>
    `${names.join(',')}\n${text
      .split(/\r?\n/)
      .map((line) =>
        line
          .trim()
          .split(/[\s,;]+/)
          .join(','),
      )
      .join('\n')}`;
}

/** The numbers of all lines but the last, which may be cut off. */
function rowsOf(head: string) {
  const lines = head.split(/\r?\n/).slice(0, -1);
  const told = lines.map((line) => line.trim()).filter((line) => line !== '' && !line.startsWith('#'));
  return told.map((line) => line.split(/[\s,;]+/).map(Number));
}

/** Whether these are the angles of a sensor that turns at least twice. */
function isTurning(values: number[]) {
  const [least, most] = extent(values);
  const unit = areDegrees(values) ? 1 : 1 / DEGREE;
  const view = unit * (most - least);
  if (view < MIN_VIEW || view > 361 || unit * Math.max(-least, most) > 361) return false;
  const steps = stepsOf(values).map((step) => unit * step);
  const jumps = steps.filter((step) => Math.abs(step) > view / 2);
  const small = steps.filter((step) => Math.abs(step) <= MAX_STEP && step !== 0);
  const up = small.filter((step) => step > 0).length;
  const steady = Math.max(up, small.length - up);
  // Jumps go back against the sense of the turn.
  const isBack = jumps.every((jump) => jump > 0 !== 2 * up > small.length);
  return jumps.length > 0 && isBack && steady >= MIN_STEADY * (steps.length - jumps.length);
}

/** The column of the ranges: positive, and the one with most different numbers. */
function rangeAmong(columns: number[][], angle: number) {
  const candidates = columns.map((values, at) => {
    const isRange = at !== angle && values.every((value) => value >= 0) && !isGrowing(values);
    return { at, different: isRange ? new Set(values).size : 0 };
  });
  const [best] = candidates.sort((a, b) => b.different - a.different);
  return best && best.different > MIN_LINES / 4 ? best.at : -1;
}

function isGrowing(values: number[]) {
  return stepsOf(values).every((step) => step >= 0) && (values.at(-1) ?? 0) > (values[0] ?? 0);
}
