// @ts-check
/**
 * `npm run fuzz -- page`: performs random actions on the built page, from a seed: drops files of all kinds, clicks buttons, changes
 * settings, goes back and forward, resizes the window. No error may be left uncaught and no worker may die; at rest, the page's
 * labels must agree with its state; when all is removed, its memory must be released.
 */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { chromium } from '@playwright/test';
import { zipSync } from 'fflate';
import { serve } from '../tests/e2e/static_server.mjs';
import { Random } from './fuzz/random.mjs';
import { say } from './progress.mjs';
import { findChromium, readArguments, ROOT, runMain, StepError } from './steps.mjs';

/** @typedef {import('@playwright/test').Page} Page */
/** @typedef {{ name: string, bytes: Uint8Array }} Given */

/** Time without a change of the page's state after which it is at rest (ms). */
const REST_MS = 120_000;
/** Growth of the page's memory above which it counts as leaked (bytes). */
const MOST_BYTES = 50 * 2 ** 20;
const SIZES = [
  [1280, 800],
  [900, 700],
  [390, 844],
];

/** Kinds of files that are dropped together. @returns {((random: Random) => Given[])[]} */
function kindsOfFiles() {
  const read = (/** @type {string} */ path) => new Uint8Array(readFileSync(join(ROOT, 'www/samples', path)));
  const text = (/** @type {string} */ words) => new TextEncoder().encode(words);
  const scans = Array.from({ length: 10 }, (_, i) => ({ name: `${i}.ply`, bytes: read(`corridor/${i}.ply`) }));
  const truth = { name: 'truth.tum', bytes: read('corridor/truth.tum') };
  const frames = [1, 2, 3, 4].flatMap((i) =>
    ['depth', 'rgb'].flatMap((folder) =>
      readdirSync(join(ROOT, 'www/samples/apartment', folder))
        .filter((name) => name.startsWith(`${i}.`))
        .map((name) => ({ name: `room/${folder}/${name}`, bytes: read(`apartment/${folder}/${name}`) })),
    ),
  );
  const junk = [
    { name: 'letter.txt', bytes: text('Dear all,\nthe scans are on the stick.\n') },
    { name: 'empty.ply', bytes: new Uint8Array() },
    { name: 'cut.ply', bytes: read('corridor/0.ply').slice(0, 300) },
    { name: 'noise.png', bytes: Uint8Array.from({ length: 500 }, (_, i) => (i * 7919) >>> 3) },
    { name: 'half.bag', bytes: text('#ROSBAG V2.0\n') },
    { name: '<b>&"\u202e.csv', bytes: text('0,0\n1,\n') },
  ];
  const some = (/** @type {Random} */ random) => scans.slice(random.below(5), 5 + random.below(6));
  return [
    some,
    (random) => [...some(random), truth],
    () => [truth],
    (random) => [random.one(junk)],
    (random) => [...some(random), random.one(junk), random.one(junk)],
    (random) => some(random).map(({ name, bytes }) => ({ name, bytes: random.damaged(bytes) })),
    () => frames,
    (random) => frames.map(({ name, bytes }) => ({ name, bytes: random.below(8) > 0 ? bytes : random.damaged(bytes) })),
    (random) => [
      { name: 'walk.zip', bytes: zipSync(Object.fromEntries(some(random).map(({ name, bytes }) => [name, bytes]))) },
    ],
    (random) => [
      { name: 'a.tum', bytes: truth.bytes },
      { name: 'reference.tum', bytes: random.below(2) > 0 ? truth.bytes : random.damaged(truth.bytes) },
    ],
  ];
}

/** Drops files on what is shown. @param {Page} page @param {Given[]} files */
async function drop(page, files) {
  const sent = files.map(({ name, bytes }) => ({ name, base64: Buffer.from(bytes).toString('base64') }));
  await page.evaluate((given) => {
    const transfer = new DataTransfer();
    for (const { name, base64 } of given)
      transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    const { width, height } = document.documentElement.getBoundingClientRect();
    let target = document.elementFromPoint(width / 2, (2 * height) / 3);
    while (target?.shadowRoot) {
      const inside = target.shadowRoot.elementFromPoint(width / 2, (2 * height) / 3);
      if (!inside || inside === target) break;
      target = inside;
    }
    for (const type of ['dragenter', 'dragover', 'drop'])
      target?.dispatchEvent(
        new DragEvent(type, { dataTransfer: transfer, bubbles: true, composed: true, cancelable: true }),
      );
  }, sent);
}

/** What can be worked: every control that is shown, in every shadow. @param {Page} page @param {number} chance @param {number} value */
function work(page, chance, value) {
  return page.evaluate(([at, number]) => {
    /** @type {HTMLElement[]} */
    const found = [];
    const search = (/** @type {ParentNode} */ root) => {
      for (const element of root.querySelectorAll('*')) {
        if (element.shadowRoot) search(element.shadowRoot);
        const is_control = element.matches('button:not([disabled]), select, input:not([type=file]), summary, a, tr');
        if (is_control && element instanceof HTMLElement && element.checkVisibility()) found.push(element);
      }
    };
    search(document);
    const element = found[at % Math.max(found.length, 1)];
    if (!element) return '';
    if (element instanceof HTMLSelectElement) element.selectedIndex = number % Math.max(element.options.length, 1);
    else if (element instanceof HTMLInputElement && element.type === 'number')
      element.value = String([0, -1, 0.05, 3, 1e9, 12][number % 6]);
    else if (element instanceof HTMLInputElement && element.type === 'range')
      element.value = String(Number(element.max || 100) * ((number % 11) / 10));
    else element.click();
    for (const type of ['input', 'change'])
      if (!element.matches('button, a, summary, tr')) element.dispatchEvent(new Event(type, { bubbles: true }));
    return `${element.localName} ${element.getAttribute('aria-label') ?? element.id} ${element.innerText?.slice(0, 40) ?? ''}`;
  }, /** @type {const} */ ([chance, value]));
}

/** Performs one random action and returns its description. @param {Page} page @param {Random} random @param {ReturnType<typeof kindsOfFiles>} kinds */
async function act(page, random, kinds) {
  const chance = random.below(100);
  if (chance < 15) {
    const files = random.one(kinds)(random);
    await drop(page, files);
    return `drop ${files.map(({ name }) => name).join(' ')}`;
  }
  if (chance < 80) return work(page, random.below(100_000), random.below(1000));
  if (chance < 85) {
    const [width = 0, height = 0] = random.one(SIZES);
    await page.setViewportSize({ width, height });
    return `size ${width}`;
  }
  if (chance < 92) {
    const is_ours = await page.evaluate(() => Boolean(history.state?.scanstitch_view));
    // Before the first view lies another page.
    if (is_ours) await page.evaluate(() => history.back());
    return is_ours ? 'back' : '';
  }
  if (chance < 95) {
    await page.evaluate(() => history.forward());
    return 'forward';
  }
  await page.keyboard.press(random.one(['Escape', 'Tab', 'Enter', 'ArrowRight', 'ArrowDown', '+', '0']));
  return 'key';
}

/** State of the page as its labels give it. @param {Page} page */
function status(page) {
  return page.evaluate(() => {
    const app = document.querySelector('scanstitch-app')?.shadowRoot;
    const views = ['scanstitch-planar', 'scanstitch-spatial'].map((name) => app?.querySelector(name) ?? null);
    const run = views.find((view) => view && !view.hasAttribute('hidden'))?.shadowRoot;
    const number = (/** @type {string | null | undefined} */ words) =>
      Number(
        (words ?? '')
          .replaceAll(/[\s\u202f]/g, '')
          .match(/\d+/g)
          ?.at(-1) ?? Number.NaN,
      );
    const table = run?.querySelector('scanstitch-frame-table')?.shadowRoot;
    const figures = run?.querySelector('scanstitch-headline')?.shadowRoot?.querySelector('dd');
    return {
      is_shown: Boolean(run),
      activity: run?.querySelector('.activity span')?.textContent ?? '',
      has_failed: /engine could not|crashed/.test(
        run?.querySelector('scanstitch-messages')?.shadowRoot?.textContent ?? '',
      ),
      count: number(app?.querySelector('.count')?.textContent),
      figure: figures ? number(figures.textContent) : null,
      placed: figures ? Number(figures.textContent?.replaceAll(/[\s\u202f]/g, '').match(/\d+/)?.[0]) : null,
      rows: table ? Number(table.querySelector('table')?.getAttribute('aria-rowcount')) - 1 : null,
    };
  });
}

/** Waits until nothing is going on, on the map. @param {Page} page */
async function rest(page) {
  await page.setViewportSize({ width: 1280, height: 800 });
  await page.keyboard.press('Escape');
  await page
    .getByRole('navigation', { name: 'Tools' })
    .getByRole('button', { name: 'Map', exact: true })
    .click({ noWaitAfter: true });
  let [before, end] = ['', 0];
  for (;;) {
    await page.waitForTimeout(700);
    const said = await status(page);
    if (said.is_shown && /^(|Stopped.*|Not computed.*)$/.test(said.activity)) return said;
    const now = JSON.stringify(said);
    if (now !== before) [before, end] = [now, performance.now() + REST_MS];
    if (performance.now() > end) throw new Error(`It does not come to rest: ${JSON.stringify(said)}`);
  }
}

/** Of the page's own thread, garbage collected. @param {import('@playwright/test').CDPSession} cdp */
async function memory(cdp) {
  await cdp.send('HeapProfiler.collectGarbage');
  const { usedSize, ...others } = await cdp.send('Runtime.getHeapUsage');
  const { backingStorageSize = 0 } = /** @type {{ backingStorageSize?: number }} */ (others);
  return usedSize + backingStorageSize;
}

/** Removes everything that is open, in both views. @param {Page} page */
async function removeAll(page) {
  const dismiss = page.getByRole('button', { name: /^Dismiss;/ });
  if (await dismiss.isVisible()) await dismiss.click();
  await page.getByRole('button', { name: 'Open', exact: true }).click();
  await page.getByRole('menuitem', { name: /^Remove all/ }).click();
}

/**
 * @param {import('@playwright/test').Browser} browser
 * @param {string} address
 * @param {number} seed
 * @param {number} seconds
 */
async function round(browser, address, seed, seconds) {
  const random = new Random(seed);
  const kinds = kindsOfFiles();
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  /** @type {string[]} */
  const done = [];
  /** @type {string[]} */
  const faults = [];
  let more = 0;
  try {
    const page = await context.newPage();
    page.on('pageerror', (error) => faults.push(error.stack ?? error.message));
    page.on('filechooser', () => undefined); // nothing is chosen
    page.on('dialog', (dialog) => void dialog.dismiss().catch(() => undefined));
    // With every panel unfolded there is more to press.
    await page.addInitScript(() => {
      localStorage['scanstitch-panels'] ??= 'figures table details settings tabs';
    });
    await page.goto(address);
    const cdp = await context.newCDPSession(page);
    await rest(page);
    const before = await memory(cdp);
    for (const end = performance.now() + 1000 * seconds; performance.now() < end && faults.length === 0;) {
      done.push(await act(page, random, kinds));
      if (random.below(3) === 0) await page.waitForTimeout(random.below(500));
    }
    const said = await rest(page);
    if (said.has_failed) faults.push('the engine died');
    const is_true = said.figure === null || (said.figure === said.count && said.placed === said.rows);
    if (!is_true) faults.push(`what it says is not true: ${JSON.stringify(said)}`);
    await removeAll(page);
    more = (await memory(cdp)) - before;
    if (more > MOST_BYTES) faults.push(`${Math.round(more / 2 ** 20)} MB did not come back`);
  } catch (error) {
    faults.push(/** @type {Error} */ (error).stack ?? String(error));
  } finally {
    await context.close();
  }
  return { faults, done, more };
}

await runMain(async () => {
  const options = /** @type {const} */ ({
    time: { type: 'string', default: '60' },
    seed: { type: 'string', default: '1' },
    each: { type: 'string', default: '20' },
    jobs: { type: 'string', default: '1' },
  });
  const { values } = readArguments(
    { options },
    'Usage: npm run fuzz -- page [--time SECONDS] [--seed N], or node scripts/fuzz_page.mjs with --each SECONDS a seed and --jobs PAGES at a time',
  );
  const [time, first, each, jobs] = [
    Number(values.time),
    Number(values.seed),
    Number(values.each),
    Number(values.jobs),
  ];
  if (!(time > 0 && each > 0) || !Number.isInteger(first) || !(Number.isInteger(jobs) && jobs > 0))
    throw new StepError('--time and --each are numbers of seconds, --seed and --jobs whole numbers.');
  if (!existsSync(join(ROOT, 'www/dist/index.html'))) throw new StepError('The page is not built. Run: npm run build');
  const executablePath = findChromium();
  if (!executablePath) {
    say('page: skipped; it needs Chromium');
    return;
  }
  const server = await serve(join(ROOT, 'www/dist'));
  const { port } = /** @type {import('node:net').AddressInfo} */ (server.address());
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--disable-gpu'] });
  const end = performance.now() + 1000 * time;
  let next = first;
  let [numClean, most] = [0, 0];
  const fuzz = async () => {
    while (performance.now() < end) {
      const seed = next++;
      const { faults, done, more } = await round(browser, `http://localhost:${port}/`, seed, each);
      if (faults.length === 0) {
        numClean += 1;
        most = Math.max(most, more);
        continue;
      }
      console.log(`page: seed ${seed}\n  ${done.slice(-25).join('\n  ')}\n${faults.join('\n')}`);
      process.exitCode = 1;
    }
  };
  try {
    await Promise.all(Array.from({ length: jobs }, fuzz));
    const memory = `at most ${(most / 2 ** 20).toFixed(1)} MB more when all was removed`;
    console.log(`page: ${numClean} of ${next - first} seeds of ${each} s, from ${first} on, clean; ${memory}`);
  } finally {
    await browser.close();
    server.close();
  }
});
