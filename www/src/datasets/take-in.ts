/** Reads and classifies files that were dropped, picked or fetched. This module is loaded with the first of them. */
import { compareNaturally } from '../../../package/base/natural_order.js';
import { classify, type Role } from '../../../package/recording/classify.js';
import { HEAD_BYTES } from '../../../package/files/heads.js';
import { isTable } from '../../../package/files/laser_logs.js';
import { assignRoles } from '../../../package/recording/planar.js';
import type { InputFile } from '../engine/protocol.js';
import type { Intake } from './dataset.js';
import type { NamedFile } from './gather.js';
import type { Note } from './note.js';

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

/** Whether it is a table of ranges. */
export function isRanges({ bytes }: InputFile): boolean {
  return isTable(new Uint8Array(bytes, 0, Math.min(bytes.byteLength, HEAD_BYTES)));
}
