/** Reading and preparing one frame: the same in a thread of its own and in the only one. */
import { fileError } from '../base/errors.js';
import type { Prepared } from '../run/frame_queue.js';
import { isScanstitchError } from './command.js';
import { fileProblem, readWholeLater } from './disk.js';

/** A frame to prepare. Files are given as paths on the disk, or as their bytes. */
export interface Order {
  /** What `begin` returned. */
  decodeConfig: string;
  kind: 'depth_images' | 'clouds';
  name: string;
  index: number;
  time: number | null;
  /** Depth image or cloud. */
  file: string | Uint8Array;
  color: string | Uint8Array | null;
  color_name: string | undefined;
  /** Why it could not be read, where it could not. */
  color_problem: string | undefined;
}

/** What is in the files, and how long reading took. */
export interface Contents {
  bytes: Uint8Array;
  color: Uint8Array | null;
  color_problem: string | undefined;
  milliseconds: number;
}

/** @returns rejects with a ScanstitchError where the file cannot be read */
export async function readContents({ name, file, color, color_name = '', color_problem }: Order): Promise<Contents> {
  const start = performance.now();
  const bytes = typeof file === 'string' ? await read(file, name) : file;
  const colors =
    typeof color === 'string' ? await readColors(() => read(color, color_name), color_name) : { color, color_problem };
  return { bytes, ...colors, milliseconds: performance.now() - start };
}

/** A colour image, or why it cannot be read: the frame is used without it. */
export async function readColors(
  read: () => Promise<Uint8Array>,
  name: string,
): Promise<{ color: Uint8Array | null; color_problem: string | undefined }> {
  try {
    return { color: await read(), color_problem: undefined };
  } catch (error) {
    const color_problem = isScanstitchError(error) ? error.message : `${name}: ${fileProblem(error)}`;
    return { color: null, color_problem };
  }
}

/** Throws a ScanstitchError where the frame is at fault. */
export function prepare(
  engine: typeof import('../index.js'),
  { decodeConfig, kind, name, index, time, color_name }: Order,
  contents: Contents,
): Prepared {
  const start = performance.now();
  const { bytes, color, color_problem, milliseconds } = contents;
  const prepared =
    kind === 'clouds'
      ? engine.prepare_cloud(decodeConfig, name, index, time, bytes)
      : engine.prepare_frame(decodeConfig, name, index, time, bytes, color, color_name, color_problem);
  return { bytes: prepared, milliseconds: { read: milliseconds, prepare: performance.now() - start } };
}

async function read(path: string, name: string) {
  try {
    return await readWholeLater(path);
  } catch (error) {
    throw fileError(name, fileProblem(error).replace(/\.$/, ''), 'See whether it was moved or deleted');
  }
}
