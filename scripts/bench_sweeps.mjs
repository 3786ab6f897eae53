// @ts-check
/**
 * Processor time of the engine a sweep, in Node or, with `--chromium`, in a page: `node scripts/bench_sweeps.mjs DIR/timing [--first 20]
 * [--times] [--engine DIR] [--chromium]`, of sweeps that `cargo measure lidar_sweeps --time --sweeps 60 --write DIR` writes (x y z t as
 * 64-bit floats), as PCD files in memory. `--times` gives the points' times, too. kiss-icp on the same sweeps:
 * `python scripts/bench_kiss_icp.py DIR --time timing`.
 */
import { readdirSync, readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { chromium } from '@playwright/test';
import { findChromium, ROOT } from './steps.mjs';
import { timeSweeps } from './sweep_timings.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    first: { type: 'string', default: '20' },
    times: { type: 'boolean', default: false },
    engine: { type: 'string', default: join(ROOT, 'pkg') },
    chromium: { type: 'boolean', default: false },
  },
});
const folder = positionals[0] ?? '';
const engine = resolve(values.engine);
const names = readdirSync(folder)
  .filter((name) => name.endsWith('.bin'))
  .sort();
/** @type {[number, number]} */
const counts = [Number(values.first), names.length];

/** A sweep as a PCD file. @param {number} number */
function pcd(number) {
  const bytes = readFileSync(join(folder, names[number] ?? ''));
  const numbers = new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8);
  const [count, width] = [numbers.length / 4, values.times ? 4 : 3];
  const kept = new Float32Array(count * width);
  for (let index = 0; index < kept.length; index++)
    kept[index] = numbers[4 * Math.floor(index / width) + (index % width)] ?? NaN;
  const each = (/** @type {string} */ word) => ` ${word}`.repeat(width);
  const header = `VERSION 0.7\nFIELDS x y z${values.times ? ' time' : ''}\nSIZE${each('4')}\nTYPE${each('F')}\nCOUNT${each('1')}\nWIDTH ${count}\nHEIGHT 1\nPOINTS ${count}\nDATA binary\n`;
  return new Uint8Array(Buffer.concat([Buffer.from(header), Buffer.from(kept.buffer)]));
}

async function inNode() {
  const module = await import(pathToFileURL(join(engine, 'scanstitch.js')).href);
  module.initSync({ module: readFileSync(join(engine, 'scanstitch_bg.wasm')) });
  const processorTime = async () => {
    const { user, system } = process.cpuUsage();
    return (user + system) / 1000;
  };
  return timeSweeps(module, async (number) => pcd(number), counts, processorTime);
}

/** Of the page's process, with the threads that compile the engine. */
async function inChromium() {
  const ORIGIN = 'http://bench.invalid'; // answered here, never looked up
  const browser = await chromium.launch({ executablePath: findChromium() ?? 'chromium', args: ['--no-sandbox'] });
  try {
    const page = await browser.newPage();
    const session = await page.context().newCDPSession(page);
    await session.send('Performance.enable');
    await page.exposeFunction('processorTime', async () => {
      const { metrics } = await session.send('Performance.getMetrics');
      return 1000 * (metrics.find(({ name }) => name === 'ProcessTime')?.value ?? NaN);
    });
    const files = new Map([
      ['/scanstitch.js', join(engine, 'scanstitch.js')],
      ['/scanstitch_bg.wasm', join(engine, 'scanstitch_bg.wasm')],
      ['/sweep_timings.mjs', join(import.meta.dirname, 'sweep_timings.mjs')],
    ]);
    await page.route(`${ORIGIN}/**`, (route) => {
      const { pathname } = new URL(route.request().url());
      const [, number] = /^\/sweep\/(\d+)$/.exec(pathname) ?? [];
      const file = files.get(pathname);
      const contentType = pathname.endsWith('.wasm') ? 'application/wasm' : 'text/javascript';
      if (file) return route.fulfill({ contentType, body: readFileSync(file) });
      if (number)
        return route.fulfill({ contentType: 'application/octet-stream', body: Buffer.from(pcd(Number(number))) });
      return route.fulfill({ contentType: 'text/html', body: '<!doctype html>' });
    });
    await page.goto(`${ORIGIN}/`);
    return await page.evaluate(async (counts) => {
      const [engine, { timeSweeps }] = await Promise.all(
        ['/scanstitch.js', '/sweep_timings.mjs'].map((address) => import(address)),
      );
      await engine.default({ module_or_path: fetch('/scanstitch_bg.wasm') });
      const fileOf = async (/** @type {number} */ number) => {
        const response = await fetch(`/sweep/${number}`);
        return new Uint8Array(await response.arrayBuffer());
      };
      const { processorTime } = /** @type {any} */ (window);
      return /** @type {Promise<string[]>} */ (timeSweeps(engine, fileOf, counts, processorTime));
    }, counts);
  } finally {
    await browser.close();
  }
}

console.log((await (values.chromium ? inChromium() : inNode())).join('\n'));
