import { expect, test } from './scanstitch_page.js';

test('the slider builds the map scan by scan, and plays to the end', async ({ app, page }) => {
  const slider = page.getByRole('slider', { name: 'Scans shown' });
  const whole = await app.numPainted();
  await slider.focus();
  await page.keyboard.press('Home');
  await expect(slider).toHaveAttribute('aria-valuetext', '1 of 10 scans');
  await expect.poll(() => app.numPainted()).toBeLessThan(0.75 * whole);
  await page.keyboard.press('ArrowRight');
  await expect(slider).toHaveAttribute('aria-valuetext', '2 of 10 scans');
  await expect(app.why).toContainText('1.ply');
  await page.keyboard.press('End');
  await page.keyboard.press('Tab');
  await expect(slider).toHaveAttribute('aria-valuetext', '10 of 10 scans');

  await page.clock.install();
  // Looking from outside may miss a value, so the page writes all of them down.
  const shown = slider.evaluate(
    (element) =>
      new Promise<string[]>((resolve) => {
        const values: string[] = [];
        const observer = new MutationObserver(() => {
          values.push(element.getAttribute('aria-valuetext') ?? '');
          if (values.at(-1) === '10 of 10 scans') resolve(values);
        });
        observer.observe(element, { attributes: true, attributeFilter: ['aria-valuetext'] });
      }),
  );
  await page.getByRole('button', { name: /^Play/ }).click();
  await expect(page.getByRole('button', { name: 'Pause' })).toBeVisible();
  await page.clock.runFor(60_000);
  expect(await shown).toEqual(Array.from({ length: 10 }, (_, index) => `${index + 1} of 10 scans`));
  await expect(page.getByRole('button', { name: /^Play/ })).toBeVisible();
});

test('points that the slider lays on the map and takes off leave it as it is painted anew, with a selected scan on top', async ({
  app,
  page,
}) => {
  const slider = page.getByRole('slider', { name: 'Scans shown' });
  /** Other colours and back: all points are painted again. */
  const anew = async (): Promise<string> => {
    await page.getByRole('button', { name: 'Dark colours' }).click();
    await app.picture();
    await page.getByRole('button', { name: 'Light colours' }).click();
    await page.mouse.move(0, 0);
    return app.picture();
  };
  for (const selected of [false, true]) {
    if (selected) await app.row('3.ply').click();
    for (const shown of ['4', '9', '6', '5', '10', '1', '7']) {
      await slider.fill(shown);
      await page.mouse.move(0, 0);
      expect(await app.picture(), `${shown} scans`).toBe(await anew());
    }
  }
});

test('keys, drags and the wheel move, zoom, turn and fit the map', async ({ app, page }) => {
  const [x, y] = await app.placeOnMap(150, 120);
  const fitted = await app.worldAt(x, y);
  await app.stage.focus();
  for (const key of ['ArrowLeft', 'ArrowUp', '+', 'r', '-']) {
    const before = await app.worldAt(x, y);
    await page.keyboard.press(key);
    await expect.poll(() => app.worldAt(x - 1, y).then(() => app.worldAt(x, y)), { message: key }).not.toBe(before);
  }
  for (let i = 0; i < 3; i++) await page.keyboard.press('r');
  await page.keyboard.press('f');
  await expect.poll(() => app.worldAt(x - 1, y).then(() => app.worldAt(x, y))).toBe(fitted);

  // Dragging moves the map, and a double click fits it.
  const [hand_x, hand_y] = await app.placeOnMap(200, 60);
  const held = await app.worldAt(hand_x, hand_y);
  await page.mouse.down();
  await page.mouse.move(hand_x + 80, hand_y + 40, { steps: 4 });
  await page.mouse.up();
  // The world has moved along with the hand.
  expect(await app.worldAt(hand_x + 80, hand_y + 40)).toBe(held);
  await page.mouse.dblclick(hand_x, hand_y);
  await expect.poll(() => app.worldAt(hand_x - 1, hand_y).then(() => app.worldAt(hand_x, hand_y))).toBe(held);

  // The wheel zooms to the cursor: what lies under it stays.
  const here = await app.worldAt(x, y);
  const there = await app.worldAt(x + 200, y);
  await page.mouse.move(x, y);
  const picture = await app.picture();
  await page.mouse.wheel(0, -400);
  await expect.poll(() => app.picture()).not.toBe(picture);
  expect(here).toMatch(/^x .* m y .* m$/);
  expect(await app.worldAt(x, y)).toBe(here);
  expect(await app.worldAt(x + 200, y)).not.toBe(there);
});

test('row and map select each other; pairs of points are shown on demand, grid, path and reference hidden', async ({
  app,
  page,
}) => {
  const plain = await app.picture();
  await app.row('3.ply').click();
  await expect(app.row('3.ply').getByRole('button')).toHaveAttribute('aria-pressed', 'true');
  await expect(app.why).toContainText('3.ply');
  expect(await app.picture()).not.toBe(plain);

  // From the map: the next scan by key, then none.
  await app.stage.focus();
  await page.keyboard.press('.');
  await expect(app.row('4.ply').getByRole('button')).toHaveAttribute('aria-pressed', 'true');
  await page.keyboard.press('Escape');
  await expect(app.why).toContainText('All scans');

  await app.row('5.ply').click();
  const without = await app.picture();
  await page.getByLabel(/Show correspondences/).check();
  await expect.poll(() => app.picture()).not.toBe(without);
  await page.getByLabel(/Show correspondences/).uncheck();
  await expect.poll(() => app.picture()).toBe(without);

  const layers = page.getByRole('button', { name: 'Layers' });
  await layers.click();
  // Beside the map, not on it.
  const [list, stage] = [
    await page.getByRole('group', { name: 'Layers' }).boundingBox(),
    await app.stage.boundingBox(),
  ];
  expect(list?.x).toBeGreaterThanOrEqual((stage?.x ?? 0) + (stage?.width ?? 0));
  for (const name of ['Grid', 'Path and poses', /^Ground truth/]) {
    const before = await app.picture();
    await page.getByRole('checkbox', { name }).uncheck();
    await expect.poll(() => app.picture()).not.toBe(before);
  }
  // Escape closes the list before it means the selection.
  await page.keyboard.press('Escape');
  await expect(page.getByRole('group', { name: 'Layers' })).toBeHidden();
  await expect(layers).toBeFocused();
  await expect(app.why).toContainText('5.ply');
});

test('why a scan is the worst: its longest pairs are drawn, and the lab is one click away, the same way up', async ({
  app,
  page,
}) => {
  await app.why.getByRole('button', { name: 'Why is this scan worst?' }).click();
  await expect(app.why).toContainText(/the \d+ longest pairs\s+of \d+\.\s+They have\s+\d+\s%/);
  const longest = page.getByLabel(/Show the longest pairs/);
  await expect(longest).toBeChecked();
  await longest.uncheck();
  const without = await app.picture();
  await longest.check();
  await expect.poll(() => app.picture()).not.toBe(without);
  // The corridor lies along the screen here and there.
  const turned = await app.map.evaluate((map) => (map as HTMLElement & { turned: number }).turned);
  expect(turned).not.toBe(0);
  await app.why.getByRole('button', { name: 'Look inside' }).click();
  const stage = page.locator('scanstitch-lab-plane');
  await expect
    .poll(() =>
      stage.evaluate((plane) => (plane as HTMLElement & { viewport: { view: { turns: number } } }).viewport.view.turns),
    )
    .toBe(turned);
});

test('a click on a pose selects its scan', async ({ app, page }) => {
  const box = await app.map.boundingBox();
  if (!box) throw new Error('The map has no size.');
  const readout = app.map.locator('.readout');
  // Along the path the read-out names the scans; a click there selects the one named.
  for (let share = 0.02; share < 1; share += 0.01) {
    await page.mouse.move(box.x + share * box.width, box.y + 0.5 * box.height);
    const [, , name] = (await readout.innerText()).split('\n');
    if (!name) continue;
    await page.mouse.down();
    await page.mouse.up();
    await expect(app.row(name).getByRole('button')).toHaveAttribute('aria-pressed', 'true');
    await expect(app.why).toContainText(name);
    return;
  }
  throw new Error('No scan lies on the middle line of the map.');
});

test('the legend of a map in pieces names them, and shows one of them', async ({ app, page }) => {
  await page.locator('scanstitch-map').evaluate((map) => {
    const piece = (label: string, frames: number[]) => ({
      label,
      exported: '',
      numPieces: 1,
      frames,
      color: [200, 100, 0],
    });
    Object.assign(map, { pieces: [piece('Main piece', [0, 1, 2]), piece('Piece 1', [3, 4, 5, 6, 7, 8, 9])] });
  });
  const legend = page.locator('scanstitch-map-legend');
  await expect(legend).toContainText('Map in 2 pieces');
  await expect(legend).toContainText('Poses within a piece are certain');
  // Below the map, not on it.
  const [key, stage] = [await legend.boundingBox(), await app.stage.boundingBox()];
  expect(key?.y).toBeGreaterThanOrEqual((stage?.y ?? 0) + (stage?.height ?? 0));
  await app.stage.press('f');
  const whole = await app.picture();
  const button = legend.getByRole('button', { name: 'Main piece 3 scans' });
  await button.click();
  await expect(button).toHaveAttribute('aria-pressed', 'true');
  await expect.poll(() => app.picture()).not.toBe(whole);
  // Nothing of the other piece: zoomed out to all of the map, less of it is painted.
  const alone = await app.numPainted();
  await button.click();
  await expect(button).toHaveAttribute('aria-pressed', 'false');
  await expect.poll(() => app.picture()).toBe(whole);
  expect(alone).not.toBe(await app.numPainted());
});
