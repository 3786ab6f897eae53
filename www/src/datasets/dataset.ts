/** A set of inputs: where it comes from, what is in it, what was not used. Plain values; every change is a new one. */
import type { InputFile, Inputs } from '../engine/protocol.js';
import type { Note } from './note.js';
import { compareNaturally } from '../../../package/base/natural_order.js';

/** Where a data set comes from. A sample, or what the host page names, is never extended by the user's files. */
export type Origin = 'sample' | 'host' | 'user';

export interface Dataset extends Inputs {
  /** How the page calls it. */
  title: string;
  origin: Origin;
  /** Whether it is a log, or several: a recording that is whole. */
  is_log: boolean;
}

/** What a drop holds once its files are read and told apart. */
export interface Intake {
  scans: InputFile[];
  /** Whether there is a log of many scans among them. */
  has_log: boolean;
  reference: InputFile | null;
  odometry: InputFile | null;
  notes: Note[];
}

/**
 * What the page shows after `intake` arrived on top of `present`: scans take its place, or, if they are to join, extend the
 * user's own (a file of the same path takes the place of the old one), unless either is a log, which is whole; a reference
 * or odometry alone joins whatever is there.
 */
export function combine(present: Dataset | null, intake: Intake, joins: boolean): Dataset {
  const is_whole = !joins || intake.has_log || present?.is_log || present?.origin !== 'user';
  const extends_present = present !== null && (!is_whole || intake.scans.length === 0);
  const old_scans = extends_present ? present.scans : [];
  const fresh = new Set(intake.scans.map(({ name }) => name));
  const scans = [...old_scans.filter(({ name }) => !fresh.has(name)), ...intake.scans];
  scans.sort((a, b) => compareNaturally(a.name, b.name));
  return {
    title: extends_present ? present.title : titleOf(intake.scans),
    origin: extends_present ? present.origin : 'user',
    is_log: extends_present ? present.is_log : intake.has_log,
    scans,
    reference: intake.reference ?? (extends_present ? present.reference : null),
    odometry: intake.odometry ?? (extends_present ? present.odometry : null),
  };
}

/** The file where it is one, else the folder that all scans share, else "Your scans". */
function titleOf(scans: readonly InputFile[]): string {
  const [only] = scans;
  if (only && scans.length === 1) return only.name.split('/').at(-1) ?? only.name;
  const folders = scans.map(({ name }) => name.split('/').slice(0, -1));
  const first = folders[0] ?? [];
  let depth = 0;
  while (depth < first.length && folders.every((folder) => folder[depth] === first[depth])) depth++;
  return first[depth - 1] ?? 'Your scans';
}
