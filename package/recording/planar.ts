/** Planar scans: what each file is used as. One reference and one odometry are used at a time: the first. */

import type { Note } from '../base/errors.js';
import { HEAD_BYTES } from '../files/heads.js';
import { isImageName } from '../files/kinds.js';
import type { ListedFile } from '../files/recording.js';
import type { Read } from './cameras.js';
import { classify, type Role } from './classify.js';

/** So many files are open at a time: a system has a limit, and reading one after the other takes longer. */
const READ_TOGETHER = 16;

interface PlanarFiles<T> {
  scans: T[];
  /** Those of the scans that hold many each. */
  logs: T[];
  /** Those of the logs whose columns somebody may want to name. */
  tables: T[];
  reference: T | null;
  odometry: T | null;
  /** What was not used, and why. */
  notes: Note[];
}

/** @param files in natural order of their names */
export function assignRoles<T>(files: readonly { name: string; role: Role; file: T }[]): PlanarFiles<T> {
  const used: PlanarFiles<T> = { scans: [], logs: [], tables: [], reference: null, odometry: null, notes: [] };
  const names: { reference: string | null; odometry: string | null } = { reference: null, odometry: null };
  for (const { name, role, file } of files) {
    if (role.role === 'scan') {
      used.scans.push(file);
      if (role.isLog) used.logs.push(file);
      if (role.isTable) used.tables.push(file);
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

/** The part of each file among planar scans; of those that cannot be read, which are noted, where the name says it. */
export async function classifyAll(files: ListedFile[], read: Read, isTable = false) {
  const known: { name: string; role: Role; file: string }[] = [];
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
