import { expectNamedControls, findWeakContrast, tabbedThrough } from './access.js';
import { expect, ScanstitchPage, sampleScans, test } from './scanstitch_page.js';

test('every control has a name, every region its role, and a menu is worked by keys', async ({ app, page }) => {
  await expectNamedControls(page);
  await expect(page.getByRole('main')).toBeVisible();
  await expect(page.getByRole('navigation', { name: 'Actions' })).toBeVisible();
  await expect(app.table.getByRole('columnheader')).toHaveCount(10);
  await expect(app.stage).toHaveAccessibleDescription(/10 of 10 scans.*Arrow keys move the map/s);
  await app.row('5.ply').click();
  await expect(app.why.getByRole('img', { name: /rmse.*by iteration/ })).toBeVisible();
  await expectNamedControls(page);
  expect(await page.locator('html').getAttribute('lang')).toBe('en');

  const button = page.getByRole('button', { name: 'Export' });
  await button.focus();
  await page.keyboard.press('Enter');
  await expect(page.getByRole('menuitem').first()).toBeFocused();
  await page.keyboard.press('ArrowDown');
  await expect(page.getByRole('menuitem').nth(1)).toBeFocused();
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('ArrowUp');
  await expect(page.getByRole('menuitem').last()).toBeFocused();
  await page.keyboard.press('Escape');
  await expect(page.getByRole('menu')).toBeHidden();
  await expect(button).toBeFocused();
});

test('the keyboard reaches everything, in the order of the page, and the focus is seen', async ({ app: { page } }) => {
  const reached = await tabbedThrough(page, 60);
  for (const name of [
    'Open',
    'Export',
    'Dark colours',
    'Preset',
    'Strategy',
    'Map',
    'Zoom in',
    'Scans shown',
    '0.ply',
  ]) {
    expect(reached).toContain(name);
  }
  // The first of this name is the tool in the header.
  const map = reached.lastIndexOf('Map');
  expect(reached.indexOf('Open')).toBeLessThan(map);
  expect(map).toBeLessThan(reached.indexOf('0.ply'));
});

test('errors are announced, and no later announcement takes their place', async ({ app, page }) => {
  await app.drop([{ name: 'letter.ply', content: 'Dear all' }, ...sampleScans().slice(0, 2)]);
  await app.stitched();
  await expect(page.getByLabel('Result in figures')).toContainText('1 file not read');
  const announced = page.getByRole('status').getByRole('paragraph');
  await expect(announced.filter({ hasText: /^2 scans stitched/ })).toHaveCount(1);
  const texts = await announced.allInnerTexts();
  const error = texts.findIndex((text) => /^letter\.ply, line 1, This is not a PLY file/.test(text));
  const result = texts.findIndex((text) => /^2 scans stitched/.test(text));
  expect(error, `the error is among: ${texts.join(' | ')}`).toBeGreaterThanOrEqual(0);
  expect(result, 'the result is announced after it').toBeGreaterThan(error);
});

test('words can be read in light and in dark colours', async ({ app, page }) => {
  await app.row('5.ply').click();
  await expect(app.why.getByRole('img', { name: /rmse.*by iteration/ })).toBeVisible();
  for (const colorScheme of ['light', 'dark'] as const) {
    await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
    await expect(page.getByRole('button', { name: /^(Light|Dark) colours$/ })).toHaveAccessibleName(
      colorScheme === 'light' ? 'Dark colours' : 'Light colours',
    );
    expect(await page.evaluate(findWeakContrast)).toEqual([]);
  }
});

test('dark colours follow the system, and the button overrules it', async ({ page }) => {
  await page.emulateMedia({ colorScheme: 'dark' });
  const app = new ScanstitchPage(page);
  await app.open();
  const corner = (): Promise<number> =>
    app.map
      .locator('canvas')
      .evaluate((canvas: HTMLCanvasElement) => canvas.getContext('2d')?.getImageData(0, 0, 1, 1).data[0] ?? -1);
  await expect.poll(corner).toBeLessThan(40);
  await page.getByRole('button', { name: 'Light colours' }).click();
  await expect.poll(corner).toBeGreaterThan(220);
  await page.getByRole('button', { name: 'Dark colours' }).click();
  await expect.poll(corner).toBeLessThan(40);
});

test.describe('on a phone', () => {
  test.use({ viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });

  test('nothing is wider than the screen, and all is within reach', async ({ app, page }) => {
    // Of the element: what is too wide for it is hidden, and the page keeps its width.
    const width = (): Promise<number> => page.locator('scanstitch-app').evaluate(({ scrollWidth }) => scrollWidth);
    await expect.poll(width).toBe(360);
    for (const tab of ['Scans', 'Details', 'Settings', 'Result']) {
      await page.getByRole('tab', { name: tab }).tap();
      await expect(page.getByRole('tabpanel', { name: tab })).toBeVisible();
      await expect.poll(width).toBe(360);
    }
    await expectNamedControls(page);

    await page.getByRole('tab', { name: 'Scans' }).tap();
    await app.row('2.ply').tap();
    await page.getByRole('tab', { name: 'Details' }).tap();
    await expect(page.getByRole('tabpanel')).toContainText('2.ply');
    await page.getByRole('tab', { name: 'Details' }).press('ArrowRight');
    await expect(page.getByRole('tab', { name: 'Settings' })).toBeFocused();

    for (const name of ['Open', 'Export']) {
      await page.getByRole('button', { name }).tap();
      const box = await page.getByRole('menu').boundingBox();
      expect(box?.x).toBeGreaterThanOrEqual(0);
      expect((box?.x ?? 0) + (box?.width ?? 0)).toBeLessThanOrEqual(360);
      await page.keyboard.press('Escape');
    }
  });

  test('two fingers zoom', async ({ app, page }) => {
    const before = await app.picture();
    const box = await app.map.boundingBox();
    const [x, y] = [(box?.x ?? 0) + 150, (box?.y ?? 0) + 150];
    const cdp = await page.context().newCDPSession(page);
    const touch = (type: 'touchStart' | 'touchMove' | 'touchEnd', spread: number) =>
      cdp.send('Input.dispatchTouchEvent', {
        type,
        touchPoints:
          type === 'touchEnd'
            ? []
            : [
                { x: x - spread, y, id: 1 },
                { x: x + spread, y, id: 2 },
              ],
      });
    await touch('touchStart', 20);
    for (const spread of [30, 45, 60]) await touch('touchMove', spread);
    await touch('touchEnd', 0);
    await expect.poll(() => app.picture()).not.toBe(before);
    await expect(page.getByRole('main')).toBeVisible();
  });
});
