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

/** What SQLite keeps beside a bag that was not closed; `bag`: that bag. @param {string} path */
export function journalOf(path) {
  const [, bag, kind] = path.match(/^(.*\.db3)-(wal|shm)$/i) ?? [];
  return bag === undefined ? null : { bag, isLog: kind?.toLowerCase() === 'wal' };
}

/** Whether a file is a bag or belongs to one. @param {string} path */
export function isOfBag(path) {
  return isBagName(path) || isBagMetadata(path) || journalOf(path) !== null;
}
