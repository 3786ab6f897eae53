// @ts-check
/** Errors about files that never reach the engine, in the form of the engine's own. */

import { printable } from './printable.js';

/** @typedef {import('./index.js').ScanstitchError} ScanstitchError */

/**
 * @param {string} file
 * @param {string} problem what is wrong, a sentence without its full stop
 * @param {string} [remedy] what can be done, likewise
 * @returns {ScanstitchError}
 */
export function fileError(file, problem, remedy = '') {
  const error = new Error(`${printable(file)}: ${problem}.${remedy && ` ${remedy}.`}`);
  return Object.assign(error, { name: /** @type {const} */ ('ScanstitchError'), file, place: null, problem, remedy });
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
