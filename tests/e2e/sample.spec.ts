import { expect, sampleScans, ScanstitchPage, test } from './scanstitch_page.js';

test('the page opens with the sample stitched, and says how far it is from the truth', async ({ page }) => {
  const app = new ScanstitchPage(page);
  const { result, timing } = await app.open();
  expect(result.frames.map(({ status }) => status)).toEqual(Array(10).fill('good'));
  expect(result.comparison?.name).toContain('truth.tum');
  expect(result.comparison?.num_matched).toBe(10);
  expect(result.comparison?.mean).toBeLessThan(0.015);
  expect(timing.frames).toHaveLength(10);
  expect(timing.total).toBeGreaterThan(0);

  const figures = page.getByLabel('Result in figures');
  await expect(figures).toContainText('Sharpness');
  await expect(figures).toContainText('Distance to truth.tum');
  expect(await app.scanNames()).toEqual(Array.from({ length: 10 }, (_, i) => `${i}.ply`));
  expect(await app.numPainted()).toBeGreaterThan(1000);
  await expect(app.messages).toBeHidden();
  await expect(page.getByRole('status')).toContainText('10 scans stitched');
  expect(app.faults).toEqual([]);
});

test('nothing is asked of any other host', async ({ page, baseURL }) => {
  const app = new ScanstitchPage(page);
  const foreign: string[] = [];
  page.on('request', (request) => {
    const url = new URL(request.url());
    if (url.protocol.startsWith('http') && url.origin !== new URL(baseURL ?? '').origin) foreign.push(request.url());
  });
  await app.open();
  await page.evaluate(() => fetch('http://example.invalid/').catch(() => 'blocked'));
  expect(foreign.filter((url) => !url.startsWith('http://example.invalid/'))).toEqual([]);
});

test('one scan after the other can be looked at, left out, and the sample comes back', async ({ app, page }) => {
  await app.row('4.ply').click();
  await expect(app.why).toContainText('4.ply');
  await page.getByRole('button', { name: 'Leave this scan out' }).click();
  const { result } = await app.stitched();
  expect(result.frames.map(({ name }) => name.replace(/.*\//, ''))).not.toContain('4.ply');
  expect(result.frames).toHaveLength(9);

  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /The sample/ }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);
});

test('without the reference there is nothing to compare with', async ({ app, page }) => {
  await page.getByRole('button', { name: 'Remove the ground truth truth.tum' }).click();
  const { result } = await app.stitched();
  expect(result.comparison).toBeNull();
  await expect(page.getByLabel('Result in figures')).not.toContainText('truth.tum');
});

test('all scans removed leave a page that says what to do', async ({ app, page }) => {
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /Remove all/ }).click();
  await expect(page.getByRole('heading', { name: /^Drop laser scans/ })).toBeVisible();
  await page.getByRole('button', { name: 'Show the sample' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);
  await expect(app.stage).toBeVisible();
});

test('the first screen says what the page is for, and back and forward move between views without a new run', async ({
  app,
  page,
}) => {
  const about = page.getByRole('region', { name: 'About' });
  await expect(about).toContainText('Drop laser scans, depth images or point clouds anywhere');
  await expect(about).toContainText('nothing leaves your machine');
  const before = await app.numStitched();
  await app.setting('Strategy').selectOption('scan_to_map');
  await app.stitched();
  await about.getByRole('link', { name: 'Evaluate' }).click();
  await expect(page.locator('.title')).toHaveText('Trajectory evaluation');
  await page.goBack();
  await expect(page.locator('.title')).toHaveText('Sample: a corridor');
  await about.getByRole('link', { name: "Bird's-eye view" }).click();
  await expect(page.locator('.title')).toHaveText("Bird's-eye view");
  await page.goBack();
  await page.goForward();
  await expect(page.locator('.title')).toHaveText("Bird's-eye view");
  await page.goBack();
  await expect(app.setting('Strategy')).toHaveValue('scan_to_map');
  expect(await app.numStitched()).toBe(before + 1);
  // Files of one's own have the page for themselves.
  await app.drop(sampleScans().slice(0, 3));
  await app.stitched();
  await expect(about).toBeHidden();
});
