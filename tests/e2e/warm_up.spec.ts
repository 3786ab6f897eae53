/** While files are being chosen, the engine for depth images is made ready; nothing of that is to be seen. */
import type { Page } from '@playwright/test';
import { recording, truth } from './spatial_recording.js';
import { expect, test } from './spatial_page.js';

/** Threads that register or prepare depth images. */
const numThreads = (page: Page): number =>
  page.workers().filter((worker) => /(registrar|preparer)-worker/.test(worker.url())).length;

test('the engine is made ready while files are chosen, and is quiet again before they come', async ({
  spatial,
  page,
}) => {
  expect(numThreads(page)).toBe(0);
  await page.getByRole('button', { name: 'Open' }).click();
  await expect.poll(() => numThreads(page)).toBeGreaterThan(1);
  await expect.poll(() => numThreads(page), { timeout: 60_000 }).toBe(0);
  await expect(page.getByText('Sample: a corridor')).toBeVisible();
  await expect(spatial.app.map).toBeVisible();
  await spatial.drop([...recording(4), truth(4)]);
  const { result } = await spatial.stitched();
  expect(result.frames.map(({ status }) => status)).toEqual(Array(4).fill('good'));
});

test('what comes early ends it', async ({ spatial, page }) => {
  await page.getByRole('button', { name: 'Open' }).click();
  await expect.poll(() => numThreads(page)).toBeGreaterThan(0);
  await page.getByRole('menuitem', { name: /^The sample/ }).click();
  await expect.poll(() => numThreads(page)).toBe(0);
  expect((await spatial.app.stitched()).result.frames).toHaveLength(10);
  await expect(spatial.map).toHaveCount(0);
});
