// @ts-check
/**
 * Measures the map of the built page (npm run build) in Chromium with 13,631 scans of 180 points, as long as the log of the Intel
 * building, while it is moved, zoomed and its slider is drawn: `node scripts/bench_map.mjs [FOLDER OF THE PAGE]`.
 * Printed as JSON, times in milliseconds, each as [median, of 95 %, worst]: `interval` from one picture to the next, `paint` of the map's
 * own script a picture; and `processor`, the mean time of the processor on the page's thread a picture, all that follows from it included,
 * which other work on the machine does not change. 60 pictures a second are 16.7 ms a picture.
 */
import { chromium } from '@playwright/test';
import { serve } from '../tests/e2e/static_server.mjs';
import { findChromium } from './steps.mjs';

const NUM_SCANS = 13_631;
const NUM_BEAMS = 180;
const NUM_PICTURES = 120;
const REST_MS = 1500;
const SIZE = { width: 1200, height: 760 };

const [folder = 'www/dist'] = process.argv.slice(2);
const server = await serve(folder);
const address = server.address();
if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
const browser = await chromium.launch({ executablePath: findChromium() ?? 'chromium', args: ['--no-sandbox'] });

/**
 * @typedef {{
 *   map: HTMLElement & Record<string, any>,
 *   paints: number[],
 *   poses: { x: number, y: number, theta: number }[],
 * }} Shown
 */

/** Shows a building of rooms of 8 m with doors, which a robot drives through, on a map of its own. @param {any} given */
function show({ numScans, numBeams, size }) {
  const [room, door] = [8, 1.5];
  const random = (/** @type {number} */ i) => (Math.abs(Math.sin(i * 12.9898) * 43758.5453) % 1) - 0.5;
  /** Way to the next wall across one axis that has no door there, at most 30 m. */
  const way = (
    /** @type {number} */ at,
    /** @type {number} */ by,
    /** @type {number} */ side,
    /** @type {number} */ sideBy,
  ) => {
    if (Math.abs(by) < 1e-6) return 30;
    for (let wall = by > 0 ? Math.floor(at / room) + 1 : Math.ceil(at / room) - 1; ; wall += Math.sign(by)) {
      const along = (wall * room - at) / by;
      if (along > 30) return 30;
      const off = (side + along * sideBy) / room;
      if (Math.abs(off - Math.floor(off) - 0.5) * room > door / 2) return along;
    }
  };
  const points = new Float32Array(2 * numScans * numBeams);
  const poses = Array.from({ length: numScans }, (_, i) => {
    const t = (i / numScans) * 12 * Math.PI;
    const [x, y] = [24 * Math.sin(t) + 0.3, 14 * Math.sin(0.83 * t) + 0.2];
    const theta = Math.atan2(11.6 * Math.cos(0.83 * t), 24 * Math.cos(t));
    for (let beam = 0; beam < numBeams; beam++) {
      const angle = theta + ((beam + 0.5) / numBeams - 0.5) * Math.PI;
      const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
      const range = Math.min(way(x, dx, y, dy), way(y, dy, x, dx)) + 0.03 * random(i * numBeams + beam);
      points[2 * (i * numBeams + beam)] = x + range * dx;
      points[2 * (i * numBeams + beam) + 1] = y + range * dy;
    }
    return { x, y, theta };
  });
  const map = /** @type {Shown['map']} */ (document.createElement('scanstitch-map'));
  map.style.cssText = `position: fixed; inset: 0 auto auto 0; width: ${size.width}px; height: ${size.height}px; z-index: 9999; background: white`;
  const paints = /** @type {number[]} */ ([]);
  map.paint = () => {
    const start = performance.now();
    Object.getPrototypeOf(map).paint.call(map);
    paints.push(performance.now() - start);
  };
  map.marks = {
    ...{ poses, statuses: poses.map(() => 'good'), uncertainLinks: poses.map(() => false), lookDirection: 0 },
    ...{ until: numScans, selected: null, hovered: null, reference: [], pairs: null, undetermined: null },
  };
  map.colors = poses.map((_, i) => [(255 * i) / numScans, 120, 255 - (255 * i) / numScans].map(Math.round));
  map.points = { points, offsets: Uint32Array.from({ length: numScans + 1 }, (_, i) => i * numBeams) };
  map.fitKey = {};
  document.body.append(map);
  Object.assign(window, { shown: { map, paints, poses } });
}

/** Takes so many steps of a motion, one a picture. @param {{ name: string, num: number }} given */
async function move({ name, num }) {
  const { map, paints, poses } = /** @type {{ shown: Shown }} */ (/** @type {unknown} */ (window)).shown;
  const [width, height] = [map.clientWidth, map.clientHeight];
  const slideTo = (/** @type {number} */ share) => {
    map.marks = { ...map.marks, until: Math.max(1, Math.round(share * poses.length)) };
  };
  const step = {
    moved: (/** @type {number} */ i) => map.shift(i < num / 2 ? 4 : -4, i < num / 2 ? 1 : -1),
    zoomed: (/** @type {number} */ i) => map.zoom(width / 3, height / 2, i < num / 2 ? 1.02 : 1 / 1.02),
    slider_back: (/** @type {number} */ i) => slideTo(1 - i / num),
    slider_on: (/** @type {number} */ i) => slideTo((i + 1) / num),
  }[name];
  if (!step) throw new Error(`There is no motion ${name}.`);
  paints.length = 0;
  const intervals = [];
  let before = await new Promise(requestAnimationFrame);
  for (let i = 0; i < num; i++) {
    step(i);
    await map.updateComplete;
    const now = await new Promise(requestAnimationFrame);
    intervals.push(now - before);
    before = now;
  }
  return { intervals, paints: [...paints] };
}

const tenth = (/** @type {number} */ value) => Number(value.toFixed(1));
/** Median, what 95 % are at most, and the worst. @param {number[]} values */
function spread(values) {
  const sorted = values.toSorted((a, b) => a - b);
  return [0.5, 0.95, 1].map((share) => tenth(sorted[Math.ceil(share * sorted.length) - 1] ?? Number.NaN));
}

try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  await page.goto(`http://localhost:${address.port}/`);
  await page.waitForFunction(() => customElements.get('scanstitch-map') !== undefined);
  const session = await page.context().newCDPSession(page);
  await session.send('Performance.enable', { timeDomain: 'threadTicks' });
  const processorTime = async () => {
    const { metrics } = await session.send('Performance.getMetrics');
    return 1000 * (metrics.find(({ name }) => name === 'TaskDuration')?.value ?? Number.NaN);
  };
  await page.evaluate(show, { numScans: NUM_SCANS, numBeams: NUM_BEAMS, size: SIZE });
  await page.waitForFunction(
    () => /** @type {{ shown: Shown }} */ (/** @type {unknown} */ (window)).shown.paints.length > 0,
  );
  const found = /** @type {Record<string, object>} */ ({});
  for (const name of ['moved', 'zoomed', 'slider_back', 'slider_on']) {
    await page.waitForTimeout(REST_MS); // the hand goes from the one to the other
    const start = await processorTime();
    const { intervals, paints } = await page.evaluate(move, { name, num: NUM_PICTURES });
    const processor = tenth(((await processorTime()) - start) / NUM_PICTURES);
    found[name] = { pictures: paints.length, interval: spread(intervals), paint: spread(paints), processor };
  }
  console.log(JSON.stringify({ scans: NUM_SCANS, points: NUM_SCANS * NUM_BEAMS, ...found }));
  if (process.env.PICTURE) await page.screenshot({ path: process.env.PICTURE });
} finally {
  await browser.close();
  server.close();
}
