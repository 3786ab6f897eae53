/** Stop, before there is anything to compute with: the files or the engine are still on their way. */
import { test } from '@playwright/test';
import { BUILDING, driveLog } from '../cli/drive_log.mjs';
import { answered, noteAnswers } from './answers.js';
import { hold } from './held.js';
import { expect, sampleScans, ScanstitchPage } from './scanstitch_page.js';
import { SpatialPage } from './spatial_page.js';
import { recording } from './spatial_recording.js';

/** Longer than a worker that has started is waited for (ms). */
const LONG = 6000;

test('scans on their way are no longer wanted', async ({ page }) => {
  const app = new ScanstitchPage(page);
  const release = await hold(page, '**/corridor*.js');
  await app.goto('./');
  await expect(page.getByText('Fetching the scans')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(app.messages).toContainText('Opening the scans was stopped');
  const fetched = page.waitForResponse('**/corridor*.js');
  await release();
  await (await fetched).finished();
  // Nothing but the scans that are dropped afterwards.
  await app.drop(sampleScans().slice(0, 3));
  await expect(app.table.getByRole('row')).toHaveCount(4);
  await expect(page.locator('.title')).toHaveText('Your scans');
  expect(app.faults).toEqual([]);
});

test('depth images on their way are no longer wanted', async ({ page }) => {
  const spatial = new SpatialPage(page);
  const release = await hold(page, '**/GT_pose*.npy');
  await spatial.open();
  await page.evaluate(() => void document.querySelector('scanstitch-app')?.open('apartment'));
  await expect(page.getByText('Inspecting the files')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(spatial.messages).toContainText('Opening the files was stopped');
  const fetched = page.waitForResponse('**/GT_pose*.npy');
  await release();
  await (await fetched).finished();
  // Nothing but the frames that are dropped afterwards.
  await spatial.drop(recording(3));
  expect((await spatial.stitched()).result.frames).toHaveLength(3);
  expect(spatial.app.faults).toEqual([]);
});

test('scans that wait for the engine are no longer wanted when it is there', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  await noteAnswers(page);
  const release = await hold(page, '**/*.wasm');
  await app.goto('./');
  await expect(page.getByText('Reading 10 scans')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(app.messages).toContainText('Opening the scans was stopped');
  await page.clock.runFor(LONG);
  await expect(app.messages).not.toContainText('crashed');
  await release();
  await answered(page, /planar-worker/);
  await expect(page.getByRole('button', { name: 'Stop' })).toBeHidden();
  await app.drop(sampleScans().slice(0, 3));
  await expect(app.table.getByRole('row')).toHaveCount(4);
  expect(app.faults).toEqual([]);
});

test('a log that waits for the full engine: nothing is computed, and the scans before it stay', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  const release = await hold(page, '**/scanstitch_bg*.wasm');
  await app.open();
  const scan = `FLASER 180 ${Array.from({ length: 180 }, (_, i) => 3 + 0.01 * i).join(' ')} 0 0 0 0 0 0`;
  await app.drop([{ name: 'walk.log', content: [0, 1, 2].map((time) => `${scan} ${time} robot ${time}\n`).join('') }]);
  await expect(page.getByText('Reading 1 scan')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(app.messages).toContainText('Reading was stopped: none of it is used');
  await expect(app.messages).toContainText('Note');
  await page.clock.runFor(LONG);
  await release();
  await expect(app.messages).not.toContainText('crashed');
  await app.setting('Strategy').selectOption('scan_to_map');
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(10);
  expect(app.faults).toEqual([]);
});

test('frames that wait for the engine are computed by Continue', async ({ page }) => {
  const spatial = new SpatialPage(page);
  const release = await hold(page, '**/scanstitch_bg*.wasm');
  await spatial.open();
  await spatial.drop(recording(5));
  await expect(page.getByText('Starting the engine')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(page.getByText('Stopped: partial map')).toBeVisible();
  const started = page.waitForResponse('**/scanstitch_bg*.wasm');
  await release();
  await (await started).finished();
  await expect(page.getByRole('button', { name: 'Export' })).toBeVisible();
  await expect(page.getByText('Stopped: partial map')).toBeVisible();
  await page.getByRole('button', { name: 'Continue' }).click();
  expect((await spatial.stitched()).result.frames).toHaveLength(5);
  expect(spatial.app.faults).toEqual([]);
});

test('a log that the engine is busy reading is left, though it cannot be interrupted, and the map before it stays', async ({
  page,
}) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  await app.open();
  await app.drop([{ name: 'drive.log', content: driveLog(BUILDING, 0, 66) }]);
  const { result } = await app.stitched();
  await app.drop([{ name: 'long.log', content: driveLog(BUILDING, 0, 66).repeat(120) }]);
  await expect(page.getByText(/Reading (1 scan|long\.log)/)).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await page.clock.runFor(LONG);
  await expect(app.messages).toContainText('Reading was stopped: none of it is used');
  await expect(app.messages).not.toContainText(/crashed|wrong/);
  await expect(page.locator('.title')).toHaveText('drive.log');
  await app.setting('Strategy').selectOption('scan_to_map');
  await expect.poll(async () => (await app.stitched()).result.settings.strategy).toBe('scan_to_map');
  expect(result.frames).toHaveLength(66);
  expect(app.faults).toEqual([]);
});
