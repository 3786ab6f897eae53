// @ts-check
/**
 * The pictures of the README, of the built page with its two samples: `npm run build && node scripts/pictures.mjs`
 * writes docs/page.png and docs/page_depth.jpg.
 */
import { join } from 'node:path';
import { chromium } from '@playwright/test';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium, ROOT } from './steps.mjs';

const SIZE = { width: 1440, height: 900 };
/** Of a view in space, that has its flight to finish and its images to decode. */
const SETTLING_MS = 2000;
const PATIENCE_MS = 180_000;

/** @param {import('@playwright/test').Page} page */
function stitched(page) {
  return page.evaluate(() => new Promise((resolve) => addEventListener('scanstitch-done', resolve, { once: true })));
}

const server = await serve(join(ROOT, 'www', 'dist'));
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({
  executablePath: findChromium() ?? 'chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader'],
});
try {
  const page = await browser.newPage({ viewport: SIZE, colorScheme: 'light', reducedMotion: 'reduce' });
  // Without a graphics card a picture in space takes long.
  page.setDefaultTimeout(PATIENCE_MS);
  await page.addInitScript(() => {
    const stitched = new Promise((resolve) => addEventListener('scanstitch-done', resolve, { once: true }));
    Object.assign(window, { stitched });
  });
  await page.goto(`http://localhost:${address.port}/`);
  await page.evaluate(() => /** @type {{ stitched: Promise<unknown> }} */ (/** @type {unknown} */ (window)).stitched);
  await page.getByRole('region', { name: 'About' }).getByRole('button', { name: 'Close' }).click();
  await page.screenshot({ path: join(ROOT, 'docs', 'page.png') });

  await page.getByRole('button', { name: 'Open' }).click();
  const done = stitched(page);
  await page.getByRole('menuitem', { name: /^An apartment/ }).click();
  await done;
  const map = page.locator('scanstitch-map3d').getByRole('group', { name: 'Map' });
  await map.focus();
  // From above, tilted and turned a little, so that the walls are seen to stand.
  for (const key of [...Array(3).fill('ArrowDown'), ...Array(2).fill('ArrowRight')]) await page.keyboard.press(key);
  await page.keyboard.press('f');
  await map.blur();
  await page.waitForTimeout(SETTLING_MS);
  await page.screenshot({ path: join(ROOT, 'docs', 'page_depth.jpg'), quality: 85 });
} finally {
  await browser.close();
  server.close();
}
