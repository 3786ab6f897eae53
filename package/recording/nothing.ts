/** What is told of files without a recording, and what they are to planar scans that are open. */
import type { Note } from '../base/errors.js';
import { HEAD_BYTES } from '../files/heads.js';
import { isImageName } from '../files/kinds.js';
import { groupBy } from '../files/names.js';
import type { Beside, Found, ListedFile } from '../files/recording.js';
import type { Read } from './cameras.js';
import { isColumn, looksLikeNumbers } from './classify.js';
import { adviceByContents, isGraph, unused } from './other_formats.js';
import { assignRoles, classifyAll } from './planar.js';

/** So many files are looked into to tell numbers from others. */
const LOOKED_FOR_NUMBERS = 100;

/** @param notes about images */
export async function nothing(notes: Note[], files: ListedFile[], read: Read): Promise<Found> {
  const told = new Set(notes.map(({ file }) => file));
  const others = files.filter(({ path }) => !isImageName(path));
  const heads = await Promise.all(others.slice(0, LOOKED_FOR_NUMBERS).map(({ path }) => read(path, HEAD_BYTES)));
  const headOf = (at: number) => heads[at] ?? new Uint8Array();
  const advised: Map<string, ListedFile[]> = groupBy(
    others.filter((_, at) => adviceByContents(headOf(at)) !== null),
    (file) => adviceByContents(headOf(others.indexOf(file))) ?? '',
  );
  const advisedFiles = new Set([...advised.values()].flat());
  const graphs = others.filter((_, at) => isGraph(headOf(at)));
  const columns = others.filter((_, at) => isColumn(headOf(at)));
  const isNumbers = (file: ListedFile, at: number) =>
    !advisedFiles.has(file) && !graphs.includes(file) && looksLikeNumbers(headOf(at));
  const numbers = new Set(others.filter(isNumbers));
  const rest = [
    ...[...advised].flatMap(([advice, files]) =>
      files.map(({ path }) => ({ file: path, reason: `not used: ${advice}` })),
    ),
    ...unused(graphs, 'relations between poses, without scans; give the log or bag of the laser'),
    ...unused(
      columns,
      'a number a line; where these are the ranges of a scan, give one alone, or a scan a line in one file',
    ),
    ...unused(
      [...numbers],
      'numbers without a scan, as of a trajectory; trajectories are compared by scanstitch evaluate, on the page under Evaluate; of points, name the columns in the first line (x,y or x,y,z), and give two files or more',
    ),
    ...unused(
      others.filter(
        (file) => !advisedFiles.has(file) && !numbers.has(file) && !graphs.includes(file) && !columns.includes(file),
      ),
      'neither a scan, nor a cloud, nor a depth image',
    ),
  ];
  const isFew = files.length <= LOOKED_FOR_NUMBERS && files.length < others.length + 2;
  return {
    notes: [...notes, ...rest.filter(({ file }) => !told.has(file))],
    ...(isFew && { beside: await besideScans(files, read) }),
  };
}

/**
 * What these files are to scans that are open. Several images, or very many files, were meant as a recording: why they
 * are none is
 * told in its own notes.
 */
async function besideScans(files: ListedFile[], read: Read): Promise<Beside> {
  const { reference, odometry, notes } = assignRoles(await classifyAll(files, read));
  return { reference, odometry, notes };
}
