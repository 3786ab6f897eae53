/** Strategies side by side: from a recording on the page to the table and the figures, one click. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Page } from '@playwright/test';
import { expectNamedControls, findWeakContrast } from './access.js';
import { hold } from './held.js';
import { dropOn, type InputFile, overflowOf, SAMPLE_FOLDER, ScanstitchPage } from './scanstitch_page.js';
import { recording, truth } from './spatial_recording.js';
import { drawNothing, expect, test } from './spatial_page.js';
import { stopAfter } from './stop.js';

const NUM_FRAMES = 5;
const LABELS = [
  'Plain',
  'Voxels 0.1 m',
  'Voxels 0.3 m',
  'Planar motion',
  'Golden data',
  'Adaptive threshold',
  'All together',
];

interface ComparedRow {
  name: string;
  result: {
    frames: unknown[];
    num_lost: number;
    map_bytes: number;
    timing: { median: number };
    comparison: { ape_mean: number } | null;
  };
}

/** Compares the strategies that are chosen at first, or all, and waits until all frames went through. */
async function compare(page: Page, which: 'some' | 'all' | 'again'): Promise<ComparedRow[]> {
  await page.evaluate(() => {
    const compared = new Promise<ComparedRow[]>((resolve) => {
      addEventListener('scanstitch-compared', (event) => resolve((event as CustomEvent).detail), { once: true });
    });
    Object.assign(window, { compared });
  });
  await page.getByRole('button', { name: 'Strategies' }).click();
  if (which === 'all') await page.getByRole('button', { name: 'Choose all' }).click();
  const start = which === 'again' ? 'Compare again' : 'Compare';
  await page.getByRole('button', { name: start, exact: true }).click();
  return page.evaluate(() => (window as unknown as { compared: Promise<ComparedRow[]> }).compared);
}

test('what is dropped on the strategies is compared there, by those that were chosen, and none before', async ({
  spatial,
  page,
}) => {
  await page.getByRole('navigation', { name: 'Tools' }).getByRole('button', { name: 'Strategies' }).click();
  const start = page.getByRole('button', { name: 'Compare', exact: true });
  await expect(page.getByRole('region', { name: 'No recording yet' })).toContainText('Drop depth images');
  await expect(start).toBeDisabled();
  await spatial.drop(recording(4));
  await expect(start).toBeEnabled({ timeout: 60_000 });
  await expect(page.getByRole('heading', { name: 'Compare strategies' })).toBeVisible();
  await expect(page.getByText('3 strategies chosen')).toBeVisible();
  await expect(page.getByRole('table', { name: 'Strategies' })).toBeHidden();
  await start.click();
  await expect(page.getByText('4 frames, 3 strategies')).toBeVisible({ timeout: 60_000 });
});

test('a link to the strategies, or a host that shows them alone: the sample is compared there', async ({ page }) => {
  const open = async (): Promise<void> => {
    await page.getByRole('button', { name: 'Open the apartment (sample)' }).click();
    await expect(page.getByRole('button', { name: 'Compare', exact: true })).toBeEnabled({ timeout: 60_000 });
    await expect(page.getByRole('heading', { name: 'Compare strategies' })).toBeVisible();
  };
  await drawNothing(page);
  await page.goto('./#strategies');
  await open();
  const host = '<!doctype html><title>Lesson</title><scanstitch-app view="strategies"></scanstitch-app>';
  await page.route('**/lesson.html', (route) => route.fulfill({ contentType: 'text/html', body: host }));
  await page.goto('./lesson.html');
  await page.addScriptTag({ type: 'module', url: 'scanstitch-app.js' });
  await open();
});

test('a recording that is dropped where a link led to is shown on the map', async ({ page }) => {
  await page.goto('./#evaluate');
  const shown = page.getByRole('navigation', { name: 'Tools' }).locator('[aria-current=page]');
  await expect(shown).toHaveText('Evaluate');
  await dropOn(page.locator('.app'), recording(3));
  await expect(shown).toHaveText('Map');
});

test('who went to the map while it loads stays there', async ({ spatial: { page } }) => {
  const tools = page.getByRole('navigation', { name: 'Tools' });
  const release = await hold(page, '**/GT_pose*.npy');
  await tools.getByRole('button', { name: 'Strategies' }).click();
  await page.getByRole('button', { name: 'Open the apartment (sample)' }).click();
  await expect(page.getByRole('heading', { name: 'Compare strategies', exact: true })).toBeHidden();
  await tools.getByRole('button', { name: 'Map', exact: true }).click();
  await release();
  // What is compared is compared as soon as its first frames are on the map.
  await stopAfter(page, 'scanstitch-spatial', 0);
  await expect(page.getByRole('heading', { name: 'Compare strategies', exact: true })).toBeHidden();
});

/** The scans of the sample as a recording of somebody's own, with their ground truth. */
function corridor(): InputFile[] {
  const names = [...Array.from({ length: 6 }, (_, i) => `${i}.ply`), 'truth.tum'];
  return names.map((name) => ({ name: `lab/${name}`, content: readFileSync(join(SAMPLE_FOLDER, name)) }));
}

test('planar scans: presets and the settings of the map, their maps on top of each other', async ({ page }, info) => {
  const app = new ScanstitchPage(page);
  await app.openEmpty();
  await page.getByRole('button', { name: 'Strategies' }).click();
  await dropOn(page.locator('scanstitch-strategies'), corridor());
  await expect(page.getByRole('button', { name: 'Compare', exact: true })).toBeEnabled();
  await expect(page.getByText('3 strategies chosen')).toBeVisible();
  const rows = await compare(page, 'some');
  expect(rows.map(({ name }) => name)).toEqual(['sharpest', 'scan_to_map', 'homework']);
  for (const { name, result } of rows) {
    expect(result.frames, name).toHaveLength(6);
    expect(result.comparison?.ape_mean, name).toBeLessThan(0.1);
    expect(result.timing.median, name).toBeGreaterThan(0);
  }
  const [sharpest, , homework] = rows;
  expect(homework?.result.comparison?.ape_mean).toBeGreaterThan(sharpest?.result.comparison?.ape_mean ?? 0);
  await expect(page.getByText('6 scans, 3 strategies')).toBeVisible();
  const maps = page.getByRole('region', { name: 'Maps on top of each other' });
  await expect(maps).toBeVisible();
  await expect(page.getByRole('region', { name: 'Points of the map' })).toBeHidden();
  await page.setViewportSize({ width: 1280, height: 1500 });
  await page.screenshot({ path: info.outputPath('planar.png') });

  // A setting that is changed on the map is one more strategy; what was compared stays until it is compared again.
  await page.getByRole('button', { name: 'Map', exact: true }).click();
  await app.setting('Strategy').selectOption('scan_to_scan');
  await page.getByRole('button', { name: 'Strategies' }).click();
  await expect(page.getByText('6 scans, 3 strategies')).toBeVisible();
  const own = page.getByRole('checkbox', { name: /^Strategy: Joint → Scan to scan/ });
  await expect(own).toBeChecked();
  const again = await compare(page, 'again');
  expect(again.map(({ name }) => name).slice(0, 3)).toEqual(['sharpest', 'scan_to_map', 'homework']);
  expect(again).toHaveLength(4);
  expect(again[0]?.result.comparison?.ape_mean).toBe(sharpest?.result.comparison?.ape_mean);
  expect(again[3]?.result.comparison?.ape_mean).not.toBe(sharpest?.result.comparison?.ape_mean);
  await page.getByRole('button', { name: 'Dark colours' }).click();
  await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  await page.screenshot({ path: info.outputPath('planar-phone.png'), fullPage: true });
});

/** Stop is clicked the moment it is there: a few frames may be over before a click from outside arrives. */
async function stopAtOnce(page: Page): Promise<void> {
  await page.locator('scanstitch-strategies').evaluate((view) => {
    const root = view.shadowRoot;
    if (!root) throw new Error('There is nothing to stop.');
    const observer = new MutationObserver(() => {
      const stop = [...root.querySelectorAll('button')].find((button) => button.textContent?.trim() === 'Stop');
      if (!stop) return;
      observer.disconnect();
      stop.click();
    });
    observer.observe(root, { childList: true, subtree: true });
  });
}

test('all strategies on one recording: compared, sorted, saved, copied, chosen by the keyboard, stopped', async ({
  spatial,
  page,
}) => {
  await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await spatial.drop([...recording(NUM_FRAMES), truth(NUM_FRAMES)]);
  await spatial.stitched();
  const rows = await compare(page, 'all');
  expect(rows.map(({ name }) => name)).toHaveLength(LABELS.length);
  for (const { name, result } of rows) {
    expect(result.frames, name).toHaveLength(NUM_FRAMES);
    expect(result.num_lost, name).toBe(0);
    expect(result.comparison?.ape_mean, name).toBeLessThan(0.06);
    expect(result.timing.median, name).toBeGreaterThan(0);
  }
  expect(rows[0]?.result.map_bytes).toBeGreaterThan(4 * (rows[1]?.result.map_bytes ?? 0));

  const table = page.getByRole('table', { name: 'Strategies' });
  await expect(table.getByRole('row')).toHaveCount(LABELS.length + 1);
  for (const title of ['Points of the map', 'Time per frame', 'Distance to ground truth', 'Paths from above']) {
    await expect(page.getByRole('region', { name: title })).toBeVisible();
  }
  // A column sorts, and sorts the other way.
  const stored = table.getByRole('button', { name: /^Map size \(MB\)/ });
  await stored.click();
  await expect(table.getByRole('row').nth(1)).toContainText('Voxels 0.3 m');
  await stored.click();
  await expect(table.getByRole('row').nth(1)).toContainText('Plain');
  await expect(table.getByRole('columnheader', { name: /^Map size/ })).toHaveAttribute('aria-sort', 'descending');

  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save CSV' }).click();
  const csv = readFileSync(await (await download).path(), 'utf8')
    .trimEnd()
    .split('\n');
  expect(csv).toHaveLength(LABELS.length + 1);
  expect(csv[0]).toMatch(/^strategy,frames,lost,map_points,map_bytes,ms_median,ms_last,ms_slope,ms_slope_error/);

  await page.getByRole('button', { name: 'Map', exact: true }).click();
  await expect(spatial.map).toBeVisible();
  // What has been compared stays.
  await page.getByRole('button', { name: 'Strategies' }).click();
  await expect(page.getByText(`${NUM_FRAMES} frames, 7 strategies`)).toBeVisible();

  await page.getByRole('button', { name: 'Copy Markdown' }).click();
  await expect(page.getByRole('status').filter({ hasText: 'copied as Markdown' })).toHaveCount(1);
  const markdown = await page.evaluate(() => navigator.clipboard.readText());
  expect(markdown.split('\n')[0]).toMatch(/^\| Strategy \| Frames \| Lost \|/);
  expect(markdown).toContain('| Golden data |');

  for (const label of LABELS.slice(2)) {
    const choice = page.getByRole('checkbox', { name: new RegExp(`^${label}`) });
    await choice.focus();
    await page.keyboard.press('Space');
    await expect(choice).not.toBeChecked();
  }
  await page.getByRole('button', { name: 'Compare again' }).focus();
  await stopAtOnce(page);
  await page.keyboard.press('Enter');
  await expect(page.getByText(/^Stopped after /).first()).toBeVisible();
  await page.locator('scanstitch-strategies').locator('button.primary').click();
  await expect(page.getByText(`${NUM_FRAMES} frames, 2 strategies`)).toBeVisible({ timeout: 60_000 });
  await expect(page.getByRole('table', { name: 'Strategies' }).getByRole('row')).toHaveCount(3);
});

test('a broken frame is named and left out; nothing is cut off on a phone, in the dark', async ({ spatial, page }) => {
  const files = recording(NUM_FRAMES).map((file) =>
    file.name.endsWith('depth/3.png') ? { ...file, content: file.content.slice(0, 200) } : file,
  );
  await spatial.drop([...files, truth(NUM_FRAMES)]);
  await spatial.stitched();
  const rows = await compare(page, 'some');
  expect(rows[1]?.result.frames).toHaveLength(NUM_FRAMES - 1);
  await expect(page.getByRole('list', { name: 'Problems' })).toContainText('3.png');
  await expectNamedControls(page);
  await page.getByRole('button', { name: 'Dark colours' }).click();
  // Colours may be on their way.
  await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  await expect(page.getByRole('region', { name: 'Table', exact: true })).toBeVisible();
});
