// @ts-check
/**
 * Whole runs in every browser that is installed, turn about: `node --experimental-websocket scripts/bench_browsers.mjs [REPEATS
 * [NAME]]`. Beside those of the benchmark there are laser scans, a log and bags. Each recording is chosen as a ZIP on the built page, which is not drawn (without a graphics
 * card its emulation would be timed). Prints a table in Markdown: milliseconds a frame, the median, and whether the poses are those
 * of the first browser, to the last bit.
 */
import { existsSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { basename, join } from 'node:path';
import { zipSync } from 'fflate';
import { browsers, serveHost } from '../tests/browsers/browsers.mjs';
import { listRuns } from './bench_runs.mjs';
import { ROOT } from './steps.mjs';

const repeats = Number(process.argv[2] ?? 3);
const wanted = process.argv[3] ?? '';
const LASER = '../shared/data/laser';
const MORE = [
  { name: 'ten_scans', folder: `${LASER}/zju10` },
  { name: 'infinite_corridor', folder: `${LASER}/radish/infinite-corridor.log` },
  { name: 'scan_bag', folder: `${LASER}/ros2_scan_bag` },
  { name: 'depth_bag', folder: '../shared/data/bags/derived_depth_pointcloud/depth_16UC1_db3' },
];
const isWanted = (/** @type {string} */ name) => name.includes(wanted);
const recordings = [
  ...listRuns(isWanted),
  ...MORE.filter(({ name, folder }) => isWanted(name) && existsSync(join(ROOT, folder))),
];
const { url, close } = await serveHost(
  Object.fromEntries(recordings.map(({ name, folder }) => [`/${name}.zip`, zipOf(join(ROOT, folder))])),
);

/** @param {string} folder or a single file */
function zipOf(folder) {
  if (statSync(folder).isFile()) {
    return zipSync({ [basename(folder)]: new Uint8Array(readFileSync(folder)) }, { level: 0 });
  }
  const files = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
  const named = files.map(({ parentPath, name }) => {
    const path = join(parentPath, name);
    return [`recording${path.slice(folder.length)}`, new Uint8Array(readFileSync(path))];
  });
  return zipSync(Object.fromEntries(named), { level: 0 });
}

/** @type {Map<string, { version: string, times: number[], frames: number, poses: string }>} */
const found = new Map();
for (let repeat = 0; repeat < repeats; repeat++) {
  for (const { name: browser, start } of browsers) {
    if (start === null) continue;
    const driver = await start();
    try {
      await driver.goto(url);
      await driver.evaluate(`scenarios.sample()`);
      for (const { name } of recordings) {
        const { elapsed_ms, status, poses } = await driver.evaluate(`timed('/${name}.zip')`);
        const key = `${browser} ${name}`;
        const frames = status.split(' ').length;
        const known = found.get(key) ?? { version: driver.version, times: /** @type {number[]} */ ([]), frames, poses };
        known.times.push(elapsed_ms / frames);
        found.set(key, known);
        console.error(`${driver.version}, ${name}: ${(elapsed_ms / frames).toFixed(1)} ms a frame`);
      }
    } finally {
      await driver.close();
    }
  }
}
close();
const shown = browsers.filter(({ start }) => start !== null).map(({ name }) => name);
console.log(`| | ${shown.join(' | ')} |\n|---|${shown.map(() => '---:').join('|')}|`);
for (const { name } of recordings) {
  const [first] = shown.map((browser) => found.get(`${browser} ${name}`)?.poses);
  const cells = shown.map((browser) => {
    const { times = [], poses } = found.get(`${browser} ${name}`) ?? {};
    const median = times.toSorted((a, b) => a - b)[times.length >> 1] ?? Number.NaN;
    return `${median.toPrecision(3)}${poses === first ? '' : ' (other poses)'}`;
  });
  console.log(`| ${name} | ${cells.join(' | ')} |`);
}
