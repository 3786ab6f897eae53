import { idle, noteAnswers } from './answers.js';
import { expect, type InputFile, sampleScans, ScanstitchPage, test } from './scanstitch_page.js';
import { stopAfter } from './stop.js';

/** The sample driven to and fro: as long as is asked, and every scan overlaps the one before it. */
function longDrive(num_scans: number): InputFile[] {
  const scans = sampleScans();
  const there_and_back = [...scans, ...scans.slice(1, -1).reverse()];
  return Array.from({ length: num_scans }, (_, i) => ({
    name: `long/${i}.ply`,
    content: there_and_back[i % there_and_back.length]?.content ?? '',
  }));
}

test('a long computation shows its progress, stops at once, keeps what it has and goes on', async ({
  app,
  page,
}, info) => {
  await app.setting('Strategy').selectOption('scan_to_map');
  await app.stitched();
  await app.drop(longDrive(240));
  const { ms, before } = await stopAfter(page, 'scanstitch-planar', 20);
  expect(before).toMatch(/Registering scan \d+ of 240/);
  info.annotations.push({ type: 'from stop to stopped', description: `${ms.toFixed(0)} ms` });
  const num_rows = Number(await app.table.getAttribute('aria-rowcount')) - 1;
  expect(num_rows).toBeGreaterThan(10);
  expect(num_rows).toBeLessThan(240);
  expect(await app.numPainted()).toBeGreaterThan(500);
  expect(await app.numStitched()).toBe(2);
  await expect(page.getByRole('button', { name: 'Export' })).toBeEnabled();

  // A stop that comes before the first slice is obeyed as well.
  const restopped = await page.evaluate(async () => {
    const app = document.querySelector('scanstitch-app');
    const view = app?.shadowRoot?.querySelector<HTMLElement & { updateComplete: Promise<boolean> }>(
      'scanstitch-planar',
    );
    const button = (name: string): HTMLButtonElement | undefined =>
      [...(view?.shadowRoot?.querySelectorAll('button') ?? [])].find(({ textContent }) => textContent === name);
    button('Continue')?.click();
    await view?.updateComplete;
    button('Stop')?.click();
    while (button('Stop')) await new Promise(requestAnimationFrame);
    return button('Continue') !== undefined;
  });
  expect(restopped).toBe(true);
  expect(Number(await app.table.getAttribute('aria-rowcount'))).toBeLessThan(240);

  await page.getByRole('button', { name: 'Continue' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(240);
});

test('all is removed in the middle of a run, and stays so', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await noteAnswers(page);
  await app.open();
  await app.drop(longDrive(150));
  await page.waitForFunction(() => {
    const view = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-planar');
    const isRunning = /Registering scan \d+ of 150/.test(view?.shadowRoot?.textContent ?? '');
    if (isRunning) (view as HTMLElement & { session: { clear(): void } }).session.clear();
    return isRunning;
  });
  // The worker that computes is told, and has obeyed.
  await page.waitForFunction(() =>
    window.answers.findLast(({ asked }) => asked.includes('load'))?.asked.includes('stop'),
  );
  await idle(page);
  await expect(page.getByRole('button', { name: 'Stop' })).toBeHidden();
  await expect(app.table).toBeHidden();
  // The removed run, had it come to its end, would be the next to be told.
  await app.drop(sampleScans().slice(0, 3));
  expect((await app.stitched()).result.frames).toHaveLength(3);
  expect(app.faults).toEqual([]);
});

test('a setting changed in the middle starts over with it', async ({ app }) => {
  await app.drop(longDrive(150));
  // From within the page: seen from outside, the run may be over before the setting is changed.
  await app.setting('Strategy').evaluate(async (select: HTMLSelectElement) => {
    const view = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-planar');
    while (!/Registering scan \d+ of 150/.test(view?.shadowRoot?.textContent ?? ''))
      await new Promise(requestAnimationFrame);
    select.value = 'scan_to_scan';
    select.dispatchEvent(new Event('change', { bubbles: true }));
  });
  const { result } = await app.stitched();
  expect(result.settings.strategy).toBe('scan_to_scan');
  expect(result.frames).toHaveLength(150);
});

test('150 rows scroll by keyboard, and only those in sight are in the document', async ({ app, page }) => {
  await app.setting('Strategy').selectOption('scan_to_scan');
  await app.stitched();
  await app.drop(longDrive(150));
  await app.stitched();
  await app.row('0.ply').getByRole('button').focus();
  await page.keyboard.press('End');
  await expect(app.row('149.ply').getByRole('button')).toBeFocused();
  expect(await app.table.getByRole('row').count()).toBeLessThan(80);
  await expect(app.table).toHaveAttribute('aria-rowcount', '151');
  await page.keyboard.press('ArrowUp');
  await expect(app.row('148.ply').getByRole('button')).toBeFocused();
  await page.keyboard.press('Home');
  await expect(app.row('0.ply').getByRole('button')).toBeFocused();
});

test.describe('on a phone', () => {
  test.use({ viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });

  test('what goes on is told below the map, not on it', async ({ app, page }, info) => {
    await page.getByRole('tab', { name: 'Scans' }).tap();
    await app.drop(longDrive(240));
    await stopAfter(page, 'scanstitch-planar', 20);
    await page.screenshot({ path: info.outputPath('phone.png') });
    await expect(page.getByRole('button', { name: 'Continue' })).toBeVisible();
    const [line, stage] = await page.evaluate(() => {
      const found: DOMRect[][] = [[], []];
      const visit = (root: ShadowRoot | Document): void => {
        for (const element of root.querySelectorAll('*')) {
          if (element.matches('.activity')) found[0]?.push(element.getBoundingClientRect());
          if (element.matches('.stage')) found[1]?.push(element.getBoundingClientRect());
          if (element.shadowRoot) visit(element.shadowRoot);
        }
      };
      visit(document);
      return found.flat().map(({ left, right, top, bottom }) => ({ left, right, top, bottom }));
    });
    expect(stage && stage.bottom - stage.top).toBeGreaterThan(100);
    expect(line?.top).toBeGreaterThanOrEqual(stage?.bottom ?? Infinity);
    expect(line?.left).toBeGreaterThanOrEqual(0);
  });
});
