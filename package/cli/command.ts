/** What every subcommand of `scanstitch` is made of. */
import { parseArgs, type ParseArgsConfig } from 'node:util';
import type { ScanstitchError } from '../../pkg/scanstitch.js';
import { printable } from '../base/printable.js';

export type Engine = typeof import('../index.js');

export interface Command {
  name: string;
  /** One line. */
  about: string;
  /** All there is to know, ending in a newline. */
  help: (engine: Engine) => string;
  /** Returns the exit code. */
  run: (engine: Engine, args: string[]) => number | Promise<number>;
}

/** They ask a program to stop. */
export const SIGNALS = ['SIGINT', 'SIGTERM'] as const;

/** Exit codes, as `scanstitch --help` documents them. */
export const EXIT = Object.freeze({ done: 0, nothing: 1, partial: 2 });

/** Something that the one who typed the command can mend: printed as one line. */
export class CommandError extends Error {}

/**
 * Node's parseArgs, its complaints as a CommandError. No argument is empty: as a path it would become the working folder,
 * and what it mostly is, is a variable of the shell that was not set.
 * @param command name of the subcommand, for the message
 */
export function readArguments<T extends ParseArgsConfig>(command: string, config: T): ReturnType<typeof parseArgs<T>> {
  const fault = (problem: string | undefined) => new CommandError(`${problem}. See: scanstitch ${command} --help`);
  let parsed: ReturnType<typeof parseArgs<T>>;
  try {
    parsed = parseArgs(config);
  } catch (error) {
    throw fault((error as Error).message.split('. ')[0]);
  }
  const named = Object.entries(parsed.values).find(([, value]) => [value].flat().includes(''));
  if (named) throw fault(`--${named[0]}: the value is empty`);
  if ((parsed.positionals as string[]).includes('')) throw fault('An argument is empty');
  return parsed;
}

type Words<Text extends string> = Text extends `${infer First} ${infer Rest}` ? First | Words<Rest> : Text;
const TEXT = { type: 'string' } as const;
const LIST = { type: 'string', multiple: true } as const;
const FLAG = { type: 'boolean', default: false } as const;

/** Options by their names, separated by blanks: `texts` take a value, `lists` may be repeated, `flags` take none. */
export function optionsOf<Texts extends string = never, Lists extends string = never, Flags extends string = never>({
  texts,
  lists,
  flags,
}: {
  texts?: Texts;
  lists?: Lists;
  flags?: Flags;
}) {
  const all = (names: string | undefined, option: object) =>
    Object.fromEntries(names?.split(' ').map((name) => [name, option]) ?? []);
  type Options = Record<Words<Texts>, typeof TEXT> &
    Record<Words<Lists>, typeof LIST> &
    Record<Words<Flags>, typeof FLAG>;
  return { ...all(texts, TEXT), ...all(lists, LIST), ...all(flags, FLAG) } as Options;
}

/** The value of an option, where it is one of its choices. */
export function oneOf<T extends string>(option: string, value: string | undefined, choices: readonly T[]): T {
  const chosen = choices.find((choice) => choice === value);
  if (chosen !== undefined) return chosen;
  throw new CommandError(`--${option} is one of ${choices.join(', ')}, not ${JSON.stringify(value)}.`);
}

/**
 * The number that an option is; undefined where it is not given.
 * @param words what it is to be
 */
export function numberIn(option: string, text: string | undefined, words: string, isIn: (value: number) => boolean) {
  if (text === undefined) return undefined;
  const value = Number(text);
  if (text.trim() !== '' && Number.isFinite(value) && isIn(value)) return value;
  throw new CommandError(`--${option} is ${words}, not "${text}".`);
}

export function wholeNumber(option: string, text: string | undefined) {
  return numberIn(option, text, 'a whole number from 1', (value) => Number.isInteger(value) && value > 0);
}

/** Does work that the first Ctrl-C or SIGTERM stops and a second one ends with the program. */
export async function untilInterrupt<T>(work: (signal: AbortSignal) => Promise<T>) {
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

/** Whether it is bad input, told by the engine, and not a defect of the engine. */
export function isScanstitchError(error: unknown): error is ScanstitchError {
  return error instanceof Error && error.name === 'ScanstitchError';
}

/** What is wrong with one input is reported, and the others go on. */
export function attempt<T>(name: string, complain: (problem: string) => void, work: () => T): T[] {
  try {
    return [work()];
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message.startsWith(name) ? error.message : `${name}: ${error.message}`);
    return [];
  }
}

/** Characters of a cell that are shown at most. */
const CELL_LENGTH = 120;

/**
 * Lays rows out in columns; numbers flush right.
 * @param left indices of the columns that are flush left
 */
export function table(heads: string[], rows: string[][], left: Set<number>) {
  const all = [heads, ...rows.map((row) => row.map((cell) => printable(cell, CELL_LENGTH)))];
  const widths = heads.map((_, column) => all.reduce((most, row) => Math.max(most, (row[column] ?? '').length), 0));
  const line = (row: string[]) =>
    row
      .map((cell, column) => (left.has(column) ? cell.padEnd(widths[column] ?? 0) : cell.padStart(widths[column] ?? 0)))
      .join('  ')
      .trimEnd();
  return `${all.map(line).join('\n')}\n`;
}
