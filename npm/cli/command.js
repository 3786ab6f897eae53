// @ts-check
/** What every subcommand of `scanstitch` is made of. */
import { parseArgs } from 'node:util';
import { printable } from '../printable.js';

/** @typedef {typeof import('../index.js')} Engine */

/**
 * @typedef {object} Command
 * @property {string} name
 * @property {string} about one line
 * @property {(engine: Engine) => string} help all there is to know, ending in a newline
 * @property {(engine: Engine, args: string[]) => number | Promise<number>} run returns the exit code
 */

/** They ask a program to stop. */
export const SIGNALS = /** @type {const} */ (['SIGINT', 'SIGTERM']);

/** Exit codes, as `scanstitch --help` documents them. */
export const EXIT = Object.freeze({ done: 0, nothing: 1, partial: 2 });

/** Something that the one who typed the command can mend: printed as one line. */
export class CommandError extends Error {}

/**
 * Node's parseArgs, its complaints as a CommandError. No argument is empty: as a path it would become the working folder,
 * and what it mostly is, is a variable of the shell that was not set.
 * @template {import('node:util').ParseArgsConfig} T
 * @param {string} command name of the subcommand, for the message
 * @param {T} config
 * @returns {ReturnType<typeof parseArgs<T>>}
 */
export function readArguments(command, config) {
  const fault = (/** @type {string | undefined} */ problem) =>
    new CommandError(`${problem}. See: scanstitch ${command} --help`);
  /** @type {ReturnType<typeof parseArgs<T>>} */
  let parsed;
  try {
    parsed = parseArgs(config);
  } catch (error) {
    throw fault(/** @type {Error} */ (error).message.split('. ')[0]);
  }
  const named = Object.entries(parsed.values).find(([, value]) => [value].flat().includes(''));
  if (named) throw fault(`--${named[0]}: the value is empty`);
  if (/** @type {string[]} */ (parsed.positionals).includes('')) throw fault('An argument is empty');
  return parsed;
}

/**
 * Does work that the first Ctrl-C or SIGTERM stops and a second one ends with the program.
 * @template T
 * @param {(signal: AbortSignal) => Promise<T>} work
 */
export async function untilInterrupt(work) {
  const controller = new AbortController();
  const stop = () => controller.abort();
  const release = () => {
    for (const signal of SIGNALS) process.removeListener(signal, stop);
  };
  controller.signal.addEventListener('abort', release);
  for (const signal of SIGNALS) process.on(signal, stop);
  try {
    return await work(controller.signal);
  } finally {
    release();
  }
}

/**
 * Whether it is bad input, told by the engine, and not a defect of the engine.
 * @param {unknown} error
 * @returns {error is import('../index.js').ScanstitchError}
 */
export function isScanstitchError(error) {
  return error instanceof Error && error.name === 'ScanstitchError';
}

/** Characters of a cell that are shown at most. */
const CELL_LENGTH = 120;

/**
 * Lays rows out in columns; numbers flush right.
 * @param {string[]} heads
 * @param {string[][]} rows
 * @param {Set<number>} left indices of the columns that are flush left
 */
export function table(heads, rows, left) {
  const all = [heads, ...rows.map((row) => row.map((cell) => printable(cell, CELL_LENGTH)))];
  const widths = heads.map((_, column) => all.reduce((most, row) => Math.max(most, (row[column] ?? '').length), 0));
  const line = (/** @type {string[]} */ row) =>
    row
      .map((cell, column) => (left.has(column) ? cell.padEnd(widths[column] ?? 0) : cell.padStart(widths[column] ?? 0)))
      .join('  ')
      .trimEnd();
  return `${all.map(line).join('\n')}\n`;
}
