/** Trajectories named on the command line: a file, or a folder with one file for each frame. */
import { readdirSync } from 'node:fs';
import { basename, join } from 'node:path';
import type { Trajectory, TrajectoryFormat } from '../../pkg/scanstitch.js';
import { compareNaturally } from '../base/natural_order.js';
import { trajectoryBytes } from '../recording/pose_file.js';
import { CommandError, type Engine, isScanstitchError } from './command.js';
import { fileProblem, isFolder } from './disk.js';
import { type Input, readInput } from './inputs.js';

export const TRAJECTORY_FORMATS: TrajectoryFormat[] = [
  'tum',
  'kitti',
  'euroc',
  'pose_table',
  'matrices',
  'npy',
  'positions',
  'planar',
];

export const TRAJECTORY_HELP = `Trajectories are files of these forms, or a folder of text files with the 4 x 4 matrix of one frame each:
  tum         t x y z qx qy qz qw             kitti      12 numbers of a 3 x 4 matrix; times by --times
  euroc       t [ns], x, y, z, qw, qx, qy, qz pose_table columns named in the first line, or x y z qw qx qy qz
  matrices    4 x 4, with or without counts   npy        (N, 7) x y z qw qx qy qz; (N, 8); (N, 3, 4); (N, 4, 4)
  positions   x y z, or x y                   planar     number x y theta
  JSON, YAML and XML with a 4 x 4 matrix for each frame (nerfstudio, Open3D, OpenCV), JSON objects with a position and
  an orientation each, COLMAP's images.txt and the vertices of a pose graph (.g2o) are read, too
`;

/** The trajectory that a path names; null where it cannot be used, which is reported. */
export function readTrajectory(
  engine: Engine,
  path: string,
  { format, times }: { format?: string | undefined; times?: string | undefined },
  complain: (problem: string) => void,
): Trajectory | null {
  if (format !== undefined) trajectoryFormat(format);
  try {
    const trajectory = isFolder(path) ? readFrames(engine, path, complain) : readFile(engine, path, format, complain);
    if (trajectory && times !== undefined && trajectory.stamps() === undefined) {
      const stamps = readInput({ name: basename(times), path: times }, complain);
      if (!stamps) return null;
      trajectory.set_stamps(stamps, basename(times));
    }
    return trajectory;
  } catch (error) {
    if (!isScanstitchError(error)) throw error;
    complain(error.message);
    return null;
  }
}

/** The format of this name. */
export function trajectoryFormat(name: string): TrajectoryFormat {
  const format = TRAJECTORY_FORMATS.find((format) => format === name);
  if (!format) throw new CommandError(`"${name}" is not a trajectory format: ${TRAJECTORY_FORMATS.join(', ')}.`);
  return format;
}

function readFile(engine: Engine, path: string, format: string | undefined, complain: (problem: string) => void) {
  const name = basename(path);
  const bytes = readInput({ name, path }, complain);
  return (
    bytes &&
    engine.Trajectory.read(trajectoryBytes(name, bytes), name, format === undefined ? null : trajectoryFormat(format))
  );
}

/** The text files of a folder that hold one pose each; empty where there are none, which is reported. */
export function frameFiles(folder: string, complain: (problem: string) => void): Input[] {
  try {
    const all = readdirSync(folder);
    const poses = all.filter((name) => /pose.*\.txt$/i.test(name));
    const names = (poses.length > 0 ? poses : all.filter((name) => /\.(txt|csv|mat)$/i.test(name))).sort(
      compareNaturally,
    );
    if (names.length === 0) complain(`${folder}: There is no text file in this folder.`);
    return names.map((name) => ({ name, path: join(folder, name) }));
  } catch (error) {
    complain(`${folder}: ${fileProblem(error)}`);
    return [];
  }
}

function readFrames(engine: Engine, folder: string, complain: (problem: string) => void) {
  const inputs = frameFiles(folder, complain);
  const files = inputs.map((input) => readInput(input, complain));
  if (files.length === 0 || files.some((file) => file === null)) return null;
  return engine.Trajectory.read_frames(
    inputs.map(({ name }) => name),
    files as Uint8Array[],
  );
}
