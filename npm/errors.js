// @ts-check
/** Errors about files that never reach the engine, in the form of the engine's own. */

/** @typedef {import('./index.js').ScanstitchError} ScanstitchError */

/**
 * @param {string} file
 * @param {string} problem what is wrong, a sentence without its full stop
 * @param {string} [remedy] what can be done, likewise
 * @returns {ScanstitchError}
 */
export function fileError(file, problem, remedy = '') {
  const error = new Error(`${file}: ${problem}.${remedy && ` ${remedy}.`}`);
  return Object.assign(error, { name: /** @type {const} */ ('ScanstitchError'), file, place: null, problem, remedy });
}
