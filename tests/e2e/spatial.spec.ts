/** Depth images become a trajectory and a coloured map in space; what the page shows of them. */
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { zipSync } from 'fflate';
import { overflowOf } from './scanstitch_page.js';
import { recording, truth } from './spatial_recording.js';
import { expect, SpatialPage, test } from './spatial_page.js';

const SHARED = join(import.meta.dirname, '../../../shared/data/rgbd');
const NUM_FRAMES = 10;

test('a dropped recording becomes a map, a path and its error against the truth, looked at frame by frame', async ({
  drawn: spatial,
  page,
}) => {
  await spatial.drop([...recording(NUM_FRAMES), truth(NUM_FRAMES)]);
  const { result } = await spatial.stitched();
  expect(result.frames.map(({ status }) => status)).toEqual(Array(NUM_FRAMES).fill('good'));
  expect(result.comparison?.num_matched).toBe(NUM_FRAMES);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.02);
  await expect(page.locator('.title')).toHaveText('room');
  await expect(spatial.figures).toContainText('Mean L2 distance to truth.txt');
  await expect(spatial.figures).toContainText(/160 × 120, 90°/);
  await expect(spatial.table.getByRole('row')).toHaveCount(NUM_FRAMES + 1);
  expect(await spatial.numPainted()).toBeGreaterThan(20_000);
  // What cannot be seen is told.
  await expect(page.getByRole('img', { name: /points from 10 of 10 frames along a path/ })).toBeVisible();
  await expect(page.getByRole('status').filter({ hasText: /10 frames registered/ })).toHaveCount(1);

  // Slider, charts, table and keys select a frame and show its images.
  await spatial.slider.focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  await expect(spatial.slider).toHaveAttribute('aria-valuetext', '3 of 10 frames');
  await expect(spatial.panel.getByRole('heading', { level: 2 })).toHaveText('3.png');
  await expect(spatial.panel.getByRole('img', { name: 'What the camera saw in frame 3.png' })).toBeVisible();
  await expect(spatial.panel.getByRole('img', { name: /Depth image of frame 3\.png, from \d/ })).toBeVisible();
  await expect(spatial.panel.getByText('Error', { exact: true })).toBeVisible();
  const few = await spatial.numPainted();
  await page.keyboard.press('End');
  await expect.poll(() => spatial.numPainted()).toBeGreaterThan(few);

  await spatial.panel.getByRole('img', { name: /^Time of each frame/ }).click({ position: { x: 150, y: 40 } });
  await expect(spatial.panel.getByRole('heading', { level: 2 })).not.toHaveText('10.png');
  await spatial.map.getByRole('group', { name: 'Map' }).focus();
  await page.keyboard.press('Escape');
  await expect(spatial.panel.getByRole('heading', { name: 'All frames' })).toBeVisible();
  await page.keyboard.press(',');
  await expect(spatial.panel.getByRole('heading', { level: 2 })).toHaveText('10.png');
});

test('a zip of the recording, and the planar scans after it, each go to their view', async ({ spatial, page }) => {
  const files = [...recording(4), truth(4)];
  const packed = zipSync(Object.fromEntries(files.map(({ name, content }) => [name, Buffer.from(content)])));
  await spatial.drop([{ name: 'room.zip', content: Buffer.from(packed) }]);
  expect((await spatial.stitched()).result.frames).toHaveLength(4);
  await expect(spatial.map).toBeVisible();
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /^The sample/ }).click();
  expect((await spatial.app.stitched()).result.frames).toHaveLength(10);
  await expect(spatial.map).toBeHidden();
  await expect(spatial.app.map).toBeVisible();
  // All is removed, what lies behind the scans as well.
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /^Remove all/ }).click();
  await page.goBack();
  await expect(page.getByRole('heading', { name: 'Drop depth images here' })).toBeVisible();
});

test('the section cuts the ceiling, keys turn, move and zoom, and colours by height, frame and direction differ', async ({
  drawn: spatial,
  page,
}) => {
  await page.setViewportSize({ width: 900, height: 600 }); // graphics are emulated pixel by pixel
  await spatial.drop(recording(6));
  await spatial.stitched();
  await spatial.settled();
  const open = await spatial.picture();
  expect(await spatial.section.getAttribute('aria-valuetext')).toMatch(/ m above the floor$/);
  await spatial.section.focus();
  await page.keyboard.press('End');
  await expect(spatial.section).toHaveAttribute('aria-valuetext', 'nothing is cut away');
  expect(await spatial.picture()).not.toBe(open);
  await page.keyboard.press('Home');
  // Below the floor nothing is left but paths and cameras.
  const shut = await spatial.numPainted();
  await page.keyboard.press('End');
  expect(await spatial.numPainted()).toBeGreaterThan(3 * shut);

  await spatial.map.getByRole('group', { name: 'Map' }).focus();
  let before = await spatial.picture();
  for (const key of ['ArrowLeft', 'ArrowDown', 'Shift+ArrowLeft', '+', 'p', 't']) {
    await page.keyboard.press(key);
    const now = await spatial.picture();
    expect(now, key).not.toBe(before);
    before = now;
  }

  await page.getByRole('button', { name: 'Layers' }).last().click();
  const pictures = new Set<string>();
  for (const mode of ['image', 'height', 'frame', 'normal']) {
    await spatial.map.getByRole('combobox', { name: 'Colour' }).selectOption(mode);
    pictures.add(await spatial.picture());
  }
  expect(pictures.size).toBe(4);
});

test('more frames, added to a finished run, go on from it', async ({ spatial, page }) => {
  await spatial.drop(recording(5));
  const first = await spatial.stitched();
  await spatial.drop([...recording(4, 5), truth(9)]);
  expect((await spatial.stitched()).result.frames).toHaveLength(4);
  await page.getByRole('button', { name: 'Add instead' }).click();
  const { result } = await spatial.stitched();
  expect(result.frames).toHaveLength(9);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.02);
  // The first frames were not computed again.
  expect(result.frames[2]?.T_world_sensor).toEqual(first.result.frames[2]?.T_world_sensor);
});

test('a changed setting computes again: a camera that moves on a floor', async ({ spatial, page }) => {
  await spatial.drop([...recording(8), truth(8)]);
  const chain = await spatial.stitched();
  await page.locator('scanstitch-spatial').getByLabel('Motion').selectOption('planar');
  const { result } = await spatial.stitched();
  expect(result.settings.motion).toBe('planar');
  expect(result.frames).toHaveLength(8);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.02);
  expect(result.frames[7]?.T_world_sensor).not.toEqual(chain.result.frames[7]?.T_world_sensor);
});

test('every control has a name; at the width of a phone all is there, in tabs, and nothing scrolls sideways', async ({
  spatial,
  page,
}) => {
  await spatial.drop([...recording(4), truth(4)]);
  await spatial.stitched();
  await page.emulateMedia({ colorScheme: 'dark', reducedMotion: 'reduce' });
  await page.getByRole('button', { name: 'Layers' }).last().click();
  const controls = await page.locator('button:visible, input:visible, select:visible, [tabindex="0"]:visible').all();
  expect(controls.length).toBeGreaterThan(20);
  for (const control of controls) await expect(control).toHaveAccessibleName(/\w/);
  await page.keyboard.press('Escape');

  await page.setViewportSize({ width: 360, height: 740 });
  for (const name of ['Result', 'Frame', 'Frames', 'Settings']) {
    await page.getByRole('tab', { name, exact: true }).click();
    expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  }
  const box = await spatial.map.boundingBox();
  expect(box?.width).toBe(360);
  expect(box?.height).toBeGreaterThan(200);
});

test('the first floor of an apartment, with nothing set', async ({ spatial, page }, info) => {
  const folder = join(SHARED, 'apartment_first_floor');
  test.skip(!existsSync(folder), '../shared/data is absent');
  await page.locator('#pick-folder').setInputFiles(folder);
  const { result, elapsed_ms, timing } = await spatial.stitched();
  expect(result.frames).toHaveLength(80);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.06);
  await expect(spatial.figures).toContainText(/Mean L2 distance to GT_pose\.npy\s*\d+\.\d\smm/);
  info.annotations.push({ type: 'mean L2', description: `${((result.comparison?.mean ?? 0) * 1000).toFixed(1)} mm` });
  info.annotations.push({ type: 'from drop to drawn map', description: `${(elapsed_ms / 1000).toFixed(1)} s` });
  info.annotations.push({ type: 'registering', description: `${(timing.total / 80).toFixed(1)} ms a frame` });
});

test('the sample of an apartment opens and finishes; once it is decided how depth is read, threads prepare it in one way', async ({
  spatial,
  page,
}, info) => {
  // Every frame that is given to a thread from now on; the menu's warm-up is another run, before.
  await page.evaluate(() => {
    const given: { frame: unknown; decodeConfig: unknown }[] = [];
    Object.assign(window, { given });
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (this: Worker, message: unknown, options: unknown): void {
      const { method, args = [] } = message as { method?: string; args?: unknown[] };
      if (method === 'prepareFrame') given.push({ decodeConfig: args[0], frame: args[2] });
      postMessage.call(this, message, options as StructuredSerializeOptions);
    };
  });
  await page.getByRole('button', { name: 'Open' }).click();
  await page.getByRole('menuitem', { name: /^An apartment/ }).click();
  const { result } = await spatial.stitched();
  expect(result.frames.filter(({ status }) => status !== 'good')).toEqual([]);
  expect(result.comparison?.mean).toBeLessThanOrEqual(0.03);
  const shown = await spatial.figures.innerText();
  expect(shown).toMatch(/Mean L2 distance to GT_pose\.npy\s+\d+\.\d\smm/);
  info.annotations.push({ type: 'mean L2', description: shown.match(/\d+\.\d\smm/)?.[0] ?? '' });
  const given = await page.evaluate(() => (window as unknown as { given: Given[] }).given);
  const decidedFor = (frame: number): unknown => {
    const { decodeConfig } = given.findLast((one) => one.frame === frame) ?? { decodeConfig: '{}' };
    return (JSON.parse(decodeConfig) as { depth: { decided: string | null } }).depth.decided;
  };
  expect(decidedFor(0)).toBeNull();
  expect(decidedFor(result.frames.length - 1)).toBe(result.quantisation);
});

/** A frame that was given to a thread, and what it was to be prepared with. */
interface Given {
  frame: number;
  decodeConfig: string;
}

test('on a single core no frame is prepared while another one is registered', async ({ page }) => {
  await page.addInitScript(() => {
    Object.defineProperty(navigator, 'hardwareConcurrency', { value: 1 });
    const calls: string[] = [];
    Object.assign(window, { calls });
    window.Worker = class extends Worker {
      constructor(...given: ConstructorParameters<typeof Worker>) {
        super(...given);
        const methods = new Map<number, string>();
        const post = this.postMessage.bind(this);
        this.postMessage = (call: { id: number; method: string }, ...more: []) => {
          methods.set(call.id, call.method);
          calls.push(call.method);
          post(call, ...more);
        };
        this.addEventListener('message', ({ data }: MessageEvent<{ id: number }>) => {
          calls.push(`${methods.get(data.id) ?? ''} answered`);
        });
      }
    };
  });
  const spatial = new SpatialPage(page);
  await spatial.open();
  await spatial.drop(recording(NUM_FRAMES));
  await spatial.stitched();
  const calls = await page.evaluate(() => (window as unknown as { calls: string[] }).calls);
  const steps = calls.filter((call) => /^(prepareFrame|place)( answered)?$/.test(call));
  const frame = ['prepareFrame', 'prepareFrame answered', 'place', 'place answered'];
  expect(steps).toEqual(Array.from({ length: NUM_FRAMES }, () => frame).flat());
});
