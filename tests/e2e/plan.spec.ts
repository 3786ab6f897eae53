/** A building plan behind the map: points taken by hand, by number and by keys, told where they contradict, undone and replayed. */
import { readFileSync } from 'node:fs';
import type { Locator } from '@playwright/test';
import { greyPng } from '../cli/depth_room.mjs';
import { expectForEverybody, expectReplayed, mendTheLog } from './mended.js';
import { expect, type ScanstitchPage, test } from './scanstitch_page.js';

const [WIDTH, HEIGHT] = [400, 200];
/** Black lines on white. */
const PLAN = greyPng(
  Uint16Array.from({ length: WIDTH * HEIGHT }, (_, at) => (at % 40 < 3 || Math.floor(at / WIDTH) % 40 < 3 ? 0 : 255)),
  WIDTH,
  8,
);
const PICTURE = { name: 'plan.png', mimeType: 'image/png', buffer: Buffer.from(PLAN) };
/** 5 cm a pixel, turned by a right angle. */
const inMap = ([u, v]: [number, number]): [number, number] => [2 + 0.05 * v, -4 + 0.05 * u];

async function openPlan(app: ScanstitchPage): Promise<Locator> {
  const panel = await mendTheLog(app);
  await panel.getByRole('button', { name: 'Plan', exact: true }).click();
  return panel;
}

/** Taps a point of the picture, given from its middle in CSS pixels; the pixel that it is. */
async function tapPicture(panel: Locator, right: number, down: number): Promise<[number, number]> {
  const stage = panel.getByRole('group', { name: 'Building plan' });
  await stage.scrollIntoViewIfNeeded();
  const { width = 0, height = 0 } = (await stage.boundingBox()) ?? {};
  await stage.click({ position: { x: width / 2 + right, y: height / 2 + down } });
  const scale = Math.min((width - 12) / WIDTH, (height - 12) / HEIGHT);
  return [WIDTH / 2 + right / scale, HEIGHT / 2 + down / scale];
}

async function typePlace(panel: Locator, point: number, [x, y]: [number, number]): Promise<void> {
  for (const [axis, value] of [
    ['x', x],
    ['y', y],
  ] as const) {
    const field = panel.getByLabel(`${axis} of point ${point} in the map (m)`);
    await field.fill(value.toFixed(3));
    await field.blur();
  }
}

test('a plan is laid by three points, told where they contradict, taken off, undone, and replayed to the same bytes', async ({
  empty: app,
  page,
}) => {
  const panel = await openPlan(app);
  const bare = await app.picture();
  const lay = panel.getByRole('button', { name: 'Lay the plan' });
  await panel.getByLabel('Picture of the plan').setInputFiles(PICTURE);
  await expect(panel.getByText(/Tap a corner of the building in the picture/)).toBeVisible();
  for (const [point, [right, down]] of (
    [
      [-60, -30],
      [70, -25],
      [-20, 35],
    ] as const
  ).entries()) {
    const tapped = await tapPicture(panel, right, down);
    await expect(panel.getByText(`Now tap point ${point + 1} on the map`, { exact: false })).toBeVisible();
    await typePlace(panel, point + 1, inMap(tapped));
  }
  await expect(panel.getByText('off 0.00 m')).toHaveCount(3);
  await expect(panel.getByText(/^5\d\.\d.mm$|^49\.\d.mm$|^50\.0.mm$/)).toBeVisible();
  // Laid on the map before it is taken.
  await expect.poll(() => app.picture()).not.toBe(bare);

  // A point that is off by two metres.
  const y = panel.getByLabel('y of point 2 in the map (m)');
  const right = await y.inputValue();
  await y.fill(String(Number(right) + 2));
  await y.blur();
  await expect(
    panel.getByText(/The points do not fit each other to 0\.0\d\d m: point \d is off by [\d.]+ m\. Correct/),
  ).toBeVisible();
  await y.fill(right);
  await y.blur();
  await expect(panel.getByText('off 0.00 m')).toHaveCount(3);
  await lay.click();
  await expect(panel.getByRole('heading', { name: '1 step taken' })).toBeVisible();
  await expect(lay).toBeDisabled();
  const laid = await app.picture();
  await panel.getByLabel('Opacity of the plan').fill('1');
  await expect.poll(() => app.picture()).not.toBe(laid);

  // On the command line, and what the page exports.
  let steps: Buffer = Buffer.from('');
  await expectReplayed(app, ['plan.png', 'plan.pgw'], (replayed) => {
    expect(replayed.stderr).toContain('building plan plan.png of 0.05');
    expect(replayed.written('plan.png').equals(PICTURE.buffer)).toBe(true);
    steps = replayed.steps;
  });

  // Undone by a key, opened from the file, taken off, and that undone.
  const inList = page.getByText('Building plan: plan.png');
  await page.getByRole('button', { name: 'Layers' }).click();
  await expect(inList).toBeVisible();
  await app.stage.press('Control+z');
  await expect(inList).toBeHidden();
  await panel
    .getByLabel('File of steps')
    .setInputFiles({ name: 'plan.steps.json', mimeType: 'application/json', buffer: steps });
  await expect(inList).toBeVisible();
  await panel.getByRole('button', { name: 'Take it off' }).click();
  await expect(inList).toBeHidden();
  await expect(panel.getByText('Choose a picture')).toBeVisible();
  await app.stage.press('Control+z');
  await expect(inList).toBeVisible();
  await expect(panel.getByText('off 0.00 m')).toHaveCount(3);

  // A workbench keeps it; it is there without the panel.
  await page.getByRole('button', { name: 'Export' }).click();
  const keeping = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Workbench/ }).click();
  await app.drop([{ name: 'workbench.zip', content: readFileSync(await (await keeping).path()) }]);
  await expect(panel).toBeHidden();
  await expect(inList).toBeVisible();
});

test('points of a plan are taken by keys, on a phone as well, and what is no picture is told', async ({
  empty: app,
  page,
}) => {
  const panel = await openPlan(app);
  const input = panel.getByLabel('Picture of the plan');
  await input.setInputFiles({ name: 'plan.pdf', mimeType: 'application/pdf', buffer: Buffer.from('%PDF-1.4') });
  await expect(
    panel.getByText('plan.pdf: The browser reads no picture from it: save it as PNG or JPEG.'),
  ).toBeVisible();
  // Dropped on the map, which would be depth images without the panel.
  await app.drop([{ name: 'plan.png', content: PLAN }]);
  const picture = panel.getByRole('group', { name: 'Building plan' });
  await expect(panel.getByText(/Tap a corner of the building in the picture/)).toBeVisible();
  for (const [point, keys] of [
    [1, []],
    [2, ['ArrowLeft']],
    [3, ['ArrowUp', 'ArrowRight']],
  ] as const) {
    for (const key of keys) await picture.press(key);
    await picture.press('Enter');
    await expect(panel.getByText(`Now tap point ${point} on the map`, { exact: false })).toBeVisible();
    for (const key of keys) await app.stage.press(key);
    await app.stage.press('Enter');
  }
  const places = panel.getByRole('list', { name: 'Points of the plan' }).getByRole('listitem');
  await expect(places).toHaveCount(3);
  await expect(panel.getByRole('button', { name: 'Lay the plan' })).toBeEnabled();
  await panel.getByRole('button', { name: 'Remove point 2' }).click();
  await expect(places).toHaveCount(2);
  await expect(panel.getByRole('button', { name: 'Lay the plan' })).toBeDisabled();

  await expectForEverybody(page);
  await expect(picture).toBeVisible();
});
