/** From dropped files, folders and archives to trajectories and what lies beside them, read. */
import { openRecording } from '../../../package/recording_reader.js';
import { trajectoryBytes } from '../../../package/recording/pose_file.js';
import type { NamedFile } from '../datasets/gather.js';
import { messageOf } from '../engine/message-of.js';
import type { Part } from './protocol.js';

export interface Intake {
  /** One file each, or the files of a folder with one pose each. */
  trajectories: { name: string; parts: readonly Part[] }[];
  times: Part | null;
  relations: Part | null;
  clouds: Part[];
  /** Files that cannot be opened, and why. */
  problems: string[];
  /** Names of files that can be no trajectory, map or times. */
  skipped: string[];
}

export async function openFiles(named: readonly NamedFile[]): Promise<Intake> {
  const recording = await openRecording(named.map(({ name: path, file: blob }) => ({ path, blob })));
  const found = await recording.trajectories();
  const problems = [...recording.opened.notes.map(({ file, reason }) => `${file}: ${reason}`), ...found.problems];
  const read = async (path: string): Promise<Part[]> => {
    try {
      return [{ name: path, bytes: trajectoryBytes(path, await recording.read(path)) }];
    } catch (error) {
      problems.push(messageOf(error));
      return [];
    }
  };
  const readAll = async (paths: readonly string[]): Promise<Part[]> => (await Promise.all(paths.map(read))).flat();
  const trajectories = await Promise.all(
    found.trajectories.map(async ({ name, paths }) => ({ name, parts: await readAll(paths) })),
  );
  const [times = null] = await readAll(found.times === null ? [] : [found.times]);
  const [relations = null] = await readAll(found.relations === null ? [] : [found.relations]);
  const clouds = await readAll(found.maps);
  const readable = trajectories.filter(({ parts }) => parts.length > 0);
  return { trajectories: readable, times, relations, clouds, problems, skipped: found.skipped };
}
