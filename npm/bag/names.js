// @ts-check
/** Which files are bags by their names: all that has to be known of bags where there is none. */
import { baseOf } from '../recording/names.js';

const BAG_NAMES = /\.(db3|mcap|bag)(\.(zstd|zst|gz|bz2))?$/i;

/** Whether a file is a bag, or a part of one. @param {string} path */
export function isBagName(path) {
  return BAG_NAMES.test(path);
}

/** @param {string} path */
export function isBagMetadata(path) {
  return baseOf(path).toLowerCase() === 'metadata.yaml';
}
