/** The page under faults: of the network, of the disk, of the graphics card. Each is told, and what there is stays. */
import type { Page } from '@playwright/test';
import { mcapBytes } from '../cli/bag_files.mjs';
import { laserScan } from '../cli/bag_messages.mjs';
import { hold } from './held.js';
import { expect, sampleScans, ScanstitchPage, test as planar, TOOL_RESULTS } from './scanstitch_page.js';
import { test as spatial } from './spatial_page.js';
import { recording } from './spatial_recording.js';
import { serve } from './static_server.mjs';

planar('a part of the page that does not come is told, and comes when it is tried again', async ({ app, page }) => {
  await page.route('**/evaluate-view*.js', (route) => route.abort());
  const tools = page.getByRole('navigation', { name: 'Tools' });
  await tools.getByRole('button', { name: 'Evaluate' }).click();
  await expect(app.messages).toContainText(
    /could not be loaded \(evaluate-view.*connection was lost, or a new version/,
  );
  expect(await app.scanNames()).toHaveLength(10);
  // The header's menus are not covered by it.
  await page.getByRole('button', { name: 'Open' }).click();
  await expect(page.getByRole('menuitem').first()).toBeVisible();
  for (const item of await page.getByRole('menuitem').all()) await item.click({ trial: true });
  await page.keyboard.press('Escape');
  await page.unroute('**/evaluate-view*.js');
  await app.messages.getByRole('button', { name: 'Try again' }).click();
  await expect(page.locator('scanstitch-evaluate')).toBeVisible();
  await tools.getByRole('button', { name: 'Map' }).click();
  await expect(app.messages).toBeHidden();
  expect(app.faults).toEqual([]);
});

planar('an engine that takes long is told of, and begins when it is there', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  const release = await hold(page, '**/*.wasm');
  await app.goto('./');
  await expect(page.getByText('Reading 10 scans')).toBeVisible();
  await page.clock.runFor(16_000);
  await expect(app.messages).toContainText('The engine has not loaded after 15 s');
  await release();
  await expect(app.table.getByRole('row')).toHaveCount(11);
  await expect(app.messages).toBeHidden();
});

planar('of a drop, what cannot be read is named and the rest is used', async ({ empty: app, page }) => {
  const scans = sampleScans()
    .slice(0, 3)
    .map(({ name, content }) => ({ name, text: Buffer.from(content).toString('latin1') }));
  await app.map.evaluate((target, given) => {
    // As the browser gives them: a file that is locked, a folder that may not be opened, and three scans.
    const fails = (_: unknown, reject: (error: Error) => void): void =>
      reject(new DOMException('', 'NotReadableError'));
    const entries = [
      { isFile: true, fullPath: '/walk/locked.ply', file: fails },
      { isFile: false, fullPath: '/walk/private', createReader: () => ({ readEntries: fails }) },
      ...given.map(({ name, text }) => ({
        isFile: true,
        fullPath: `/walk/${name}`,
        file: (resolve: (file: File) => void) => resolve(new File([text], name)),
      })),
    ];
    const items = entries.map((entry) => ({ kind: 'file', webkitGetAsEntry: () => entry }));
    const event = new Event('drop', { bubbles: true, composed: true, cancelable: true });
    Object.defineProperty(event, 'dataTransfer', { value: { types: ['Files'], items } });
    target.dispatchEvent(event);
  }, scans);
  expect((await app.stitched()).result.frames).toHaveLength(3);
  await expect(app.messages).toContainText('walk/locked.ply');
  await expect(app.messages).toContainText('walk/private');
  await expect(page.locator('.title')).toHaveText('walk');
});

planar('scans of a bag that are lost are told', async ({ empty: app }) => {
  const scan = (i: number): Uint8Array =>
    laserScan(
      { sec: 100 + i, nsec: 0 },
      -1.5,
      0.05,
      [0.1, 9],
      Array.from({ length: 60 }, (_, k) => 2 + 0.01 * k),
    );
  const messages = Array.from({ length: 6 }, (_, i) => ({
    topic: '/scan',
    time: BigInt(100 + i) * 1_000_000_000n,
    data: i === 2 ? scan(i).slice(0, 40) : scan(i),
  }));
  const bag = mcapBytes([{ name: '/scan', type: 'sensor_msgs/msg/LaserScan' }], messages);
  await app.drop([{ name: 'walk.mcap', content: Buffer.from(bag) }]);
  expect((await app.stitched()).result.frames).toHaveLength(5);
  await expect(app.messages).toContainText('1 scan of 6 left out');
});

/** The first request is never answered, as by a connection that has died; how many there were. */
async function hangOnce(page: Page, address: string): Promise<() => number> {
  let count = 0;
  await page.route(address, (route) => (count++ === 0 ? undefined : route.continue()));
  return () => count;
}

planar('a download of the engine that hangs is begun anew without a reload', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  const numAsked = await hangOnce(page, '**/*.wasm');
  await app.goto('./');
  await expect(page.getByText('Reading 10 scans')).toBeVisible();
  await page.clock.runFor(16_000);
  await expect(app.messages).toContainText('The engine has not loaded after 15 s');
  expect(numAsked()).toBe(1);
  await app.messages.getByRole('button', { name: 'Try again' }).click();
  await expect(app.table.getByRole('row')).toHaveCount(11);
  await expect(app.messages).toBeHidden();
});

planar(
  'a part of the page that does not come and does not fail is told, and tried again by a reload',
  async ({ page }) => {
    const app = new ScanstitchPage(page);
    await page.clock.install();
    const numAsked = await hangOnce(page, '**/evaluate-view*.js');
    await app.open();
    const evaluate = page.getByRole('navigation', { name: 'Tools' }).getByRole('button', { name: 'Evaluate' });
    await evaluate.click();
    await expect.poll(numAsked).toBe(1);
    await page.clock.runFor(16_000);
    await expect(app.messages).toContainText('A part of the page has not loaded after 15 s');
    const reloaded = page.waitForEvent('load');
    await app.messages.getByRole('button', { name: 'Try again' }).click();
    await reloaded;
    await evaluate.click();
    await expect(page.locator('scanstitch-evaluate')).toBeVisible();
    await expect(app.messages).toBeHidden();
  },
);

planar('files that are dropped while the sample is fetched stay', async ({ page }) => {
  const app = new ScanstitchPage(page);
  const release = await hold(page, '**/corridor*.js');
  const opened = app.open();
  await expect(page.getByText('Fetching the scans')).toBeVisible();
  await app.drop(sampleScans().slice(0, 3));
  expect((await opened).result.frames).toHaveLength(3);
  const fetched = page.waitForResponse('**/corridor*.js');
  await release();
  await (await fetched).finished();
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(resolve)));
  await app.setting('Strategy').selectOption('scan_to_map');
  const { result } = await app.stitched();
  expect([result.settings.strategy, result.frames.length]).toEqual(['scan_to_map', 3]);
  await expect(page.locator('.title')).toHaveText('Your scans');
});

planar('the same of the full engine, which a log needs', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.clock.install();
  await hangOnce(page, '**/scanstitch_bg*.wasm');
  await app.open();
  const scan = `FLASER 180 ${Array.from({ length: 180 }, (_, i) => 3 + 0.01 * i).join(' ')} 0 0 0 0 0 0`;
  await app.drop([{ name: 'walk.log', content: [0, 1, 2].map((time) => `${scan} ${time} robot ${time}\n`).join('') }]);
  await expect(page.getByText('Reading 1 scan')).toBeVisible();
  await page.clock.runFor(16_000);
  await expect(app.messages).toContainText('The engine has not loaded after 15 s');
  await app.messages.getByRole('button', { name: 'Try again' }).click();
  await expect(app.table.getByRole('row')).toHaveCount(4);
  await expect(app.messages).toBeHidden();
});

/**
 * Loses the graphics context as soon as the table has more than so many rows, from within the page: seen from outside, the
 * run may be over by then. Returns whether the run was under way.
 */
async function loseContextAfter(page: Page, num_rows: number): Promise<boolean> {
  return page.evaluate(async (num_rows) => {
    type View = HTMLElement & { updateComplete: Promise<boolean> };
    const view = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-spatial')?.shadowRoot;
    if (!view) throw new Error('There is no view of depth images');
    const table = (): View | null => view.querySelector<View>('scanstitch-frame-table');
    const numRows = (): number =>
      Number(table()?.shadowRoot?.querySelector('table')?.getAttribute('aria-rowcount') ?? 1) - 1;
    await new Promise<void>((resolve) => {
      const look = async (): Promise<void> => {
        await table()?.updateComplete;
        if (numRows() <= num_rows) return;
        observer.disconnect();
        resolve();
      };
      const observer = new MutationObserver(() => void look());
      observer.observe(view, { childList: true, subtree: true, attributes: true, characterData: true });
      void look();
    });
    const canvas = view.querySelector('scanstitch-map3d')?.shadowRoot?.querySelector('canvas');
    canvas?.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
    return view.querySelector('.activity') !== null;
  }, num_rows);
}

spatial('a graphics context that is lost in mid-run costs nothing', async ({ drawn: app, page }) => {
  await page.setViewportSize({ width: 900, height: 600 }); // they are emulated pixel by pixel
  await app.drop(recording(1));
  await app.stitched(); // the graphics are there, which take longer than some frames
  const losing = loseContextAfter(page, 1);
  await app.drop(recording(120));
  expect(await losing, 'the run is under way').toBe(true);
  expect((await app.stitched()).result.frames).toHaveLength(120);
  await expect(page.getByRole('status').filter({ hasText: 'The map has been redrawn' })).toHaveCount(1);
  expect(await app.numPainted()).toBeGreaterThan(100);
});

planar('kept for use offline where the host asks for it: every tool works without a network', async ({ browser }) => {
  const server = await serve('www/dist');
  const address = server.address();
  const context = await browser.newContext();
  const page = await context.newPage();
  const app = new ScanstitchPage(page);
  try {
    // As a host writes it, in its own copy of the page.
    const url = `http://localhost:${typeof address === 'object' && address ? address.port : 0}/`;
    await page.route(url, async (route) => {
      const response = await route.fetch();
      const body = (await response.text()).replace('<scanstitch-app ', '<scanstitch-app offline ');
      await route.fulfill({ response, body });
    });
    await app.open(url);
    await page.evaluate(async () => {
      const { active } = await navigator.serviceWorker.ready;
      if (active?.state !== 'activated')
        await new Promise((resolve) => active?.addEventListener('statechange', resolve, { once: true }));
    });
    await page.unroute(url);
    await new Promise((resolve) => server.close(resolve).closeAllConnections());
    const tools = page.getByRole('navigation', { name: 'Tools' });
    for (const [tool, element, result] of TOOL_RESULTS) {
      await tools.getByRole('button', { name: tool }).click();
      await expect(tools.locator('[aria-current=page]')).toHaveText(tool);
      await expect(page.locator(element)).toContainText(result);
    }
    // And once more from the beginning.
    await page.goto('about:blank');
    await page.goto(url);
    await expect(app.table.getByRole('row')).toHaveCount(11);
    await app.drop([...recording(3)].map((file) => ({ ...file, content: Buffer.from(file.content) })));
    await expect(page.locator('scanstitch-spatial').getByRole('table').getByRole('row')).toHaveCount(4, {
      timeout: 60_000,
    });
    expect(app.faults).toEqual([]);
  } finally {
    server.close();
    await context.close();
  }
});

planar('a page for which the storage has no room says so, and works', async ({ page, baseURL }) => {
  const app = new ScanstitchPage(page);
  const session = await page.context().newCDPSession(page);
  const { origin } = new URL(baseURL ?? '');
  await session.send('Storage.overrideQuotaForOrigin', { origin, quotaSize: 50_000 });
  await page.route('**/', async (route) => {
    const response = await route.fetch();
    const body = (await response.text()).replace('<scanstitch-app ', '<scanstitch-app offline ');
    await route.fulfill({ response, body });
  });
  await app.open();
  await expect(app.messages).toContainText('The page is not kept for use offline');
  await expect(app.messages).toContainText('the storage may be full');
  expect(await app.scanNames()).toHaveLength(10);
  expect(app.faults).toEqual([]);
});

planar('a page that cannot be kept says so, and works', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.route('**/', async (route) => {
    const response = await route.fetch();
    const body = (await response.text()).replace('<scanstitch-app ', '<scanstitch-app offline="missing.js" ');
    await route.fulfill({ response, body });
  });
  await app.open();
  await expect(app.messages).toContainText('The page is not kept for use offline');
  expect(await app.scanNames()).toHaveLength(10);
  await app.drop(sampleScans().slice(0, 3));
  await expect(app.table.getByRole('row')).toHaveCount(4);
  await expect(app.messages).toContainText('The page is not kept for use offline');
});
