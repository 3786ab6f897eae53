/** A map that is mended on the page: a wrong loop from a file of steps, found and removed; what the command line makes of the steps. */
import { readFileSync } from 'node:fs';
import { expectForEverybody, expectReplayed, LOG, mendTheLog, NUM_SCANS } from './mended.js';
import { expect, test } from './scanstitch_page.js';

/** As if two scans 9 m apart had been taken at one place. */
const WRONG = { action: 'add_loop', target: 5, source: 55, T_target_source: { x: 0, y: 0, theta: 0 }, unchecked: true };

const stepsFile = (...steps: object[]): { name: string; mimeType: string; buffer: Buffer } => ({
  name: 'wrong.steps.json',
  mimeType: 'application/json',
  buffer: Buffer.from(JSON.stringify({ scanstitch_steps: 1, num_scans: NUM_SCANS, settings: {}, steps })),
});

test('a wrong loop is found and removed by three clicks, undone by a key, and replayed on the command line', async ({
  empty: app,
  page,
}) => {
  await app.drop([{ name: 'drive.log', content: LOG }]);
  const right = (await app.stitched()).result;
  const posesOf = ({ frames }: typeof right): unknown[] => frames.map(({ T_world_sensor }) => T_world_sensor);
  await page.getByRole('button', { name: 'Mend the map' }).click();
  const panel = page.locator('scanstitch-mend');
  await panel.getByLabel('File of steps').setInputFiles(stepsFile(WRONG));
  const wrong = (await app.stitched()).result;
  expect(wrong.frames.every(({ status }) => status === 'doubtful')).toBe(true);

  // What a user does who sees the bent map.
  await panel.getByRole('button', { name: /contradicted/ }).click();
  await expect(panel.getByRole('list', { name: 'What it changes' })).toContainText(/scans become good/);
  await panel.getByRole('button', { name: 'Remove this loop' }).click();
  expect(posesOf((await app.stitched()).result)).toEqual(posesOf(right));
  await expect(panel.getByRole('heading', { name: '2 steps taken' })).toBeVisible();

  // By keys: undone, and removed again.
  await app.stage.press('Control+z');
  expect(posesOf((await app.stitched()).result)).toEqual(posesOf(wrong));
  await panel.getByRole('button', { name: /contradicted/ }).press('Enter');
  await expect(panel.getByRole('button', { name: 'Remove this loop' })).toBeEnabled();
  await app.stage.press('Escape');
  await expect(panel.getByRole('button', { name: 'Remove this loop' })).toBeHidden();
  await panel.getByRole('button', { name: /contradicted/ }).press('Enter');
  await expect(panel.getByRole('button', { name: 'Remove this loop' })).toBeEnabled();
  await app.stage.press('Delete');
  await app.stitched();
  await app.stage.press('Control+z');
  await app.stitched();

  // The steps as they are now, saved, and the results of both.
  await expectReplayed(app, [], async ({ written }) => {
    const saved = page.waitForEvent('download');
    await panel.getByRole('button', { name: 'Save the graph' }).click();
    expect(readFileSync(await (await saved).path()).equals(written('graph.g2o'))).toBe(true);
  });

  // The workbench is the same map again, with its steps.
  await page.getByRole('button', { name: 'Export' }).click();
  const keeping = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Workbench/ }).click();
  await app.drop([{ name: 'workbench.zip', content: readFileSync(await (await keeping).path()) }]);
  expect(posesOf((await app.stitched()).result)).toEqual(posesOf(wrong));
  await page.getByRole('button', { name: 'Mend the map' }).click();
  await expect(panel.getByRole('heading', { name: '1 step taken' })).toBeVisible();
});

test('a loop is proposed by two scans, refused with the reason, and the panel is for everybody', async ({
  empty: app,
  page,
}) => {
  const panel = await mendTheLog(app);
  await panel.getByRole('button', { name: 'Propose a loop' }).click();
  await panel.getByLabel('First scan').fill('5');
  await panel.getByLabel('First scan').press('Enter');
  await panel.getByLabel('Second scan').fill('55');
  await panel.getByLabel('Second scan').press('Enter');
  const changes = panel.getByRole('list', { name: 'What it changes' });
  await expect(changes).toContainText('No scan moves by a millimetre');
  await panel.getByRole('button', { name: 'On the first' }).click();
  await expect(changes).toContainText('Refused: The scans do not match there');
  await expect(panel.getByRole('button', { name: 'Add this loop' })).toBeDisabled();

  // The second scan is dragged, and the map stays.
  const [x, y] = await app.placeOnMap(200, 200);
  const before = await app.worldAt(x, y);
  const picture = await app.picture();
  await page.mouse.down();
  await page.mouse.move(x + 60, y + 30, { steps: 3 });
  await page.mouse.up();
  expect(await app.worldAt(x, y)).toBe(before);
  expect(await app.picture()).not.toBe(picture);

  await expectForEverybody(page);
  // What it changes may be out of sight there, the decision is not.
  await expect(panel.getByRole('button', { name: 'Back' })).toBeInViewport({ ratio: 1 });
});

test('the grid is painted by hand and by numbers, cropped and turned to the walls, undone by a key, and replayed to the same bytes', async ({
  empty: app,
  page,
}) => {
  const panel = await mendTheLog(app);
  await panel.getByRole('button', { name: 'Grid and frame' }).click();
  const taken = panel.getByRole('heading', { name: /steps? taken/ });

  // By the mouse: a line is dragged, and the map stays.
  const [x, y] = await app.placeOnMap(150, 150);
  const before = await app.worldAt(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 90, y + 60, { steps: 4 });
  await page.mouse.up();
  expect(await app.worldAt(x, y)).toBe(before);
  const field = (name: string): ReturnType<typeof panel.getByLabel> => panel.getByLabel(name, { exact: true });
  const fromX = Number(/x (-?[\d.]+)/.exec(before.replace('−', '-'))?.[1]);
  await expect.poll(async () => Math.abs(Number(await field('From x (m)').inputValue()) - fromX)).toBeLessThan(0.02);
  await panel.getByRole('button', { name: 'Paint the line' }).click();
  await app.stitched();
  await expect(taken).toHaveText('1 step taken');

  // By numbers, and what is wrong with them.
  const type = async (numbers: Record<string, string>): Promise<void> => {
    for (const [name, value] of Object.entries(numbers)) {
      await field(name).fill(value);
      await field(name).blur();
    }
  };
  await panel.getByRole('button', { name: 'Rectangle' }).click();
  await panel.getByRole('button', { name: 'Unknown' }).click();
  await type({ 'From x (m)': '1', 'From y (m)': '-0.5', 'To x (m)': '1', 'To y (m)': '0.5' });
  await expect(panel.getByRole('status')).toHaveText('The rectangle has no size: give two opposite corners.');
  await expect(panel.getByRole('button', { name: 'Paint the rectangle' })).toBeDisabled();
  await type({ 'To x (m)': '2' });
  await app.stage.press('Enter');
  await app.stitched();
  await expect(taken).toHaveText('2 steps taken');

  // By two taps; undone by a key, and done again.
  await panel.getByRole('button', { name: 'Rotate to the walls' }).click();
  await app.stitched();
  await panel.getByRole('button', { name: 'Crop', exact: true }).click();
  await page.mouse.click(...(await app.placeOnMap(120, 120)));
  await page.mouse.click(...(await app.placeOnMap(250, 280)));
  await panel.getByRole('button', { name: 'Crop to the rectangle' }).click();
  await app.stitched();
  await expect(taken).toHaveText('4 steps taken');
  await app.stage.press('Control+z');
  await app.stitched();
  await expect(taken).toHaveText('3 steps taken');

  // Corner by corner: by taps, by numbers, and one that is dragged.
  await panel.getByRole('button', { name: 'Polygon' }).click();
  const [cornerX, cornerY] = await app.placeOnMap(120, 120);
  await page.mouse.click(cornerX, cornerY);
  await page.mouse.click(...(await app.placeOnMap(250, 130)));
  await page.mouse.click(...(await app.placeOnMap(190, 240)));
  await type({ 'Corner x (m)': '3', 'Corner y (m)': '1' });
  await panel.getByRole('button', { name: 'Add', exact: true }).click();
  await expect(panel.getByRole('status')).toHaveText('4 corners');
  await panel.getByRole('button', { name: 'Remove the last' }).click();
  await expect(panel.getByRole('status')).toHaveText('3 corners');
  await page.mouse.move(cornerX, cornerY);
  await page.mouse.down();
  await page.mouse.move(cornerX + 20, cornerY + 30, { steps: 3 });
  await page.mouse.up();
  await expect(panel.getByRole('status')).toHaveText('3 corners');
  await panel.getByRole('button', { name: 'Paint the polygon' }).click();
  await app.stitched();
  await expect(taken).toHaveText('4 steps taken');

  await expectReplayed(app, [], ({ steps }) => {
    const actions = JSON.parse(steps.toString()).steps.map(({ action }: { action: string }) => action);
    expect(actions).toEqual(['paint_line', 'paint_rectangle', 'rotate', 'paint_polygon']);
  });

  await expectForEverybody(page);
});

test('points of the map are measured by hand, by numbers and by keys, and a place tells the scans that saw it', async ({
  empty: app,
  page,
}) => {
  const panel = await mendTheLog(app);
  await panel.getByRole('button', { name: 'Measure' }).click();
  const take = async (x: string, y: string): Promise<void> => {
    await panel.getByLabel('Point x (m)').fill(x);
    await panel.getByLabel('Point y (m)').fill(y);
    await panel.getByRole('button', { name: 'Take', exact: true }).click();
  };
  for (const [x, y] of [
    ['0', '0'],
    ['4', '0'],
    ['4', '3'],
  ]) {
    await take(x ?? '', y ?? '');
  }
  const told = panel.getByRole('status');
  await expect(told).toContainText(/Distance\s*3\.000 m\s*Direction\s*90\.0°\s*Angle at the point before\s*90\.0°/);
  await expect(told).toContainText(/Along all points\s*7\.000 m\s*Round them\s*12\.000 m\s*Area\s*6\.00 m²/);
  await take('0', '3');
  await take('2', '-9');
  await expect(told).toContainText('none: the way crosses itself');
  await app.stage.press('Escape');
  await expect(told).toBeHidden();

  // By keys: the place under the cross, which the arrow keys move.
  const cross = panel.getByText(/^x −?[\d.]+ m, y −?[\d.]+ m$/).first();
  await app.stage.press('Enter');
  await app.stage.press('ArrowRight');
  await expect(cross).toBeVisible();
  await app.stage.press('Enter');
  await expect(told).toContainText(/Distance\s*[\d.]+ m/);
  await app.stage.press('Backspace');
  await expect(told).not.toContainText('Distance');
  await app.stage.press('Escape');

  // By the mouse: what is told is what the map tells of the place.
  const [x, y] = await app.placeOnMap(200, 200);
  await page.mouse.click(x, y);
  const at = await app.worldAt(x, y);
  await expect(told).toContainText(at.replace(' y', ', y'));

  // The laser of the first scan stood at the origin: beams of it pass near by, ahead of it.
  await panel.getByRole('button', { name: 'Scans at a place' }).click();
  await take('0.5', '0');
  const list = panel.getByRole('list', { name: 'Scans at the place' });
  await expect(list.getByRole('button', { name: /^scan 0 / })).toBeVisible();
  await expect(panel.getByText(/scans at x 0\.50 m, y 0\.00 m: beams of 0 end there/)).toBeVisible();
  await list.getByRole('button', { name: /^scan 0 / }).click();
  await expect(list.getByRole('button', { name: /^scan 0 / })).toHaveAttribute('aria-pressed', 'true');
  await take('500', '0');
  await expect(panel.getByText(/^0 scans at/)).toBeVisible();

  await expectForEverybody(page);
});

test('the map is anchored to known coordinates, refused where they contradict each other, undone, and replayed to the same bytes', async ({
  empty: app,
  page,
}) => {
  const panel = await mendTheLog(app);
  /** Of the last run that was done. */
  const first = (): Promise<{ x: number; y: number; theta: number }> =>
    page.evaluate(() => {
      const last = window.stitched.at(-1) as unknown as { result: { frames: { T_world_sensor: never }[] } };
      return last.result.frames[0]?.T_world_sensor as never;
    });
  const before = await first();
  await panel.getByRole('button', { name: 'Grid and frame' }).click();
  await panel.getByRole('button', { name: 'Anchor', exact: true }).click();
  const [x, y] = await app.placeOnMap(150, 150);
  await page.mouse.click(x, y);
  await page.mouse.click(x + 120, y);
  const places = panel.getByText(/^\d: −?[\d.]+, −?[\d.]+ m is$/);
  await expect(places).toHaveCount(2);
  const numbers = (await places.allTextContents()).map((text) =>
    text.replaceAll('−', '-').slice(2).split(',').map(Number.parseFloat),
  );
  const [[x0 = 0, y0 = 0] = [], [x1 = 0, y1 = 0] = []] = numbers;
  const anchor = panel.getByRole('button', { name: 'Anchor the map' });
  await expect(anchor).toBeDisabled();
  const type = async (name: string, value: number): Promise<void> => {
    await panel.getByLabel(name, { exact: true }).fill(value.toFixed(2));
    await panel.getByLabel(name, { exact: true }).blur();
  };
  // Turned by a right angle, and shifted; the second place first too far away.
  await type('X of place 1 (m)', 300 - y0);
  await type('Y of place 1 (m)', 50 + x0);
  await type('X of place 2 (m)', 300 - y1);
  await type('Y of place 2 (m)', 50 + x1 + 2);
  await anchor.click();
  const refusal = page.getByRole('listitem').filter({ hasText: 'the pairs do not fit each other to 0.05 m: pair' });
  await expect(refusal).toContainText('further apart in the world than in the map');
  await expect(panel.getByRole('heading', { name: '0 steps taken' })).toBeVisible();
  expect(await first()).toEqual(before);

  // The pairs are still there to be corrected.
  await type('Y of place 2 (m)', 50 + x1);
  await anchor.click();
  await expect.poll(async () => (await first()).x).toBeGreaterThan(200);
  const { x: atX, y: atY, theta } = await first();
  expect(Math.hypot(atX - (300 - before.y), atY - (50 + before.x))).toBeLessThan(0.05);
  expect(Math.abs(Math.sin(theta - before.theta - Math.PI / 2))).toBeLessThan(0.02);
  await expect(panel.getByRole('heading', { name: '1 step taken' })).toBeVisible();

  await expectReplayed(app, []);
  await app.stage.press('Control+z');
  await expect.poll(first).toEqual(before);
});
