// @ts-check
/** What is told of files without a recording, and what they are to planar scans that are open. */
import { isColumn, looksLikeNumbers } from './classify.js';
import { HEAD_BYTES } from './heads.js';
import { isImageName } from './kinds.js';
import { groupBy } from './names.js';
import { adviceByContents, isGraph, unused } from './other_formats.js';
import { assignRoles, classifyAll } from './planar.js';

/** @typedef {import('../recording.js').ListedFile} ListedFile */
/** @typedef {import('../recording.js').Note} Note */
/** @typedef {import('../recording.js').Read} Read */
/** @typedef {import('../recording.js').Recording} Recording */

/** So many files are looked into to tell numbers from others. */
const LOOKED_FOR_NUMBERS = 100;

/**
 * @param {Note[]} notes about images
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<Partial<Recording> & { notes: Note[] }>}
 */
export async function nothing(notes, files, read) {
  const told = new Set(notes.map(({ file }) => file));
  const others = files.filter(({ path }) => !isImageName(path));
  const heads = await Promise.all(others.slice(0, LOOKED_FOR_NUMBERS).map(({ path }) => read(path, HEAD_BYTES)));
  const headOf = (/** @type {number} */ at) => heads[at] ?? new Uint8Array();
  /** @type {Map<string, ListedFile[]>} */
  const advised = groupBy(
    others.filter((_, at) => adviceByContents(headOf(at)) !== null),
    (file) => adviceByContents(headOf(others.indexOf(file))) ?? '',
  );
  const advisedFiles = new Set([...advised.values()].flat());
  const graphs = others.filter((_, at) => isGraph(headOf(at)));
  const columns = others.filter((_, at) => isColumn(headOf(at)));
  const isNumbers = (/** @type {ListedFile} */ file, /** @type {number} */ at) =>
    !advisedFiles.has(file) && !graphs.includes(file) && looksLikeNumbers(headOf(at));
  const numbers = new Set(others.filter(isNumbers));
  const rest = [
    ...[...advised].flatMap(([advice, files]) =>
      files.map(({ path }) => ({ file: path, reason: `not used: ${advice}` })),
    ),
    ...unused(graphs, 'relations between poses, without scans; give the log or bag of the laser'),
    ...unused(
      columns,
      'a number a line; where these are the ranges of a scan, say where it begins and its step: --table range=1,start=-135deg,step=0.5deg',
    ),
    ...unused(
      [...numbers],
      'numbers without a scan, as of a trajectory; trajectories are compared by scanstitch evaluate, on the page under Evaluate; of points x y or x y z, give two files or more',
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
 * What these files are to scans that are open. Several images, or very many files, were meant as a recording: why they are none is
 * told in its own notes.
 * @param {ListedFile[]} files
 * @param {Read} read
 * @returns {Promise<import('../recording.js').Beside>}
 */
async function besideScans(files, read) {
  const { reference, odometry, notes } = assignRoles(await classifyAll(files, read));
  return { reference, odometry, notes };
}
