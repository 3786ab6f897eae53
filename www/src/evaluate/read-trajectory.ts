import { Trajectory } from '../engine/package.js';
import type { TrajectoryFile } from './protocol.js';

/** The trajectory of one file, or of a folder with a file for each frame. Call `free()` when done. */
export function readTrajectory({ name, parts }: Pick<TrajectoryFile, 'name' | 'parts'>): Trajectory {
  const [only] = parts;
  if (parts.length === 1 && only) return Trajectory.read(only.bytes, name);
  return Trajectory.read_frames(
    parts.map((part) => part.name),
    parts.map(({ bytes }) => bytes),
  );
}
