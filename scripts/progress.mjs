// @ts-check
/**
 * Tells whoever waits what is being done and how far it is: on a terminal one line that is rewritten, elsewhere a line now
 * and then. Nothing here may import a package: it runs before `npm ci` has.
 */
import { AsyncLocalStorage } from 'node:async_hooks';

/**
 * A piece of work that is under way.
 * @typedef {object} Work
 * @property {string} title
 * @property {number} start when it began (ms)
 * @property {string} far how far it is, as its commands tell; empty where they do not
 * @property {number} cpuSeconds processor time of its commands that have ended
 * @property {(text: string | Uint8Array) => void} write where it and its commands write
 */

/** The work that the running code belongs to. @type {AsyncLocalStorage<Work>} */
const current = new AsyncLocalStorage();
/** @type {Set<Work>} */
const underWay = new Set();

/** Nobody wonders about work that takes less (ms). */
const PATIENCE_MS = 3000;
/** Between two lines where none can be rewritten (ms). */
const INTERVAL_MS = 10_000;
const TICK_MS = 1000;
const CLEAR_LINE = '\r\u001B[K';

/** @type {NodeJS.WritableStream & { isTTY?: boolean, columns?: number }} */
let stream = process.stdout;
let isLineShown = false;
let lastTold = 0;
/** @type {NodeJS.Timeout | undefined} */
let timer;

/** From here on everything is told on this stream. @param {typeof stream} other */
export function tellOn(other) {
  stream = other;
}

/** Writes at once, whatever else is under way. @param {string | Uint8Array} text */
export function print(text) {
  if (isLineShown) stream.write(CLEAR_LINE);
  isLineShown = false;
  stream.write(text);
}

/** Writes where the current work writes. @param {string | Uint8Array} text */
export function write(text) {
  const work = current.getStore();
  if (work) work.write(text);
  else print(text);
}

/** A line to the person at the keyboard. @param {string} line */
export function say(line) {
  write(`${line}\n`);
}

/** The work that the caller belongs to, if it belongs to any. */
export function currentWork() {
  return current.getStore();
}

/**
 * Does a piece of work; until it ends it is told how far it is.
 * @template T
 * @param {string} title
 * @param {() => T | Promise<T>} action
 * @param {Work['write']} [write]
 * @returns {Promise<{ result: T, work: Work }>}
 */
export async function track(title, action, write = print) {
  /** @type {Work} */
  const work = { title, start: performance.now(), far: '', cpuSeconds: 0, write };
  underWay.add(work);
  timer ??= setInterval(tell, TICK_MS).unref();
  try {
    return { result: await current.run(work, action), work };
  } finally {
    underWay.delete(work);
    if (underWay.size === 0) {
      clearInterval(timer);
      timer = undefined;
      print('');
    }
  }
}

/** Everything that has been under way for some time: `Compiling the engine, 34 of 62 nalgebra, 12 s; ...` */
export function describe() {
  const now = performance.now();
  return [...underWay]
    .filter(({ start }) => now - start >= PATIENCE_MS)
    .map(({ title, start, far }) => [title, far, `${Math.round((now - start) / 1000)} s`].filter(Boolean).join(', '))
    .join('; ');
}

function tell() {
  const now = performance.now();
  const isNew = [...underWay].some(({ start }) => now - start >= PATIENCE_MS && lastTold - start < PATIENCE_MS);
  if (!isNew && !stream.isTTY && now - lastTold < INTERVAL_MS) return;
  const line = describe();
  if (line === '') return;
  lastTold = now;
  if (stream.isTTY) print(`  ${line}`.slice(0, (stream.columns ?? 80) - 1));
  else print(`  ${line}\n`);
  isLineShown = Boolean(stream.isTTY);
}

/** What cargo says while all goes well: nobody needs it. */
const CARGO_ROUTINE =
  /^\s*(Compiling|Checking|Documenting|Downloaded|Downloading|Updating|Locking|Finished|Blocking|Fresh)\b/;
const CARGO_PROGRESS = /^\s*(?:Building|Updating|Fetch|Downloading) \[[=> ]*\] (\d+)\/(\d+)(?:: (.*))?/;
/** What makes cargo tell its progress where nobody sees a terminal. */
export const CARGO_TELLS = { CARGO_TERM_PROGRESS_WHEN: 'always', CARGO_TERM_PROGRESS_WIDTH: '100' };

/** A test that passed, as the runners tell it. */
const PASSED = /^test .* \.\.\. ok$|^\s*✔ |^\s*✓\s+\d+ /;

/**
 * Whether a line of a command's output only tells how far the command is. The work then tells it, and how many tests passed.
 * @param {string} line
 * @param {Work | undefined} work
 */
export function isProgress(line, work) {
  const [, done, total, crates = ''] = line.match(CARGO_PROGRESS) ?? [];
  if (work && total !== undefined) {
    work.far = [`${done} of ${total}`, crates.replace(/\(.*?\)|\.{3}/g, '').trim()].filter(Boolean).join(' ');
  } else if (work && PASSED.test(line)) {
    work.far = `${Number(work.far.match(/^(\d+) passed$/)?.[1] ?? 0) + 1} passed`;
  }
  return total !== undefined || CARGO_ROUTINE.test(line);
}
