/** While files are being chosen, the engine for depth images is made ready; nothing of that is to be seen. */
import type { Page, Worker } from '@playwright/test';
import { hold } from './held.js';
import { recording, truth } from './spatial_recording.js';
import { expect, test } from './scanstitch_page.js';
import { SpatialPage } from './spatial_page.js';

/** Threads that register or prepare depth images. */
const threads = (page: Page): Worker[] =>
  page.workers().filter((worker) => /(registrar|preparer)-worker/.test(worker.url()));

const isWarm = (page: Page): Promise<boolean> =>
  page.evaluate(() => performance.getEntriesByName('scanstitch-warm', 'mark').length === 1);

test('the engine is made ready while files are chosen, and its threads take the recording', async ({ app, page }) => {
  const spatial = new SpatialPage(page, app);
  expect(threads(page)).toHaveLength(0);
  await page.getByRole('button', { name: 'Open' }).click();
  await expect.poll(() => threads(page).length).toBeGreaterThan(1);
  await expect.poll(() => isWarm(page), { timeout: 60_000 }).toBe(true);
  const warm = threads(page);
  await expect(page.getByText('Sample: a corridor')).toBeVisible();
  await expect(app.map).toBeVisible();
  await spatial.drop([...recording(4), truth(4)]);
  const { result } = await spatial.stitched();
  expect(result.frames.map(({ status }) => status)).toEqual(Array(4).fill('good'));
  // They also make the picture of the image that is shown.
  await expect(spatial.panel.getByRole('img', { name: /^Depth image of frame/ })).toBeVisible();
  expect(threads(page)).toEqual(warm);
});

test('threads that nobody wants end after a minute', async ({ app, page }) => {
  await expect(app.map).toBeVisible();
  // Minutes are over when the test says so; all that is shorter takes its time.
  await page.evaluate(() => {
    const wait = window.setTimeout;
    const minutes: (() => void)[] = [];
    const later = (action: () => void, ms = 0): number => (ms === 60_000 ? minutes.push(action) : wait(action, ms));
    Object.assign(window, { setTimeout: later, minutes });
  });
  await page.getByRole('button', { name: 'Open' }).click();
  await expect.poll(() => isWarm(page), { timeout: 60_000 }).toBe(true);
  expect(threads(page).length).toBeGreaterThan(1);
  await page.evaluate(() => {
    for (const end of (window as unknown as { minutes: (() => void)[] }).minutes) end();
  });
  await expect.poll(() => threads(page).length).toBe(0);
});

test('what comes early ends it', async ({ app, page }) => {
  const release = await hold(page, '**/preparer-worker*.js');
  await page.getByRole('button', { name: 'Open' }).click();
  await expect.poll(() => threads(page).length).toBeGreaterThan(0);
  await page.getByRole('menuitem', { name: /^The sample/ }).click();
  await expect.poll(() => threads(page).length).toBe(0);
  expect((await app.stitched()).result.frames).toHaveLength(10);
  await expect(page.locator('scanstitch-map3d')).toHaveCount(0);
  await release();
});

test('while files are dragged over the page it says so, and is made ready where they may be depth images', async ({
  app,
  page,
}) => {
  const hint = page.getByText('Drop scans, depth images or a folder here');
  /** Drags files of these types over the map, and away. */
  const drag = async (...types: string[]): Promise<void> => {
    const dataTransfer = await page.evaluateHandle((types) => {
      const all = new DataTransfer();
      types.forEach((type, i) => all.items.add(new File([], String(i), { type })));
      return all;
    }, types);
    await app.map.dispatchEvent('dragenter', { dataTransfer });
    await expect(hint).toBeVisible();
    await app.map.dispatchEvent('dragleave', { dataTransfer });
    await expect(hint).toBeHidden();
  };
  const asked: string[] = [];
  page.on('request', (request) => asked.push(request.url()));
  await drag('', '', ''); // scans: browsers know no type of theirs
  expect(asked.filter((url) => /warm-up/.test(url))).toEqual([]);
  await drag('image/png', 'image/png');
  await expect.poll(() => threads(page).length).toBeGreaterThan(1);
});
