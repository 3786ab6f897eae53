import type { Page } from '@playwright/test';
import { answered, noteAnswers } from './answers.js';
import { BevPage } from './bev_page.js';
import { EvaluationView } from './evaluation_view.js';
import { expect, sampleScans, ScanstitchPage, test, TOOL_RESULTS } from './scanstitch_page.js';

/** Makes the worker whose address matches throw outside of any call. It has started: one that dies before is not told. */
async function crash(page: Page, script: RegExp): Promise<void> {
  await answered(page, script);
  await expect.poll(() => page.workers().filter((worker) => script.test(worker.url())).length).toBe(1);
  const worker = page.workers().find((candidate) => script.test(candidate.url()));
  if (!worker) return;
  const ended = worker.waitForEvent('close');
  await worker.evaluate(() => {
    setTimeout(() => {
      throw new Error('for the sake of this test');
    });
  });
  await ended;
}

test('a crash of the worker is told, and the scans can be computed again; three in a row end it', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await noteAnswers(page);
  await app.open();
  await crash(page, /planar-worker/);
  await expect(app.messages).toContainText('The engine crashed');
  await expect(app.messages).toContainText('your scans are still loaded');
  // What was computed is still there to be looked at.
  expect(await app.scanNames()).toHaveLength(10);
  await app.row('2.ply').click();
  await expect(app.why).toContainText('2.ply');

  await page.getByRole('button', { name: 'Compute again' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(10);
  await expect(app.messages).toBeHidden();
  await expect.poll(() => page.workers()).toHaveLength(1);

  // A changed setting computes as well.
  await crash(page, /planar-worker/);
  await expect(app.messages).toContainText('The engine crashed');
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_map');

  // With nothing computed in between three end it.
  for (let i = 0; i < 3; i++) {
    await crash(page, /planar-worker/);
    // The first two say the same and are one row.
    const said = [/crash/, /2 times/, /crashed 3 times/][i] ?? '';
    await expect(app.messages).toContainText(said);
  }
  await expect(app.messages).toContainText('The engine crashed 3 times and is not started again');
  await expect.poll(() => page.workers().filter((worker) => /planar-worker/.test(worker.url()))).toHaveLength(0);
  expect(await app.scanNames()).toHaveLength(10);
});

test('a page whose engine cannot be fetched says so, and fetches it when it is tried again', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.route('**/*.wasm', async (route) => {
    await page.getByText('Reading 10 scans').waitFor(); // scans that come after the failure try it again
    await route.fulfill({ status: 404 });
  });
  await app.goto('./');
  await expect(app.messages).toContainText('The engine could not be started');
  await page.unroute('**/*.wasm');
  await app.messages.getByRole('button', { name: 'Try again' }).click();
  await expect(app.table.getByRole('row')).toHaveCount(11);
  await expect(app.messages).toBeHidden();
});

test('without an engine files are not lost: it is fetched for them', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.route('**/*.wasm', (route) => route.abort());
  await app.goto('./');
  await expect(app.messages).toContainText('The engine could not be started');
  await app.drop([{ name: 'walk.tum', content: 'no trajectory' }]);
  await expect(app.messages).toContainText('walk.tum');
  await page.unroute('**/*.wasm');
  await app.drop(sampleScans().slice(0, 3));
  await expect(app.table.getByRole('row')).toHaveCount(4);
  await expect(app.messages).toBeHidden();
});

test('every tool tells that there is no engine, and begins when it is tried again', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await page.route('**/scanstitch_bg*.wasm', (route) => route.fulfill({ status: 500 }));
  await app.open();
  const tools = page.getByRole('navigation', { name: 'Tools' });
  for (const [tool, element] of TOOL_RESULTS) {
    await tools.getByRole('button', { name: tool }).click();
    await expect(page.locator(element)).toContainText('The engine could not be started');
  }
  await page.unroute('**/scanstitch_bg*.wasm');
  for (const [tool, element, result] of TOOL_RESULTS) {
    await tools.getByRole('button', { name: tool }).click();
    const again = page.locator(element).getByRole('button', { name: 'Try again' });
    await again.click();
    await expect(page.locator(element)).toContainText(result);
    await expect(again).toHaveCount(0);
  }
});

test('a worker whose script cannot be loaded is told', async ({ page }) => {
  await page.route('**/*planar-worker*.js', (route) => route.fulfill({ status: 404 }));
  await page.goto('./');
  await expect(page.getByRole('region', { name: 'Messages' })).toContainText('The engine could not be started');
});

test('a crash of the evaluation is told, and it answers again', async ({ page }) => {
  const app = new ScanstitchPage(page);
  await noteAnswers(page);
  await app.open();
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await expect(evaluation.rows).toHaveCount(1);
  await crash(page, /evaluate-worker/);
  await expect(evaluation.view.getByRole('alert')).toContainText('The evaluation crashed');
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('none'));
  await expect(evaluation.rows).toHaveCount(1);
});

test("a crash of the bird's-eye view is told, and it answers again", async ({ page }) => {
  const bev = new BevPage(page);
  await noteAnswers(page);
  await bev.open();
  await crash(page, /bev-worker/);
  await expect(page.getByText('The engine crashed')).toBeVisible();
  const before = await bev.numDrawn();
  await page.getByLabel('Front pixels').selectOption('truncated');
  await bev.drawn(before);
  expect(bev.faults).toEqual([]);
});
