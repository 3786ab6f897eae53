/** A map in space flattened to a grid on the page: the band is chosen by eye, and the files are those of the command line. */
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { expect, type Locator, type Page } from '@playwright/test';
import { unzipSync } from 'fflate';
import { scanstitch } from '../cli/support.mjs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { recording } from './spatial_recording.js';
import { test } from './spatial_page.js';

async function gridFrom(page: Page, press: () => Promise<void>): Promise<Record<string, Buffer>> {
  const download = page.waitForEvent('download');
  await press();
  const file = await download;
  expect(file.suggestedFilename()).toBe('floor_grid.zip');
  const files = unzipSync(readFileSync(await file.path()));
  return Object.fromEntries(Object.entries(files).map(([name, bytes]) => [name, Buffer.from(bytes)]));
}

test('the map is cut to a band of heights, flattened, and saved as the command line does', async ({
  drawn: spatial,
  page,
}) => {
  test.slow();
  const files = recording(12);
  await spatial.drop(files);
  await spatial.stitched();
  const { map } = spatial;
  const stage = map.getByRole('group', { name: 'Map' });
  await map.getByRole('button', { name: 'View from above' }).click();
  await spatial.settled();
  const whole = await spatial.numPainted();
  await stage.press('v');
  await map.getByRole('radio', { name: 'Floor grid', exact: true }).check();
  // The floor is cut away with all that lies below the band.
  await expect.poll(() => spatial.numPainted()).toBeLessThan(0.8 * whole);
  const slider = (name: string): Locator => map.getByRole('slider', { name });
  await slider('From over the floor').fill('0.3');
  await slider('to over the floor').fill('1.5');
  await expect(slider('From over the floor')).toHaveAttribute('aria-valuetext', '0.30 m');
  await map.getByRole('button', { name: 'Make the grid' }).click();
  await expect(map.getByAltText(/^The grid from above: \d{2,} cells occupied, \d{3,} free$/)).toBeVisible();
  await expect(map.getByText(/^\d+ × \d+ cells of 50\.0.mm: [\d\u202f]+ occupied, [\d\u202f]+ free$/)).toBeVisible();
  const saved = await gridFrom(page, () => map.getByRole('button', { name: 'Save the grid' }).click());
  expect(Object.keys(saved)).toEqual(['map.pgm', 'map.yaml']);
  expect(saved['map.yaml']?.toString()).toMatch(/# Flattened from 0\.3 to 1\.5 m over the floor\. /);

  // The command line makes the same of the same files, and so does the menu.
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-floor-'));
  for (const { name, content } of files) {
    mkdirSync(dirname(join(folder, name)), { recursive: true });
    writeFileSync(join(folder, name), content);
  }
  const grid = join(folder, 'map.yaml');
  const run = await scanstitch([
    'reconstruct',
    join(folder, 'room'),
    '--grid',
    grid,
    '--band',
    '0.3:1.5',
    '--out',
    join(folder, 'out'),
  ]);
  expect(run.status, run.stderr).toBe(0);
  await page.getByRole('button', { name: 'Export' }).click();
  const exported = await gridFrom(page, () => page.getByRole('menuitem', { name: /^Grid on the floor/ }).click());
  for (const name of ['map.pgm', 'map.yaml']) {
    expect(exported[name]?.equals(saved[name] ?? Buffer.alloc(0)), name).toBe(true);
    expect(readFileSync(join(folder, name)).equals(saved[name] ?? Buffer.alloc(0)), name).toBe(true);
  }
  rmSync(folder, { recursive: true });

  await expectNamedControls(page);
  for (const scheme of ['Dark', 'Light']) {
    await page.getByRole('button', { name: `${scheme} colours` }).click();
    await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  }
  await map.getByRole('radio', { name: 'Turn', exact: true }).check();
  await expect(map.getByAltText(/^The grid from above/)).toBeHidden();
});
