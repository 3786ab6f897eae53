// @ts-check
/**
 * Opens two clouds in the ICP lab of the built page (npm run build) in Chromium and measures its response times:
 * `node scripts/bench_lab.mjs SOURCE TARGET [--drag] [--shots FOLDER]`;  with `--drag` only those of dragging, in space
 * without the drawing itself, which takes a second a picture where graphics are emulated.
 * Printed as JSON, times in milliseconds: the run with its trace; the pairs of a pose that is dragged to, computed in the
 * worker (median and the second worst of 20 poses) and painted; a landscape and a basin, on one core as the lab's second worker
 * is not used; and the basin's first coarse picture. In the plane the landscape has 201 x 201 poses and the basin 41 x 41 x 9
 * starts, in space 25 x 25 and 9 x 9: the page itself begins with these, and goes on as far as a few seconds allow.
 * With `--shots` each tab of the lab is kept as a picture, light on a desktop and dark on a phone.
 */
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { chromium } from '@playwright/test';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium } from './steps.mjs';

const PHONE = { width: 390, height: 844 };

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { shots: { type: 'string' }, drag: { type: 'boolean', default: false } },
});
const server = await serve('www/dist');
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({
  executablePath: findChromium() ?? 'chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader'],
});

/** The lab with both files open. @param {{ width: number, height: number }} viewport @param {'light' | 'dark'} colorScheme */
async function openLab(viewport, colorScheme) {
  const page = await browser.newPage({ viewport, colorScheme });
  if (values.drag) {
    await page.addInitScript(() => {
      for (const name of /** @type {const} */ (['drawArrays', 'drawElements'])) {
        WebGL2RenderingContext.prototype[name] = () => undefined;
      }
    });
  }
  // @ts-expect-error: a number, as checked above
  await page.goto(`http://localhost:${address.port}/#icp`);
  const lab = page.locator('scanstitch-lab');
  await lab.waitFor({ state: 'attached' });
  await lab.locator('input[type=file]').setInputFiles(positionals);
  await page.waitForFunction(
    () => {
      const app = document.querySelector('scanstitch-app');
      const lab = /** @type {any} */ (app?.shadowRoot?.querySelector('scanstitch-lab'));
      return lab?.session.trace && lab.session.given.clouds.length === 2;
    },
    undefined,
    { timeout: 60_000 },
  );
  return page;
}

/** @param {import('@playwright/test').Page} page */
function measure(page) {
  return page.evaluate(async (drags_only) => {
    const lab = /** @type {any} */ (
      document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-lab')
    );
    const { session } = lab;
    const { client, active, trace, facts } = session;
    const now = () => performance.now();
    const end = Array.from(trace.poses.slice(-16));
    const sorted = (/** @type {number[]} */ times) => times.sort((a, b) => a - b);

    // As the page samples large clouds while they follow the hand.
    const stride = Math.max(1, Math.ceil(facts.source_points.length / 3 / 8000));
    const [pairs, paints] = [/** @type {number[]} */ ([]), /** @type {number[]} */ ([])];
    const stage = lab.shadowRoot.querySelector('scanstitch-lab-plane, scanstitch-lab-space');
    for (let i = 0; i < 20; i++) {
      const T = [...end];
      T[3] += 0.3 * Math.sin(i / 5);
      T[7] += 0.3 * Math.cos(i / 5);
      const asked = now();
      session.iteration = await client.ask('iteration', active, T, stride);
      pairs.push(now() - asked);
      session.pose = T;
      stage.scene = lab.sceneOf(facts);
      const painted = now();
      stage.paint();
      paints.push(now() - painted);
    }

    // The same clouds from another side: what orbiting costs the page's thread.
    const frames = /** @type {number[]} */ ([]);
    for (let i = 0; i < 20; i++) {
      const begin = now();
      stage.turn?.(3, 1);
      stage.paint();
      frames.push(now() - begin);
    }
    const tenth = (/** @type {number} */ value) => Number(value.toFixed(1));
    const hand = {
      points: [facts.source_points.length / 3, facts.target_points.length / 3],
      iterations: trace.records.length,
      trace: tenth(trace.milliseconds),
      sampled: Math.ceil(facts.source_points.length / 3 / stride),
      pairs: { median: tenth(sorted(pairs)[10] ?? 0), worst_of_20: tenth(pairs[18] ?? 0) },
      paint: { median: tenth(sorted(paints)[10] ?? 0), worst_of_20: tenth(paints[18] ?? 0) },
      orbit: { median: tenth(sorted(frames)[10] ?? 0), worst_of_20: tenth(frames[18] ?? 0) },
    };
    if (drags_only) return hand;

    const grid = (/** @type {number[]} */ axes, /** @type {number[]} */ size) => ({
      T_center: end,
      axes,
      half_widths: axes.map((axis) => (facts.is_planar && axis === 2 ? Math.PI / 4 : 1)),
      size,
    });
    const timed = async (/** @type {() => Promise<unknown>} */ work) => {
      const begin = now();
      await work();
      return now() - begin;
    };
    const seat = async (/** @type {'landscape' | 'basin'} */ question, /** @type {any} */ of) => {
      const rows = of.size.slice(1).reduce((/** @type {number} */ product, /** @type {number} */ n) => product * n, 1);
      return timed(() =>
        client.share(active, question, [{ ...of, rows: [0, rows] }], () => undefined, new AbortController().signal),
      );
    };
    await client.prepareWorkers(active);
    const landscape = grid([0, 1], facts.is_planar ? [201, 201] : [25, 25]);
    const basin = facts.is_planar ? grid([0, 1, 2], [41, 41, 9]) : grid([0, 1], [9, 9]);
    const coarse = facts.is_planar ? grid([0, 1, 2], [9, 9, 3]) : grid([0, 1], [5, 5]);
    return {
      ...hand,
      landscape: tenth(await seat('landscape', landscape)),
      basin_coarse: tenth(await seat('basin', coarse)),
      basin: tenth(await seat('basin', basin)),
    };
  }, values.drag);
}

/** @param {import('@playwright/test').Page} page @param {string} folder @param {string} name */
async function keepPictures(page, folder, name) {
  mkdirSync(folder, { recursive: true });
  for (const tab of await page.locator('scanstitch-lab').getByRole('tab').allInnerTexts()) {
    await page.locator('scanstitch-lab').getByRole('tab', { name: tab }).click();
    await page.waitForTimeout(tab === 'Step' ? 500 : 4000);
    await page.screenshot({
      path: join(folder, `${name}-${tab.trim().toLowerCase().replaceAll(' ', '_')}.png`),
      fullPage: true,
    });
  }
}

try {
  // Graphics are emulated where there is no card: a small picture leaves the processor to what is measured.
  const page = await openLab(values.drag ? { width: 640, height: 480 } : { width: 1280, height: 800 }, 'light');
  console.log(JSON.stringify(await measure(page), null, 1));
  if (values.shots !== undefined) {
    await keepPictures(page, values.shots, 'desktop');
    await keepPictures(await openLab(PHONE, 'dark'), values.shots, 'phone');
  }
} finally {
  await browser.close();
  server.close();
}
