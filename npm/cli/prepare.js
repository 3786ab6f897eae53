// @ts-check
/** Reading and preparing one frame: the same in a thread of its own and in the only one. */
import { readFile } from 'node:fs/promises';
import { basename } from 'node:path';
import { fileError } from '../errors.js';
import { fileProblem } from './inputs.js';

/**
 * A frame to prepare. Files are given as paths on the disk, or as their bytes.
 * @typedef {object} Order
 * @property {string} preparation what `begin` returned
 * @property {'depth_images' | 'clouds'} kind
 * @property {string} name
 * @property {number} index
 * @property {number | null} time
 * @property {string | Uint8Array} file depth image or cloud
 * @property {string | Uint8Array | null} color
 * @property {string | undefined} color_name
 */

/** @typedef {{ bytes: Uint8Array, colors: Uint8Array | null, milliseconds: number }} Contents and how long reading took */

/** @param {Order} order @returns {Promise<Contents>} rejects with a ScanstitchError where the file cannot be read */
export async function readContents({ name, file, color }) {
  const start = performance.now();
  const bytes = typeof file === 'string' ? await read(file, name) : file;
  const colors = typeof color === 'string' ? await read(color, basename(color)).catch(() => null) : color;
  return { bytes, colors, milliseconds: performance.now() - start };
}

/**
 * Throws a ScanstitchError where the frame is at fault.
 * @param {typeof import('../index.js')} engine
 * @param {Order} order
 * @param {Contents} contents
 * @returns {import('../spatial_run.js').Prepared}
 */
export function prepare(engine, { preparation, kind, name, index, time, color_name }, { bytes, colors, milliseconds }) {
  const start = performance.now();
  const prepared =
    kind === 'clouds'
      ? engine.prepare_cloud(preparation, name, index, time, bytes)
      : engine.prepare_frame(preparation, name, index, time, bytes, colors, color_name);
  return { bytes: prepared, milliseconds: { read: milliseconds, prepare: performance.now() - start } };
}

/** @param {string} path @param {string} name */
async function read(path, name) {
  try {
    return await readFile(path);
  } catch (error) {
    throw fileError(name, fileProblem(error).replace(/\.$/, ''), 'Was it moved or deleted?');
  }
}
