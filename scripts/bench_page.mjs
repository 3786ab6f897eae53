// @ts-check
/**
 * Chooses a folder on the built page, in a fresh tab of Chromium and in the time that a person takes, and prints, as JSON,
 * the number of registered frames, the time from the choice to the last one, their mean error against the ground truth, and
 * the time that frames took to register: the mean, the first and the worst.
 * `node bench_page.mjs FOLDER`
 */
import { chromium } from '@playwright/test';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium } from './steps.mjs';

/** Time that a browser needs to settle after its start. */
const SETTLING_MS = 3000;
/** Time that a person needs to choose a folder in the system's dialog, at least. */
const CHOOSING_MS = 3000;

const [folder = ''] = process.argv.slice(2);
const server = await serve('www/dist');
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({
  executablePath: findChromium() ?? 'chromium',
  args: ['--no-sandbox', '--disable-gpu', '--disable-3d-apis'],
});
try {
  const page = await browser.newPage();
  /** @typedef {{ result: { frames: unknown[], comparison?: { mean: number } | null }, elapsed_ms: number }} Stitched */
  await page.addInitScript(() => {
    const stitched = /** @type {Stitched[]} */ ([]);
    const registering = /** @type {number[]} */ ([]);
    Object.assign(window, { stitched, registering });
    window.Worker = class extends Worker {
      /** @param {ConstructorParameters<typeof Worker>} args */
      constructor(...args) {
        super(...args);
        this.addEventListener('message', ({ data }) => {
          if (data?.value && typeof data.value === 'object' && 'ms' in data.value) registering.push(data.value.ms);
        });
      }
    };
    addEventListener('scanstitch-done', (event) => stitched.push(/** @type {CustomEvent} */ (event).detail));
  });
  // The page notifies: polling sixty times a second would cost it a seventh of its time.
  const count = (/** @type {number} */ least) =>
    page.evaluate(
      (least) =>
        /** @type {Promise<void>} */ (
          new Promise((resolve) => {
            const { stitched } = /** @type {{ stitched: Stitched[] }} */ (/** @type {unknown} */ (window));
            const look = () => (stitched.length >= least ? resolve() : undefined);
            addEventListener('scanstitch-done', look);
            look();
          })
        ),
      least,
    );
  await page.goto(`http://localhost:${address.port}/`);
  await count(1); // the sample that the page opens with
  await page.waitForTimeout(SETTLING_MS);
  await page.getByRole('button', { name: 'Open' }).click();
  const asked = page.waitForEvent('filechooser');
  await page.getByRole('menuitem', { name: 'Folder' }).click();
  const dialogue = await asked;
  await page.waitForTimeout(CHOOSING_MS);
  const num_before = await page.evaluate(() => {
    const { registering } = /** @type {{ registering: number[] }} */ (/** @type {unknown} */ (window));
    return registering.length; // of frames of the sample
  });
  await dialogue.setFiles(folder);
  await count(2);
  const found = await page.evaluate((num_before) => {
    const { stitched, registering } = /** @type {{ stitched: Stitched[], registering: number[] }} */ (
      /** @type {unknown} */ (window)
    );
    const times = registering.slice(num_before);
    const mean = times.reduce((sum, ms) => sum + ms, 0) / times.length;
    const last = /** @type {Stitched} */ (stitched.at(-1));
    const { frames, comparison } = last.result;
    return {
      frames: frames.length,
      milliseconds: last.elapsed_ms,
      mean_error: comparison?.mean ?? null,
      registering_ms: { mean, first: times[0] ?? NaN, worst: Math.max(...times) },
    };
  }, num_before);
  console.log(JSON.stringify(found));
} finally {
  await browser.close();
  server.close();
}
