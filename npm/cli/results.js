// @ts-check
/** What both kinds of reconstruction share: offering files to the engine, writing what came of them. */
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { CommandError, isScanstitchError } from './command.js';
import { fileProblem } from './inputs.js';

/**
 * What a reconstruction is given.
 * @typedef {object} Task
 * @property {import('./command.js').Engine} engine
 * @property {import('./inputs.js').Inputs} inputs
 * @property {import('../recording.js').Recording} recording
 * @property {Options} options
 * @property {(problem: string) => void} complain tells what is left out, which makes the exit code 2
 */

/**
 * @typedef {object} Options
 * @property {string} out
 * @property {string | undefined} reference
 * @property {string | undefined} odometry of planar scans
 * @property {string | undefined} intrinsics
 * @property {string | undefined} preset
 * @property {string[]} set
 * @property {number} workers
 */

/**
 * What the engine makes of settings it may refuse.
 * @template T
 * @param {() => T} make
 */
export function create(make) {
  try {
    return make();
  } catch (error) {
    if (isScanstitchError(error)) throw new CommandError(error.message);
    throw error;
  }
}

/**
 * Whether the engine took it; what it says otherwise is told.
 * @param {() => void} offer
 * @param {(problem: string) => void} complain
 */
export function accepted(offer, complain) {
  try {
    offer();
    return true;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return false;
  }
}

/**
 * @param {string} folder
 * @param {Record<string, string | Uint8Array>} files
 */
export function writeResults(folder, files) {
  try {
    mkdirSync(folder, { recursive: true });
    for (const [name, contents] of Object.entries(files)) writeFileSync(join(folder, name), contents);
  } catch (error) {
    throw new CommandError(`${folder}: The results could not be written. ${fileProblem(error)}`);
  }
}

/** One file, where it is asked for. @param {string} path @param {string | Uint8Array} contents */
export function writeFile(path, contents) {
  try {
    writeFileSync(path, contents);
  } catch (error) {
    throw new CommandError(`${path}: The file could not be written. ${fileProblem(error)}`);
  }
}

/** @param {string} text */
export function note(text) {
  process.stderr.write(`note: ${text}\n`);
}

/** @param {number} metres */
export function millimetres(metres) {
  return (1000 * metres).toFixed(1);
}
