// @ts-check
/**
 * What a user does with the built page, in every browser that is installed: `node --experimental-websocket tests/browsers/run.mjs`. What Firefox and
 * WebKit find has to be what Chromium finds, poses to the last bit, but for the rounding that a browser states. Prints a line for each scenario and
 * browser, with its time.
 */
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { zipSync } from 'fflate';
import { mcapBytes } from '../cli/bag_files.mjs';
import { laserScan } from '../cli/bag_messages.mjs';
import { browsers, serveHost } from './browsers.mjs';

const SCENARIOS = ['sample', 'ten scans', 'export', 'depth images in a ZIP', 'a bag of laser scans', 'ICP lab'];
const SAMPLES = join(import.meta.dirname, '../../www/samples');
const NUM_IMAGES = 8;

/** The first depth and colour images of the second sample. */
function depthZip() {
  const files = ['depth', 'rgb'].flatMap((folder) =>
    readdirSync(join(SAMPLES, 'apartment', folder), { withFileTypes: true })
      .filter((entry) => entry.isFile() && Number.parseInt(entry.name, 10) <= NUM_IMAGES)
      .map(({ name }) => [`room/${folder}/${name}`, readFileSync(join(SAMPLES, 'apartment', folder, name))]),
  );
  return zipSync(Object.fromEntries(files), { level: 0 });
}

/** The scans of the first sample, by their addresses. */
function scans() {
  const names = readdirSync(join(SAMPLES, 'corridor')).filter((name) => name.endsWith('.ply'));
  return Object.fromEntries(names.map((name) => [`/${name}`, readFileSync(join(SAMPLES, 'corridor', name))]));
}

/** A laser that drives through a room of 8 m by 5 m with a box in it. */
function scansBag() {
  const [num_beams, increment] = [181, Math.PI / 180];
  const messages = Array.from({ length: 6 }, (_, i) => {
    const stamp = { sec: 10 + i, nsec: 0 };
    const ranges = Array.from({ length: num_beams }, (_, k) =>
      rangeAt(0.25 * i - 1, 0.1 * i, k * increment - Math.PI / 2),
    );
    const data = laserScan(stamp, -Math.PI / 2, increment, [0.1, 30], ranges);
    return { topic: '/scan', time: BigInt(stamp.sec) * 1_000_000_000n, data };
  });
  return mcapBytes([{ name: '/scan', type: 'sensor_msgs/msg/LaserScan' }], messages);
}

/** @param {number} x @param {number} y @param {number} angle rad */
function rangeAt(x, y, angle) {
  const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
  const walls = [(4 - x) / dx, (-4 - x) / dx, (2.5 - y) / dy, (-2.5 - y) / dy];
  // The box's near side, from y = 0.5 on.
  const box = (2.5 - x) / dx;
  if (box > 0 && y + box * dy > 0.5 && y + box * dy < 1.5) walls.push(box);
  return Math.min(...walls.filter((range) => range > 0));
}

const files = {
  '/depth.zip': depthZip(),
  '/scans.mcap': scansBag(),
  ...scans(),
};
const { url, close } = await serveHost(files);

const counts = { pass: 0, fail: 0, skipped: 0 };
/** @param {keyof typeof counts} outcome @param {string} what */
function tell(outcome, what) {
  counts[outcome]++;
  console.log(`${{ pass: '✔', fail: '✖', skipped: '﹣' }[outcome]} ${what}`);
}

/**
 * The largest difference of two numbers at one place; infinite where anything else differs.
 * @param {unknown} a @param {unknown} b @returns {number}
 */
function difference(a, b) {
  if (typeof a === 'number' && typeof b === 'number') return Math.abs(a - b);
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return a === b ? 0 : Infinity;
  const [left, right] = [Object.entries(a), new Map(Object.entries(b))];
  if (left.length !== right.size) return Infinity;
  return Math.max(0, ...left.map(([key, value]) => (right.has(key) ? difference(value, right.get(key)) : Infinity)));
}

/** What Chromium saw. @type {Map<string, unknown>} */
const expected = new Map();
for (const { name, start } of browsers) {
  if (start === null) {
    for (const scenario of SCENARIOS) tell('skipped', `${name}: ${scenario} # not installed`);
    continue;
  }
  const driver = await start();
  try {
    await driver.goto(url);
    const lacks = Object.entries(await driver.evaluate('lacks()')).filter(([, is_lacking]) => is_lacking);
    console.log(`# ${driver.version}${lacks.map(([what]) => `, without ${what}`).join('')}`);
    for (const scenario of SCENARIOS) {
      try {
        const { ms, seen, faults } = await driver.evaluate(`look(${JSON.stringify(scenario)})`);
        if (!expected.has(scenario)) expected.set(scenario, seen);
        const off = difference(seen, expected.get(scenario));
        const is_same = off <= driver.rounding;
        if (is_same && off > 0) console.log(`# ${driver.version} rounds otherwise, by ${off}`);
        const other = `saw ${JSON.stringify(seen).slice(0, 300)}`;
        const problems = [...faults, ...driver.faults.splice(0), ...(is_same ? [] : [other])];
        const words = problems.length > 0 ? `: ${problems.join('; ')}` : ms > 0 ? ` (${ms} ms)` : '';
        tell(problems.length > 0 ? 'fail' : 'pass', `${name}: ${scenario}${words}`);
      } catch (error) {
        tell('fail', `${name}: ${scenario}: ${/** @type {Error} */ (error).message}`);
      }
    }
  } finally {
    await driver.close();
  }
}
close();
for (const [word, count] of Object.entries(counts)) console.log(`ℹ ${word} ${count}`);
process.exitCode = counts.fail > 0 ? 1 : 0;
