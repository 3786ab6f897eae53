// @ts-check
/**
 * Whole runs as users make them, from the files to the placed frames: by the command line, and by files chosen on the page in
 * Chromium, on one core and on two. Graphics are off in Chromium: without a graphics card, emulating one would be timed.
 */
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { capture, findProgram, ROOT, StepError } from './steps.mjs';

const REPEATS = 5;

/** @typedef {{ name: string, folder: string }} Recording */
/** @typedef {{ mean: number, first: number, worst: number }} Registering ms a frame, without waiting for its preparation */
/** @typedef {{ frames: number, milliseconds: number, mean_error: number | null, registering_ms?: Registering }} WholeRun */

/** @type {Recording[]} */
const RECORDINGS = [
  { name: 'run_sample', folder: 'www/samples/apartment' },
  { name: 'run_first_floor', folder: '../shared/data/rgbd/apartment_first_floor' },
  { name: 'run_second_floor', folder: '../shared/data/rgbd/apartment_second_floor' },
  { name: 'run_realsense', folder: '../shared/data/rgbd/d435_robot' },
  { name: 'run_kinect_robot', folder: '../shared/data/rgbd/kinect_pioneer' },
  { name: 'run_kinect_office', folder: '../shared/data/rgbd/kinect_office' },
];

/** The recordings there are. @param {(name: string) => boolean} isWanted */
export function listRuns(isWanted) {
  return RECORDINGS.filter(({ name, folder }) => {
    if (!isWanted(name)) return false;
    const isThere = existsSync(join(ROOT, folder));
    if (!isThere) console.error(`skipped ${name}: ${folder} is absent`);
    return isThere;
  });
}

/**
 * Times a recording everywhere, turn about, so that what else the machine does falls on all alike.
 * @param {Recording} recording
 * @param {string | undefined} browser
 */
export async function timeRuns({ name, folder }, browser) {
  const taskset = findProgram(['taskset']);
  if (!taskset) console.error('taskset is absent: timed on all cores only');
  const places = [{ where: 'node', run: inNode }, ...(browser ? [{ where: 'chromium', run: inChromium }] : [])];
  const runs = places.flatMap(({ where, run }) => {
    /** @type {(1 | 2)[]} */
    const counts = taskset ? [1, 2] : [2];
    return counts.map((cores) => ({ where, cores, run, results: /** @type {WholeRun[]} */ ([]) }));
  });
  for (let repeat = 0; repeat < REPEATS; repeat++) {
    for (const { cores, run, results } of runs) {
      const pinned = taskset ? [taskset, '-c', cores === 1 ? '0' : '0,1'] : [];
      results.push(await run(join(ROOT, folder), pinned));
    }
  }
  return runs.map(({ where, cores, results }) => {
    const times = results.map(({ frames, milliseconds }) => milliseconds / frames).sort((a, b) => a - b);
    const [first] = results;
    if (!first) throw new StepError(`${name} was not run`);
    const [median = 0, min = 0, max = 0] = [times[REPEATS >> 1], times[0], times.at(-1)].map((ms) => round(ms ?? 0));
    console.error(`  ${where}, ${cores} ${cores === 1 ? 'core' : 'cores'}: ${median} ms a frame (${min} to ${max})`);
    const registering = medianRegistering(results);
    if (registering) {
      const { mean, first, worst } = registering;
      console.error(`    registering: ${mean} ms in the mean, ${first} the first, ${worst} the worst frame`);
    }
    const ms_a_frame = { median, min, max };
    return {
      where,
      cores,
      frames: first.frames,
      mean_error_m: first.mean_error,
      ms_a_frame,
      registering_ms: registering,
    };
  });
}

/** Of each figure the median over the runs. @param {WholeRun[]} results @returns {Registering | undefined} */
function medianRegistering(results) {
  const measured = results.flatMap(({ registering_ms }) => registering_ms ?? []);
  if (measured.length === 0) return undefined;
  const median = (/** @type {keyof Registering} */ key) => {
    const sorted = measured.map((times) => times[key]).sort((a, b) => a - b);
    return round(sorted[sorted.length >> 1] ?? NaN);
  };
  return { mean: median('mean'), first: median('first'), worst: median('worst') };
}

/** @param {string} folder @param {string[]} pinned @returns {Promise<WholeRun>} */
async function inNode(folder, pinned) {
  const out = mkdtempSync(join(tmpdir(), 'scanstitch-bench-'));
  try {
    const output = await checked([...pinned, process.execPath, 'npm/cli.js', 'reconstruct', folder, '--out', out]);
    const [, frames, milliseconds] = /of (\d+) frames in (\d+) ms/.exec(output) ?? [];
    const [, mean] = /^Distance to .*: mean ([\d.]+) m/m.exec(output) ?? [];
    return { frames: Number(frames), milliseconds: Number(milliseconds), mean_error: mean ? Number(mean) : null };
  } finally {
    rmSync(out, { recursive: true, force: true });
  }
}

/** @param {string} folder @param {string[]} pinned @returns {Promise<WholeRun>} */
async function inChromium(folder, pinned) {
  const output = await checked([...pinned, process.execPath, join(ROOT, 'scripts', 'bench_page.mjs'), folder]);
  return JSON.parse(output.trim().split('\n').at(-1) ?? '');
}

/** @param {string[]} command */
async function checked([program = '', ...args]) {
  const { code, output } = await capture(program, args);
  if (code !== 0) throw new StepError(`A whole run failed:\n${output}`);
  return output;
}

/** To four significant digits. @param {number} value */
function round(value) {
  return Number(value.toPrecision(4));
}
