// @ts-check
/**
 * What each recording is read as: `node scripts/recordings.mjs PATH...` prints a row for each file or folder, with what was said
 * of it, as a table in Markdown; without a path, for every folder of ../shared/data and every file in it, but for the images of
 * series.
 */
import { readdirSync } from 'node:fs';
import { basename, join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { openInputs } from '../npm/cli/inputs.js';
import * as engine from '../npm/index.js';
import { ROOT } from './steps.mjs';

const DATA = join(ROOT, '..', 'shared', 'data');
/** So many files that end alike are a series. */
const MIN_SERIES = 20;

/**
 * What a file or folder is read as, and its number of frames; `complaints` are of what could not be opened.
 * @param {string} path
 */
export async function readAs(path) {
  /** @type {string[]} */
  const complaints = [];
  const { recording, close } = await openInputs([path], (problem) => complaints.push(problem));
  const { kind, depth_frames, clouds, scans, logs, notes } = recording;
  try {
    let frames = depth_frames.length + clouds.length;
    for (const file of scans) {
      const bytes = await recording.read(file);
      try {
        frames += scansIn(basename(file), bytes, logs.includes(file));
      } catch (error) {
        complaints.push(String(/** @type {Error} */ (error).message));
      }
    }
    return { kind, frames, notes, complaints };
  } finally {
    await close();
  }
}

/** @param {string} name @param {Uint8Array} bytes @param {boolean} isLog */
function scansIn(name, bytes, isLog) {
  const reconstruction = new engine.Reconstruction();
  try {
    if (isLog) return reconstruction.add_log(name, bytes).num_scans;
    reconstruction.add_scan(name, bytes);
    return 1;
  } finally {
    reconstruction.free();
  }
}

/** A folder, what lies in it that is no image of a series, and the folders in it. @param {string} folder @returns {string[]} */
function pathsUnder(folder) {
  const entries = readdirSync(folder, { withFileTypes: true }).sort((a, b) => (a.name < b.name ? -1 : 1));
  const files = entries.filter((entry) => entry.isFile()).map(({ name }) => name);
  const endingOf = (/** @type {string} */ name) => name.slice(name.lastIndexOf('.'));
  const isAlone = (/** @type {string} */ name) =>
    files.filter((other) => endingOf(other) === endingOf(name)).length < MIN_SERIES;
  const folders = entries.filter((entry) => entry.isDirectory()).map(({ name }) => join(folder, name));
  return [
    ...(files.length > 0 ? [folder, ...files.filter(isAlone).map((name) => join(folder, name))] : []),
    ...folders.flatMap(pathsUnder),
  ];
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  await engine.load();
  console.log('| recording | read as | frames | said |\n|---|---|---|---|');
  const given = process.argv.slice(2);
  for (const path of given.length > 0 ? given : pathsUnder(DATA)) {
    const { kind, frames, notes, complaints } = await readAs(path).catch((error) => ({
      ...{ kind: 'nothing', frames: 0, notes: [] },
      complaints: [String(error.message ?? error)],
    }));
    const said = [...complaints, ...notes.map(({ file, reason }) => `${file}: ${reason}`)].join('; ');
    console.log(`| ${path} | ${kind.replace('_', ' ')} | ${frames} | ${said.replaceAll('|', '/')} |`);
  }
}
