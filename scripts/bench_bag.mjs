// @ts-check
/**
 * Opens a large bag in Chromium and measures: `node scripts/bench_bag.mjs [--format mcap|db3] [--gigabytes 2] [--bag FILE]
 * [--seconds N]`.
 * With `--bag` that file is used, or written and kept where it is absent; `--seconds` ends the run after that time.
 * The bag (large_bag.mjs) is written into a temporary folder first. Then the built page (npm run build) opens it, and these
 * are printed as JSON: milliseconds to the list of topics and to the first map, seconds of the whole run, frames placed,
 * and the most memory that the tab's process had (megabytes resident, all its workers in it, as /proc tells; looked at
 * ten times a second).
 */
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { chromium } from '@playwright/test';
import { writeLargeBag } from './large_bag.mjs';
import { findChromium, ROOT } from './steps.mjs';

const PORT = 4399;
const POLL_MS = 100;
const { values } = parseArgs({
  options: {
    format: { type: 'string', default: 'mcap' },
    gigabytes: { type: 'string', default: '2' },
    bag: { type: 'string' },
    seconds: { type: 'string', default: 'Infinity' },
  },
});

/** Most memory the process ever had, and has now (MB). @param {number} id */
function memoryOf(id) {
  const status = readFileSync(`/proc/${id}/status`, 'utf8');
  const megabytes = (/** @type {string} */ name) =>
    Number(status.match(new RegExp(`${name}:\\s+(\\d+) kB`))?.[1]) / 1024;
  return { peak: megabytes('VmHWM'), now: megabytes('VmRSS') };
}

const folder = mkdtempSync(join(tmpdir(), 'scanstitch-bag-'));
const server = spawn(
  process.execPath,
  [join(ROOT, 'tests/e2e/static_server.mjs'), join(ROOT, 'www/dist'), String(PORT)],
  {
    stdio: 'ignore',
  },
);
const browser = await chromium.launch({
  executablePath: findChromium() ?? 'chromium',
  args: ['--no-sandbox', '--disable-gpu'],
});
try {
  const path = values.bag ?? join(folder, `large.${values.format}`);
  if (!existsSync(path)) writeLargeBag(path, Number(values.gigabytes), values.format);
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  await page.goto(`http://localhost:${PORT}/`);
  await page.getByRole('group', { name: 'Map' }).waitFor();
  await page.evaluate(() => {
    const times = /** @type {any} */ (window);
    times.stitched = [];
    document.addEventListener('scanstitch-done', (event) =>
      times.stitched.push(/** @type {CustomEvent} */ (event).detail),
    );
  });
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  const renderers = processInfo.filter(({ type }) => type === 'renderer').map(({ id }) => id);
  const before = Math.max(...renderers.map((id) => memoryOf(id).now));
  const start = performance.now();
  await page.locator('#pick-files').setInputFiles(path);
  await page
    .locator('scanstitch-topics')
    .getByText(/\d+ topics/)
    .waitFor();
  const topicsMs = performance.now() - start;
  await page.locator('scanstitch-map3d canvas').waitFor({ timeout: 120_000 });
  const mapMs = performance.now() - start;
  const result = () =>
    page.evaluate(() => {
      const { stitched } = /** @type {any} */ (window);
      // The sample may have been stitched meanwhile.
      const detail = stitched.find((/** @type {any} */ { result }) => /^depth\//.test(result.frames[0]?.name));
      if (!detail) return null;
      const { frames, comparison } = detail.result;
      const good = frames.filter((/** @type {{ status: string }} */ { status }) => status === 'good').length;
      return { frames: frames.length, good, mean_error: comparison?.mean ?? null };
    });
  const log = [];
  // What the kernel says was the most lags behind what can be seen.
  let most = before;
  let done = await result();
  for (; !done && performance.now() - start < 1000 * Number(values.seconds); done = await result()) {
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    const memory = Math.max(...renderers.map((id) => memoryOf(id).now));
    most = Math.max(most, memory);
    if (log.length * 10_000 < performance.now() - start) {
      log.push(Math.round(memory));
      const line = await page
        .getByRole('progressbar')
        .first()
        .getAttribute('aria-valuetext')
        .catch(() => '');
      process.stderr.write(
        `${Math.round((performance.now() - start) / 1000)} s, ${Math.round(memory)} MB ${line ?? ''}\n`,
      );
    }
  }
  const seconds = (performance.now() - start) / 1000;
  const peak = Math.max(most, ...renderers.map((id) => memoryOf(id).peak));
  console.log(
    JSON.stringify({
      bag: { format: values.format, bytes: statSync(path).size },
      topics_ms: Math.round(topicsMs),
      map_ms: Math.round(mapMs),
      run_s: Number(seconds.toFixed(1)),
      ...done,
      memory_mb: { before: Math.round(before), every_10_s: log, peak: Math.round(peak) },
    }),
  );
} finally {
  await browser.close();
  server.kill();
  rmSync(folder, { recursive: true });
}
