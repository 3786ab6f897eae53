import type { Locator } from '@playwright/test';
import { hold } from './held.js';
import { expect, overflowOf, sampleScans, ScanstitchPage, test } from './scanstitch_page.js';

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
  const violated = page.evaluate(
    () =>
      new Promise((resolve) =>
        addEventListener('securitypolicyviolation', ({ effectiveDirective }) => resolve(effectiveDirective)),
      ),
  );
  await page.evaluate(() => fetch('http://example.invalid/').catch(() => undefined));
  expect(await violated).toBe('connect-src');
  expect(foreign.filter((url) => !url.startsWith('http://example.invalid/'))).toEqual([]);
});

test('one scan, the reference and all scans are removed, and the sample comes back', async ({ app, page }) => {
  await app.row('4.ply').click();
  await expect(app.why).toContainText('4.ply');
  await page.getByRole('button', { name: 'Leave this scan out' }).click();
  const { result } = await app.stitched();
  expect(result.frames.map(({ name }) => name.replace(/.*\//, ''))).not.toContain('4.ply');
  expect(result.frames).toHaveLength(9);

  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /The sample/ }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);

  // Without the reference there is nothing to compare with.
  await page.getByRole('button', { name: 'Remove the ground truth truth.tum' }).click();
  expect((await app.stitched()).result.comparison).toBeNull();
  await expect(page.getByLabel('Result in figures')).not.toContainText('truth.tum');

  // All scans removed leave a page that says what to do.
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /Remove all/ }).click();
  await expect(page.getByRole('heading', { name: /^Drop laser scans/ })).toBeVisible();
  await page.getByRole('button', { name: 'Show the sample' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);
  await expect(app.stage).toBeVisible();
});

test('the first screen says what it does, how to begin, what else there is and how to embed it', async ({
  app,
  page,
}) => {
  const about = page.getByRole('region', { name: 'About' });
  await expect(about.getByRole('heading')).toHaveText('Laser scans and depth images to a path and a map');
  await expect(about).toContainText('Drop files anywhere on this page');
  await expect(about).toContainText('nothing leaves your machine');
  for (const tool of ['Map', 'ICP', 'Evaluate', "Bird's-eye view", 'Strategies'])
    await expect(about.getByRole('list', { name: 'Tools' })).toContainText(tool);
  await about.getByText('Embed it in your page').click();
  await expect(about.getByLabel('Lines to embed the page')).toContainText('<scanstitch-app src=');
  // On a phone, too, nothing is wider than the screen, and the map is in sight.
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  await expect(page.locator('.title')).toBeInViewport({ ratio: 1 });
  await expect(app.stage).toBeInViewport({ ratio: 1 });
  await about.getByRole('button', { name: 'Close the introduction' }).click();
  await expect(about).toBeHidden();
});

test('at first sight the map has half of the window and more; what is unfolded is remembered', async ({ page }) => {
  await page.setViewportSize({ width: 1280, height: 860 });
  const app = new ScanstitchPage(page, '');
  await app.open();
  const share = async (): Promise<number> => {
    const { width = 0, height = 0 } = (await app.stage.boundingBox()) ?? {};
    return (width * height) / (1280 * 860);
  };
  expect(await share()).toBeGreaterThan(0.5);
  // The figures are there, in one line.
  await expect(page.getByLabel('Result in figures')).toContainText('Distance to truth.tum');
  expect((await page.getByLabel('Result in figures').boundingBox())?.height).toBeLessThan(60);
  const panels = page.getByRole('group', { name: 'Panels' });
  for (const [name, panel] of [
    ['Scans', app.table],
    ['Settings', page.getByRole('complementary', { name: 'Settings' })],
    ['Details', app.why],
  ] as const) {
    const button = panels.getByRole('button', { name });
    await expect(panel).toBeHidden();
    await expect(button).toHaveAttribute('aria-expanded', 'false');
    await button.focus();
    await page.keyboard.press('Enter');
    await expect(panel).toBeVisible();
    await expect(button).toHaveAttribute('aria-expanded', 'true');
  }
  await panels.getByRole('button', { name: 'Details' }).click();
  await page.reload();
  await new ScanstitchPage(page, '').stitched();
  await expect(app.table).toBeVisible();
  await expect(app.setting('Strategy')).toBeVisible();
  await expect(app.why).toBeHidden();
  // A scan that is selected is explained.
  await app.row('4.ply').click();
  await expect(app.why).toContainText('4.ply');
});

test('an address that names another tool is followed on the open page', async ({ app, page }) => {
  await expect(app.stage).toBeVisible();
  const shown = page.getByRole('navigation', { name: 'Tools' }).locator('[aria-current=page]');
  await expect(shown).toHaveText('Map');
  for (const [fragment, tool] of [
    ['#evaluate', 'Evaluate'],
    ['#icp&scene=outliers', 'ICP'],
    ['#strategies', 'Strategies'],
    ['#localize', 'Localize'],
  ] as const) {
    await page.evaluate((hash) => (location.hash = hash), fragment);
    await expect(shown).toHaveText(tool);
    // The scene of the address, not the scans of the run.
    if (tool === 'ICP') await expect(page.locator('scanstitch-lab')).not.toContainText('1.ply');
    if (tool === 'ICP') await expect(page.getByRole('region', { name: 'Question' })).toContainText('Outliers');
  }
  await page.goBack();
  await expect(shown).toHaveText('Strategies');
  await page.goBack();
  await expect(shown).toHaveText('ICP');
});

test('back and forward move between views without a new run', async ({ app, page }) => {
  const tools = page.getByRole('navigation', { name: 'Tools' });
  const shown = tools.locator('[aria-current=page]');
  const before = await app.numStitched();
  await app.setting('Strategy').selectOption('scan_to_map');
  await app.stitched();
  for (const tool of ['Evaluate', "Bird's-eye view", 'Strategies', 'ICP']) {
    await tools.getByRole('button', { name: tool }).click();
    await expect(shown).toHaveText(tool);
  }
  for (const tool of ['Strategies', "Bird's-eye view", 'Evaluate', 'Map']) {
    await page.goBack();
    await expect(shown).toHaveText(tool);
  }
  await page.goForward();
  await expect(shown).toHaveText('Evaluate');
  await page.goBack();
  await expect(app.setting('Strategy')).toHaveValue('scan_to_map');
  expect(await app.numStitched()).toBe(before + 1);
  // Files of one's own have the page for themselves.
  await app.drop(sampleScans().slice(0, 3));
  expect((await app.stitched()).result.frames).toHaveLength(3);
  await expect(page.getByRole('region', { name: 'About' })).toBeHidden();
});

test('the address is that of the view that is shown', async ({ app, page }) => {
  const tools = page.getByRole('navigation', { name: 'Tools' });
  const shown = tools.locator('[aria-current=page]');
  const expectAddress = (address: RegExp): Promise<void> =>
    expect.poll(() => new URL(page.url()).hash).toMatch(address);
  await app.setting('Strategy').selectOption('scan_to_map');
  await app.stitched();
  await tools.getByRole('button', { name: 'ICP' }).click();
  await expectAddress(/^#icp&/);
  await tools.getByRole('button', { name: 'Map' }).click();
  await expectAddress(/^#strategy=scan_to_map$/);
  await tools.getByRole('button', { name: 'ICP' }).click();
  await expectAddress(/^#icp&/);
  await tools.getByRole('button', { name: 'Evaluate' }).click();
  await expectAddress(/^#strategy=scan_to_map$/);
  for (const [tool, address] of [
    ['ICP', /^#icp&/],
    ['Map', /^#strategy=scan_to_map$/],
  ] as const) {
    await page.goBack();
    await expect(shown).toHaveText(tool);
    await expectAddress(address);
  }
});

test('a page that began with the ICP lab goes back to it', async ({ page }) => {
  await page.goto('./#icp&scene=outliers');
  const shown = page.getByRole('navigation', { name: 'Tools' }).locator('[aria-current=page]');
  await expect(shown).toHaveText('ICP');
  await expect.poll(() => new URL(page.url()).hash).toContain('source=');
  await page.getByRole('navigation', { name: 'Tools' }).getByRole('button', { name: 'Map' }).click();
  await expect(shown).toHaveText('Map');
  await expect.poll(() => new URL(page.url()).hash).toBe('');
  await page.goBack();
  await expect(shown).toHaveText('ICP');
  await expect.poll(() => new URL(page.url()).hash).toContain('scene=outliers');
});

test('a link leads to Evaluate, to the strategies and to the localisation, and the sample is behind them', async ({
  page,
}) => {
  const tools = page.getByRole('navigation', { name: 'Tools' });
  const shown = tools.locator('[aria-current=page]');
  for (const [hash, tool] of [
    ['#evaluate', 'Evaluate'],
    ['#strategies', 'Strategies'],
    ['#localize', 'Localize'],
  ] as const) {
    await page.goto('about:blank');
    await page.goto(`./${hash}`);
    await expect(shown).toHaveText(tool);
    await tools.getByRole('button', { name: 'Map' }).click();
    await expect(page.locator('.title')).toHaveText('Sample: a corridor');
    await expect.poll(() => new URL(page.url()).hash).toBe('');
    await page.goBack();
    await expect(shown).toHaveText(tool);
  }
});

test('a view that loads late does not come over one that was chosen since', async ({ app, page }) => {
  const tool = (name: string): Locator => page.getByRole('navigation', { name: 'Tools' }).getByRole('button', { name });
  const release = await hold(page, '**/strategies-view*.js');
  await tool('Strategies').click();
  await tool('Evaluate').click();
  await expect(tool('Evaluate')).toHaveAttribute('aria-current', 'page');
  const loaded = page.waitForEvent('requestfinished', (request) => /strategies-view/.test(request.url()));
  await release();
  await loaded;
  // Chosen again it would be there at once; the one chosen since stays.
  await page.waitForFunction(() => customElements.get('scanstitch-strategies'));
  await expect(tool('Evaluate')).toHaveAttribute('aria-current', 'page');
  await expect(page.locator('scanstitch-evaluate')).toBeVisible();
  expect(app.faults).toEqual([]);
});
