/** The surface of a run of depth images or clouds: making it, drawing, exporting and stopping it; after a failure the points are still shown. */
import { readFileSync } from 'node:fs';
import { expect, type Locator, type Page } from '@playwright/test';
import { roomCloud } from '../cli/room_clouds.mjs';
import { evenDepth, recording, truth } from './spatial_recording.js';
import { type SpatialPage, test } from './spatial_page.js';

const button = (page: Page): Locator => page.getByRole('button', { name: 'Surface', exact: true });
const shown = (page: Page, what: 'Points' | 'Surface' | 'Both'): Locator =>
  page.getByRole('radio', { name: what, exact: true });

/** Triangles and frames, as the line below the map has them. */
async function counts({ map }: SpatialPage): Promise<{ triangles: number; frames: string }> {
  const words = map.getByText(/ triangles of /);
  await expect(words).toBeVisible();
  const [, triangles = '', frames = ''] = /([\d\s]+) triangles of (.*? frames?)\b/.exec(await words.innerText()) ?? [];
  return { triangles: Number(triangles.replace(/\s/g, '')), frames };
}

/** What the menu of exports gives. */
async function taken(page: Page, item: string, name: string): Promise<Buffer> {
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: item }).click();
  const file = await download;
  expect(file.suggestedFilename()).toBe(name);
  return readFileSync(await file.path());
}

const exported = (page: Page, format: string): Promise<Buffer> =>
  taken(page, `Surface as ${format}`, `surface.${format.toLowerCase()}`);

test('the surface of a room is drawn in the place of the points, coloured by its deviation, and exported', async ({
  drawn: spatial,
  page,
}) => {
  await page.setViewportSize({ width: 700, height: 500 });
  await spatial.drop(recording(8));
  const { result } = await spatial.stitched();
  await page.setViewportSize({ width: 700, height: 560 }); // room for the line below the map
  const numWorkers = (): number => page.workers().filter((worker) => /surface-worker/.test(worker.url())).length;
  expect(numWorkers()).toBe(0);
  await spatial.map.getByRole('group', { name: 'Map' }).press('m');
  const { triangles, frames } = await counts(spatial);
  expect(numWorkers()).toBe(1);
  expect(triangles).toBeGreaterThan(20_000);
  expect(frames).toBe(`${result.frames.length} frames`);
  await expect(button(page)).toHaveAttribute('aria-pressed', 'true');

  await shown(page, 'Points').check();
  const points = await spatial.picture();
  const num_painted = await spatial.numPainted();
  await button(page).click();
  await expect(shown(page, 'Surface')).toBeChecked();
  const surface = await spatial.picture();
  expect(surface).not.toBe(points);
  expect(await spatial.numPainted()).toBeGreaterThan(num_painted / 2);
  await shown(page, 'Both').check();
  expect([points, surface]).not.toContain(await spatial.picture());
  await shown(page, 'Surface').check();
  await page.getByRole('checkbox', { name: 'Standard deviation' }).check();
  await expect(spatial.map.getByText(/\d mm or more/)).toBeVisible();
  expect(await spatial.picture()).not.toBe(surface);

  const ply = await exported(page, 'PLY');
  expect(ply.toString('latin1', 0, 600)).toMatch(
    new RegExp(`property float deviation\nelement face ${triangles}\n[^]*end_header\n`),
  );
  expect((await exported(page, 'STL')).readUInt32LE(80)).toBe(triangles);
  expect((await exported(page, 'OBJ')).toString().match(/^f /gm)).toHaveLength(triangles);
  const glb = await exported(page, 'GLB');
  expect(glb.readUInt32LE(8)).toBe(glb.length);
  const { meshes, accessors } = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  expect(accessors[meshes[0].primitives[0].indices].count).toBe(3 * triangles);

  await page.getByRole('combobox', { name: 'Triangles' }).selectOption('20 000');
  await expect(spatial.map.getByText(/; moved by up to \d+\.\d mm to have fewer/)).toBeVisible();
  const decimated = (await counts(spatial)).triangles;
  expect(decimated).toBeLessThanOrEqual(20_000);
  expect((await exported(page, 'STL')).readUInt32LE(80)).toBe(decimated);
  await page.getByRole('combobox', { name: 'Triangles' }).selectOption('all');
  await expect(spatial.map.getByText(/ moved by /)).toBeHidden();
  expect((await counts(spatial)).triangles).toBe(triangles);

  await page.getByRole('combobox', { name: 'Voxels' }).selectOption('5 cm');
  await expect(spatial.map.getByText('; voxels of 5 cm')).toBeVisible();
  expect((await counts(spatial)).triangles).toBeLessThan(triangles / 3);

  await page.getByRole('combobox', { name: 'Holes' }).selectOption('filled up to 50 cm');
  await expect(spatial.map.getByText(/; [\d\s]+ of them fill holes/)).toBeVisible();
  await expect(spatial.map.getByText('filled, not measured')).toBeVisible();
  expect((await exported(page, 'PLY')).toString('latin1', 0, 600)).toContain('property uchar filled\n');
  await page.getByRole('combobox', { name: 'Holes' }).selectOption('open');
  await expect(spatial.map.getByText('filled, not measured')).toBeHidden();
});

test('clouds have a surface, too: its voxels follow from their density, and their holes stay open', async ({
  drawn: spatial,
  page,
}) => {
  await spatial.drop([0, 1].map((number) => ({ name: `${number}.ply`, content: roomCloud(number) })));
  await spatial.stitched();
  const points = await spatial.picture();
  await button(page).click();
  const { triangles, frames } = await counts(spatial);
  expect(triangles).toBeGreaterThan(5000);
  expect(frames).toBe('2 frames');
  expect(await spatial.picture()).not.toBe(points);
  await expect(spatial.map.getByText(/ cm, as the points lie too far apart for smaller ones/)).toBeVisible();
  await expect(page.getByRole('combobox', { name: 'Holes' })).toBeHidden();
  expect((await exported(page, 'STL')).readUInt32LE(80)).toBe(triangles);
  await page.getByRole('combobox', { name: 'Voxels' }).selectOption('50 cm');
  await expect(spatial.map.getByText('; voxels of 50 cm')).toBeVisible();
  expect((await counts(spatial)).triangles).toBeLessThan(triangles / 2);
});

test('the apartment is walked in, ridden through, measured and cut; its pictures and a video of it are taken along', async ({
  drawn: spatial,
  page,
}) => {
  await page.setViewportSize({ width: 1000, height: 860 });
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /^An apartment/ }).click();
  await spatial.stitched();
  await spatial.map.getByRole('group', { name: 'Map' }).press('m');
  await counts(spatial);
  await page.getByRole('combobox', { name: 'Voxels' }).selectOption('5 cm');
  await expect(spatial.map.getByText('; voxels of 5 cm')).toBeVisible();
  const zip = (await taken(page, 'Images and poses', 'splats.zip')).toString('latin1');
  for (const path of ['transforms.json', 'sparse/0/images.txt', 'sparse_pc.ply', 'images/frame_00041.jpg'])
    expect(zip.includes(path), path).toBe(true);
  await useTools(spatial, page);
  // The eight seconds of a turn go by in one.
  await page.evaluate(() => {
    const now = performance.now.bind(performance);
    performance.now = () => 8 * now();
  });
  const video = await taken(page, 'Turntable', 'turntable.webm');
  expect(video.readUInt32BE(0)).toBe(0x1a45dfa3); // EBML
  expect(video.length).toBeGreaterThan(20_000);
});

/** On foot, along the camera's path, measuring and cutting, on a map with a surface. */
async function useTools(spatial: SpatialPage, page: Page): Promise<void> {
  const { map } = spatial;
  const stage = map.getByRole('group', { name: 'Map' });
  const tool = (name: string): Locator => map.getByRole('radio', { name, exact: true });
  const from_above = await spatial.picture();
  await stage.press('v');
  // What was drawn so far, and is not to be seen again.
  const seen = new Set<string>();
  const isNew = async (): Promise<void> => {
    const picture = await spatial.picture();
    expect(seen.has(picture)).toBe(false);
    seen.add(picture);
  };
  await tool('Walk').check();
  await isNew();
  await page.keyboard.press('w', { delay: 100 });
  await isNew();
  await page.keyboard.press('ArrowLeft', { delay: 100 });
  await isNew();
  await map.getByRole('button', { name: 'Step to the right' }).press('Enter');
  await isNew();
  await stage.press('Escape');
  await expect(tool('Turn')).toBeChecked();

  await tool('Camera’s path').check();
  await expect(map.getByText('1 of 41')).toBeVisible();
  await isNew();
  await stage.press('ArrowRight');
  await expect(map.getByText('2 of 41')).toBeVisible();
  await expect(map.getByAltText('What the camera saw here')).toBeVisible();
  await isNew();
  await map.getByRole('button', { name: 'Play', exact: true }).click();
  await expect(map.getByText('41 of 41')).toBeVisible();
  await expect(map.getByRole('button', { name: 'Play', exact: true })).toBeVisible();
  await isNew();
  await stage.press('Escape');
  await stage.press('Escape'); // selects no frame

  // On the floor seen straight from above, what is measured is what the scale says.
  await map.getByRole('button', { name: 'View from above' }).click();
  await map.getByRole('button', { name: 'Orthographic view' }).click();
  await spatial.settled();
  await tool('Measure').check();
  const { x, y, width, height } = (await spatial.canvas.boundingBox()) ?? { x: 0, y: 0, width: 0, height: 0 };
  const scale = map.locator('.scale');
  const metres = Number(/[\d.]+/.exec(await scale.innerText())?.[0]) / ((await scale.boundingBox())?.width ?? 0);
  const output = map.getByRole('status');
  await expect(output).toHaveText('Choose the first point.');
  await page.mouse.click(x + 0.3 * width, y + 0.77 * height);
  await expect(output).toHaveText('Choose the second point.');
  await page.mouse.click(x + 0.4 * width, y + 0.77 * height);
  await expect(output).toHaveText(/^\d+\.\d{3} m ± \d+ mm$/);
  const measured = Number(/^[\d.]+/.exec(await output.innerText())?.[0]);
  expect(Math.abs(measured / (0.1 * width * metres) - 1)).toBeLessThan(0.03);
  await isNew();
  await page.mouse.click(x + 4, y + 4);
  await expect(output).toHaveText('There is no surface at this point.');

  await map.getByRole('combobox', { name: 'Section' }).selectOption('across');
  const half = await spatial.numPainted();
  await map.getByRole('slider', { name: 'Place of the section' }).fill('1');
  expect(await spatial.numPainted()).toBeGreaterThan(1.3 * half);
  await stage.press('v');
  await expect(tool('Turn')).toHaveCount(0);
  await map.getByRole('button', { name: 'Orthographic view' }).click();
  await map.getByRole('button', { name: 'Show the whole map' }).click();
  expect(await spatial.picture()).toBe(from_above);
}

test('a surface is stopped in its middle and made again; it stays without its ground truth, not with other frames', async ({
  spatial,
  page,
}) => {
  // The fourth frame waits until it is let go.
  await page.evaluate(() => {
    const { postMessage } = Worker.prototype;
    const held = Object.assign(window, { num_added: 0, is_held: true });
    Worker.prototype.postMessage = function (this: Worker, message: unknown, options: unknown): void {
      const is_frame = (message as { method?: string }).method === 'put' && ++held.num_added > 3;
      if (!is_frame || !held.is_held) postMessage.call(this, message, options as StructuredSerializeOptions);
    };
  });
  await spatial.drop([...recording(8), truth(8)]);
  await spatial.stitched();
  await button(page).click();
  await expect(page.getByText('Surface: frame 4 of 8')).toBeVisible();
  await page.getByRole('button', { name: 'Stop' }).click();
  await expect(page.getByText('Surface: frame 4 of 8')).toBeHidden();
  await expect(page.getByRole('status').filter({ hasText: 'The points of the map are still there' })).toHaveCount(1);
  await expect(shown(page, 'Surface')).toHaveCount(0);
  await expect(spatial.messages).toBeHidden();
  await page.evaluate(() => Object.assign(window, { is_held: false }));
  // From the menu, it is made first.
  expect((await exported(page, 'GLB')).toString('latin1', 0, 4)).toBe('glTF');
  expect((await counts(spatial)).frames).toBe('8 frames');
  await page.getByRole('button', { name: /^Remove the ground truth/ }).click();
  await expect(spatial.figures).not.toContainText('Mean L2 distance');
  await expect(shown(page, 'Surface')).toBeChecked();
  await spatial.drop(recording(5));
  await spatial.stitched();
  await expect(shown(page, 'Surface')).toHaveCount(0);
  await expect(button(page)).toHaveAttribute('aria-pressed', 'false');
});

test('a surface that is switched on while the run goes on grows with it, and its points stay shown where they were chosen', async ({
  spatial,
  page,
}) => {
  // From the third on, frames wait until they are let go.
  await page.evaluate(() => {
    const { postMessage } = Worker.prototype;
    const start = { since: performance.now(), num_placed: 0, placed_at: 0 };
    const held = Object.assign(window, { ...start, num_free: 2, waiting: [] as (() => void)[] });
    Worker.prototype.postMessage = function (this: Worker, message: unknown, options: unknown): void {
      const post = (): void => postMessage.call(this, message, options as StructuredSerializeOptions);
      const { method, id } = message as { method?: string; id?: number };
      const isFrame = method === 'place';
      if (isFrame) {
        this.addEventListener('message', ({ data }) => {
          if (data.id === id) [held.num_placed, held.placed_at] = [held.num_placed + 1, performance.now()];
        });
      }
      if (!isFrame || held.num_free-- > 0) post();
      else held.waiting.push(post);
    };
  });
  const letGo = (count: number): Promise<void> =>
    page.evaluate((count) => {
      const held = window as unknown as { num_free: number; waiting: (() => void)[] };
      const now = held.waiting.splice(0, count);
      held.num_free = count - now.length;
      for (const post of now) post();
    }, count);
  await spatial.drop(recording(8));
  // A map is sent with the next frame after this: between two maps there is as long as it took to the first, or 400 ms.
  await page.waitForFunction(() => {
    const { since, num_placed, placed_at } = window as unknown as Record<'since' | 'num_placed' | 'placed_at', number>;
    return num_placed === 2 && performance.now() - placed_at > 2 * (placed_at - since) + 400;
  });
  await letGo(1);
  await expect.poll(async () => Number(await spatial.table.getAttribute('aria-rowcount')) - 1).toBeGreaterThan(1);
  await button(page).click();
  // It begins with the frames of the map that was sent last: the third may come with the next one, or wait as it is near the second.
  await expect(spatial.map.getByText(/ triangles of (2 frames|3 frames|2 of 3 frames so far); voxels/)).toBeVisible();
  await shown(page, 'Both').check();
  await letGo(8);
  await spatial.stitched();
  await expect(spatial.map.getByText(/ triangles of 8 frames/)).toBeVisible();
  await expect(shown(page, 'Both')).toBeChecked();
});

test('what leaves no surface, or less of it, is told, and the points stay', async ({ spatial, page }) => {
  // One frame alone.
  await spatial.drop(recording(1));
  await spatial.stitched();
  await button(page).click();
  expect((await counts(spatial)).frames).toBe('1 frame');

  // Frames that do not overlap: those that are lost are left out.
  const apart = recording(3).map((file) =>
    /depth\/[23]/.test(file.name) ? { ...file, content: evenDepth(/2/.test(file.name) ? 700 : 3900) } : file,
  );
  await spatial.drop(apart);
  const { result } = await spatial.stitched();
  const num_good = result.frames.filter(({ status, piece }) => status === 'good' && piece === 0).length;
  expect(num_good).toBeLessThan(3);
  await button(page).click();
  expect((await counts(spatial)).frames).toBe(`${num_good} of 3 frames`);
  await expect(spatial.map.getByText(/those with a good pose/)).toBeVisible();
});

test('a worker that runs out of memory is told, and it is tried again', async ({ spatial, page }) => {
  // The first worker fails from its first line on: a fault that is put in once it runs may come too late.
  const fails = `addEventListener('message', ({ data }) => {
    if (data.method === 'put') throw new RangeError('Out of memory');
  });\n`;
  await page.route(
    /surface-worker/,
    async (route) => {
      const response = await route.fetch();
      await route.fulfill({ response, body: fails + (await response.text()) });
    },
    { times: 1 },
  );
  await spatial.drop(recording(4));
  await spatial.stitched();
  await button(page).click();
  await expect(spatial.messages).toContainText(
    /The surface could not be made.*memory.*points of the map are still there/,
  );
  await expect(spatial.table.getByRole('row')).toHaveCount(5);
  await spatial.messages.getByRole('button', { name: 'Try again' }).click();
  expect((await counts(spatial)).frames).toBe('4 frames');
  await expect(spatial.messages).toBeHidden();
});
