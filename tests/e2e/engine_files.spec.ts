/** The page begins with a small file of the engine and goes over to the full one; what is shown outlives the change. */
import type { Page } from '@playwright/test';
import { expect, sampleScans, ScanstitchPage, test } from './scanstitch_page.js';

const FULL = '**/scanstitch_bg*.wasm';

/** The workers of planar scans, by the name of their scripts. */
const workers = (page: Page): string[] =>
  page.workers().flatMap((worker) => /(first-)?planar-worker/.exec(worker.url())?.[0] ?? []);

/** The whole result but for the names of its scans. */
const poses = ({ result }: Awaited<ReturnType<ScanstitchPage['stitched']>>): unknown =>
  result.frames.map(({ T_world_sensor, status }) => ({ T_world_sensor, status }));

test('what follows the first scans is done by the full engine, which finds the same', async ({ page }) => {
  const app = new ScanstitchPage(page);
  const fetched = page.waitForEvent('requestfinished', (request) => /scanstitch_bg/.test(request.url()));
  const first = await app.open();
  expect(workers(page)).toEqual(['first-planar-worker']);
  await fetched; // by an idle page, though nothing asks for it
  // Nothing that can be read: what is shown stays, with the worker that can be asked about it.
  await app.drop([{ name: 'letter.ply', content: 'Dear all' }]);
  await expect(app.messages).toContainText('letter.ply');
  await expect.poll(() => workers(page)).toEqual(['first-planar-worker']);
  await app.row('3.ply').click();
  await expect(app.why.getByRole('img', { name: /rmse.*by iteration/ })).toBeVisible();

  await app.drop(sampleScans());
  const again = await app.stitched();
  await expect.poll(() => workers(page)).toEqual(['planar-worker']);
  expect(poses(again)).toEqual(poses(first));
  expect(app.faults).toEqual([]);
});

test('without the full engine a log is told of, and the scans stay', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.route(FULL, (route) => route.abort());
  await app.open();
  const ranges = Array.from({ length: 180 }, () => '3.00').join(' ');
  await app.drop([{ name: 'room.log', content: `FLASER 180 ${ranges} 0 0 0 0 0 0 0 robot 0\n`.repeat(3) }]);
  await expect(app.messages).toContainText('The engine could not be started');
  expect(await app.scanNames()).toHaveLength(10);
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_map');
  expect(app.faults).toEqual([]);
});
