// @ts-check
/** Trajectories named on the command line: a file, or a folder with one file for each frame. */
import { readdirSync, statSync } from 'node:fs';
import { basename, join } from 'node:path';
import { compareNaturally } from '../natural_order.js';
import { CommandError, isScanstitchError } from './command.js';
import { fileProblem, readInput } from './inputs.js';

/** @typedef {import('./command.js').Engine} Engine */
/** @typedef {import('../index.js').TrajectoryFormat} TrajectoryFormat */
/** @typedef {import('../index.js').Trajectory} Trajectory */

/** @type {TrajectoryFormat[]} */
export const TRAJECTORY_FORMATS = ['tum', 'kitti', 'euroc', 'pose_table', 'matrices', 'npy', 'positions', 'planar'];

export const TRAJECTORY_HELP = `Trajectories are files of these forms, or a folder of text files with the 4 x 4 matrix of one frame each:
  tum         t x y z qx qy qz qw             kitti      12 numbers of a 3 x 4 matrix; times by --times
  euroc       t [ns], x, y, z, qw, qx, qy, qz pose_table columns named in the first line, or x y z qw qx qy qz
  matrices    4 x 4, with or without counts   npy        (N, 7) x y z qw qx qy qz; (N, 8); (N, 3, 4); (N, 4, 4)
  positions   x y z, or x y                   planar     number x y theta
`;

/**
 * The trajectory that a path names; null where it cannot be used, which is told.
 * @param {Engine} engine
 * @param {string} path
 * @param {{ format?: string | undefined, times?: string | undefined }} options
 * @param {(problem: string) => void} complain
 * @returns {Trajectory | null}
 */
export function readTrajectory(engine, path, { format, times }, complain) {
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

/** The format of this name. @param {string} name @returns {TrajectoryFormat} */
export function trajectoryFormat(name) {
  const format = TRAJECTORY_FORMATS.find((format) => format === name);
  if (!format) throw new CommandError(`"${name}" is no form of a trajectory: ${TRAJECTORY_FORMATS.join(', ')}.`);
  return format;
}

/** @param {string} path */
function isFolder(path) {
  return statSync(path, { throwIfNoEntry: false })?.isDirectory() ?? false;
}

/**
 * @param {Engine} engine
 * @param {string} path
 * @param {string | undefined} format
 * @param {(problem: string) => void} complain
 */
function readFile(engine, path, format, complain) {
  const name = basename(path);
  const bytes = readInput({ name, path }, complain);
  return bytes && engine.Trajectory.read(bytes, name, format === undefined ? null : trajectoryFormat(format));
}

/**
 * @param {Engine} engine
 * @param {string} folder
 * @param {(problem: string) => void} complain
 */
function readFrames(engine, folder, complain) {
  /** @type {string[]} */
  let names;
  try {
    const all = readdirSync(folder);
    const poses = all.filter((name) => /pose.*\.txt$/i.test(name));
    names = (poses.length > 0 ? poses : all.filter((name) => /\.(txt|csv|mat)$/i.test(name))).sort(compareNaturally);
  } catch (error) {
    complain(`${folder}: ${fileProblem(error)}`);
    return null;
  }
  if (names.length === 0) {
    complain(`${folder}: There is no text file in this folder.`);
    return null;
  }
  const files = names.map((name) => readInput({ name, path: join(folder, name) }, complain));
  if (files.some((file) => file === null)) return null;
  return engine.Trajectory.read_frames(names, /** @type {Uint8Array[]} */ (files));
}
