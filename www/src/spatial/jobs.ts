/** The frames of a recording as the engine is given them. */
import type { Content, OpenedRecording } from '../../../package/recording_reader.js';
import type { SpatialJob } from '../engine/preparer.js';

export function jobsOf(recording: OpenedRecording): SpatialJob[] {
  const file = (path: string): Content => recording.files.get(path) as Content;
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
