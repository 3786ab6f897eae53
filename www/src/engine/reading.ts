/** What the threads of planar scans and of the localisation read. */
import type { Reconstruction } from './package.js';
import type { InputFile, Problem, ReadOutcome } from './protocol.js';
import { isInputError } from './serve.js';

/** The part of the engine that reads no logs has no `add_log`. */
type Reader = Pick<Reconstruction, 'add_scan'> & Partial<Pick<Reconstruction, 'add_log'>>;

/** Adds one scan, or all of a log. Returns how many. */
export function addScans(
  next: Reader,
  { name, bytes, table, isLog }: InputFile,
  { problems, notes }: Pick<ReadOutcome, 'problems' | 'notes'>,
): number {
  const content = new Uint8Array(bytes);
  if (!next.add_log || !(isLog || table !== undefined)) {
    next.add_scan(name, content);
    return 1;
  }
  const log = next.add_log(name, content, table);
  for (const problem of log.losses) problems.push({ file: name, place: null, problem, remedy: '' });
  for (const text of log.notes) notes.push({ file: name, text });
  return log.num_scans;
}

/** Runs `action`; an input error becomes a problem of `file`, other exceptions are passed on. */
export function attempt(problems: Problem[], file: string, action: () => void): boolean {
  try {
    action();
    return true;
  } catch (error) {
    if (!isInputError(error)) throw error;
    const { file: named, place, problem, remedy, message } = error as Partial<Problem> & Error;
    problems.push({ file: named || file, place: place ?? null, problem: problem || message, remedy: remedy ?? '' });
    return false;
  }
}
