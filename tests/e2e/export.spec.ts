import { readFileSync } from 'node:fs';
import type { Download } from '@playwright/test';
import { unzipSync } from 'fflate';
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

test('the trajectory as TUM', async ({ app }) => {
  const { name, bytes } = await exported(app, /^Trajectory/);
  expect(name).toBe('trajectory.tum');
  expectTum(bytes.toString());
});

test('one matrix a scan', async ({ app }) => {
  const { bytes } = await exported(app, /^Matrices/);
  const files = unzipSync(bytes);
  expect(Object.keys(files)).toHaveLength(10);
  expect(Object.keys(files)).toContain('matrices/0003_3.txt');
  for (const file of Object.values(files)) expectMatrix(Buffer.from(file).toString());
});

test('the map as PLY, which the page reads again', async ({ app }) => {
  const { name, bytes } = await exported(app, /^Map/);
  expectPly(bytes);
  await app.drop([{ name, content: bytes }]);
  const { result } = await app.stitched();
  expect(result.frames[0]?.cleaning.num_read).toBeGreaterThan(1000);
});

test('the picture as PNG', async ({ app }) => {
  const { name, bytes } = await exported(app, /^Picture/);
  expect(name).toBe('map.png');
  expect([...bytes.subarray(0, 4)]).toEqual(PNG_SIGNATURE);
  expect(bytes.length).toBeGreaterThan(10_000);
});

test('everything in one zip', async ({ app }) => {
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
});
