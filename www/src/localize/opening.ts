/** What was dropped for a localisation: a map, a recording of planar scans, or both. */
import type { OpenedRecording } from '../../../package/recording_reader.js';
import type { NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import { findMap, type FoundMap } from './map-files.js';

export interface Dropped extends Omit<FoundMap, 'others'> {
  /** What the files are that are none of a map; null where there are none. */
  recording: OpenedRecording | null;
}

export interface Asked {
  /** Whether a picture alone is a map. */
  isForMap: boolean;
  notes: readonly Note[];
  signal?: AbortSignal;
}

export async function understandDrop(files: readonly NamedFile[], asked: Asked): Promise<Dropped> {
  return withRecording(await findMap(files, asked.isForMap), asked);
}

/** The same where there is a map; null without, or where it lies beside depth images or clouds: those are opened without it. */
export async function dropWithMap(files: readonly NamedFile[], asked: Asked): Promise<Dropped | null> {
  const found = await findMap(files, asked.isForMap);
  if (!found.map && !found.problem) return null;
  const dropped = await withRecording(found, asked);
  const { kind = 'nothing' } = dropped.recording ?? {};
  return kind === 'nothing' || kind === 'planar_scans' ? dropped : null;
}

async function withRecording({ others, ...found }: FoundMap, asked: Asked): Promise<Dropped> {
  const { notes, signal } = asked;
  if (others.length === 0) return { ...found, recording: null, notes: [...notes, ...found.notes] };
  const { openRecording } = await import('../../../package/recording_reader.js');
  const recording = await openRecording(
    others.map(({ name: path, file: blob }) => ({ path, blob })),
    { notes, ...(signal && { signal }) },
  );
  return { ...found, recording };
}
