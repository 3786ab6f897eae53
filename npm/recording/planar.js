// @ts-check
/** Planar scans: what each file is used as. One reference and one odometry are used at a time: the first. */

import { classify } from './classify.js';
import { HEAD_BYTES } from './heads.js';
import { isImageName } from './kinds.js';

/** So many files are open at a time: a system has a limit, and reading one after the other takes longer. */
const READ_TOGETHER = 16;

/** @typedef {import('../recording.js').ListedFile} ListedFile */
/** @typedef {import('../recording.js').Read} Read */
/** @typedef {import('../recording.js').Note} Note */
/** @typedef {import('./classify.js').Role} Role */

/**
 * @template T
 * @typedef {object} PlanarFiles
 * @property {T[]} scans
 * @property {T[]} logs those of the scans that hold many each
 * @property {T[]} tables those of the logs whose columns somebody may want to name
 * @property {T | null} reference
 * @property {T | null} odometry
 * @property {Note[]} notes what was not used, and why
 */

/**
 * @template T
 * @param {readonly { name: string, role: Role, file: T }[]} files in natural order of their names
 * @returns {PlanarFiles<T>}
 */
export function assignRoles(files) {
  /** @type {PlanarFiles<T>} */
  const used = { scans: [], logs: [], tables: [], reference: null, odometry: null, notes: [] };
  /** @type {{ reference: string | null, odometry: string | null }} */
  const names = { reference: null, odometry: null };
  for (const { name, role, file } of files) {
    if (role.role === 'scan') {
      used.scans.push(file);
      if (role.is_log) used.logs.push(file);
      if (role.is_table) used.tables.push(file);
    } else if (role.role === 'ignored') {
      if (role.reason !== null) used.notes.push({ file: name, reason: `not used: ${role.reason}` });
    } else if (names[role.role] === null) {
      used[role.role] = file;
      names[role.role] = name;
    } else {
      const what = role.role === 'reference' ? 'reference trajectory' : 'odometry';
      const reason = `not used: one ${what} is used at a time, here ${names[role.role]}`;
      used.notes.push({ file: name, reason });
    }
  }
  return used;
}

/**
 * The part of each file among planar scans; of those that cannot be read, which are noted, where the name says it.
 * @param {ListedFile[]} files
 * @param {Read} read
 * @param {boolean} [isTable]
 */
export async function classifyAll(files, read, isTable = false) {
  /** @type {{ name: string, role: Role, file: string }[]} */
  const known = [];
  for (let at = 0; at < files.length; at += READ_TOGETHER) {
    const some = files.slice(at, at + READ_TOGETHER);
    const heads = await Promise.all(some.map(({ path }) => read(path, HEAD_BYTES)));
    for (const [place, { path }] of some.entries()) {
      const head = heads[place] ?? null;
      const nameSaysAll = /\.ply$/i.test(path) || isImageName(path);
      if (nameSaysAll || head) known.push({ name: path, role: classify(path, head, isTable), file: path });
    }
  }
  return known;
}
