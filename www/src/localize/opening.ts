/** What was dropped for a localisation: a map, a recording of planar scans, or both. */
import type { OpenedRecording, OpenProgress } from '../../../package/recording_reader.js';
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
  onProgress?: (progress: OpenProgress) => void;
}

export async function understandDrop(files: readonly NamedFile[], asked: Asked): Promise<Dropped> {
  const { isForMap, notes, signal, onProgress } = asked;
  const { others, ...found } = await findMap(files, isForMap);
  if (others.length === 0) return { ...found, recording: null, notes: [...notes, ...found.notes] };
  const { openRecording } = await import('../../../package/recording_reader.js');
  const recording = await openRecording(
    others.map(({ name: path, file: blob }) => ({ path, blob })),
    { notes, ...(signal && { signal }), ...(onProgress && { onProgress }) },
  );
  return { ...found, recording };
}

/** A map, unless depth images or clouds in space lie beside it: those are opened as they are without it. */
export function isForLocalization({ map, problem, recording }: Dropped): boolean {
  return (
    (map !== null || problem !== null) &&
    (recording === null || recording.kind === 'planar_scans' || recording.kind === 'nothing')
  );
}
