import type { Trajectory } from '../engine/package.js';
import type { TrajectoryFile } from './protocol.js';

/** The trajectory of one file, or of a folder with a file for each frame, read by the worker's engine. Call `free()` when done. */
export function readTrajectory(
  engine: Pick<typeof Trajectory, 'read' | 'read_frames'>,
  { name, parts }: Pick<TrajectoryFile, 'name' | 'parts'>,
): Trajectory {
  const [only] = parts;
  if (parts.length === 1 && only) return engine.read(only.bytes, name);
  return engine.read_frames(
    parts.map((part) => part.name),
    parts.map(({ bytes }) => bytes),
  );
}
