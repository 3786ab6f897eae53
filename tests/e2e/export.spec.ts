import { readFileSync, writeFileSync } from 'node:fs';
import type { Download } from '@playwright/test';
import { unzipSync } from 'fflate';
import { openOne } from '../cli/bag_files.mjs';
import { expect, type ScanstitchPage, test } from './scanstitch_page.js';

async function exported(app: ScanstitchPage, item: RegExp): Promise<{ name: string; bytes: Buffer }> {
  await app.page.getByRole('button', { name: 'Export' }).click();
  const download: Promise<Download> = app.page.waitForEvent('download');
  await app.page.getByRole('menuitem', { name: item }).click();
  const file = await download;
  return { name: file.suggestedFilename(), bytes: readFileSync(await file.path()) };
}

function expectTum(text: string): void {
  const rows = text
    .trim()
    .split('\n')
    .filter((line) => !line.startsWith('#'))
    .map((line) => line.split(' ').map(Number));
  expect(rows).toHaveLength(10);
  for (const row of rows) {
    expect(row).toHaveLength(8);
    expect(Math.hypot(...row.slice(4))).toBeCloseTo(1, 6);
  }
}

function expectMatrix(text: string): void {
  const rows = text
    .trim()
    .split('\n')
    .map((line) => line.trim().split(/\s+/).map(Number));
  expect(rows.map((row) => row.length)).toEqual([4, 4, 4, 4]);
  expect(rows[3]).toEqual([0, 0, 0, 1]);
}

function expectPly(bytes: Uint8Array): void {
  const header = Buffer.from(bytes.subarray(0, 400)).toString('latin1');
  expect(header).toMatch(/^ply\nformat binary_little_endian 1\.0\n/);
  expect(Number(/element vertex (\d+)/.exec(header)?.[1])).toBeGreaterThan(1000);
}

const PNG_SIGNATURE = [0x89, 0x50, 0x4e, 0x47];

test('each result alone, and everything in one zip; the page reads its own map again', async ({ app }) => {
  const trajectory = await exported(app, /^Trajectory/);
  expect(trajectory.name).toBe('trajectory.tum');
  expectTum(trajectory.bytes.toString());

  const matrices = unzipSync((await exported(app, /^Matrices/)).bytes);
  expect(Object.keys(matrices)).toHaveLength(10);
  expect(Object.keys(matrices)).toContain('matrices/0003_3.txt');
  for (const file of Object.values(matrices)) expectMatrix(Buffer.from(file).toString());

  const picture = await exported(app, /^Picture/);
  expect(picture.name).toBe('map.png');
  expect([...picture.bytes.subarray(0, 4)]).toEqual(PNG_SIGNATURE);
  expect(picture.bytes.length).toBeGreaterThan(10_000);

  const tiff = await exported(app, /^GeoTIFF/);
  expect(tiff.name).toBe('map.tif');
  expect(tiff.bytes.toString('latin1', 0, 4)).toBe('II*\0');

  const walls = await exported(app, /^Walls to print/);
  expect(walls.name).toBe('walls.stl');
  expect(walls.bytes.readUInt32LE(80)).toBeGreaterThan(100);
  expect(walls.bytes).toHaveLength(84 + 50 * walls.bytes.readUInt32LE(80));
  const space = await exported(app, /^Walls in space/);
  expect([space.name, space.bytes.toString('latin1', 0, 4)]).toEqual(['walls.glb', 'glTF']);

  const mcap = await exported(app, /^MCAP/);
  const { bag } = await openOne(mcap.name, new Uint8Array(mcap.bytes));
  expect(bag.topics.map(({ name: topic, count }) => [topic, count])).toEqual([
    ['/map', 1],
    ['/path', 1],
    ['/scan_points', 10],
    ['/tf', 10],
  ]);

  const { name, bytes } = await exported(app, /^Everything/);
  expect(name).toBe('scanstitch.zip');
  const files = unzipSync(bytes);
  const content = (path: string): Buffer => Buffer.from(files[path] ?? []);
  expectTum(content('trajectory.tum').toString());
  expectMatrix(content('matrices/0000_0.txt').toString());
  expectPly(content('map.ply'));
  expect([...content('map.png').subarray(0, 4)]).toEqual(PNG_SIGNATURE);
  const report = JSON.parse(content('report.json').toString());
  expect(report.version).toMatch(/^\d+\.\d+\.\d+/);
  expect(report.settings.strategy).toBe('joint');
  expect(report.frames).toHaveLength(10);
  expect(report.sharpness.mean_residual).toBeGreaterThan(0);

  const map = await exported(app, /^Map/);
  expectPly(map.bytes);
  await app.drop([{ name: map.name, content: map.bytes }]);
  const { result } = await app.stitched();
  expect(result.frames[0]?.cleaning.num_read).toBeGreaterThan(1000);
});

test('the report to be read: one file with its picture, which runs no script and fits on paper', async ({
  app,
}, info) => {
  const { name, bytes } = await exported(app, /^Report to print/);
  expect(name).toBe('report.html');
  const file = info.outputPath('report.html');
  writeFileSync(file, bytes);
  const page = await app.page.context().newPage();
  const asked: string[] = [];
  page.on('request', (request) => asked.push(request.url()));
  await page.goto(`file://${file}`);
  await expect(page.getByRole('heading', { level: 1 })).toHaveText('Sample: a corridor');
  const picture = page.getByRole('img', { name: 'The map as it was on the screen' });
  expect(await picture.evaluate((img: HTMLImageElement) => img.complete && img.naturalWidth)).toBeGreaterThan(200);
  await expect(page.locator('tbody').first().locator('tr')).toHaveCount(10);
  await expect(page.locator('.figures')).toContainText('With all poses aligned');
  await expect(page.getByText('corridor/truth.tum', { exact: true })).toBeVisible();
  expect(asked.filter((url) => !url.startsWith('data:'))).toHaveLength(1);
  await page.emulateMedia({ media: 'print' });
  await page.setViewportSize({ width: 794, height: 1123 }); // A4
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(794);
  // No word or number is broken, and the far end of the corridor does not shrink the picture.
  const broken = await page
    .locator('thead th, tbody:first-of-type td:nth-child(n + 3):not(:last-child)')
    .evaluateAll((cells) =>
      cells.flatMap((cell) => {
        const range = document.createRange();
        range.selectNodeContents(cell);
        return new Set(Array.from(range.getClientRects(), ({ top }) => Math.round(top))).size > 1
          ? [cell.textContent]
          : [];
      }),
    );
  expect(broken).toEqual([]);
  const path = page.getByRole('img', { name: 'Map and path from above' }).locator('path[stroke="#2356c7"]');
  // The same way up as in the picture above it: the corridor runs across.
  const [of_path, of_all] = await path.evaluate((line: SVGPathElement) => [
    line.getBoundingClientRect().width,
    line.ownerSVGElement?.getBoundingClientRect().width ?? 0,
  ]);
  expect((of_path ?? 0) / (of_all ?? 1)).toBeGreaterThan(0.4);
  await expect(page.getByText('y to the right, −x up')).toBeVisible();
  await page.screenshot({ path: info.outputPath('report.png'), fullPage: true });
});
