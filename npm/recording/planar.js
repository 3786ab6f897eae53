// @ts-check
/** Planar scans: what each file is used as. One reference and one odometry are used at a time: the first. */

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
