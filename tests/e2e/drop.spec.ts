import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { BUILDING, driveLog } from '../cli/drive_log.mjs';
import { expect, sampleScans, test, ZJU_FOLDER, zjuScans } from './scanstitch_page.js';

/** The published positions of the ten recorded scans, m. */
const MATLAB_POSITIONS = [
  [0, 0],
  [0.0459, 1.1082],
  [0.1924, 2.2068],
  [0.3375, 3.3133],
  [0.397, 4.01],
  [0.3145, 5.0264],
  [0.2742, 5.9423],
  [0.1316, 6.8498],
  [0.1663, 8.1005],
  [0.1687, 9.0731],
];

test('ten recorded scans, dropped in any order, become a trajectory and a map', async ({ empty: app }, info) => {
  test.skip(!existsSync(ZJU_FOLDER), '../shared/data is absent');
  const reference = { name: 'matlab.txt', content: MATLAB_POSITIONS.map(([x, y]) => `${x} ${y} 0`).join('\n') };
  const scans = zjuScans();
  await app.drop([...scans.slice(5).reverse(), reference, ...scans.slice(0, 5)]);
  const { result, timing, elapsed_ms } = await app.stitched();
  info.annotations.push({ type: 'from drop to drawn map', description: `${elapsed_ms.toFixed(0)} ms` });
  info.annotations.push({ type: 'computing', description: `${timing.total.toFixed(0)} ms` });

  expect(await app.scanNames()).toEqual(Array.from({ length: 10 }, (_, i) => `${i}.ply`));
  expect(result.frames.filter(({ status }) => status === 'lost')).toEqual([]);
  expect(result.sharpness?.mean_residual).toBeLessThanOrEqual(0.017);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.121);
  expect(result.comparison?.max).toBeLessThanOrEqual(0.3);
  await expect(app.page.getByLabel('Result in figures')).toContainText('Distance to matlab.txt');
  await expect(app.page.getByText('Your scans')).toBeVisible();
});

test('scans are put in natural order: 2.ply before 10.ply; files of no use leave them, and say why', async ({
  empty: app,
  page,
}) => {
  const scans = sampleScans();
  const names = ['scan_10.ply', 'scan_2.ply', 'scan_1.ply'];
  await app.drop(names.map((name, i) => ({ name, content: scans[2 - i]?.content ?? '' })));
  await app.stitched();
  const order = ['scan_1.ply', 'scan_2.ply', 'scan_10.ply'];
  expect(await app.scanNames()).toEqual(order);

  await app.drop([{ name: 'broken.ply', content: 'ply\nformat ascii 1.0\nelement vertex 3\nend_header\n' }]);
  await expect(app.messages).toContainText('broken.ply');
  expect(await app.scanNames()).toEqual(order);
  await expect(page.getByRole('region', { name: 'Replaced recording' })).toBeHidden();
  // Another run before this one would be the next to be told.
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_map');
});

test('a drop replaces what is open; Undo brings it back as it was, and Redo the other one', async ({ app, page }) => {
  const scans = sampleScans();
  const bar = page.getByRole('region', { name: 'Replaced recording' });
  await app.drop(scans.slice(3, 7).map(({ name, content }) => ({ name: `hall_${name}`, content })));
  const first = await app.stitched();
  expect(first.result.frames).toHaveLength(4);
  await expect(bar).toBeHidden(); // the sample can be opened again
  await app.setting('Strategy').selectOption('scan_to_map');
  const second = await app.stitched();
  await app.drop(scans.slice(0, 3));
  const third = await app.stitched();
  expect(third.result.frames).toHaveLength(3);
  expect(third.result.settings.strategy).toBe('scan_to_map');
  expect(await app.scanNames()).toEqual(['0.ply', '1.ply', '2.ply']);

  await bar.getByRole('button', { name: 'Undo' }).click();
  expect(await app.scanNames()).toEqual(['hall_3.ply', 'hall_4.ply', 'hall_5.ply', 'hall_6.ply']);
  // The engine has it, too: the trajectory that is written is that of the run before.
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Trajectory/ }).click();
  const rows = readFileSync(await (await download).path(), 'utf8')
    .split('\n')
    .filter((row) => /^[\d.]/.test(row));
  expect(rows.map((row) => Number(row.split(' ')[1]))).toEqual(
    second.result.frames.map(({ T_world_sensor: { x } }) => expect.closeTo(x, 6) as unknown as number),
  );
  await bar.getByRole('button', { name: 'Redo' }).click();
  expect(await app.scanNames()).toEqual(['0.ply', '1.ply', '2.ply']);
  await bar.getByRole('button', { name: 'Dismiss' }).click();
  await expect(bar).toBeHidden();
  // Another run before this one would be the next to be told.
  await app.setting('Strategy').selectOption('scan_to_scan');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_scan');
});

test('files join what they replaced when that is wanted; one of the same name replaces the old one', async ({
  empty: app,
  page,
}) => {
  const scans = sampleScans();
  const add = page.getByRole('button', { name: 'Add instead' });
  await app.drop(scans.slice(3, 7));
  await app.stitched();
  await app.drop(scans.slice(0, 4));
  await app.stitched();
  await add.click();
  expect((await app.stitched()).result.frames).toHaveLength(7);
  expect(await app.scanNames()).toEqual(['0.ply', '1.ply', '2.ply', '3.ply', '4.ply', '5.ply', '6.ply']);
  await expect(add).toBeHidden();
});

test('a second log joins the first when that is wanted, and lies where it was driven', async ({ empty: app, page }) => {
  const [numFirst, first, last] = [40, 20, 66];
  await app.drop([{ name: 'monday.log', content: driveLog(BUILDING, 0, numFirst) }]);
  await app.stitched();
  await app.drop([{ name: 'tuesday.log', content: driveLog(BUILDING, first, last) }]);
  await app.stitched();
  await page.getByRole('button', { name: 'Add instead' }).click();
  const { frames } = (await app.stitched()).result;
  expect(frames).toHaveLength(numFirst + last - first);
  expect(new Set(frames.map(({ piece }) => piece)).size).toBe(1);
  const off = (scan: number): number => {
    const [monday, tuesday] = [frames[scan], frames[numFirst + scan - first]].map((frame) => frame?.T_world_sensor);
    return Math.hypot((monday?.x ?? NaN) - (tuesday?.x ?? NaN), (monday?.y ?? NaN) - (tuesday?.y ?? NaN));
  };
  expect(Math.max(off(first), off(numFirst - 1))).toBeLessThan(0.05);

  // One of the same name is the same recording, or another one: which, its name does not tell.
  await app.drop([{ name: 'monday.log', content: driveLog(BUILDING, first, last) }]);
  await app.stitched();
  await expect(page.getByRole('button', { name: 'Undo' })).toBeVisible();
  await expect(page.getByRole('button', { name: 'Add instead' })).toBeHidden();
});

test('a trajectory dropped alone is compared with what is there', async ({ empty: app }) => {
  const scans = sampleScans();
  await app.drop(scans);
  expect((await app.stitched()).result.comparison).toBeNull();
  await app.drop([{ name: 'path.csv', content: scans.map((_, i) => `0, ${i}, 0`).join('\n') }]);
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(10);
  expect(result.comparison?.name).toBe('path.csv');
});

test('a folder is opened to any depth; what is no scan is named and not used', async ({ empty: app, page }, info) => {
  const folder = info.outputPath('recording');
  mkdirSync(join(folder, 'late'), { recursive: true });
  const scans = sampleScans();
  scans.slice(0, 2).forEach(({ name, content }) => void writeFileSync(join(folder, name), content));
  scans.slice(2, 4).forEach(({ name, content }) => void writeFileSync(join(folder, 'late', name), content));
  writeFileSync(join(folder, 'notes.md'), 'taken on a Tuesday');
  writeFileSync(join(folder, '.DS_Store'), 'x');

  // Only the browser itself makes entries that can be opened: a drop by its own protocol, with a path of this machine.
  const cdp = await page.context().newCDPSession(page);
  const box = await app.map.boundingBox();
  const [x, y] = [(box?.x ?? 0) + 100, (box?.y ?? 0) + 100];
  const data = { items: [], files: [folder], dragOperationsMask: 1 };
  for (const type of ['dragEnter', 'dragOver', 'drop'] as const)
    await cdp.send('Input.dispatchDragEvent', { type, x, y, data });

  const { result } = await app.stitched();
  expect(result.frames.map(({ name }) => name)).toEqual([
    'recording/0.ply',
    'recording/1.ply',
    'recording/late/2.ply',
    'recording/late/3.ply',
  ]);
  await expect(app.messages).toContainText('recording/notes.md');
  await expect(app.messages).not.toContainText('.DS_Store');
  await expect(page.locator('.title')).toHaveText('recording');
  await app.messages.getByRole('button', { name: 'Dismiss the messages' }).click();
  await expect(app.messages).toBeHidden();
});

test('files are picked as well as dropped', async ({ empty: app, page }) => {
  await page.getByRole('button', { name: 'Open' }).click();
  const chooser = page.waitForEvent('filechooser');
  await page.getByRole('menuitem', { name: /Files/ }).click();
  const scans = sampleScans().slice(0, 3);
  await (
    await chooser
  ).setFiles(
    scans.map(({ name, content }) => ({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(content) })),
  );
  expect((await app.stitched()).result.frames).toHaveLength(3);
});
