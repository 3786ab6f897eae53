// @ts-check
/** Errors about files that never reach the engine, in the form of the engine's own. */

import { printable } from './printable.js';

/** @typedef {import('./index.js').ScanstitchError} ScanstitchError */

/**
 * @param {string} file
 * @param {string} problem what is wrong, a sentence without its full stop, or a question
 * @param {string} [remedy] what can be done, likewise
 * @returns {ScanstitchError}
 */
export function fileError(file, problem, remedy = '') {
  const stop = problem.endsWith('?') ? '' : '.';
  const error = new Error(`${printable(file)}: ${problem}${stop}${remedy && ` ${remedy}.`}`);
  return Object.assign(error, { name: /** @type {const} */ ('ScanstitchError'), file, place: null, problem, remedy });
}

/**
 * A note about a file that cannot be used; throws the error where it is not about the file.
 * @param {string} file
 * @param {unknown} error
 */
export function notUsed(file, error) {
  const { name, problem, remedy, message } = /** @type {ScanstitchError} */ (error);
  // Errors of the system have a code: a file that was there when it was listed may have been moved or deleted.
  if (name !== 'ScanstitchError' && /** @type {NodeJS.ErrnoException} */ (error).code === undefined) throw error;
  const reason = [problem || message, remedy].filter(Boolean).join('. ');
  return lost(file, `not used: ${reason.charAt(0).toLowerCase()}${reason.slice(1)}`);
}

/** More comes out of packed bytes than is accepted of them. */
export class TooLarge extends RangeError {}

/**
 * A note about something that could have been used and is left out, which the exit code of a command tells as well.
 * @param {string} file
 * @param {string} reason
 * @returns {import('./recording.js').Note}
 */
export function lost(file, reason) {
  return { file, reason, is_loss: true };
}
