import { expect, ScanstitchPage, test } from './scanstitch_page.js';

test('a crash of the worker is told, and the scans can be computed again', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await app.open();
  const [worker] = page.workers();
  await worker?.evaluate(() => {
    setTimeout(() => {
      throw new Error('out of memory, for the sake of this test');
    });
  });
  await expect(app.messages).toContainText('The computation crashed');
  await expect(app.messages).toContainText('your scans are still loaded');
  // What was computed is still there to be looked at.
  expect(await app.scanNames()).toHaveLength(10);
  await app.row('2.ply').click();
  await expect(app.why).toContainText('2.ply');

  await page.getByRole('button', { name: 'Compute again' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);
  await expect(app.messages).toBeHidden();
  expect(page.workers()).toHaveLength(1);
});

test('after a crash a changed setting computes as well', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await app.open();
  await page.workers()[0]?.evaluate(() => {
    setTimeout(() => {
      throw new Error('for the sake of this test');
    });
  });
  await expect(app.messages).toContainText('The computation crashed');
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_map');
});

test('a page whose engine cannot be fetched says so', async ({ page }) => {
  await page.route('**/*.wasm', (route) => route.fulfill({ status: 404 }));
  await page.goto('./');
  await expect(page.getByRole('region', { name: 'Messages' })).toContainText('The engine could not be started');
});
