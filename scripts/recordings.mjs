// @ts-check
/**
 * What each recording is read as: `node scripts/recordings.mjs PATH...` prints a row for each file or folder, with what was said
 * of it, as a table in Markdown.
 */
import { pathToFileURL } from 'node:url';
import { gather } from '../npm/cli/inputs.js';
import * as engine from '../npm/index.js';
import { understand } from '../npm/recording.js';
import { HEAD_BYTES } from '../npm/recording/heads.js';

/**
 * What a file or folder is read as, and its number of frames; `complaints` are of what could not be opened.
 * @param {string} path
 */
export async function readAs(path) {
  /** @type {string[]} */
  const complaints = [];
  const inputs = await gather([path], (problem) => complaints.push(problem));
  const read = async (/** @type {string} */ file) => (await inputs.sources.get(file)?.read()) ?? new Uint8Array();
  try {
    const head = async (/** @type {string} */ file, /** @type {number} */ length) =>
      inputs.sources.get(file)?.readHead(length) ?? new Uint8Array();
    const { kind, depth_frames, clouds, scans, notes } = await understand([...inputs.sources.values()], head);
    let frames = depth_frames.length + clouds.length;
    for (const file of scans) frames += scansIn(file, await read(file));
    return { kind, frames, notes: [...inputs.notes, ...notes], complaints };
  } finally {
    await inputs.close();
  }
}

/** @param {string} name @param {Uint8Array} bytes */
function scansIn(name, bytes) {
  const reconstruction = new engine.Reconstruction();
  try {
    if (engine.is_laser_log(bytes.subarray(0, HEAD_BYTES))) return reconstruction.add_log(name, bytes).num_scans;
    reconstruction.add_scan(name, bytes);
    return 1;
  } finally {
    reconstruction.free();
  }
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  await engine.load();
  console.log('| recording | read as | frames | said |\n|---|---|---|---|');
  for (const path of process.argv.slice(2)) {
    const { kind, frames, notes, complaints } = await readAs(path).catch((error) => ({
      ...{ kind: 'nothing', frames: 0, notes: [] },
      complaints: [String(error.message ?? error)],
    }));
    const said = [...complaints, ...notes.map(({ file, reason }) => `${file}: ${reason}`)].join('; ');
    console.log(`| ${path} | ${kind.replace('_', ' ')} | ${frames} | ${said.replaceAll('|', '/')} |`);
  }
}
