// @ts-check
/**
 * Recordings rewritten by other conventions:
 * `node scripts/convention_trials.mjs [--only RECORDING] [--trials COUNT] [--trial N] [--data FOLDER]`.
 *
 * Six recordings are written anew, fifty times each: in another unit, scale, format and order, moved, with other axes or a laser mounted
 * otherwise, with another sign for no return, all drawn by a generator of random numbers with a fixed seed. Each is reconstructed with
 * nothing set and compared with the recording as it is. Printed is a table in Markdown: how many came out right, were asked or doubtful,
 * refused with help, or silently wrong, and a line for each trial that is not right.
 */
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { parseArgs } from 'node:util';
import { invoke } from '../npm/cli/invocation.js';
import { main } from '../npm/cli/main.js';
import { compareNaturally } from '../npm/base/natural_order.js';
import * as engine from '../npm/index.js';
import { cloudFiles, depthFiles, planarFiles } from './convention_files.mjs';
import { moved } from '../tests/cli/support.mjs';
import { ROOT } from './steps.mjs';

/** @typedef {import('./convention_files.mjs').Motion} Motion */
/** @typedef {Record<string, string | Uint8Array>} Files */
/** @typedef {{ files: Files, expected: Motion[], offset: number[], changes: string }} Trial offset: of the coordinates (m) */

const { values: given } = parseArgs({
  options: {
    only: { type: 'string' },
    trials: { type: 'string', default: '50' },
    trial: { type: 'string' },
    data: { type: 'string' },
  },
});
const DATA = given.data ?? join(ROOT, '..', 'shared', 'data');
const TRIALS = Number(given.trials);
/** A path is right within this share of its length and this distance (m). */
const [SAME_PATH, SAME_PLACE] = [0.05, 0.05];

/** Numbers from 0 to 1 (mulberry32). @param {number} seed */
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let bits = Math.imul(state ^ (state >>> 15), 1 | state);
    bits = (bits + Math.imul(bits ^ (bits >>> 7), 61 | bits)) ^ bits;
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** @param {string} folder */
const filesIn = (folder) => readdirSync(join(DATA, folder)).sort(compareNaturally);
/** @param {string} path */
const read = (path) => new Uint8Array(readFileSync(join(DATA, path)));

/** @param {string} path @param {number} most */
function logOf(path, most) {
  const lines = readFileSync(join(DATA, path), 'latin1').split('\n');
  return lines
    .filter((line) => line.startsWith('ROBOTLASER1'))
    .slice(0, most)
    .map((line) => {
      const words = line.split(' ').map(Number);
      const [start = 0, step = 0, count = 0] = [words[2], words[4], words[8]];
      const ranges = words.slice(9, 9 + count);
      return {
        bearings: ranges.map((_, beam) => start + step * beam),
        ranges: ranges.map((r) => (r > 50 ? Infinity : r)),
      };
    });
}

/** @param {string} path @param {number} [stride] */
function cloud(path, stride = 1) {
  const points = engine.PointCloud.read(read(path), path).positions();
  const count = points.length / 3;
  const all = Array.from({ length: Math.floor(count / stride) }, (_, at) => [
    ...points.subarray(3 * stride * at, 3 * stride * at + 3),
  ]);
  return all.filter((point) => point.every(Number.isFinite));
}

/** Scans that are files of points. @param {string} folder */
function scansOf(folder) {
  const names = filesIn(folder).filter((name) => name.endsWith('.ply'));
  return names.map((name) => {
    const points = cloud(`${folder}/${name}`);
    return {
      bearings: points.map(([x = 0, y = 0]) => Math.atan2(y, x)),
      ranges: points.map(([x = 0, y = 0]) => Math.hypot(x, y)),
    };
  });
}

/** @param {string} folder @param {number[]} frames @param {(frame: number) => string} nameOf @param {number} perMetre @param {number[]} camera */
function depthOf(folder, frames, nameOf, perMetre, camera) {
  const images = frames.map((frame) => {
    const image = engine.decode_depth(nameOf(frame), read(`${folder}/${nameOf(frame)}`));
    const { width, height } = image;
    // In millimetres to a fraction; 0 is none.
    const depth = Float64Array.from(image.values(), (value) => (value === 65_535 ? 0 : (1000 * value) / perMetre));
    return { width, height, depth };
  });
  return { images, camera };
}

const two = (/** @type {number} */ n) => String(n).padStart(6, '0');
/** @type {Record<string, () => (next: (() => number) | null, truth: Motion[]) => Trial>} */
const RECORDINGS = {
  fr079: () => planarFiles(logOf('laser/fr079/fr079.log', 60)),
  zju10: () => planarFiles(scansOf('laser/zju10')),
  figure8: () =>
    cloudFiles(
      filesIn('lidar/synthetic_figure8/scans')
        .slice(0, 8)
        .map((name) => cloud(`lidar/synthetic_figure8/scans/${name}`)),
    ),
  pcl_pairwise: () =>
    cloudFiles(
      filesIn('lidar/pcl_pairwise')
        .slice(0, 3)
        .map((name) => cloud(`lidar/pcl_pairwise/${name}`, 12)),
    ),
  fusion_demo50: () =>
    depthFiles(
      depthOf(
        'rgbd/fusion_demo50',
        [8, 9, 10, 11],
        (n) => `rgbd-frames/frame-${two(n)}.depth.png`,
        1000,
        [585, 585, 320, 240],
      ),
    ),
  habitat: () =>
    depthFiles(depthOf('rgbd/habitat_16bit', [1, 2, 3, 4], (n) => `depth/${n}.png`, 6553.5, [256, 256, 256, 256])),
};

/** @param {Files} files */
async function reconstruct(files) {
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-trial-'));
  for (const [name, content] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, 'in', name)), { recursive: true });
    writeFileSync(join(folder, 'in', name), content);
  }
  let said = '';
  const into = { write: (/** @type {string} */ text) => (said += text) };
  const out = join(folder, 'out');
  const status = await invoke({ stdout: into, stderr: into }, () =>
    main(['reconstruct', join(folder, 'in'), '--out', out]),
  );
  const report = status === 1 ? null : JSON.parse(readFileSync(join(out, 'report.json'), 'utf8'));
  rmSync(folder, { recursive: true, force: true });
  return { said, report };
}

/** Where the frames are. @param {any} report @param {number[]} offset of the coordinates @returns {Motion[]} */
function motionsOf(report, offset) {
  return report.frames.map((/** @type {any} */ { status, T_world_sensor: pose, piece }) => {
    if (!pose) return { isGood: false, place: [NaN, NaN, NaN], heading: NaN, piece };
    const { x, y, z, theta = 0 } = pose;
    const place = z === undefined ? [x, y, 0] : moved(pose, offset).map((value, axis) => value - (offset[axis] ?? 0));
    return { isGood: status === 'good', place, heading: theta, piece };
  });
}

/** Where a frame is as seen from another one, whose heading counts in the plane alone. @param {Motion | undefined} from @param {Motion | undefined} to */
function seenFrom(from, to) {
  const [x = 0, y = 0, z = 0] = to?.place.map((value, axis) => value - (from?.place[axis] ?? 0)) ?? [];
  const [cos, sin] = [Math.cos(from?.heading ?? 0), Math.sin(from?.heading ?? 0)];
  return [cos * x + sin * y, cos * y - sin * x, z];
}

/** @param {number[] | undefined} a @param {number[]} [b] */
function distance(a = [], b = []) {
  return Math.hypot(...a.map((value, axis) => value - (b[axis] ?? 0)));
}

/** What there may be to say of a recording that was read wrongly. */
const QUESTIONS =
  /possible as well|and may be|mirror|left-handed|taken for (milli|centi)?metres|Set [a-z_]+ to|set (scan_unit|cloud_unit|depth_scale|fx|laser_direction|field_of_view)|may have another size|not used|in the wrong order|near is bright|begin at the sensor/i;

/** @param {Awaited<ReturnType<typeof reconstruct>>} result @param {Trial} trial */
function verdictOn({ said, report }, { expected, offset }) {
  if (!report)
    return /(^|\n)\s*\S.*(Give|Save|Set|set|give|Say|Correct|Write|Unpack)/i.test(said)
      ? 'refused with help'
      : 'refused without help';
  const found = motionsOf(report, offset);
  const good = found.filter(({ isGood }) => isGood).length;
  if (found.length !== expected.length) return good === 0 || QUESTIONS.test(said) ? 'asked' : 'silently wrong';
  // How the pieces of a map lie relative to each other is not claimed.
  /** @type {Map<number | undefined, number>} */
  const firsts = new Map();
  found.forEach(({ isGood, piece }, at) => isGood && !firsts.has(piece) && firsts.set(piece, at));
  const off = found.map(({ isGood, piece }, at) => {
    const first = firsts.get(piece);
    if (!isGood || first === undefined) return 0;
    const [seen, wanted] = [found, expected].map((motions) => seenFrom(motions[first], motions[at]));
    return distance(seen, wanted) - SAME_PLACE - SAME_PATH * distance(wanted, [0, 0, 0]);
  });
  const isRight = off.every((error) => error <= 0);
  if (isRight && 2 * good > found.length) return 'right';
  if (isRight || 2 * good <= found.length) return 'asked';
  return QUESTIONS.test(said) ? 'asked' : 'silently wrong';
}

await engine.load();
/** @type {Record<string, Record<string, number>>} */
const table = {};
for (const [name, open] of Object.entries(RECORDINGS)) {
  if (given.only !== undefined && given.only !== name) continue;
  const make = open();
  /** @type {Motion[]} */
  let truth = [];
  const row = (table[name] = {
    right: 0,
    asked: 0,
    'refused with help': 0,
    'refused without help': 0,
    'silently wrong': 0,
  });
  for (let trial = 0; trial <= TRIALS; trial += 1) {
    if (given.trial !== undefined && trial !== 0 && trial !== Number(given.trial)) continue;
    const made = make(trial === 0 ? null : random(1000 * trial + 7), truth);
    const result = await reconstruct(made.files);
    if (trial === 0) {
      // As it is: what the others are compared with.
      truth = motionsOf(result.report, made.offset);
      console.error(`${name}: ${truth.filter(({ isGood }) => isGood).length} of ${truth.length} good as it is`);
      continue;
    }
    const verdict = verdictOn(result, made);
    row[verdict] = (row[verdict] ?? 0) + 1;
    if (verdict !== 'right') {
      const lines = result.said.split('\n').filter((line) => line.trim() !== '');
      console.error(
        `${name} ${trial} ${verdict}: ${made.changes}${given.trial === undefined ? '' : `\n${lines.join('\n')}`}`,
      );
    }
  }
}
const verdicts = ['right', 'asked', 'refused with help', 'refused without help', 'silently wrong'];
console.log(`| recording | ${verdicts.join(' | ')} |\n|---|${verdicts.map(() => '---|').join('')}`);
for (const [name, row] of Object.entries(table))
  console.log(`| ${name} | ${verdicts.map((verdict) => row[verdict]).join(' | ')} |`);
