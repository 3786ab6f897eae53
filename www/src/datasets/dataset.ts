/** A set of inputs: where it comes from, what is in it, what was not used. Plain values; every change is a new one. */
import type { OpenedRecording } from '../../../npm/recording_reader.js';
import type { InputFile, Inputs } from '../engine/protocol.js';
import type { Note } from './note.js';
import { compareNaturally } from '../../../npm/natural_order.js';

/** Where a data set comes from. A sample, or what the host page names, is never extended by the user's files. */
export type Origin = 'sample' | 'host' | 'user';

/** What was opened, and how the page calls it; empty: after its folder. */
export interface Opened {
  title: string;
  origin: Origin;
  recording: OpenedRecording;
}

export interface Dataset extends Inputs {
  /** How the page calls it. */
  title: string;
  origin: Origin;
}

/** Whether there is a log of many scans among them: a recording that is whole. */
export const hasLog = (scans: readonly InputFile[]): boolean => scans.some(({ is_log }) => is_log);

/** Planar scans and what lies beside them, read. */
export interface Intake {
  scans: InputFile[];
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
  const is_whole = !joins || hasLog(intake.scans) || hasLog(present?.scans ?? []) || present?.origin !== 'user';
  const extends_present = present !== null && (!is_whole || intake.scans.length === 0);
  const old_scans = extends_present ? present.scans : [];
  const fresh = new Set(intake.scans.map(({ name }) => name));
  const scans = [...old_scans.filter(({ name }) => !fresh.has(name)), ...intake.scans];
  scans.sort((a, b) => compareNaturally(a.name, b.name));
  return {
    title: extends_present ? present.title : titleOf(intake.scans),
    origin: extends_present ? present.origin : 'user',
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
