/** Planar scans: what each file is used as. One reference and one odometry are used at a time: the first. */
import type { Note } from '../base/errors.js';
import type { Role } from './classify.js';

interface PlanarFiles<T> {
  scans: T[];
  /** Whether a log of many scans is among them. */
  hasLog: boolean;
  reference: T | null;
  odometry: T | null;
  /** What was not used, and why. */
  notes: Note[];
}

/** @param files in natural order of their names */
export function assignRoles<T>(files: readonly { name: string; role: Role; file: T }[]): PlanarFiles<T> {
  const used: PlanarFiles<T> = { scans: [], hasLog: false, reference: null, odometry: null, notes: [] };
  const names: { reference: string | null; odometry: string | null } = { reference: null, odometry: null };
  for (const { name, role, file } of files) {
    if (role.role === 'scan') {
      used.scans.push(file);
      used.hasLog ||= role.isLog;
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
