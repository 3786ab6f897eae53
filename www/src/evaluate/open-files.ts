/** From dropped files, folders and archives to bytes. */
import { isPoseDocument, posesOfDocument, trajectoryBytes } from '../../../package/recording/pose_file.js';
import type { NamedFile } from '../datasets/gather.js';
import { openFiles } from '../datasets/spatial-files.js';
import { messageOf } from '../engine/message-of.js';
import { isOfNoUse } from './intake.js';
import type { Part } from './protocol.js';

export interface OpenedFiles {
  parts: Part[];
  /** Files that cannot be opened, and why. */
  problems: string[];
  /** Names of files that can be no trajectory, map or times, and were not opened. */
  skipped: string[];
}

export async function readAll(named: readonly NamedFile[]): Promise<OpenedFiles> {
  const { files, notes } = await openFiles(named);
  const wanted = files.filter(({ path }) => !isOfNoUse(path) || isPoseDocument(path));
  const opened: OpenedFiles = {
    parts: [],
    problems: notes.map(({ file, reason }) => `${file}: ${reason}`),
    skipped: files.filter((file) => !wanted.includes(file)).map(({ path }) => path),
  };
  const read = await Promise.allSettled(wanted.map(async (file) => ({ name: file.path, bytes: await file.read() })));
  for (const result of read) {
    if (result.status === 'fulfilled') {
      const { name, bytes } = result.value;
      if (isPoseDocument(name) && !posesOfDocument(bytes)) opened.skipped.push(name);
      else opened.parts.push({ name, bytes: trajectoryBytes(name, bytes) });
    } else opened.problems.push(messageOf(result.reason));
  }
  return opened;
}
