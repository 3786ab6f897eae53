/** The frames of a recording as the engine is given them. */
import type { Recording } from '../../../package/files/recording.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { StoredFile } from './spatial-files.js';

/** `files` holds all that the recording names. */
export function jobsOf(recording: Recording, files: readonly StoredFile[]): SpatialJob[] {
  const by_path = new Map(files.map((file) => [file.path, file]));
  const file = (path: string): StoredFile => by_path.get(path) as StoredFile;
  if (recording.kind === 'clouds') {
    return recording.clouds.map((path, index) => ({
      index,
      name: path,
      time: recording.cloud_times?.[index] ?? null,
      file: file(path),
      color: null,
      is_cloud: true,
    }));
  }
  return recording.depth_frames.map(({ name, depth, color, time }, index) => ({
    index,
    name,
    time,
    file: file(depth),
    color: color === null ? null : file(color),
    is_cloud: false,
  }));
}
