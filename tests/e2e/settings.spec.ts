import { expect, ScanstitchPage, test } from './scanstitch_page.js';

test('a changed setting computes again, and is marked until it is put back', async ({ app, page }) => {
  await app.setting('Strategy').selectOption('scan_to_scan');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_scan');
  await expect(app.setting('Preset')).toHaveValue('');
  await page.getByRole('button', { name: 'Reset' }).click();
  expect((await app.stitched()).result.settings.strategy).toBe('joint');
  await expect(page.getByRole('button', { name: 'Reset' })).toBeDisabled();
});

test('angles are degrees on the screen and radians in the engine', async ({ app }) => {
  await app.setting('Search rotation').fill('20');
  await app.setting('Search rotation').press('Enter');
  const { result } = await app.stitched();
  expect(result.settings.search_rotation).toBeCloseTo((20 * Math.PI) / 180, 9);
});

test('a number out of its range goes to the nearest end, no number is put back', async ({ app }) => {
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

  const other = new ScanstitchPage(await context.newPage());
  const { result } = await other.open('./#strategy=scan_to_map&max_range=20&metric=nonsense&unknown=1');
  expect(result.settings.strategy).toBe('scan_to_map');
  expect(result.settings.max_range).toBe(20);
  expect(result.settings.metric).toBe('point_to_line');
});

test('settings in space are kept in the address, and a link carries them to the depth images', async ({
  page,
  context,
}) => {
  test.slow();
  const app = new ScanstitchPage(page);
  const { result } = await app.open('./#spatial&map_voxel_size=0.05&color=not_used&metric=nonsense');
  expect(result.frames.length).toBeGreaterThan(10);
  const settings = result.settings as unknown as Record<string, unknown>;
  expect([settings.map_voxel_size, settings.color, settings.metric]).toEqual([0.05, 'not_used', 'point_to_plane']);

  await page.locator('scanstitch-spatial').getByLabel('Search effort', { exact: true }).selectOption('quick');
  await app.stitched();
  const link = new URL(page.url()).hash;
  expect(new URLSearchParams(link.slice(1)).get('effort')).toBe('quick');
  const again = await new ScanstitchPage(await context.newPage()).open(`./${link}`);
  const carried = again.result.settings as unknown as Record<string, unknown>;
  expect([carried.effort, carried.color, carried.map_voxel_size]).toEqual(['quick', 'not_used', 0.05]);
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
