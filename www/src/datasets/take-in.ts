/** Reads the planar scans of a recording that was opened, and what lies beside them. Loaded with the first of them. */
import type { OpenedRecording } from '../../../npm/recording_reader.js';
import { messageOf } from '../engine/message-of.js';
import type { InputFile } from '../engine/protocol.js';
import type { Intake } from './dataset.js';
import type { Note } from './note.js';

/** A file that cannot be read becomes a note; the rest goes on. */
export async function takeIn(recording: OpenedRecording): Promise<Intake> {
  const { files, beside, scans, logs, tables } = recording;
  const notes: Note[] = [];
  const read = async (path: string | null | undefined): Promise<InputFile[]> => {
    const file = files.get(path ?? '');
    if (!file) return [];
    const { path: name } = file;
    try {
      const bytes = await file.read();
      notes.push(...(file.losses ?? []));
      const is_log = logs.includes(name);
      return [{ name, bytes: ownBuffer(bytes), ...(is_log && { is_log, is_table: tables.includes(name) }) }];
    } catch (error) {
      notes.push({ file: name, reason: `not used: ${(error as { problem?: string }).problem ?? messageOf(error)}` });
      return [];
    }
  };
  const found = beside ?? { reference: recording.reference[0], odometry: recording.odometry, notes: recording.notes };
  const [read_scans, [reference = null], [odometry = null]] = await Promise.all([
    Promise.all(scans.map(read)),
    read(found.reference),
    read(found.odometry),
  ]);
  return { scans: read_scans.flat(), reference, odometry, notes: [...found.notes, ...notes] };
}

function ownBuffer(bytes: Uint8Array): ArrayBuffer {
  const is_whole = bytes.byteLength === bytes.buffer.byteLength && bytes.buffer instanceof ArrayBuffer;
  return is_whole ? (bytes.buffer as ArrayBuffer) : bytes.slice().buffer;
}
