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
 * @param problem what is wrong, a sentence without its full stop
 * @param remedy what can be done, likewise
 */
export function fileError(file: string, problem: string, remedy = ''): ScanstitchError {
  const error = new Error(`${printable(file)}: ${problem}.${remedy && ` ${remedy}.`}`);
  return Object.assign(error, { name: 'ScanstitchError' as const, file, place: null, problem, remedy });
}

/** More comes out of packed bytes than is accepted of them. */
export class TooLarge extends RangeError {}

/** A note about something that could have been used and is left out, which the exit code of a command tells as well. */
export function lost(file: string, reason: string): Note {
  return { file, reason, is_loss: true };
}
