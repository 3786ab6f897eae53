// @ts-check
/**
 * Opens a laser log, with what lies beside it, on the built page (npm run build) in a fresh tab of Chromium and measures:
 * `node scripts/bench_log.mjs FILE... [--settings odometry=none]`.
 * Printed as JSON: frames and their assessment, seconds from the choice of the files to the finished map on the screen, the
 * processor time of the tab's process in that time, milliseconds a scan over the first thousand and the last thousand scans,
 * and the most memory that the process had above what it had with the sample open (megabytes resident, all its workers in
 * it, as /proc tells; looked at ten times a second).
 */
import { readFileSync } from 'node:fs';
import { parseArgs } from 'node:util';
import { chromium } from '@playwright/test';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium } from './steps.mjs';

/** Time that a browser needs to settle after its start. */
const SETTLING_MS = 2000;
const POLL_MS = 100;
const TICKS_PER_SECOND = 100;
const LIMIT_MS = 300_000;
/** Number of scans over which times are averaged. */
const STRETCH = 1000;

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { settings: { type: 'string', default: '' } },
});
const server = await serve('www/dist');
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({
  executablePath: findChromium() ?? 'chromium',
  args: ['--no-sandbox', '--disable-gpu'],
});

/** Memory (MB) and processor time (s) of a process. @param {number} id */
function usage(id) {
  const status = readFileSync(`/proc/${id}/status`, 'utf8');
  const kilobytes = (/** @type {string} */ name) => Number(status.match(new RegExp(`${name}:\\s+(\\d+) kB`))?.[1]);
  // proc(5): the fields after the name in brackets begin with the third; the 14th and 15th are its processor time.
  const fields = readFileSync(`/proc/${id}/stat`, 'utf8').split(') ').at(-1)?.split(' ') ?? [];
  return {
    now: kilobytes('VmRSS') / 1024,
    peak: kilobytes('VmHWM') / 1024,
    cpu: (Number(fields[11]) + Number(fields[12])) / TICKS_PER_SECOND,
  };
}

/** @param {readonly number[]} numbers */
const mean = (numbers) => numbers.reduce((sum, value) => sum + value, 0) / Math.max(numbers.length, 1);
/** @param {number} value */
const rounded = (value) => Number(value.toFixed(2));

try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  await page.addInitScript(() => {
    Object.assign(window, { stitched: [] });
    addEventListener('scanstitch-done', (event) =>
      /** @type {any} */ (window).stitched.push(/** @type {CustomEvent} */ (event).detail),
    );
  });
  const fragment = values.settings === '' ? '' : `#${values.settings}`;
  await page.goto(`http://localhost:${address.port}/${fragment}`);
  const numStitched = () => page.evaluate(() => /** @type {any} */ (window).stitched.length);
  while ((await numStitched()) === 0) await page.waitForTimeout(POLL_MS);
  await page.waitForTimeout(SETTLING_MS);

  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  const renderers = processInfo.filter(({ type }) => type === 'renderer').map(({ id }) => id);
  const tab = renderers.reduce((a, b) => (usage(a).now > usage(b).now ? a : b));
  const before = usage(tab);
  const started = performance.now();
  await page.locator('#pick-files').setInputFiles(positionals);
  let most = before.now;
  while ((await numStitched()) < 2 && performance.now() - started < LIMIT_MS) {
    most = Math.max(most, usage(tab).now);
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
  const after = usage(tab);
  const found = await page.evaluate(() => {
    const { result, timing, elapsed_ms } = /** @type {any} */ (window).stitched.at(-1);
    const count = (/** @type {string} */ wanted) =>
      result.frames.filter((/** @type {{ status: string }} */ { status }) => status === wanted).length;
    const pieces = new Set(result.frames.map((/** @type {{ piece: number }} */ { piece }) => piece)).size;
    return {
      frames: result.frames.length,
      assessment: { good: count('good'), doubtful: count('doubtful'), lost: count('lost'), pieces },
      elapsed_s: elapsed_ms / 1000,
      timing,
    };
  });
  const { frames, joint, load, total } = found.timing;
  console.log(
    JSON.stringify({
      frames: found.frames,
      ...found.assessment,
      elapsed_s: rounded(found.elapsed_s),
      processor_s: rounded(after.cpu - before.cpu),
      engine_s: { all: rounded(total / 1000), load: rounded(load / 1000), loops_and_joint: rounded(joint / 1000) },
      ms_a_scan: { first: rounded(mean(frames.slice(0, STRETCH))), last: rounded(mean(frames.slice(-STRETCH))) },
      memory_mb: {
        before: Math.round(before.now),
        peak: Math.round(Math.max(most, after.peak)),
        after: Math.round(after.now),
      },
    }),
  );
} finally {
  await browser.close();
  server.close();
}
