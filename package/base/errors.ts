/** Errors about files that never reach the engine, in the form of the engine's own. */

import type { ScanstitchError } from '../../pkg/scanstitch.js';
import { printable } from './printable.js';

/** What is worth knowing of a file; `reason` completes "FILE: ...". `is_loss`: it could have been used. */
export interface Note {
  file: string;
  reason: string;
  is_loss?: true;
}

/**
 * @param problem what is wrong, a sentence without its full stop, or a question
 * @param remedy what can be done, likewise
 */
export function fileError(file: string, problem: string, remedy = ''): ScanstitchError {
  const stop = problem.endsWith('?') ? '' : '.';
  const error = new Error(`${printable(file)}: ${problem}${stop}${remedy && ` ${remedy}.`}`);
  return Object.assign(error, { name: 'ScanstitchError' as const, file, place: null, problem, remedy });
}

/** A note about a file that cannot be used; throws the error where it is not about the file. */
export function notUsed(file: string, error: unknown) {
  const { name, problem, remedy, message } = error as ScanstitchError;
  // Errors of the system have a code: a file that was there when it was listed may have been moved or deleted.
  if (name !== 'ScanstitchError' && (error as NodeJS.ErrnoException).code === undefined) throw error;
  const reason = [problem || message, remedy].filter(Boolean).join('. ');
  return lost(file, `not used: ${reason.charAt(0).toLowerCase()}${reason.slice(1)}`);
}

/** More comes out of packed bytes than is accepted of them. */
export class TooLarge extends RangeError {}

/** A note about something that could have been used and is left out, which the exit code of a command tells as well. */
export function lost(file: string, reason: string): Note {
  return { file, reason, is_loss: true };
}
