/** Where a recording was taken in a map: both dropped together or one after the other, named by a page, and what is wrong with a map. */
import { readFileSync } from 'node:fs';
import type { Locator, Page } from '@playwright/test';
import { BUILDING, driveAt, driveLog, driveOdometry, floorPlan, HALL } from '../cli/drive_log.mjs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { test as onCourse } from './course_page.js';
import { dropOn, expect, type InputFile, overflowOf, test } from './scanstitch_page.js';

const [FIRST, LAST] = [8, 66];
const NUM_SCANS = LAST - FIRST;
const { pgm, yaml } = floorPlan(BUILDING);
const MAP: InputFile[] = [
  { name: 'map.yaml', content: yaml },
  { name: 'map.pgm', content: pgm },
];
const DRIVE: InputFile[] = [
  { name: 'drive.log', content: driveLog(BUILDING, FIRST, LAST) },
  { name: 'drive.odometry.txt', content: driveOdometry(FIRST, LAST).join('') },
];

const viewOf = (page: Page): Locator => page.locator('scanstitch-localize');
const messagesOf = (page: Page): Locator => viewOf(page).getByRole('region', { name: 'Messages' });
const dropInView = (page: Page, files: readonly InputFile[]): Promise<void> =>
  dropOn(viewOf(page).locator('.whole'), files);
const FOUND = 'Found in this map';

/** How far a position in words, "1.23, −0.45 m ± 0.03 m", is from where the robot was (m). */
function offBy(words: string, scan: number): number {
  const [x = Number.NaN, y = Number.NaN] = words.replaceAll('\u2212', '-').split(',').map(Number.parseFloat);
  const [trueX = 0, trueY = 0] = driveAt(scan);
  return Math.hypot(x - trueX, y - trueY);
}

test('a map and a drive that are dropped together: each scan is found, told in words, drawn and exported', async ({
  empty: app,
  page,
}) => {
  await app.drop([...MAP, ...DRIVE]);
  const view = viewOf(page);
  await expect(view.getByRole('region', { name: 'Result' })).toContainText(
    `of ${NUM_SCANS} scans have a certain place`,
  );
  await expect(view.getByText(FOUND, { exact: true })).toBeVisible();
  const scan = view.getByRole('region', { name: 'Selected scan' });
  const position = scan.locator('dt:text-is("Position") + dd');
  await expect(scan.getByRole('heading')).toHaveText(`Scan ${NUM_SCANS}`);
  await expect(scan).toContainText('certain');
  expect(offBy(await position.innerText(), LAST - 1)).toBeLessThan(0.1);

  // The slider, and the keys of the map.
  await view.getByRole('slider').press('Home');
  await expect(scan.getByRole('heading')).toHaveText('Scan 1');
  expect(offBy(await position.innerText(), FIRST)).toBeLessThan(0.1);
  const stage = view.getByRole('group', { name: 'Map' });
  await stage.press('.');
  await expect(scan.getByRole('heading')).toHaveText('Scan 2');
  await expect(stage.locator('#map-description')).toHaveText(/^map\.yaml, .* metres\. Scan 2: certain at /);

  await view.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /^Trajectory/ }).click();
  const rows = readFileSync(await (await download).path(), 'utf8')
    .split('\n')
    .filter((line) => /^\d/.test(line))
    .map((line) => line.split(' ').map(Number));
  expect(rows.length).toBeGreaterThan(NUM_SCANS / 2);
  for (const [time = 0, x, y] of rows) expect(offBy(`${x}, ${y}`, FIRST + time)).toBeLessThan(0.15);

  await expectNamedControls(page);
  await page.getByRole('button', { name: 'Dark colours' }).click();
  // Colours may be on their way.
  await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  await expect(view.getByText(FOUND, { exact: true })).toBeInViewport();
});

test('particles beside the exact places: they follow the slider, and other numbers start them anew', async ({
  empty: app,
  page,
}) => {
  await app.drop([...MAP, ...DRIVE]);
  const view = viewOf(page);
  await expect(view.getByText(FOUND, { exact: true })).toBeVisible();
  await view.getByRole('button', { name: 'Compare with a particle filter' }).click();
  const panel = view.getByRole('region', { name: 'Monte Carlo' });
  const words = panel.locator('dt:has-text("Effective particles") + dd');
  await expect(words).toContainText(`of 2 000, scan ${NUM_SCANS}`);
  const shares = panel.getByRole('table', { name: 'Exact and by particles' });
  await expect(shares.getByRole('row').last()).toContainText('elsewhere');
  const atEnd = await words.innerText();

  await view.getByRole('slider').press('Home');
  await expect(words).toContainText('of 2 000, scan 1');

  // The same seed draws the same numbers.
  await view.getByRole('slider').press('End');
  await expect(words).toHaveText(atEnd);
  await panel.getByLabel('Particles', { exact: true }).fill('500');
  await panel.getByLabel('Particles', { exact: true }).press('Enter');
  await expect(words).toContainText(`of 500, scan ${NUM_SCANS}`);

  // Out of its limits: nothing changes.
  await panel.getByLabel('Beams', { exact: true }).fill('0');
  await panel.getByLabel('Beams', { exact: true }).press('Enter');
  await expect(words).toContainText(`of 500, scan ${NUM_SCANS}`);

  await view.getByRole('button', { name: 'Layers' }).click();
  await view.getByRole('checkbox', { name: 'Likelihood of a return' }).check();
  await view.getByRole('button', { name: 'Hide the particles' }).click();
  await expect(panel).toBeHidden();
  await expect(view.getByRole('checkbox', { name: 'Particles' })).toBeHidden();
});

test('a map alone is drawn and asks for a recording, which is found in it, or not', async ({ empty: app, page }) => {
  await app.drop(MAP);
  const view = viewOf(page);
  await expect(view).toContainText('Drop the recording to locate');
  // Walls, free and unknown cells.
  const colors = await view.locator('canvas').evaluate((canvas: HTMLCanvasElement) => {
    const { data } = canvas.getContext('2d')?.getImageData(0, 0, canvas.width, canvas.height) ?? { data: [] };
    const counts = new Map<string, number>();
    for (let i = 0; i < data.length; i += 4) {
      const color = `${data[i]} ${data[i + 1]} ${data[i + 2]}`;
      counts.set(color, (counts.get(color) ?? 0) + 1);
    }
    return [...counts].filter(([, count]) => count > 1000).map(([color]) => color);
  });
  expect(colors).toEqual(expect.arrayContaining(['255 255 255', '28 38 51', '221 226 233']));

  await dropInView(page, [{ name: 'hall.log', content: driveLog(HALL, 0, 30) }]);
  await expect(view.getByRole('region', { name: 'Result' })).toContainText(/Not in this map|Undecided/);
  await dropInView(page, DRIVE);
  await expect(view.getByText(FOUND, { exact: true })).toBeVisible();
});

test('a map that is dropped on a drive which is open: the drive is located', async ({ empty: app, page }) => {
  await app.drop(DRIVE);
  await app.stitched();
  await app.drop(MAP);
  await expect(viewOf(page).getByText(FOUND, { exact: true })).toBeVisible();
  // The map of the drive is as it was left.
  await page.getByRole('navigation', { name: 'Tools' }).getByRole('button', { name: 'Map' }).click();
  await expect(page.locator('.title')).toHaveText('drive.log');
});

test('what is wrong with a map is told with the file, and what it lacks is asked for', async ({ empty: app, page }) => {
  await app.drop(MAP.slice(0, 1));
  await expect(messagesOf(page)).toContainText(/map\.yaml\s*Its picture map\.pgm is not among the files/);
  await dropInView(page, MAP.slice(1));
  await expect(viewOf(page)).toContainText('Drop the recording to locate');
  await expect(messagesOf(page)).toBeHidden();

  const header = (size: number): Buffer => Buffer.from(`P5\n${size} ${size}\n255\n`);
  const wrong: [InputFile[], RegExp][] = [
    [
      [{ name: 'bad.yaml', content: yaml.replace('resolution: ', 'resolution: -') }, ...MAP.slice(1)],
      /bad\.yaml, line 2\s*The resolution is -0\.05/,
    ],
    [
      [...MAP.slice(0, 1), { name: 'map.pgm', content: header(30_000) }],
      /map\.pgm\s*The header announces 30000 x 30000 pixels, more than the limit/,
    ],
    [[...MAP.slice(0, 1), { name: 'map.pgm', content: 'no picture' }], /map\.pgm, byte 0\s*This is neither a PGM/],
  ];
  for (const [files, message] of wrong) {
    await dropInView(page, files);
    await expect(messagesOf(page)).toContainText(message);
  }

  await dropInView(page, [{ name: 'floor.pgm', content: pgm }]);
  const side = page.getByLabel('Side of a pixel (m)');
  await expect(viewOf(page)).toContainText('floor.pgm is a picture without a YAML file');
  await side.fill('-1');
  await side.press('Enter');
  await expect(messagesOf(page)).toContainText(/floor\.pgm\s*The resolution is -1/);
  await side.fill('0.05');
  await side.press('Enter');
  await expect(side).toBeHidden();
  await dropInView(page, DRIVE);
  await expect(viewOf(page).getByText(FOUND, { exact: true })).toBeVisible();
});

/** Runs first in the worker: once it has told of a scan, it goes on when it has been stopped. */
function waitForStop(): void {
  const { postMessage } = MessagePort.prototype;
  const held: (() => void)[] = [];
  let isHeld: boolean | null = null;
  MessagePort.prototype.postMessage = function (this: MessagePort, message: unknown): void {
    const post = (): void => postMessage.call(this, message);
    if (isHeld) held.push(post);
    else post();
  };
  const tell = self.postMessage.bind(self);
  self.postMessage = (message: { event?: { state: string } }, more?: WindowPostMessageOptions) => {
    isHeld ??= message.event?.state === 'running' || null;
    tell(message, more);
  };
  addEventListener('message', ({ data }: MessageEvent<{ method: string }>) => {
    if (data.method !== 'stop') return;
    isHeld = false;
    for (const post of held.splice(0)) post();
  });
}

/** Clicks the button that stops as soon as some scans are located. */
function stopOnceLocating(view: Element): void {
  const root = view.shadowRoot;
  if (!root) throw new Error('There is nothing to stop.');
  const observer = new MutationObserver(() => {
    const stop = [...root.querySelectorAll('button')].find((button) => button.textContent.trim() === 'Stop');
    if (!stop || !root.querySelector('scanstitch-timeline')) return;
    observer.disconnect();
    stop.click();
  });
  observer.observe(root, { childList: true, subtree: true });
}

test('what is located before a stop stays, and can be looked at; then all is located', async ({ empty: app, page }) => {
  await page.route(/localize-worker/, async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, body: `(${waitForStop})();\n${await response.text()}` });
  });
  await app.drop(MAP);
  const view = viewOf(page);
  await expect(view).toContainText('Drop the recording to locate');
  await view.evaluate(stopOnceLocating);
  await dropInView(page, DRIVE);
  const again = view.getByRole('button', { name: 'Locate again' });
  await expect(again).toBeVisible();
  await view.getByRole('slider').press('Home');
  await expect(view.getByRole('heading', { name: 'Scan 1', exact: true })).toBeVisible();
  await again.click();
  await expect(view.getByRole('region', { name: 'Result' })).toContainText(
    `of ${NUM_SCANS} scans have a certain place`,
  );
});

onCourse('a course page names a map and a recording', async ({ course, page }) => {
  const files = Object.fromEntries([...MAP, ...DRIVE].map(({ name, content }) => [name, content]));
  await course.open(
    '<scanstitch-app view="localize" map="map.yaml" src="drive.log drive.odometry.txt"></scanstitch-app>',
    files,
  );
  await expect(viewOf(page).getByText(FOUND, { exact: true })).toBeVisible();
  const { detail } = await course.heard('scanstitch-located');
  expect(detail.verdict).toBe('found');
  expect(detail.num_scans_to_find).toBeLessThan(NUM_SCANS);
});
