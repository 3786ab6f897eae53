/** A set of inputs: where it comes from, what is in it, what was not used. Plain values; every change is a new one. */
import type { InputFile, Inputs } from '../engine/protocol.js';
import type { NamedFile } from './gather.js';
import type { Note } from './note.js';
import { compareNaturally } from '../../../npm/natural_order.js';
import { classify, type Role } from '../../../npm/recording/classify.js';
import { HEAD_BYTES } from '../../../npm/recording/heads.js';
import { assignRoles } from '../../../npm/recording/planar.js';

/** Where a data set comes from. That of the page, or of the one that the element stands on, is never extended by the user's files. */
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

/** Reads and classifies the files. A file the browser cannot read becomes a note; the rest goes on. */
export async function takeIn(files: readonly NamedFile[]): Promise<Intake> {
  const ordered = [...files].sort((a, b) => compareNaturally(a.name, b.name));
  const notes: Note[] = [];
  const known: { name: string; role: Role; file: InputFile }[] = [];
  const contents = await Promise.allSettled(ordered.map(readKnown));
  for (const [index, content] of contents.entries()) {
    const { name } = ordered[index] as NamedFile;
    if (content.status === 'rejected') {
      notes.push({ file: name, reason: 'the browser could not read this file; was it moved or deleted?' });
    } else {
      const { role, bytes } = content.value;
      known.push({ name, role, file: { name, bytes } });
    }
  }
  const { scans, hasLog, reference, odometry, notes: unused } = assignRoles(known);
  return { scans, has_log: hasLog, reference, odometry, notes: [...notes, ...unused] };
}

async function readKnown({ name, file }: NamedFile) {
  const role = classify(name, new Uint8Array(await file.slice(0, HEAD_BYTES).arrayBuffer()));
  // A film or an archive dropped by mistake is not read to its end.
  const bytes = role.role === 'ignored' ? new ArrayBuffer(0) : await file.arrayBuffer();
  return { role, bytes };
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
