/** Bad input, workers that die, a graphics card that gives up: each is told, and nothing that was computed is lost. */
import { mkdirSync, readFileSync, truncateSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import type { Page } from '@playwright/test';
import { idle, noteAnswers } from './answers.js';
import { gateWorkers } from './held.js';
import type { InputFile } from './scanstitch_page.js';
import { colorPicture, evenDepth, recording, truth } from './spatial_recording.js';
import { expect, SpatialPage, test } from './spatial_page.js';
import { stopAfter } from './stop.js';

test('a depth image that is cut off or of zeros only is named, and the frames around it are placed', async ({
  spatial,
}) => {
  const files = recording(6).map((file): InputFile => {
    if (file.name === 'room/depth/5.png') return { ...file, content: evenDepth(0) };
    if (file.name !== 'room/depth/3.png') return file;
    return { ...file, content: file.content.slice(0, file.content.length / 2) };
  });
  await spatial.drop([...files, truth(6)]);
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(4);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.02);
  await expect(spatial.messages.getByRole('listitem')).toHaveCount(2);
  for (const name of ['3.png', '5.png']) await expect(spatial.messages).toContainText(name);
});

test('colour images in the place of depth are told', async ({ spatial, page }) => {
  await spatial.drop(
    recording(4).map((file) => (/depth/.test(file.name) ? { ...file, content: colorPicture() } : file)),
  );
  await expect(spatial.messages).toContainText(/Called depth, but holds 8-bit colours/);
  await expect(page.getByRole('button', { name: 'Stop' })).toBeHidden();
  expect(await spatial.app.numStitched()).toBe(0);
});

test('a colour image of another size, and one that is missing, are told, and every frame is placed', async ({
  spatial,
}) => {
  const one_pixel = Buffer.from(
    'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC',
    'base64',
  );
  const files = recording(4)
    .filter(({ name }) => name !== 'room/rgb/4.png')
    .map((file) => (file.name === 'room/rgb/2.png' ? { ...file, content: one_pixel } : file));
  await spatial.drop(files);
  expect((await spatial.stitched()).result.frames.map(({ status }) => status)).toEqual(Array(4).fill('good'));
  await expect(spatial.page.getByText(/2\.png.*1 x 1 pixels, the depth image 160 x 120/)).toBeVisible();
  await expect(spatial.messages).toContainText(/4\.png/);
});

test('a colour image that the browser can no longer read is told, and its frame is placed', async ({
  spatial,
  page,
}) => {
  const files = recording(4);
  const gone = files.find(({ name }) => name === 'room/rgb/3.png')?.content as Buffer;
  await page.evaluate((size) => {
    const read = Object.getOwnPropertyDescriptor(Blob.prototype, 'arrayBuffer')?.value as Blob['arrayBuffer'];
    Blob.prototype.arrayBuffer = function (this: Blob) {
      const is_gone = this instanceof File && this.name.endsWith('3.png') && this.size === size;
      return is_gone ? Promise.reject(new DOMException('gone', 'NotFoundError')) : read.call(this);
    };
  }, gone.length);
  await spatial.drop(files);
  const { result } = await spatial.stitched();
  expect(result.frames.map(({ status }) => status)).toEqual(Array(4).fill('good'));
  expect(result.notes.join('\n')).toMatch(
    /depth\/3\.png: its colours are left out: .*rgb\/3\.png: This file could not be read; was it moved or deleted\?/,
  );
  await expect(page.getByText(/rgb\/3\.png: This file could not be read/)).toBeVisible();
});

test('a reference with another number of poses, or one that is not finite, is told, and the frames are placed without it', async ({
  spatial,
}) => {
  await spatial.drop([...recording(5), truth(3)]);
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(5);
  expect(result.comparison).toBeFalsy();
  const message = spatial.messages.getByRole('listitem').filter({ hasText: 'truth.txt' });
  await expect(message).toHaveCount(1);
  await expect(message).toContainText('The reference has 3 poses, but the recording has 5 frames');

  const bad = String(truth(5).content).replace(/^2 \S+/m, '2 nan');
  await spatial.drop([...recording(5), { name: 'room/truth.txt', content: bad }]);
  expect((await spatial.stitched()).result.frames).toHaveLength(5);
  await expect(message).toContainText(/nan/i);
});

/**
 * The first workers with this script throw at their third message that counts. It stands in the script: seen from outside, all may be
 * done before a listener is there.
 */
async function doom(page: Page, script: string, count: number, counts = 'true') {
  let numStarted = 0;
  await page.route(`**/*${script}*.js`, async (route) => {
    const response = await route.fetch();
    const fatal = `let numHeard = 0;
      addEventListener('message', (event) => {
        if (${counts} && ++numHeard === 3) throw new Error('for the sake of this test');
      });\n`;
    await route.fulfill({ response, body: (numStarted++ < count ? fatal : '') + (await response.text()) });
  });
}

test('preparing workers that die in the middle are replaced, and no frame is missing', async ({ spatial, page }) => {
  await doom(page, 'preparer-worker', 2);
  await spatial.drop([...recording(20), truth(20)]);
  const { result } = await spatial.stitched();
  expect(result.frames.map(({ index }) => index)).toEqual(Array.from({ length: 20 }, (_, i) => i));
  await expect(spatial.messages).toContainText('crashed and was replaced');
});

test('a registrar that crashes is told and begins again by itself', async ({ spatial, page }) => {
  await doom(page, 'registrar-worker', 1, "event.data.method === 'place'");
  await spatial.drop([...recording(12), truth(12)]);
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(12);
  await expect(spatial.messages).toContainText('It was started again and computes again');
});

test('a stop answers at once and keeps what is done; it goes on from there', async ({ page }, info) => {
  const spatial = new SpatialPage(page);
  // However slow the page is, the run is not over before it is stopped.
  const gate = await gateWorkers(page, 'place', 60);
  await noteAnswers(page);
  await spatial.open();
  await spatial.drop([...recording(90), truth(90)]);
  const { ms, atOnce } = await stopAfter(page, 'scanstitch-spatial', 1);
  await gate.open(0);
  expect(atOnce).toContain('Stopped: partial map');
  info.annotations.push({ type: 'from stop to stopped', description: `${ms.toFixed(0)} ms` });
  const numRows = async (): Promise<number> => Number(await spatial.table.getAttribute('aria-rowcount')) - 1;
  expect(await numRows()).toBeGreaterThan(1);
  await expect(page.getByRole('button', { name: 'Export' })).toBeEnabled();
  // It stays stopped when a file of no use is dropped, and when the ground truth is removed.
  await spatial.drop([{ name: 'README.md', content: 'words' }]);
  await expect(spatial.messages).toContainText('The file cannot be used');
  await page.getByRole('button', { name: /^Remove the ground truth/ }).click();
  // The frame that was being registered may still come in.
  await idle(page);
  expect(await numRows()).toBeLessThan(90);
  await page.getByRole('button', { name: 'Dismiss the messages' }).click();
  await gate.close();
  await page.getByRole('button', { name: 'Continue' }).click();
  // It goes on when one is dropped in its middle.
  await spatial.drop([{ name: 'README.md', content: 'words' }]);
  await expect(page.getByRole('button', { name: 'Stop' })).toBeVisible();
  await expect(spatial.messages).toContainText('The file cannot be used');
  await gate.open();
  expect((await spatial.stitched()).result.frames).toHaveLength(90);
  expect(spatial.app.faults).toEqual([]);
});

test('a lost graphics context is told and comes back with all that was computed', async ({ drawn: spatial, page }) => {
  await spatial.drop(recording(5));
  await spatial.stitched();
  const before = await spatial.numPainted();
  await spatial.canvas.evaluate((canvas: HTMLCanvasElement) => {
    canvas.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
  });
  await expect(page.getByRole('status').filter({ hasText: 'The map has been redrawn' })).toHaveCount(1);
  expect(await spatial.numPainted()).toBeGreaterThan(0.9 * before);
  await expect(spatial.table.getByRole('row')).toHaveCount(6);
});

test('everything can be exported', async ({ spatial, page }) => {
  await spatial.drop([...recording(5), truth(5)]);
  await spatial.stitched();
  const files: [RegExp, string, (bytes: Buffer) => void][] = [
    [/^Trajectory/, 'trajectory.tum', (bytes) => expect(bytes.toString().trim().split('\n')).toHaveLength(6)],
    [
      /^Map as PLY/,
      'map.ply',
      (bytes) => expect(bytes.toString('latin1', 0, 300)).toMatch(/^ply\n[^]*property \w+ red/),
    ],
    [/^Map as PCD/, 'map.pcd', (bytes) => expect(bytes.toString('latin1', 0, 200)).toMatch(/VERSION/)],
    [
      /^PCD, compressed/,
      'map.pcd',
      (bytes) => expect(bytes.toString('latin1', 0, 400)).toMatch(/DATA binary_compressed\n/),
    ],
    [/^Report to print/, 'report.html', (bytes) => expect(bytes.toString()).toMatch(/^<!doctype html>[^]*5 frames/i)],
    [/^Report as JSON/, 'report.json', (bytes) => expect(JSON.parse(bytes.toString()).frames).toHaveLength(5)],
    [/^Errors/, 'errors.csv', (bytes) => expect(bytes.toString()).toMatch(/error_m[^]*\n4,/)],
    [/^Picture/, 'map.png', (bytes) => expect(bytes.readUInt32BE(16)).toBeGreaterThan(1000)],
    [/^Everything/, 'scanstitch.zip', (bytes) => expect(bytes.length).toBeGreaterThan(10_000)],
  ];
  for (const [item, name, check] of files) {
    await page.getByRole('button', { name: 'Export' }).click();
    const download = page.waitForEvent('download');
    await page.getByRole('menuitem', { name: item }).click();
    const taken = await download;
    expect(taken.suggestedFilename()).toBe(name);
    check(readFileSync(await taken.path()));
  }
});

test('a tab in the background computes on: nothing waits for the screen', async ({ spatial, page }) => {
  // What a hidden tab does: no animation frame comes.
  await page.evaluate(() => {
    window.requestAnimationFrame = () => 0;
  });
  await spatial.drop(recording(8));
  await expect(page.getByRole('status').filter({ hasText: /8 frames registered/ })).toHaveCount(1, { timeout: 60_000 });
  await expect(spatial.table.getByRole('row')).toHaveCount(9);
});

test('a folder with a gigabyte beside the frames is not read to its end', async ({ spatial, page }, info) => {
  const folder = info.outputPath('large');
  for (const { name, content } of recording(4)) {
    const path = join(folder, name);
    mkdirSync(dirname(path), { recursive: true });
    writeFileSync(path, content);
  }
  writeFileSync(join(folder, 'film.mp4'), '');
  truncateSync(join(folder, 'film.mp4'), 2 ** 30);
  await page.evaluate(() => {
    const read = Blob.prototype.arrayBuffer;
    const counted = Object.assign(window, { most_read: 0 });
    Blob.prototype.arrayBuffer = function () {
      counted.most_read = Math.max(counted.most_read, this.size);
      return read.call(this);
    };
    for (const name of ['stream', 'text'] as const)
      Blob.prototype[name] = () => {
        throw new Error(`${name} is not counted`);
      };
  });
  await page.locator('#pick-folder').setInputFiles(folder);
  expect((await spatial.stitched()).result.frames).toHaveLength(4);
  const most_read = await page.evaluate(() => (window as unknown as { most_read: number }).most_read);
  expect(most_read).toBeGreaterThan(0);
  expect(most_read).toBeLessThan(2 ** 24);
  await expect(spatial.messages).toContainText('film.mp4');
});

test('without graphics the figures, the table and the exports are there, and it is said', async ({ spatial, page }) => {
  await page.evaluate(() => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...rest: unknown[]) {
      return kind.startsWith('webgl') ? null : original.call(this, kind as '2d', ...(rest as []));
    } as typeof original;
  });
  await spatial.drop([...recording(4), truth(4)]);
  expect((await spatial.stitched()).result.frames).toHaveLength(4);
  await expect(spatial.map.getByText('does not support 3D graphics')).toBeVisible();
  await expect(spatial.figures).toContainText('Mean L2 distance');
});
