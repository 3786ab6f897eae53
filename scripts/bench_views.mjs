// @ts-check
/**
 * Measures the views beside the map of the built page (npm run build) in Chromium: `node scripts/bench_views.mjs`.
 * Printed as JSON, times in milliseconds. `evaluate`: two trajectories of 100 000 poses, from the drop to the drawn figures, compared
 * by another alignment, and a frame while the mouse moves over a figure, of which its script (medians of 60; `idle`: over none).
 * `drag`: a step of a point that is dragged over images of 2048 x 2048 pixels, until both are drawn, and the time of the processor
 * on the page's thread, which other work on the machine does not change.
 */
import { chromium } from '@playwright/test';
import { bev_presets, load } from '../npm/index.js';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium } from './steps.mjs';

const NUM_POSES = 100_000;
const NUM_FRAMES = 60;
const IMAGE_SIZE = 2048;
const NUM_STEPS = 40;

const server = await serve('www/dist');
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({ executablePath: findChromium() ?? 'chromium', args: ['--no-sandbox'] });

/** The page at this fragment, with the times that its events of this type tell. @param {string} fragment @param {string} event */
async function open(fragment, event) {
  const page = await browser.newPage({ viewport: { width: 1600, height: 1100 } });
  await page.addInitScript((event) => {
    const times = /** @type {number[]} */ ([]);
    Object.assign(window, { times });
    addEventListener(event, (heard) => {
      const { detail } = /** @type {CustomEvent} */ (heard);
      times.push(detail.total_ms ?? detail.elapsed_ms);
    });
  }, event);
  // @ts-expect-error: a number, as checked above
  await page.goto(`http://localhost:${address.port}/${fragment}`);
  const times = () => page.evaluate(() => /** @type {{ times: number[] }} */ (/** @type {unknown} */ (window)).times);
  /** Does something, and waits for the next event; its time. @param {() => Promise<unknown>} action */
  const answered = async (action) => {
    const { length } = await times();
    await action();
    await page.waitForFunction(
      (length) => /** @type {{ times: number[] }} */ (/** @type {unknown} */ (window)).times.length > length,
      length,
    );
    return tenth((await times()).at(-1));
  };
  return { page, times, answered };
}

const tenth = (value = Number.NaN) => Number(value.toFixed(1));
const median = (/** @type {number[]} */ values) => tenth(values.toSorted((a, b) => a - b)[values.length >> 1]);

/** As files of the field have it: times in 100 us, positions in micrometres. @param {number} noise m */
function trajectory(noise) {
  const line = (/** @type {number} */ index) => {
    const s = index / 4000;
    const off = noise * Math.sin(index * 0.37);
    const position = [30 * Math.sin(s) + off, 20 * Math.sin(0.61 * s), 2 * Math.cos(0.3 * s) - off];
    const numbers = [...position, 0, 0, Math.sin(s / 2), Math.cos(s / 2)].map((value) => value.toFixed(6));
    return `${(index / 100).toFixed(4)} ${numbers.join(' ')}\n`;
  };
  return Array.from({ length: NUM_POSES }, (_, index) => line(index)).join('');
}

async function timeEvaluation() {
  const { page, answered } = await open('#evaluate', 'scanstitch-evaluated');
  const view = page.locator('scanstitch-evaluate');
  const files = [0, 0.05].map((noise, i) => ({
    name: ['gt.tum', 'est.tum'][i] ?? '',
    mimeType: '',
    buffer: Buffer.from(trajectory(noise)),
  }));
  const dropped = await answered(() => view.locator('input[type=file]').setInputFiles(files));
  const aligned = await answered(() => page.getByLabel('Alignment').selectOption('sim3'));
  /** @param {import('@playwright/test').Locator} target where the mouse moves @returns times of frames and of their scripts */
  const hover = (target) =>
    target.evaluate(async (element, num_frames) => {
      const box = element.getBoundingClientRect();
      const inside = element.shadowRoot?.querySelector('div');
      const frames = /** @type {number[]} */ ([]);
      const scripts = /** @type {number[]} */ ([]);
      let before = await new Promise(requestAnimationFrame);
      for (let i = 0; i < num_frames; i++) {
        const start = performance.now();
        const place = { clientX: box.x + 80 + (i % 40) * 8, clientY: box.y + box.height / 2 + (i % 7) * 5 };
        inside?.dispatchEvent(new PointerEvent('pointermove', { ...place, bubbles: true, composed: true }));
        // All that follows from it is done in microtasks.
        await new Promise((resolve) => setTimeout(resolve));
        scripts.push(performance.now() - start);
        const now = await new Promise(requestAnimationFrame);
        frames.push(now - before);
        before = now;
      }
      return { frames, scripts };
    }, NUM_FRAMES);
  const found = /** @type {Record<string, { frame: number, script: number }>} */ ({});
  for (const [name, target] of Object.entries({
    idle: page.locator('body'),
    errors: page.locator('section.errors scanstitch-figure'),
    paths: page.locator('section.paths scanstitch-figure'),
  })) {
    const { frames, scripts } = await hover(target);
    found[name] = { frame: median(frames), script: median(scripts) };
  }
  return { poses: NUM_POSES, dropped, aligned, ...found };
}

async function timeDrag() {
  await load();
  const scene = bev_presets().find(({ name }) => name === 'homework_views')?.scene;
  if (!scene) throw new Error('There is no preset homework_views.');
  for (const camera of [scene.top, scene.front]) camera.width = camera.height = IMAGE_SIZE;
  const { page, times, answered } = await open('#bev', 'scanstitch-projected');
  const png = await page.evaluate((size) => {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = size;
    const context = canvas.getContext('2d');
    for (let i = 0; i < 256 && context; i++) {
      context.fillStyle = (i + (i >> 4)) % 2 ? '#e65a28' : '#285ae6';
      context.fillRect(((i % 16) * size) / 16, ((i >> 4) * size) / 16, size / 16, size / 16);
    }
    return canvas.toDataURL().split(',')[1] ?? '';
  }, IMAGE_SIZE);
  const picture = (/** @type {string} */ name) => ({ name, mimeType: 'image/png', buffer: Buffer.from(png, 'base64') });
  const json = { name: 'scene.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(scene)) };
  await page.locator('#pick').setInputFiles([json, picture('top.png'), picture('front.png')]);
  await page.waitForFunction(() => {
    const view = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-bev')?.shadowRoot;
    const warp = view?.querySelector('scanstitch-bev-picture#front')?.shadowRoot?.querySelector('.warp');
    if (!(warp instanceof HTMLCanvasElement)) return false;
    return warp.getContext('2d')?.getImageData(1000, 1900, 1, 1).data[3] === 255;
  });
  const place = async (/** @type {number} */ u, /** @type {number} */ v) => {
    const box = await page.locator('scanstitch-bev-picture#top .marks').boundingBox();
    if (!box) throw new Error('The picture has no size.');
    return /** @type {const} */ ([
      box.x + ((u + 0.5) * box.width) / IMAGE_SIZE,
      box.y + ((v + 0.5) * box.height) / IMAGE_SIZE,
    ]);
  };
  for (const [u, v] of /** @type {const} */ ([
    [900, 200],
    [1300, 200],
    [1300, 500],
    [900, 500],
  ])) {
    const at = await place(u, v);
    await answered(() => page.mouse.click(...at));
  }
  const session = await page.context().newCDPSession(page);
  await session.send('Performance.enable', { timeDomain: 'threadTicks' });
  const processorTime = async () => {
    const { metrics } = await session.send('Performance.getMetrics');
    return 1000 * (metrics.find(({ name }) => name === 'TaskDuration')?.value ?? Number.NaN);
  };
  const { length } = await times();
  const [x, y] = await place(900, 500);
  const [to_x, to_y] = await place(1160, 370);
  await page.mouse.move(x, y);
  await page.mouse.down();
  const start = await processorTime();
  for (let step = 1; step <= NUM_STEPS; step++) {
    await page.mouse.move(x + ((to_x - x) * step) / NUM_STEPS, y + ((to_y - y) * step) / NUM_STEPS);
    await page.evaluate(() => new Promise(requestAnimationFrame));
  }
  const processor = tenth(((await processorTime()) - start) / NUM_STEPS);
  const steps = (await times()).slice(length);
  return { step: median(steps), worst: tenth(Math.max(...steps)), drawn: steps.length, processor };
}

try {
  console.log(JSON.stringify({ evaluate: await timeEvaluation(), drag: await timeDrag() }));
} finally {
  await browser.close();
  server.close();
}
