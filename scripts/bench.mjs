// @ts-check
/**
 * `npm run bench`: times the benchmarks of crate/bench natively, and as WebAssembly under Node and in Chromium where there
 * is one, side by side, and prints one JSON document. Progress goes to stderr, so `npm run --silent bench > bench.json` keeps it.
 * `npm run bench -- NAME...` runs those whose name contains one of the words. Names beginning with `run_` are whole runs, on one
 * core and on two; `sizes` lists the sizes of the page and of the engine's parts; `small_gicp` times that library on the same pair of
 * clouds, where it can be installed; kiddo and faer are timed beside our k-d tree and sparse Cholesky. `views` are drags and hovers on
 * the page, and the map of a long log while it is moved and its slider drawn.
 */
import { existsSync, readdirSync } from 'node:fs';
import { cpus, totalmem } from 'node:os';
import { join } from 'node:path';
import { hasSmallGicp, timeSmallGicp } from './bench_peers.mjs';
import { listRuns, timeRuns } from './bench_runs.mjs';
import { buildBench, buildEngine, buildPackage, buildPage } from './engine.mjs';
import { tellOn } from './progress.mjs';
import { engineParts, fileSizes } from './sizes.mjs';
import {
  capture,
  ensureWasmTarget,
  findChromium,
  ROOT,
  readArguments,
  requireToolchain,
  run,
  runMain,
  StepError,
  TARGET_DIR,
} from './steps.mjs';

const WARM_UP_MS = 300;
const SAMPLE_MS = 20;
const SAMPLES = 25;

const NATIVE = join(TARGET_DIR, 'release', 'scanstitch-bench');
const PKG = join(TARGET_DIR, 'bench-pkg');

/** Frames that the stages of depth images are timed on: the last is registered to the others. */
const NUM_FRAMES = 5;

/** Recordings that benchmarks are run on, by the beginning of the benchmark's name; absent ones are skipped with a message. */
const RECORDINGS = [
  { benchmarks: 'reconstruct_files', suffix: '_sample', folder: 'www/samples/corridor', list: plyFiles },
  { benchmarks: 'reconstruct_files', suffix: '_zju10', folder: '../shared/data/laser/zju10', list: plyFiles },
  { benchmarks: 'depth_', suffix: '_sample', folder: 'www/samples/apartment', list: frames },
  {
    benchmarks: 'depth_',
    suffix: '_first_floor',
    folder: '../shared/data/rgbd/apartment_first_floor',
    list: frames,
  },
  { benchmarks: 'color_', suffix: '_sample', folder: 'www/samples/apartment', list: frames },
  {
    benchmarks: 'color_',
    suffix: '_first_floor',
    folder: '../shared/data/rgbd/apartment_first_floor',
    list: frames,
  },
  { benchmarks: 'pair_', suffix: '_kitti', folder: '../shared/data/lidar/kitti_pair', list: plyFiles },
  { benchmarks: 'neighbours_', suffix: '_sample', folder: 'www/samples/corridor', list: plyFiles },
  { benchmarks: 'neighbours_', suffix: '_zju10', folder: '../shared/data/laser/zju10', list: plyFiles },
  { benchmarks: 'neighbours_', suffix: '_kitti', folder: '../shared/data/lidar/kitti_pair', list: plyFiles },
  { benchmarks: 'neighbours_', suffix: '_surfels_sample', folder: 'www/samples/apartment', list: depthImages },
  {
    benchmarks: 'neighbours_',
    suffix: '_surfels_first_floor',
    folder: '../shared/data/rgbd/apartment_first_floor',
    list: depthImages,
  },
];

/** @typedef {{ label: string, name: string, about: string, files: string[] }} Job */
/** @typedef {{ median_ns: number, min_ns: number, max_ns: number, iqr_ns: number, rate?: number }} Timing */

/** @returns {Promise<Job[]>} */
async function listJobs() {
  const { output } = await capture(NATIVE, ['list']);
  return output
    .trim()
    .split('\n')
    .flatMap((line) => {
      const [name = '', about = ''] = line.split('\t');
      const recordings = RECORDINGS.filter(({ benchmarks }) => name.startsWith(benchmarks));
      if (recordings.length === 0) return [{ label: name, name, about, files: [] }];
      return recordings.flatMap(({ suffix, folder, list }) => {
        const [path, label] = [join(ROOT, folder), `${name}${suffix}`];
        if (existsSync(path)) return [{ label, name, about: `${about}: ${folder}`, files: list(path) }];
        console.error(`skipped ${label}: ${folder} is absent`);
        return [];
      });
    });
}

/** @param {string} folder */
function plyFiles(folder) {
  return filesOf(folder, '.ply');
}

/** The first depth and colour images, turn about. @param {string} folder */
function frames(folder) {
  const [depth, color] = ['depth', 'rgb'].map((part) => filesOf(join(folder, part), ''));
  return Array.from({ length: NUM_FRAMES }, (_, index) => [depth?.[index] ?? '', color?.[index] ?? '']).flat();
}

/** The first two depth images. @param {string} folder */
function depthImages(folder) {
  return filesOf(join(folder, 'depth'), '').slice(0, 2);
}

/** @param {string} folder @param {string} suffix */
function filesOf(folder, suffix) {
  const names = readdirSync(folder).filter((name) => name.endsWith(suffix));
  return names.sort(new Intl.Collator('en', { numeric: true }).compare).map((name) => join(folder, name));
}

/**
 * Runs one harness on one benchmark.
 * @param {string} command
 * @param {string[]} args
 * @param {Job} job
 * @returns {Promise<{ timing: Timing, unit: string | undefined }>}
 */
async function time(command, args, job) {
  const policy = [WARM_UP_MS, SAMPLE_MS, SAMPLES].map(String);
  const { code, output } = await capture(command, [...args, job.name, ...policy, ...job.files]);
  const [work = '', samples = ''] = output.trim().split('\n');
  if (code !== 0 || samples === '') throw new StepError(`The benchmark ${job.label} failed:\n${output}`);
  const [amount, unit] = work.split(' ');
  const timing = summary(samples.split(' ').map(Number));
  if (unit === '-' || unit === undefined) return { timing, unit: undefined };
  const per_second = Number(amount) / (timing.median_ns * 1e-9);
  return unit === 'bytes'
    ? { timing: { ...timing, rate: round(per_second / 1e6) }, unit: 'MB/s' }
    : { timing: { ...timing, rate: round(per_second) }, unit: `${unit}/s` };
}

/** @param {number[]} nanoseconds @returns {Timing} */
function summary(nanoseconds) {
  const sorted = nanoseconds.toSorted((a, b) => a - b);
  return {
    median_ns: quantile(sorted, 0.5),
    min_ns: quantile(sorted, 0),
    max_ns: quantile(sorted, 1),
    iqr_ns: Math.round(quantile(sorted, 0.75) - quantile(sorted, 0.25)),
  };
}

/** Linear between the neighbouring samples. @param {number[]} sorted @param {number} share */
function quantile(sorted, share) {
  const place = share * (sorted.length - 1);
  const below = sorted[Math.floor(place)] ?? Number.NaN;
  const above = sorted[Math.ceil(place)] ?? Number.NaN;
  return Math.round(below + (place - Math.floor(place)) * (above - below));
}

/** To four significant digits. @param {number} value */
function round(value) {
  return Number(value.toPrecision(4));
}

async function main() {
  const { positionals: words } = readArguments({ allowPositionals: true }, 'Usage: npm run bench [-- NAME...]');
  // Only the document goes to stdout.
  tellOn(process.stderr);
  requireToolchain();
  await ensureWasmTarget();
  const isWanted = (/** @type {string} */ name) => words.length === 0 || words.some((word) => name.includes(word));
  const isTimed = words.length === 0 || words.some((word) => word !== 'sizes' && word !== 'views');
  if (isTimed) {
    const withPeers = ['--features', 'peers'];
    await run('cargo', ['build', '--release', '--package', 'scanstitch-bench', ...withPeers]);
    await buildBench(PKG, ...withPeers);
  }
  const jobs = isTimed ? (await listJobs()).filter(({ label }) => isWanted(label)) : [];
  const recordings = listRuns(isWanted);
  const withPeer = isWanted('small_gicp') || jobs.some(({ name }) => name.startsWith('pair_'));
  if (jobs.length + recordings.length === 0 && !withPeer && !isWanted('sizes') && !isWanted('views'))
    throw new StepError(`No benchmark has a name with ${words.join(' or ')} in it.`);
  const browser = findChromium();
  if (!browser) console.error('Chromium is absent: timed natively and in Node');
  const benchmarks = [];
  for (const job of jobs) {
    console.error(`${job.label}: ${job.about}`);
    const native = await time(NATIVE, [], job);
    const wasm = await time(process.execPath, [join(ROOT, 'scripts', 'bench_wasm.mjs'), PKG], job);
    const chromium = browser && (await time(process.execPath, [join(ROOT, 'scripts', 'bench_chromium.mjs'), PKG], job));
    const ratio = round(wasm.timing.median_ns / native.timing.median_ns);
    benchmarks.push({
      name: job.label,
      about: job.about,
      ...(native.unit && { rate_unit: native.unit }),
      native: native.timing,
      wasm: wasm.timing,
      ...(chromium && { chromium: chromium.timing }),
      wasm_over_native: ratio,
    });
    const show = (/** @type {Timing} */ timing) => `${(timing.median_ns / 1e6).toFixed(3)} ms`;
    const in_chromium = chromium ? `, Chromium ${show(chromium.timing)}` : '';
    console.error(`  native ${show(native.timing)}, wasm in Node ${show(wasm.timing)}${in_chromium}, ratio ${ratio}`);
  }
  /** @type {{ name: string, peer: Timing }[]} */
  const peers = [];
  if (withPeer && (await hasSmallGicp())) {
    for (const { name, nanoseconds } of await timeSmallGicp({ warm_up_ms: WARM_UP_MS, samples: SAMPLES })) {
      peers.push({ name, peer: summary(nanoseconds) });
      console.error(`${name}: ${(summary(nanoseconds).median_ns / 1e6).toFixed(3)} ms`);
    }
  }
  const runs = [];
  const withSizes = isWanted('sizes');
  const withViews = isWanted('views') && browser;
  if (recordings.length > 0 || withSizes || withViews) {
    await buildEngine('release');
    await buildPackage();
    await buildPage('warn'); // what it tells else goes to stdout
  }
  const sizes = withSizes ? { files: fileSizes(), engine_code: engineParts() } : null;
  for (const recording of recordings) {
    console.error(`${recording.name}: a whole run of ${recording.folder}`);
    runs.push({ ...recording, timings: await timeRuns(recording, browser) });
  }
  let views = null;
  if (withViews) {
    console.error('views: drags and hovers on the page');
    const measured = async (/** @type {string} */ script) => {
      const { output } = await capture(process.execPath, [join(ROOT, 'scripts', script)]);
      return JSON.parse(output.trim().split('\n').at(-1) ?? '');
    };
    views = { ...(await measured('bench_views.mjs')), map: await measured('bench_map.mjs') };
  }
  const { output: rustc } = await capture('rustc', ['--version']);
  const machine = {
    cpu: cpus()[0]?.model.trim() ?? 'unknown',
    cores: cpus().length,
    memory_gib: round(totalmem() / 2 ** 30),
    platform: `${process.platform} ${process.arch}`,
    node: process.version,
    rustc: rustc.trim(),
  };
  const policy = { warm_up_ms: WARM_UP_MS, sample_ms: SAMPLE_MS, samples: SAMPLES, threads: 1 };
  process.stdout.write(`${JSON.stringify({ machine, policy, sizes, benchmarks, peers, runs, views }, null, 2)}\n`);
}

// Only the document goes to stdout: what is told, by Vite too, and what the compilers print goes to stderr.
console.log = console.error;
tellOn(process.stderr);
await runMain(main);
