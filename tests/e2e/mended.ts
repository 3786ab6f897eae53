/** What tests of mending a map have in common: the drive that is mended, its steps replayed, and the panel as everybody meets it. */
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Locator, Page } from '@playwright/test';
import { unzipSync } from 'fflate';
import { BUILDING, driveLog } from '../cli/drive_log.mjs';
import { scanstitch, writeFiles } from '../cli/support.mjs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { expect, overflowOf, type ScanstitchPage } from './scanstitch_page.js';

export const NUM_SCANS = 66;
export const LOG = driveLog(BUILDING, 0, NUM_SCANS);

/** The log, stitched, with the panel open. */
export async function mendTheLog(app: ScanstitchPage): Promise<Locator> {
  await app.drop([{ name: 'drive.log', content: LOG }]);
  await app.stitched();
  await app.stage.press('m');
  return app.page.locator('scanstitch-mend');
}

export interface Replayed {
  /** The file of steps that the page saved. */
  steps: Buffer;
  /** What the command line said. */
  stderr: string;
  /** What it wrote. */
  written: (name: string) => Buffer;
}

/**
 * Saves the steps, and replays them on the command line: it writes the same bytes as the page exports. `look`: at what it wrote,
 * before that goes.
 */
export async function expectReplayed(
  { page }: ScanstitchPage,
  names: readonly string[],
  look: (replayed: Replayed) => Promise<void> | void = () => undefined,
): Promise<void> {
  const saving = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save the steps' }).click();
  const steps = readFileSync(await (await saving).path());
  const folder = mkdtempSync(join(tmpdir(), 'scanstitch-mended-'));
  const [log = '', file = ''] = writeFiles(folder, { 'drive.log': LOG, 'drive.steps.json': steps });
  const { status, stderr } = await scanstitch(['edit', log, file, '--g2o', '--out', folder]);
  expect(status, stderr).toBe(0);
  await page.getByRole('button', { name: 'Export' }).click();
  const exporting = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Everything/ }).click();
  const exported = unzipSync(readFileSync(await (await exporting).path()));
  const written = (name: string): Buffer => readFileSync(join(folder, name));
  for (const name of ['trajectory.tum', 'map.ply', 'report.json', 'map.pgm', 'map.yaml', ...names]) {
    expect(Buffer.from(exported[name] ?? []).equals(written(name)), name).toBe(true);
  }
  await look({ steps, stderr, written });
  rmSync(folder, { recursive: true });
}

/** All controls have names, all words are legible, light and dark, and nothing is wider than a phone. */
export async function expectForEverybody(page: Page): Promise<void> {
  await expectNamedControls(page);
  for (const scheme of ['Dark', 'Light']) {
    await page.getByRole('button', { name: `${scheme} colours` }).click();
    await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  }
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
}
