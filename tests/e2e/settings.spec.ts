import { expect, ScanstitchPage, test } from './scanstitch_page.js';
import { drawNothing } from './spatial_page.js';

test('a changed setting computes again, in degrees and within its range, and is marked until it is put back', async ({
  app,
  page,
}) => {
  await app.row('9.ply').getByRole('button').click();
  await app.setting('Strategy').selectOption('scan_to_scan');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_scan');
  await expect(app.setting('Preset')).toHaveValue('');
  // The map grew again, at first without that scan.
  await expect(app.row('9.ply').getByRole('button')).toHaveAttribute('aria-pressed', 'true');
  // The result before stays beside the new one: its figures, and on the map, until it is dismissed.
  const compared = page.getByRole('region', { name: 'Before and after' });
  await expect(compared).toContainText('Strategy: Joint → Scan to scan');
  await expect(compared).toContainText(/Sharpness\s*[\d.]+\smm → [\d.]+\smm\s*[+−][\d.]+\smm/);
  const both = await app.picture();
  await compared.getByLabel('Before, in grey').uncheck();
  await expect.poll(() => app.picture()).not.toBe(both);
  await page.getByRole('button', { name: 'Reset' }).click();
  expect((await app.stitched()).result.settings.strategy).toBe('joint');
  await expect(page.getByRole('button', { name: 'Reset' })).toBeDisabled();
  await expect(compared).toContainText('Strategy: Scan to scan → Joint');
  await compared.getByRole('button', { name: 'Back' }).click();
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_scan');
  await compared.getByRole('button', { name: /^Dismiss/ }).click();
  await expect(compared).toBeHidden();
  await page.getByRole('button', { name: 'Reset' }).click();
  await app.stitched();

  // Radians in the engine.
  await app.setting('Search rotation').fill('20');
  await app.setting('Search rotation').press('Enter');
  expect((await app.stitched()).result.settings.search_rotation).toBeCloseTo((20 * Math.PI) / 180, 9);

  // A number out of its range goes to the nearest end; no number is put back.
  await app.setting('Local map').fill('100000');
  await app.setting('Local map').press('Enter');
  const { result } = await app.stitched();
  const largest = result.settings.local_map_scans;
  expect(largest).toBeLessThan(100000);
  await expect(app.setting('Local map')).toHaveValue(String(largest));
  await app.setting('Local map').fill('');
  await app.setting('Local map').press('Enter');
  await expect(app.setting('Local map')).toHaveValue(String(largest));
});

test('every preset runs', async ({ app }) => {
  const presets = await app.setting('Preset').locator('option').all();
  const values = await Promise.all(presets.map((preset) => preset.getAttribute('value')));
  expect(values.length).toBeGreaterThan(1);
  for (const value of values.slice(1)) {
    await app.setting('Preset').selectOption(value);
    expect((await app.stitched()).result.frames).toHaveLength(10);
  }
});

test('changed settings are kept in the address, and a link carries them', async ({ app, page, context }) => {
  await app.setting('Strategy').selectOption('scan_to_map');
  await app.stitched();
  await expect.poll(() => new URL(page.url()).hash).toBe('#strategy=scan_to_map');
  await context.grantPermissions(['clipboard-read', 'clipboard-write']);
  await page.getByRole('button', { name: 'Export' }).click();
  await page.getByRole('menuitem', { name: /^Copy link/ }).click();
  await expect(page.getByRole('status')).toContainText('The link was copied');
  expect(await page.evaluate(() => navigator.clipboard.readText())).toBe(page.url());

  const other = new ScanstitchPage(await context.newPage());
  const { result } = await other.open('./#strategy=scan_to_map&max_range=20&metric=nonsense&unknown=1');
  expect(result.settings.strategy).toBe('scan_to_map');
  expect(result.settings.max_range).toBe(20);
  expect(result.settings.metric).toBe('point_to_line');
});

test('settings in space are kept in the address, and a link carries them to the depth images', async ({ page }) => {
  await drawNothing(page);
  await page.goto('./#spatial&map_voxel_size=0.05&color=not_used&metric=nonsense');
  await page.locator('scanstitch-spatial').getByRole('button', { name: 'Settings' }).click();
  const effort = page.locator('scanstitch-spatial').getByLabel('Effort', { exact: true });
  await effort.selectOption('quick');
  const linked = (name: string): string | null => new URLSearchParams(new URL(page.url()).hash.slice(1)).get(name);
  await expect.poll(() => linked('effort')).toBe('quick');
  const link = page.url();
  await page.goto('about:blank');
  const { result } = await new ScanstitchPage(page).open(link);
  expect(result.frames.length).toBeGreaterThan(10);
  expect(result.settings).toMatchObject({
    effort: 'quick',
    color: 'not_used',
    map_voxel_size: 0.05,
    metric: 'point_to_plane',
  });
});

test('every setting has a label and a line of explanation', async ({ page, app }) => {
  const panel = page.locator('scanstitch-settings');
  const folded = panel.locator('details:not([open]) summary');
  while ((await folded.count()) > 0) await folded.first().click();
  const controls = await panel.locator('input, select').all();
  expect(controls.length).toBeGreaterThan(15);
  for (const control of controls) {
    await expect(control).toHaveAccessibleName(/\w/);
    await expect(control).toHaveAccessibleDescription(/\w{3}/);
  }
  expect(await app.numStitched()).toBe(1);
});
