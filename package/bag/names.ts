/** Which files are bags by their names: all that has to be known of bags where there is none. */
import { baseOf } from '../files/names.js';

const BAG_NAMES = /\.(db3|mcap|bag)(\.(zstd|zst|gz|bz2))?$/i;

/** Whether a file is a bag, or a part of one. */
export function isBagName(path: string) {
  return BAG_NAMES.test(path);
}

export function isBagMetadata(path: string) {
  return baseOf(path).toLowerCase() === 'metadata.yaml';
}

/** What SQLite keeps beside a bag that was not closed; `bag`: that bag. */
export function journalOf(path: string) {
  const [, bag, kind] = path.match(/^(.*\.db3)-(wal|shm)$/i) ?? [];
  return bag === undefined ? null : { bag, isLog: kind?.toLowerCase() === 'wal' };
}

/** Whether a file is a bag or belongs to one. */
export function isOfBag(path: string) {
  return isBagName(path) || isBagMetadata(path) || journalOf(path) !== null;
}
