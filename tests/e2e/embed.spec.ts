import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Page } from '@playwright/test';
import { dropOn, expect, SAMPLE_FOLDER, ScanstitchPage, test as base } from './scanstitch_page.js';

const COURSE_HOST = 'http://course.example';

/**
 * A course page on another host than Scanstitch's: `body` stands in it, the scans of the sample lie beside it, and the
 * element comes from `baseURL`. Returns the page's address.
 */
async function serveCourse(page: Page, baseURL: string, body: string): Promise<string> {
  await page.context().route(`${COURSE_HOST}/**`, async (route) => {
    const { pathname } = new URL(route.request().url());
    if (pathname === '/lesson/') {
      const script = `<script type="module" src="${baseURL}scanstitch-app.js"></script>`;
      await route.fulfill({ contentType: 'text/html', body: `<!doctype html><title>Lesson</title>${body}${script}` });
    } else if (pathname === '/lesson/scans/set.json') {
      const scans = ['0.ply', '1.ply', '2.ply'];
      await route.fulfill({ json: { title: 'Lesson 3', scans, reference: 'truth.tum' } });
    } else if (pathname.startsWith('/lesson/scans/')) {
      const name = pathname.slice('/lesson/scans/'.length);
      const content = name === 'truth.tum' ? truthOf(3) : readFileSync(join(SAMPLE_FOLDER, name));
      await route.fulfill({ contentType: 'application/octet-stream', body: content });
    } else {
      await route.fulfill({ status: 404 });
    }
  });
  return `${COURSE_HOST}/lesson/`;
}

/** The true poses of the sample's first scans. */
function truthOf(num_scans: number): string {
  const lines = readFileSync(join(SAMPLE_FOLDER, 'truth.tum'), 'utf8').split('\n');
  return lines
    .filter((line) => line !== '' && !line.startsWith('#'))
    .slice(0, num_scans)
    .join('\n');
}

/** Script errors on the page fail a test. */
const test = base.extend<{ course: (body: string) => Promise<ScanstitchPage> }>({
  page: async ({ page }, use) => {
    const faults: string[] = [];
    page.on('pageerror', (error) => faults.push(error.message));
    await use(page);
    expect(faults).toEqual([]);
  },
  course: async ({ page, baseURL }, use) => {
    await use(async (body) => {
      await new ScanstitchPage(page).open(await serveCourse(page, baseURL ?? '', body));
      return new ScanstitchPage(page);
    });
  },
});

/** Files that are still on their way when a test ends are no fault. */
test.afterEach(({ page }) => page.context().unrouteAll({ behavior: 'ignoreErrors' }));

test('a course page on another host embeds the element with its own scans', async ({ course, page }) => {
  const app = await course(
    '<p>A column of text.</p><div style="width: 600px"><scanstitch-app src="scans/set.json"></scanstitch-app></div>',
  );
  const { result } = await app.stitched();
  expect(result.frames.map(({ name }) => name)).toEqual(['0.ply', '1.ply', '2.ply']);
  expect(result.comparison?.num_matched).toBe(3);
  await expect(page.getByText('Lesson 3')).toBeVisible();
  // In a narrow column it is laid out as on a phone, and the page keeps its own width.
  await expect(page.getByRole('tab', { name: 'Result' })).toBeVisible();
  expect(await page.locator('scanstitch-app').evaluate((element) => element.scrollWidth)).toBeLessThanOrEqual(600);
});

test('scans are named one by one, with settings and colours of the course', async ({ course, page }) => {
  const app = await course(
    '<scanstitch-app src="scans/0.ply scans/1.ply scans/truth.tum" settings="strategy=scan_to_scan" theme="dark"></scanstitch-app>',
  );
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(2);
  expect(result.settings.strategy).toBe('scan_to_scan');
  await expect(page.getByRole('button', { name: 'Light colours' })).toBeVisible();
  expect(page.url()).not.toContain('#');
});

test('in little room, and with fewer controls, the map keeps most of it', async ({ course, page }) => {
  const app = await course(
    '<scanstitch-app src="scans/set.json" style="display: block; width: 520px; height: 360px"></scanstitch-app>',
  );
  const element = page.locator('scanstitch-app');
  const share = async (): Promise<number> => {
    const { width = 0, height = 0 } = (await app.stage.boundingBox()) ?? {};
    return (width * height) / (520 * 360);
  };
  expect(await share()).toBeGreaterThan(0.5);
  const tools = page.getByRole('navigation', { name: 'Tools' });
  for (const name of ['Map', 'Strategies']) await expect(tools.getByRole('button', { name })).toBeInViewport();
  await page.getByRole('tab', { name: 'Scans' }).click();
  await expect(app.table).toBeVisible();
  await page.getByRole('button', { name: 'Panel', exact: true }).click();
  await expect(app.table).toBeHidden();

  await element.evaluate((element) => element.setAttribute('controls', 'minimal'));
  await expect(page.getByRole('navigation')).toHaveCount(0);
  await expect(page.getByRole('tab')).toHaveCount(0);
  await expect(page.getByRole('slider', { name: 'Scans shown' })).toBeVisible();
  await page.getByRole('button', { name: 'Full screen' }).click();
  await expect.poll(() => page.evaluate(() => document.fullscreenElement?.localName)).toBe('scanstitch-app');
  await page.getByRole('button', { name: 'Leave full screen' }).click();
  await element.evaluate((element) => element.setAttribute('controls', 'none'));
  await expect(page.getByRole('button')).toHaveCount(0);
  expect(await share()).toBeGreaterThan(0.99);
  await element.evaluate((element) => element.setAttribute('controls', 'few'));
  await expect(app.messages).toContainText('“few” is not a value of controls: none, minimal, full');
});

test('in a page that scrolls, the wheel belongs to the page until the map is clicked', async ({ course, page }) => {
  const app = await course('<scanstitch-app src="scans/set.json"></scanstitch-app><div style="height: 3000px"></div>');
  await app.stitched();
  const box = await app.map.boundingBox();
  const [x, y] = [(box?.x ?? 0) + 100, (box?.y ?? 0) + 60];
  await page.mouse.move(x, y);
  await page.mouse.wheel(0, 120);
  await expect.poll(() => page.evaluate(() => scrollY)).toBeGreaterThan(50);
  await page.evaluate(() => scrollTo(0, 0));
  await page.mouse.click(x, y);
  const before = await app.picture();
  await page.mouse.wheel(0, -200);
  await expect.poll(() => app.picture()).not.toBe(before);
  expect(await page.evaluate(() => scrollY)).toBe(0);
});

test('scans that cannot be fetched are told', async ({ page, baseURL }) => {
  await page.context().route(`${COURSE_HOST}/**`, (route) => {
    const is_page = new URL(route.request().url()).pathname === '/';
    const body = `<scanstitch-app src="missing.json"></scanstitch-app><script type="module" src="${baseURL}scanstitch-app.js"></script>`;
    return route.fulfill(is_page ? { contentType: 'text/html', body } : { status: 404 });
  });
  await page.goto(`${COURSE_HOST}/`);
  await expect(page.getByRole('region', { name: 'Messages' })).toContainText(/missing\.json answered 404/);
  await expect(page.getByRole('button', { name: 'Show the sample' })).toBeVisible();
});

test('a course page opens a scene of the ICP lab, and comes back to it from other clouds', async ({
  page,
  baseURL,
}) => {
  const body = '<scanstitch-app view="icp" scene="corridor" style="height: 700px"></scanstitch-app>';
  await page.goto(await serveCourse(page, baseURL ?? '', body));
  const question = page.getByRole('region', { name: 'Question' });
  await expect(question).toContainText('corridor', { ignoreCase: true });
  const scans = [0, 1].map((i) => ({ name: `${i}.ply`, content: readFileSync(join(SAMPLE_FOLDER, `${i}.ply`)) }));
  await dropOn(page.locator('scanstitch-lab .lab'), scans);
  await expect(page.locator('scanstitch-lab').getByLabel('Source', { exact: false }).first()).toHaveValue(/\.ply$/);
  await expect(question).toBeHidden();
  await page.getByRole('button', { name: 'This page’s clouds' }).click();
  await expect(question).toBeVisible();
  await page.locator('scanstitch-app').evaluate((element) => element.setAttribute('scene', 'nowhere'));
  await expect(page.getByRole('region', { name: 'Messages' })).toContainText('There is no scene “nowhere”');
});

test('a course page opens the ICP lab on two addresses, and an iteration is stepped by keys alone', async ({
  page,
  baseURL,
}) => {
  const body = '<scanstitch-app view="icp" src="scans/1.ply scans/0.ply" style="height: 600px"></scanstitch-app>';
  await page.goto(await serveCourse(page, baseURL ?? '', body));
  const lab = page.locator('scanstitch-lab');
  await expect(lab.getByLabel('Source', { exact: false }).first()).toHaveValue(/1\.ply$/);
  await expect(lab.getByLabel('Target', { exact: false }).first()).toHaveValue(/0\.ply$/);
  const clouds = page.getByRole('application', { name: 'The two clouds' });
  await expect(clouds).toHaveAccessibleDescription(/^Start of [1-9]/);
  const isReached = (): Promise<boolean> => clouds.evaluate((element) => element.matches(':focus'));
  for (let i = 0; i < 40 && !(await isReached()); i++) await page.keyboard.press('Tab');
  await expect(clouds).toBeFocused();
  await page.keyboard.press('.');
  await expect(page.getByRole('status').filter({ hasText: 'After iteration 1 of' })).not.toHaveCount(0);
  // Nothing was on the map, so that nothing is said of it.
  await expect(page.getByRole('status').filter({ hasText: 'removed' })).toHaveCount(0);
  expect(await page.evaluate(() => location.hash), 'the address is the course page’s own').toBe('');
});
