/**
 * What Hokuyo's lasers answer to the commands MD, MS, ME, GD and GS, as terminals and programs keep it.
 *
 * Source: Hokuyo, "Communication Protocol Specification for SCIP2.0 Standard" (C-42-03320B): an echo of the command (first and last
 * step and the steps of a group in decimal digits), a status (00 or 99) with its sum, a clock of 24 bits (ms), blocks of at most 64
 * characters with their sum, and an empty line. A character holds 6 bits above 0x30; a sum is the last 6 bits of the characters'
 * sum, held alike. The parameters (PP) name the steps of a turn (ARES) and the one that looks ahead (AFRT).
 */
import type { Scan } from './scan.js';

/** Command, first and last step, steps of a group. */
const ECHO = /^(M[DSE]|G[DSE])(\d{4})(\d{4})(\d{2})/;
const STATUS = /^(00P|99b)$/;
const HEAD = /^(?:M[DSE]|G[DSE])\d{10}.*\r?\n(?:00P|99b)\r?$/m;
const PARAMETER = /^(ARES|AFRT):(\d+);/;
/** Steps of a turn and the step that points ahead where the file has no parameters: of the URG-04LX, and of lasers with more steps. */
const SHORT = { steps: 1024, front: 384, last: 768 };
const LONG = { steps: 1440, front: 540 };
/** Smallest range (mm): values below it are error codes. */
const FIRST_RANGE = 20;
/** Smallest error code above the ranges (mm). */
const NO_RETURN = 65_533;
/** No laser answers with more lines: 1,440 steps of six characters. */
const MOST_LINES = 200;
/** Characters of a range, by the last letter of the command; of an echo's intensity as many again. */
const WIDTH = { D: 3, S: 2, E: 3 };

export function isScip(head: string) {
  return HEAD.test(head);
}

/** The scans, and how many answers are damaged or cut off. */
export function readScip(text: string): { scans: Scan[]; numBroken: number } {
  const lines = text.split(/\r?\n/);
  const known: Map<string, number> = new Map();
  const scans: Scan[] = [];
  let numBroken = 0;
  for (let at = 0; at < lines.length; at += 1) {
    const [, name, value] = PARAMETER.exec(lines[at] ?? '') ?? [];
    if (name !== undefined) known.set(name, Number(value));
    const echo = ECHO.exec(lines[at] ?? '');
    if (!echo || !STATUS.test(lines[at + 1] ?? '')) continue;
    const rest = lines.slice(at + 2, at + 2 + MOST_LINES);
    const length = rest.indexOf('');
    // The first answer to MD holds the status alone.
    if (length === 0) continue;
    const scan = length < 0 ? null : scanOf(echo, rest.slice(0, length), known);
    if (scan) scans.push(scan);
    else numBroken += 1;
    if (scan) at += 1 + length;
  }
  return { scans, numBroken };
}

/**
 * @param body the clock and the blocks
 * @returns null where it is damaged
 */
function scanOf(
  [, command = '', first, last, group]: RegExpExecArray,
  [clock = '', ...blocks]: readonly string[],
  known: ReadonlyMap<string, number>,
): Scan | null {
  const [from, to, grouped] = [Number(first), Number(last), Math.max(1, Number(group))];
  if (![clock, ...blocks].every(hasItsSum) || clock.length !== 5) return null;
  const data = blocks.map((block) => block.slice(0, -1)).join('');
  const width = WIDTH[command[1] as 'D' | 'S' | 'E'];
  const stride = command[1] === 'E' ? 2 * width : width;
  const count = Math.floor((to - from) / grouped) + 1;
  if (data.length !== stride * count) return null;
  const ranges = Array.from({ length: count }, (_, reading) => {
    const millimetres = decoded(data.slice(stride * reading, stride * reading + width));
    return millimetres < FIRST_RANGE || millimetres >= NO_RETURN ? null : 1e-3 * millimetres;
  });
  const usual = to <= SHORT.last ? SHORT : LONG;
  const turn = (2 * Math.PI) / (known.get('ARES') ?? usual.steps);
  const start = (from + (grouped - 1) / 2 - (known.get('AFRT') ?? usual.front)) * turn;
  return { ranges, start, step: grouped * turn, time: 1e-3 * decoded(clock.slice(0, 4)) };
}

function decoded(characters: string) {
  return [...characters].reduce((value, character) => 64 * value + (character.charCodeAt(0) - 0x30), 0);
}

function hasItsSum(block: string) {
  const sum = [...block.slice(0, -1)].reduce((total, character) => total + character.charCodeAt(0), 0);
  return block.length > 1 && block.charCodeAt(block.length - 1) === (sum & 0x3f) + 0x30;
}
