/** How long a step of a drag takes, told and not asserted: the machine may be busy. */
import { engine, expect, pair, presetNamed, test } from './bev_page.js';

test.use({ trace: 'off' }); // recording a trace costs more than what is measured

test('a drag over images of 2048 x 2048 pixels', async ({ bev, page }, info) => {
  const { scene } = presetNamed('homework_views');
  for (const camera of [scene.top, scene.front]) [camera.width, camera.height] = [2048, 2048];
  await bev.load([
    { name: 'scene.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(scene)) },
    ...pair(2048),
  ]);
  await expect.poll(async () => (await bev.colorAt('front', 'warp', 1000, 1900))[3], { timeout: 60_000 }).toBe(255);
  for (const [u, v] of [
    [900, 200],
    [1300, 200],
    [1300, 500],
    [900, 500],
  ] as const) {
    await bev.click('top', u, v);
  }
  // Wall time says how busy the machine is; the processor's own time is the page's.
  const session = await page.context().newCDPSession(page);
  await session.send('Performance.enable', { timeDomain: 'threadTicks' });
  const processorTime = async () => {
    const { metrics } = await session.send('Performance.getMetrics');
    return 1000 * (metrics.find(({ name }) => name === 'TaskDuration')?.value ?? Number.NaN);
  };
  const before = await bev.numDrawn();
  const [x, y] = await bev.place('top', 900, 500);
  const [to_x, to_y] = await bev.place('top', 1160, 370);
  await page.mouse.move(x, y);
  await page.mouse.down();
  const steps = 40;
  const start = await processorTime();
  for (let step = 1; step <= steps; step++) {
    await page.mouse.move(x + ((to_x - x) * step) / steps, y + ((to_y - y) * step) / steps);
    await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(resolve)));
  }
  const spent = ((await processorTime()) - start) / steps;
  await page.mouse.up();
  // However many steps were skipped, the last one is drawn.
  await bev.drawn(before);
  await expect(page.getByLabel('Point 4, top u')).toHaveValue('1160');
  await expect(page.getByLabel('Point 4, top v')).toHaveValue('370');
  const view = new engine.BirdsEyeView(scene);
  const [last] = view.points(Float64Array.of(1160, 370), 'top');
  view.free();
  const projected = last?.projected?.map((value) => value.toFixed(2)).join(' ');
  await expect.poll(async () => (await bev.projections())[3]).toBe(projected);
  const times = (await bev.times()).slice(before).toSorted((a, b) => a - b);
  const [median, worst] = [times[times.length >> 1] ?? Number.NaN, times.at(-1) ?? Number.NaN];
  const words = `${median.toFixed(1)} ms in the middle, ${worst.toFixed(1)} ms at worst, of ${times.length}`;
  info.annotations.push({ type: 'a step of a drag, until both views are drawn', description: words });
  info.annotations.push({
    type: 'the same, time of the processor on the main thread',
    description: `${spent.toFixed(1)} ms`,
  });
  console.log(`drag on 2048 x 2048: ${words}; ${spent.toFixed(1)} ms of the processor`);
});
