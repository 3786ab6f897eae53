// @ts-check
/** Files named on the command line, read from the disk. */
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { basename, join } from 'node:path';
import { compareNaturally } from '../natural_order.js';

/** @typedef {{ name: string, path: string }} Input name: short, for messages and results */

/**
 * The scans that these arguments name: files as they are, folders by the PLY files right inside them, all in natural
 * order (`2.ply` before `10.ply`). What cannot be found is told and left out.
 * @param {string[]} paths
 * @param {(problem: string) => void} complain
 * @returns {Input[]}
 */
export function listScans(paths, complain) {
  const files = [...new Set(paths.flatMap((path) => expand(path, complain)))].sort(compareNaturally);
  const names = files.map((path) => basename(path));
  const distinct = new Set(names).size === names.length;
  return files.map((path) => ({ name: distinct ? basename(path) : path, path }));
}

/**
 * @param {string} path
 * @param {(problem: string) => void} complain
 * @returns {string[]}
 */
function expand(path, complain) {
  try {
    if (!statSync(path).isDirectory()) return [path];
    const scans = readdirSync(path).filter((name) => /\.ply$/i.test(name));
    if (scans.length === 0) complain(`${path}: There is no PLY file in this folder.`);
    return scans.map((name) => join(path, name));
  } catch (error) {
    complain(`${path}: ${fileProblem(error)}`);
    return [];
  }
}

/**
 * The file's bytes; null where it cannot be read, which is told.
 * @param {Input} input
 * @param {(problem: string) => void} complain
 */
export function readInput({ name, path }, complain) {
  try {
    return readFileSync(path);
  } catch (error) {
    complain(`${name}: ${fileProblem(error)}`);
    return null;
  }
}

/** @param {unknown} error */
export function fileProblem(error) {
  const { code, message } = /** @type {NodeJS.ErrnoException} */ (error);
  switch (code) {
    case 'ENOENT':
      return 'There is no such file or folder.';
    case 'EACCES':
    case 'EPERM':
      return 'The file may not be read or written: permission denied.';
    case 'EISDIR':
      return 'This is a folder, not a file.';
    case 'ENOTDIR':
    case 'EEXIST':
      return 'There is a file where a folder should be.';
    default:
      return message;
  }
}
