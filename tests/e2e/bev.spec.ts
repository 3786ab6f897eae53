/** The third view: points of a top view land in a front view. */
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import type { BevScene } from '../../pkg/scanstitch.js';
import { BevPage, engine, expect, pair, type Picture, picture, presetNamed, test } from './bev_page.js';
import { hold } from './held.js';

const SHARED = join(import.meta.dirname, '../../../shared/data/bev');

/** Marked in the top view, and where they are published to land. */
const MARKED = [
  [239, 141],
  [258, 314],
  [368, 211],
  [360, 123],
] as const;
const PUBLISHED = ['247 387', '257 457', '322 408', '307 382'];

test('the published clicks land on the published pixels; drag, arrow keys, undo, redo, remove', async ({
  bev,
  page,
}) => {
  await bev.load(pair(512));
  await expect(bev.view.getByText('top.png')).toBeVisible();
  for (const [u, v] of MARKED) await bev.click('top', u, v);
  await page.getByLabel('Front pixels').selectOption('truncated');
  await expect.poll(() => bev.projections()).toEqual(PUBLISHED);
  await page.getByLabel('Front pixels').selectOption('rounded');
  await expect.poll(() => bev.projections()).toEqual(['247 387', '258 457', '323 409', '307 383']);
  await page.getByLabel('Front pixels').selectOption('truncated');

  // Dragged in the top view by ten pixels and two, in many steps that are one change.
  const [x, y] = await bev.place('top', 239, 141);
  const [toX, toY] = await bev.place('top', 249, 143);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move((x + toX) / 2, (y + toY) / 2, { steps: 4 });
  await page.mouse.move(toX, toY, { steps: 4 });
  await page.mouse.up();
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('249');
  await expect(page.getByLabel('Point 1, top v')).toHaveValue('143');
  await expect(bev.rows).toHaveCount(4);
  // However many steps were skipped, the last one is drawn.
  const view = new engine.BirdsEyeView(presetNamed('homework_numbers').scene);
  const [dragged] = view.points(Float64Array.of(249, 143), 'top', 'truncated');
  view.free();
  await expect.poll(async () => (await bev.projections())[0]).toBe(dragged?.projected?.join(' '));
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.press('ArrowUp');
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('248');
  await expect(page.getByLabel('Point 1, top v')).toHaveValue('142');
  await page.keyboard.press('Control+z');
  await page.keyboard.press('Control+z');
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('249');
  await bev.view.getByRole('button', { name: 'Undo' }).click();
  await expect.poll(() => bev.projections()).toEqual(PUBLISHED);
  await bev.view.getByRole('button', { name: 'Redo' }).click();
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('249');

  await page.getByRole('button', { name: 'Point 2, pixel 258, 314' }).press('Delete');
  await expect(bev.rows).toHaveCount(3);
  await page.getByLabel('Point 1, top u').fill('239');
  await page.getByLabel('Point 1, top u').press('Tab');
  await bev.view.getByRole('button', { name: 'Remove all marks' }).click();
  await expect(bev.rows).toHaveCount(0);
});

test('clicking and dragging in the front view is the way back', async ({ bev, page }) => {
  await page.getByRole('button', { name: 'Points', exact: true }).click();
  // 1 m below the camera, 2 m ahead: half of the focal length below the middle.
  await bev.click('front', 256, 384);
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('256');
  await expect(page.getByLabel('Point 1, top v')).toHaveValue('128');
  await expect.poll(() => bev.projections()).toEqual(['256 384']);
  const [x, y] = await bev.place('front', 256, 384);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(...(await bev.place('front', 320, 384)), { steps: 3 });
  await page.mouse.up();
  await expect(page.getByLabel('Point 1, top u')).toHaveValue('384');
  // Above the horizon nothing is added, and it is said.
  await page.mouse.click(...(await bev.place('front', 256, 100)));
  await expect(bev.view.getByText(/sees no ground/)).toBeAttached();
  await expect(bev.rows).toHaveCount(1);
  await page.mouse.move(...(await bev.place('top', 256, 128)));
  await expect(bev.view.locator('.readout').first()).toContainText('front 256, 384');
  await page.mouse.move(...(await bev.place('front', 256, 100)));
  await expect(bev.view.locator('.readout').first()).toContainText('no ground');
});

test('a region that reaches behind the front camera is cut, and the cut is shown', async ({ bev, page }, info) => {
  await bev.choose('Open', /the two views/);
  const has_shared = existsSync(SHARED);
  info.annotations.push({ type: 'pictures', description: has_shared ? '../shared/data/bev' : 'drawn by the test' });
  await bev.load(has_shared ? ['bev1.png', 'front1.png'].map((name) => join(SHARED, name)) : pair(512));
  for (const [u, v] of [
    [235, 46],
    [416, 19],
    [470, 330],
    [180, 380],
  ] as const) {
    await bev.click('top', u, v);
  }
  await expect(bev.view.getByText('2 behind the front camera; the region is cut')).toBeVisible();
  await expect(bev.rows.nth(2)).toContainText('behind the front camera');
  expect((await bev.projections()).slice(2)).toEqual(['– –', '– –']);
  const report = JSON.parse((await bev.download(/^Everything/)).toString());
  expect(report.polygon.is_clipped).toBe(true);
  for (const [u, v] of report.polygon.projected) {
    expect(Math.max(Math.abs(u - 255.5), Math.abs(v - 255.5))).toBeLessThanOrEqual(256);
  }
  expect(report.polygon.cuts.filter(Boolean)).toHaveLength(2);
  await page.screenshot({ path: info.outputPath('behind.png') });
});

test('the top view is warped into the front view; a wrong height shows', async ({ bev, page }) => {
  await bev.choose('Open', /the two views/);
  await bev.load(pair(512));
  const { scene } = presetNamed('homework_views');
  const expected = await colorBelow(scene, 300, 420);
  await expect.poll(() => bev.colorAt('front', 'warp', 300, 420), { timeout: 20_000 }).toEqual(expected);
  expect(await bev.colorAt('front', 'warp', 300, 100)).toEqual([0, 0, 0, 0]);
  const slider = page.getByLabel(/^Blend/);
  await slider.fill('70');
  await expect(bev.view.getByText('warped top view 70 %')).toBeVisible();
  expect(
    await page.locator('scanstitch-bev-picture#front .warp').evaluate((one) => getComputedStyle(one).opacity),
  ).toBe('0.7');
  // Another height of the front camera, and the floor is elsewhere.
  const field = page.getByLabel('Front camera: y (m)');
  await field.fill('1.3');
  await field.press('Tab');
  const moved = structuredClone(scene);
  if (moved.front.pose.kind === 'euler') moved.front.pose.position[1] = 1.3;
  const then = await colorBelow(moved, 300, 400);
  expect(then).not.toEqual(await colorBelow(scene, 300, 400));
  await expect.poll(() => bev.colorAt('front', 'warp', 300, 400), { timeout: 20_000 }).toEqual(then);
});

/** The colour of the tile that a front pixel sees. */
async function colorBelow(scene: BevScene, u: number, v: number): Promise<number[]> {
  const view = new engine.BirdsEyeView(scene);
  const [point] = view.points(Float64Array.of(u, v), 'front');
  view.free();
  const [top_u = 0, top_v = 0] = point?.projected ?? [];
  const is_orange = (Math.floor((top_u + 0.5) / 32) + Math.floor((top_v + 0.5) / 32)) % 2;
  return is_orange ? [230, 90, 40, 255] : [40, 90, 230, 255];
}

test('pairs marked in both views refine the camera', async ({ bev, page }) => {
  await bev.choose('Open', /the two views/);
  await page.getByRole('button', { name: 'Pairs' }).click();
  // What cameras show whose front camera stands 1.2 m high and looks down by 3 degrees.
  const { scene } = presetNamed('homework_views');
  const truth = structuredClone(scene);
  if (truth.front.pose.kind === 'euler') {
    truth.front.pose.position[1] = 1.2;
    truth.front.pose.angles[0] = (-3 * Math.PI) / 180;
  }
  const view = new engine.BirdsEyeView(truth);
  const tops = [
    [180, 40],
    [330, 60],
    [256, 100],
    [200, 110],
    [360, 30],
  ] as const;
  for (const { marked, projected } of view.points(Float64Array.from(tops.flat()), 'top')) {
    await bev.click('top', ...marked);
    await bev.click('front', Math.round(projected?.[0] ?? 0), Math.round(projected?.[1] ?? 0));
  }
  view.free();
  const refinement = bev.view.getByRole('region', { name: 'Refinement' });
  await refinement.getByLabel('offset').uncheck();
  await refinement.getByRole('button', { name: 'Refine' }).click();
  const evidence = refinement.getByRole('status');
  await expect(evidence).toContainText('rmse');
  const [, pitch = '', height = '', , rmse = ''] =
    /pitch ([+−][\d.]+)°, height ([+−][\d.]+) m.*rmse ([\d.]+) → ([\d.]+) px/s.exec(await evidence.innerText()) ?? [];
  expect(Number(pitch.replace('−', '-'))).toBeCloseTo(-3, 0);
  expect(Number(height)).toBeCloseTo(0.2, 1);
  expect(Number(rmse)).toBeLessThan(0.8); // pixels were rounded
  // Undone, the old camera is back.
  await bev.view.getByRole('button', { name: 'Undo' }).click();
  await expect(page.getByLabel('Front camera: y (m)')).toHaveValue('1');
});

test('everything is exported, and the link opens the same scene', async ({ bev, page, context }) => {
  await context.grantPermissions(['clipboard-read', 'clipboard-write']);
  await bev.load(pair(512));
  for (const [u, v] of MARKED) await bev.click('top', u, v);
  await page.getByLabel('Front pixels').selectOption('truncated');
  await expect.poll(() => bev.projections()).toEqual(PUBLISHED);
  const field = page.getByLabel('Top camera: y (m)');
  await field.fill('1.25');
  await field.press('Tab');
  await expect(field).toHaveValue('1.25');
  await expect.poll(() => bev.projections()).not.toEqual(PUBLISHED);
  const shown = await bev.projections();

  const csv = (await bev.download(/^Points/)).toString().trim().split('\n');
  expect(csv[0]).toBe('number,top_u,top_v,x,y,z,front_u,front_v,status');
  expect(csv.slice(1).map((line) => line.split(',').slice(6, 8).join(' '))).toEqual(shown);
  const report = JSON.parse((await bev.download(/^Everything/)).toString());
  expect(report.points.map(({ projected }: { projected: number[] }) => projected.join(' '))).toEqual(shown);
  const scene = JSON.parse((await bev.download(/^Scene/)).toString());
  expect(scene.top.pose.position[1]).toBe(1.25);
  for (const item of [/^Top view/, /^Front view/]) {
    const png = await bev.download(item);
    expect(png.subarray(1, 4).toString('latin1')).toBe('PNG');
    expect([png.readUInt32BE(16), png.readUInt32BE(20)]).toEqual([512, 512]);
  }

  await bev.choose('Export', /^Copy a link/);
  await expect(bev.view.getByText(/The link was copied/)).toBeAttached();
  const link = await page.evaluate(() => navigator.clipboard.readText());
  const other = new BevPage(await context.newPage());
  await other.open(link);
  await expect(other.page.getByLabel('Top camera: y (m)')).toHaveValue('1.25');
  await expect.poll(() => other.projections()).toEqual(shown);
  await expect(other.page.getByLabel('Front pixels')).toHaveValue('truncated');
  expect(other.faults).toEqual([]);

  // A link that was cut off is told, and the view works.
  const spoilt = new BevPage(await context.newPage());
  await spoilt.open(link.slice(0, -40));
  await expect(spoilt.page.getByRole('alert')).toContainText('link is cut off');
  await spoilt.click('top', 239, 141);
  await expect(spoilt.rows).toHaveCount(1);
});

test('axes and kinds of poses are other numbers for the same cameras', async ({ bev, page }) => {
  for (const [u, v] of MARKED) await bev.click('top', u, v);
  await page.getByLabel('Front pixels').selectOption('truncated');
  await expect.poll(() => bev.projections()).toEqual(PUBLISHED);
  await page.getByLabel('Axes', { exact: true }).selectOption('robotics');
  await expect(page.getByLabel('Top camera: z (m)')).toHaveValue('1');
  await expect(page.getByLabel('Top camera: x (m)')).toHaveValue('1.5');
  await page.getByLabel('Top camera: pose by').selectOption('matrix');
  await expect(page.getByLabel('Front camera: T_world_camera')).toBeVisible();
  await page.getByLabel('Top camera: intrinsics').selectOption('focal');
  await expect(page.getByLabel('Top camera: fx (px)')).toHaveValue('256');
  await page.getByLabel('Ground: given by').selectOption('tilted');
  await expect(page.getByLabel('Ground: normal z')).toHaveValue('1');
  // What is answered for another point is of this ground.
  await bev.click('top', 300, 200);
  await expect.poll(() => bev.projections()).toEqual([...PUBLISHED, '281 404']);
});

test('bad input has its own message each, and the page goes on', async ({ bev, page }) => {
  await bev.load(pair(512));
  await bev.click('top', 239, 141);
  await page.getByLabel('Front pixels').selectOption('truncated');
  await expect.poll(() => bev.projections()).toEqual(['247 387']);
  const alert = page.getByRole('alert');
  const type = async (label: string, value: string) => {
    await page.getByLabel(label).fill(value);
    await page.getByLabel(label).press('Tab');
  };
  await type('Front camera: view angle (°)', '180');
  await expect(alert).toContainText("front camera's field of view is 180 degrees");
  await type('Front camera: view angle (°)', '90');
  await expect(alert).toHaveCount(0);

  await type('Ground: height (m)', '1');
  await expect(alert).toContainText('The ground passes through the top camera');
  await bev.view.getByRole('button', { name: 'Undo' }).click();
  await expect(alert).toHaveCount(0);

  await page.getByLabel('Front camera: pose by').selectOption('matrix');
  await type('Front camera: T_world_camera', '1 0 0 0\n0 1 0 1\n2 0 0 0\n0 0 0 1');
  await expect(alert).toContainText('front camera is singular');
  await bev.view.getByRole('button', { name: 'Undo' }).click();
  await expect(alert).toHaveCount(0);

  const [top] = pair(512);
  await bev.load([picture('small_top.png', 640, 480, () => [9, 9, 9])]);
  await expect(alert).toContainText('640 x 480 pixels, but its camera has 512 x 512');
  await alert.getByRole('button', { name: 'Use 640 × 480' }).click();
  await expect(alert).toHaveCount(0);
  await expect(page.getByLabel('Top camera: width (px)')).toHaveValue('640');
  await bev.view.getByRole('button', { name: 'Undo' }).click();
  await expect(alert).toContainText('640 x 480');
  await bev.load([top as Picture]);
  await expect(alert).toHaveCount(0);

  await bev.load([{ name: 'front.png', mimeType: 'image/png', buffer: Buffer.from('no image at all') }]);
  await expect(alert).toContainText('front.png is not an image');
  await alert.getByRole('button', { name: 'Dismiss the message' }).click();
  await bev.load([{ name: 'scene.json', mimeType: 'application/json', buffer: Buffer.from('{"axes": "up"}') }]);
  await expect(alert).toContainText('scene.json, line 1');
  await bev.load([{ name: 'points.csv', mimeType: 'text/csv', buffer: Buffer.from('1,2\n3,left\n') }]);
  await expect(alert).toContainText('points.csv, line 2: "left" is not a number');
  await expect.poll(() => bev.projections()).toEqual(['247 387']);
});

test('the sample gives way to what is opened while it loads, and afterwards', async ({ bev, page }) => {
  await page.addInitScript(() => {
    const decode = window.createImageBitmap;
    const decoded: ImageBitmap[] = [];
    const createImageBitmap = async (blob: Blob): Promise<ImageBitmap> => {
      const bitmap = await decode(blob);
      decoded.push(bitmap);
      return bitmap;
    };
    Object.assign(window, { decoded, createImageBitmap });
  });
  const numDecoded = (): Promise<number> =>
    page.evaluate(() => (window as unknown as { decoded: ImageBitmap[] }).decoded.length);
  const release = await hold(page, /front\b.*\.jpg$/);
  await page.goto('about:blank');
  await page.goto('./#bev');
  await expect(bev.view.getByText('top.jpg')).toBeVisible();
  await bev.choose('Open', /the worked numbers/);
  await expect(bev.view.getByText('top.jpg')).toHaveCount(0);
  await release();
  await expect.poll(numDecoded, 'both pictures of the sample').toBe(2);
  await bev.click('top', 239, 141);
  await expect.poll(() => bev.projections()).toEqual(['247.28 387.33']);
  await expect(bev.view.getByText('front.jpg')).toHaveCount(0);
  await expect(page.getByRole('alert')).toHaveCount(0);

  await bev.choose('Open', /sample/i);
  await expect(bev.view.getByText('front.jpg')).toBeVisible();
  await expect(page.getByLabel('Top camera: width (px)')).toHaveValue('1024');
  await bev.choose('Open', /the worked numbers/);
  await expect(bev.view.getByText('front.jpg')).toHaveCount(0);
  await expect(page.getByRole('alert')).toHaveCount(0);
});

test('a scene and points as files, a grid, and the way back to the map', async ({ bev, page }) => {
  const { scene } = presetNamed('homework_numbers');
  await bev.load([
    { name: 'scene.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(scene)) },
    { name: 'points.csv', mimeType: 'text/csv', buffer: Buffer.from(MARKED.map((one) => one.join(',')).join('\n')) },
  ]);
  await page.getByLabel('Front pixels').selectOption('truncated');
  await expect.poll(() => bev.projections()).toEqual(PUBLISHED);
  await page.getByRole('button', { name: 'Grid' }).click();
  await bev.click('top', 200, 100);
  await bev.click('top', 320, 220);
  await page.getByLabel('columns').fill('2');
  await page.getByLabel('columns').press('Tab');
  await expect(bev.rows).toHaveCount(3 * 5);
  await page.getByRole('button', { name: 'Map', exact: true }).click();
  await expect(page.getByRole('group', { name: 'Map' })).toBeVisible();
  await page.getByRole('button', { name: "Bird's-eye view" }).click();
  await expect(bev.rows).toHaveCount(3 * 5);
});

test('on a phone in the dark all of it is reached', async ({ bev, page }, info) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await page.emulateMedia({ colorScheme: 'dark' });
  await bev.load(pair(512));
  for (const [u, v] of MARKED) await bev.click('top', u, v);
  await expect(bev.rows).toHaveCount(4);
  expect(await bev.view.evaluate((one) => one.scrollWidth <= one.clientWidth)).toBe(true);
  await page.getByLabel('Front camera: y (m)').scrollIntoViewIfNeeded();
  await expect(page.getByLabel('Front camera: y (m)')).toBeInViewport();
  await page.screenshot({ path: info.outputPath('phone.png') });
});

test('a course page begins with its own scene', async ({ bev, page, baseURL }) => {
  const { scene } = presetNamed('homework_numbers');
  const [top, front] = pair(512);
  scene.top.image = 'top.png';
  scene.front.image = 'views/front.png';
  const script = `<script type="module" src="${baseURL}scanstitch-app.js"></script>`;
  const body = `<!doctype html><title>Lesson</title><scanstitch-app view="bev" src="set/scene.json"></scanstitch-app>`;
  await page.route('**/lesson/', (route) => route.fulfill({ contentType: 'text/html', body: body + script }));
  await page.route('**/lesson/set/scene.json', (route) => route.fulfill({ json: scene }));
  await page.route('**/lesson/set/top.png', (route) => route.fulfill({ body: top?.buffer ?? '' }));
  await page.route('**/lesson/set/views/front.png', (route) => route.fulfill({ body: front?.buffer ?? '' }));
  await bev.open(`${baseURL}lesson/`);
  await expect(bev.view.getByText('views/front.png')).toBeVisible();
  await bev.click('top', 239, 141);
  await expect.poll(() => bev.projections()).toEqual(['247.28 387.33']);
  await expect(page.getByRole('alert')).toHaveCount(0);
});
