/** From a recording that was opened to the planar scans that are loaded: its files are read, and join what is open or replace it. */
import { compareNaturally } from '../../../package/base/natural_order.js';
import type { Mended } from '../../../package/files/recording.js';
import type { OpenedRecording } from '../../../package/recording_reader.js';
import { messageOf } from '../engine/message-of.js';
import type { InputFile } from '../engine/protocol.js';
import type { Dataset } from './dataset.js';
import type { Note } from './note.js';

/** Planar scans and what lies beside them, read. */
export interface Intake {
  scans: InputFile[];
  reference: InputFile | null;
  odometry: InputFile | null;
  /** Of a workbench. */
  mended?: Mended | undefined;
  notes: Note[];
}

/** A file that cannot be read becomes a note; the rest goes on. */
export async function takeIn(recording: OpenedRecording): Promise<Intake> {
  const { files, beside, scans, logs, tables, mended } = recording;
  const notes: Note[] = [];
  const read = async (path: string | null | undefined): Promise<InputFile[]> => {
    const file = files.get(path ?? '');
    if (!file) return [];
    const { path: name } = file;
    try {
      const bytes = await file.read();
      notes.push(...(file.losses ?? []));
      const isLog = logs.includes(name);
      const table = isLog && mended?.table;
      return [
        {
          ...{ name, bytes: ownBuffer(bytes) },
          ...(isLog && { isLog, isTable: tables.includes(name) }),
          ...(table && { table }),
        },
      ];
    } catch (error) {
      notes.push({ file: name, reason: `not used: ${(error as { problem?: string }).problem ?? messageOf(error)}` });
      return [];
    }
  };
  /** Poses, of tables in other conventions as the engine reads them. */
  const readPoses = async (path: string | null | undefined): Promise<InputFile[]> => {
    const [file] = await read(path);
    if (!file) return [];
    const { trajectoryBytes } = await import('../../../package/recording/pose_file.js');
    return [{ ...file, bytes: ownBuffer(trajectoryBytes(file.name, new Uint8Array(file.bytes))) }];
  };
  const found = beside ?? { reference: recording.reference[0], odometry: recording.odometry, notes: recording.notes };
  const [readScans, [reference = null], [odometry = null]] = await Promise.all([
    Promise.all(scans.map(read)),
    readPoses(found.reference),
    readPoses(found.odometry),
  ]);
  return { scans: readScans.flat(), reference, odometry, mended, notes: [...found.notes, ...notes] };
}

function ownBuffer(bytes: Uint8Array): ArrayBuffer {
  const isWhole = bytes.byteLength === bytes.buffer.byteLength && bytes.buffer instanceof ArrayBuffer;
  return isWhole ? (bytes.buffer as ArrayBuffer) : bytes.slice().buffer;
}

/**
 * What the page shows after `intake` arrived on top of `present`: scans take its place, or, if they are to join, extend the
 * user's own (a file of the same path takes the place of the old one); a reference or odometry alone joins whatever is there.
 */
export function combine(present: Dataset | null, intake: Intake, joins: boolean): Dataset {
  const isJoined = joins && present?.origin === 'user';
  const extendsPresent = present !== null && (isJoined || intake.scans.length === 0);
  const oldScans = extendsPresent ? present.scans : [];
  const fresh = new Set(intake.scans.map(({ name }) => name));
  const scans = [...oldScans.filter(({ name }) => !fresh.has(name)), ...intake.scans];
  scans.sort((a, b) => compareNaturally(a.name, b.name));
  return {
    title: present && intake.scans.length === 0 ? present.title : titleOf(scans),
    origin: extendsPresent ? present.origin : 'user',
    scans,
    reference: intake.reference ?? (extendsPresent ? present.reference : null),
    odometry: intake.odometry ?? (extendsPresent ? present.odometry : null),
    mended: intake.mended,
  };
}

/** The file where it is one, or the logs; else the folder that all scans share, else "Your scans". */
export function titleOf(scans: readonly InputFile[]): string {
  const [only, second, ...others] = scans.map(({ name }) => name.split('/').at(-1) ?? name);
  if (only !== undefined && second === undefined) return only;
  if (scans.length > 0 && scans.every(({ isLog }) => isLog))
    return `${only} and ${others.length > 0 ? `${others.length + 1} others` : second}`;
  const folders = scans.map(({ name }) => name.split('/').slice(0, -1));
  const first = folders[0] ?? [];
  let depth = 0;
  while (depth < first.length && folders.every((folder) => folder[depth] === first[depth])) depth++;
  return first[depth - 1] ?? 'Your scans';
}
