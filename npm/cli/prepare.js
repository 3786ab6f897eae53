// @ts-check
/** Reading and preparing one frame: the same in a thread of its own and in the only one. */
import { fileError } from '../errors.js';
import { isScanstitchError } from './command.js';
import { fileProblem, readWholeLater } from './disk.js';

/**
 * A frame to prepare. Files are given as paths on the disk, or as their bytes.
 * @typedef {object} Order
 * @property {string} decodeConfig what `begin` returned
 * @property {'depth_images' | 'clouds'} kind
 * @property {string} name
 * @property {number} index
 * @property {number | null} time
 * @property {string | Uint8Array} file depth image or cloud
 * @property {string | Uint8Array | null} color
 * @property {string | undefined} color_name
 * @property {string | undefined} color_problem why it could not be read, where it could not
 */

/**
 * What is in the files, and how long reading took.
 * @typedef {object} Contents
 * @property {Uint8Array} bytes
 * @property {Uint8Array | null} color
 * @property {string | undefined} color_problem
 * @property {number} milliseconds
 */

/** @param {Order} order @returns {Promise<Contents>} rejects with a ScanstitchError where the file cannot be read */
export async function readContents({ name, file, color, color_name = '', color_problem }) {
  const start = performance.now();
  const bytes = typeof file === 'string' ? await read(file, name) : file;
  const colors =
    typeof color === 'string' ? await readColors(() => read(color, color_name), color_name) : { color, color_problem };
  return { bytes, ...colors, milliseconds: performance.now() - start };
}

/**
 * A colour image, or why it cannot be read: the frame is used without it.
 * @param {() => Promise<Uint8Array>} read
 * @param {string} name
 * @returns {Promise<{ color: Uint8Array | null, color_problem: string | undefined }>}
 */
export async function readColors(read, name) {
  try {
    return { color: await read(), color_problem: undefined };
  } catch (error) {
    const color_problem = isScanstitchError(error) ? error.message : `${name}: ${fileProblem(error)}`;
    return { color: null, color_problem };
  }
}

/**
 * Throws a ScanstitchError where the frame is at fault.
 * @param {typeof import('../index.js')} engine
 * @param {Order} order
 * @param {Contents} contents
 * @returns {import('../spatial_run.js').Prepared}
 */
export function prepare(engine, { decodeConfig, kind, name, index, time, color_name }, contents) {
  const start = performance.now();
  const { bytes, color, color_problem, milliseconds } = contents;
  const prepared =
    kind === 'clouds'
      ? engine.prepare_cloud(decodeConfig, name, index, time, bytes)
      : engine.prepare_frame(decodeConfig, name, index, time, bytes, color, color_name, color_problem);
  return { bytes: prepared, milliseconds: { read: milliseconds, prepare: performance.now() - start } };
}

/** @param {string} path @param {string} name */
async function read(path, name) {
  try {
    return await readWholeLater(path);
  } catch (error) {
    throw fileError(name, fileProblem(error).replace(/\.$/, ''), 'See whether it was moved or deleted');
  }
}
