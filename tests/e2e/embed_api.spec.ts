/** The element as a page uses it: what `src` may hold, attributes that change, methods, events, and what goes wrong. */
import { bag, CLOSED, COURSE, depthImages, expect, scans, test } from './course_page.js';
import type { ScanstitchElement } from '../../npm/element.js';
import { ScanstitchPage } from './scanstitch_page.js';

test('depth images, listed by a manifest', async ({ course }) => {
  const files = depthImages(3);
  const names = Object.keys(files);
  const list = (folder: string): string[] => names.filter((name) => name.startsWith(`room/${folder}/`));
  const manifest = {
    title: 'Lab 4',
    depth: list('depth'),
    color: list('rgb'),
    files: 'room/camera-intrinsics.txt',
  };
  await course.open('<scanstitch-app src="set.json"></scanstitch-app>', {
    ...files,
    'set.json': JSON.stringify(manifest),
  });
  const { detail } = await course.heard('scanstitch-done');
  expect(detail.kind).toBe('spatial');
  expect(detail.result.frames.map(({ status }) => status)).toEqual(['good', 'good', 'good']);
  expect(detail.result).toMatchObject({ camera: { fx: 80 } });
  await expect(course.page.getByText('Lab 4')).toBeVisible();
  const { detail: first } = await course.heard('scanstitch-progress');
  expect(first).toMatchObject({ stage: 'fetching', activity: 'Fetching file 1 of 7' });
});

test('scans of a manifest are called by their names, without queries and escapes', async ({ course }) => {
  const { '0.ply': first = '', '1.ply': second = '' } = scans(2);
  const inline = `data:application/octet-stream;name=inline.ply;base64,${Buffer.from(second as Buffer).toString('base64')}`;
  const manifest = { scans: ['./my%20scan.ply?v=2', inline] };
  await course.open('<scanstitch-app src="set.json"></scanstitch-app>', {
    'my%20scan.ply': first,
    'set.json': JSON.stringify(manifest),
  });
  const { detail } = await course.heard('scanstitch-done');
  expect(detail.result.frames.map(({ name }) => name)).toEqual(['my scan.ply', 'inline.ply']);
});

test('a bag by its address, then other addresses, by a method that waits', async ({ course, page }) => {
  await course.open('<scanstitch-app src="room.mcap"></scanstitch-app>', { 'room.mcap': bag(3), ...scans(3) });
  const { detail } = await course.heard('scanstitch-done');
  expect(detail.kind).toBe('spatial');
  expect(detail.result.frames).toHaveLength(3);
  const told = await course.element.evaluate(async (element: ScanstitchElement) => {
    await element.open(['0.ply', '1.ply']);
    const under_way = element.result;
    const { kind, result } = await element.run();
    const map = element.map_points;
    return { under_way, kind, num: result.frames.length, map: map && [map.dimensions, map.positions.length] };
  });
  expect(told).toEqual({ under_way: null, kind: 'planar', num: 2, map: [2, 720] });
  await expect(page.getByRole('region', { name: 'Topics of the bag' })).toHaveCount(0);
});

test('an element that is not shown tells when it is done', async ({ course, page }) => {
  await course.open('<scanstitch-app src="0.ply 1.ply" style="display: none"></scanstitch-app>', scans(2));
  const { detail } = await course.heard('scanstitch-done');
  expect(detail.result.frames).toHaveLength(2);
  await course.element.evaluate((element) => element.removeAttribute('style'));
  await expect(page.getByRole('group', { name: 'Map' })).toBeVisible();
});

test('files of the page, a run that is cancelled and goes on', async ({ course }) => {
  const files = depthImages(6);
  await course.open('<scanstitch-app src="none"></scanstitch-app>', files);
  const told = await course.element.evaluate(
    async (element: ScanstitchElement, names) => {
      await customElements.whenDefined('scanstitch-app');
      const nothing = await element.run().catch((error: Error) => error.message);
      const fetched = names.map(async (name) => new File([await (await fetch(name)).blob()], name.replace('/', '-')));
      await element.open(await Promise.all(fetched));
      const cancelled = element.run().catch((error: Error) => error.message);
      element.cancel();
      const why = await cancelled;
      const { result } = await element.run();
      return { nothing, why, num: result.frames.length };
    },
    Object.keys(files).filter((name) => name.includes('depth')),
  );
  expect(told).toEqual({ nothing: 'There is nothing to compute', why: 'The run was stopped', num: 6 });
});

test('open() works on an element that was added to the page a moment before', async ({ course, page }) => {
  await course.open('<p id="here"></p>');
  const opened = await page.evaluate(async () => {
    const element = document.createElement('scanstitch-app');
    element.setAttribute('src', 'none');
    document.getElementById('here')?.append(element);
    await element.open('');
    const { result } = await element.run();
    return result.frames.length;
  });
  expect(opened).toBe(10);
});

test('attributes act when they change', async ({ course, page }) => {
  await course.open('<scanstitch-app src="0.ply 1.ply"></scanstitch-app>', scans(3));
  await course.heard('scanstitch-done');
  const set = (name: string, value: string): Promise<void> =>
    course.element.evaluate((element, [name, value]) => element.setAttribute(name, value), [name, value] as const);
  await set('src', '["0.ply", "1.ply", "2.ply"]');
  expect((await course.heard('scanstitch-done', 1)).detail.result.frames).toHaveLength(3);
  await set('settings', 'strategy=scan_to_scan');
  expect((await course.heard('scanstitch-done', 2)).detail.result.settings).toMatchObject({ strategy: 'scan_to_scan' });
  await set('theme', 'dark');
  await expect(page.getByRole('button', { name: 'Light colours' })).toBeVisible();
  await set('view', 'bev');
  await expect(page.locator('scanstitch-bev')).toBeVisible();
  await set('view', 'map');
  await expect(page.locator('scanstitch-map')).toBeVisible();
});

test('attributes that change while it runs: what was set last is computed', async ({ course, page }) => {
  const names = Array.from({ length: 10 }, (_, i) => `${i}.ply`);
  const body = `<scanstitch-app src="ten.json"></scanstitch-app><script>
    const element = document.querySelector('scanstitch-app');
    const changes = [
      { settings: 'max_iterations=41', view: 'strategies' },
      { src: 'three.json', settings: 'max_iterations=42', view: 'map' },
    ];
    addEventListener('scanstitch-progress', ({ detail }) => {
      if (detail.stage !== 'running') return;
      for (const [name, value] of Object.entries(changes.shift() ?? {})) element.setAttribute(name, value);
    });
  </script>`;
  await course.open(body, {
    ...scans(10),
    'ten.json': JSON.stringify({ scans: names }),
    'three.json': JSON.stringify({ scans: names.slice(0, 3) }),
  });
  const result = (): Promise<unknown> =>
    course.element.evaluate(({ result }: ScanstitchElement) => [
      result?.result.frames.length,
      (result?.result.settings as { max_iterations?: number } | undefined)?.max_iterations,
    ]);
  await expect.poll(result, { timeout: 30_000 }).toEqual([3, 42]);
  await expect(page.locator('scanstitch-map')).toBeVisible();
  expect(await page.evaluate(() => window.heard.filter(({ type }) => type === 'scanstitch-error').length)).toBe(0);
});

test('depth images of the page that a drop replaces come back by Undo', async ({ course, page }) => {
  const manifest = {
    title: 'Lab 4',
    depth: ['room/depth/1.png', 'room/depth/2.png'],
    files: 'room/camera-intrinsics.txt',
  };
  await course.open('<scanstitch-app src="set.json"></scanstitch-app>', {
    ...depthImages(2),
    'set.json': JSON.stringify(manifest),
  });
  await course.heard('scanstitch-done');
  const own = Object.entries(depthImages(3)).filter(([name]) => !name.includes('/rgb/'));
  await new ScanstitchPage(page).drop(
    own.map(([name, content]) => ({ name: name.replace('room', 'hall'), content: content as Buffer })),
  );
  expect((await course.heard('scanstitch-done', 1)).detail.result.frames).toHaveLength(3);
  const bar = page.getByRole('region', { name: 'Replaced recording' });
  await expect(bar).toContainText('Lab 4');
  await bar.getByRole('button', { name: 'Undo' }).click();
  await expect(bar).toContainText('Lab 4 is open again');
  expect(await course.element.evaluate((element: ScanstitchElement) => element.result?.result.frames.length)).toBe(2);
});

test('it is moved in the document while it runs, and each of two has its own part of the address', async ({
  course,
  page,
}) => {
  const body = `<div id="left"><scanstitch-app id="a" src="scans.json" remember-settings></scanstitch-app></div>
    <div id="right"></div><scanstitch-app id="b" src="0.ply 1.ply" remember-settings></scanstitch-app><script>
    const element = document.querySelector('#a');
    const right = document.querySelector('#right');
    element.addEventListener('scanstitch-progress', ({ detail }) => {
      if (detail.stage === 'running' && element.parentElement !== right) right.append(element);
    });
  </script>`;
  const names = Array.from({ length: 10 }, (_, i) => `${i}.ply`);
  await course.open(body, { ...scans(10), 'scans.json': JSON.stringify({ scans: names }) });
  const done = [await course.heard('scanstitch-done'), await course.heard('scanstitch-done', 1)];
  const counts = Object.fromEntries(done.map(({ of, detail }) => [of, detail.result.frames.length]));
  expect(counts).toEqual({ a: 10, b: 2 });
  await expect(page.locator('#right > #a')).toHaveCount(1);
  const stages = await page.evaluate(() =>
    window.heard.flatMap(({ type, of, detail }) =>
      type === 'scanstitch-progress' && of === 'a' ? [detail.stage] : [],
    ),
  );
  expect(stages.slice(stages.indexOf('running')), 'it is not begun anew').not.toContain('reading');

  await page.evaluate(() => {
    location.hash = '#strategy=scan_to_scan';
  });
  const { of, detail } = await course.heard('scanstitch-done', 2);
  expect(of).toBe('a');
  expect(detail.result.settings).toMatchObject({ strategy: 'scan_to_scan' });
  await page.evaluate(() => {
    location.hash += '&@b=max_iterations%3D7';
  });
  const own = await course.heard('scanstitch-done', 3);
  expect(own.of).toBe('b');
  expect(own.detail.result.settings).toMatchObject({ max_iterations: 7 });
  await page.locator('#a').getByRole('button', { name: 'Settings' }).click();
  await page.locator('#a').getByLabel('Strategy').selectOption('joint');
  expect((await course.heard('scanstitch-done', 4)).of).toBe('a');
  expect(new URL(page.url()).hash, 'what the other has stays').toBe('#@b=max_iterations%3D7');
  expect(await page.evaluate(() => window.heard.filter(({ type }) => type === 'scanstitch-error').length)).toBe(0);
});

test('removed and put back, it computes again', async ({ course, page }) => {
  await course.open('<scanstitch-app id="a" src="0.ply 1.ply 2.ply"></scanstitch-app>', scans(3));
  await course.heard('scanstitch-done');
  const message = await page.evaluate(async () => {
    const element = document.querySelector('#a') as ScanstitchElement;
    element.setAttribute('settings', 'max_iterations=41');
    await new Promise((resolve) => element.addEventListener('scanstitch-progress', resolve, { once: true }));
    const told = new Promise((resolve) =>
      element.addEventListener('scanstitch-error', (event) => resolve(event.detail.message), { once: true }),
    );
    const run = element.run().catch((error: Error) => error.message);
    await Promise.resolve();
    element.remove();
    const words = [await told, await run];
    document.body.append(element);
    return words;
  });
  const reason = 'The element was removed from the page before the run was done';
  expect(message).toEqual([reason, reason]);
  const { detail } = await course.heard('scanstitch-done', 1);
  expect(detail.result.frames).toHaveLength(3);
  expect(detail.result.settings).toMatchObject({ max_iterations: 41 });
});

test('of what is opened at once the last counts, and the others are rejected', async ({ course, page }) => {
  await course.open('<scanstitch-app src="none"></scanstitch-app>', scans(3));
  let answer = (): void => undefined;
  const answered = new Promise<void>((resolve) => (answer = resolve));
  await page.route(`${COURSE}0.ply`, async (route) => {
    await answered;
    await route.fallback();
  });
  const first = await course.element.evaluateHandle(async (element: ScanstitchElement) => {
    await customElements.whenDefined('scanstitch-app');
    const asked = [
      element.open(['0.ply', '1.ply']),
      element.open('0.ply 2.ply'),
      element.open(['0.ply', '1.ply', '2.ply']),
    ];
    return { ended: Promise.all(asked.map((opening) => opening.catch(({ name }: Error) => name))) };
  });
  const names = (): Promise<string[]> =>
    course.element.evaluate(async (element: ScanstitchElement) =>
      (await element.run()).result.frames.map(({ name }) => name),
    );
  await course.element.evaluate((element: ScanstitchElement) => element.open(['1.ply', '2.ply']));
  expect(await names()).toEqual(['1.ply', '2.ply']);
  answer();
  expect(await first.evaluate(({ ended }) => ended)).toEqual(['AbortError', 'AbortError', 'AbortError']);
  expect(await names()).toEqual(['1.ply', '2.ply']);
});

test('removed, it no longer listens to the window and the document', async ({ course, page }) => {
  await page.addInitScript(() => {
    const { addEventListener, removeEventListener } = EventTarget.prototype;
    const listeners: Record<string, Set<unknown>> = {};
    Object.assign(window, { listeners });
    const noted = (method: typeof addEventListener, note: 'add' | 'delete'): typeof addEventListener =>
      function (this: EventTarget | undefined, type, listener, options) {
        const target = this ?? window;
        if (target === window || target === document) (listeners[type] ??= new Set())[note](listener);
        method.call(target, type, listener, options);
      };
    EventTarget.prototype.addEventListener = noted(addEventListener, 'add');
    EventTarget.prototype.removeEventListener = noted(removeEventListener, 'delete');
  });
  await course.open('<scanstitch-app src="0.ply 1.ply"></scanstitch-app>', scans(2));
  await course.heard('scanstitch-done');
  const counts = (): Promise<[string, number][]> =>
    page.evaluate(() => {
      const { listeners } = window as unknown as { listeners: Record<string, Set<unknown>> };
      return Object.entries(listeners).map(([type, { size }]) => [type, size]);
    });
  const before = await counts();
  await page.evaluate(() => {
    const other = document.createElement('scanstitch-app');
    other.setAttribute('src', '0.ply 1.ply');
    document.body.append(other);
  });
  await course.heard('scanstitch-done', 1);
  expect(await counts()).not.toEqual(before);
  await page.evaluate(() => document.querySelectorAll('scanstitch-app')[1]?.remove());
  expect(await counts()).toEqual(before);
});

test('title, side panel, parts and colours of the page; events of its own parts do not leave it', async ({
  course,
  page,
}) => {
  const body = `<style>scanstitch-app { --scanstitch-accent: rgb(200, 0, 0) } ::part(map) { opacity: 0.9 }</style>
    <scanstitch-app src="0.ply 1.ply"><b slot="title">Robotics 101</b><p slot="side">Read chapter 3 first.</p></scanstitch-app>`;
  await course.open(body, scans(2));
  await course.heard('scanstitch-done');
  await expect(page.getByText('Robotics 101')).toBeVisible();
  await expect(page.getByText('Read chapter 3 first.')).toBeVisible();
  const seen = await course.element.evaluate((element) => {
    const run = element.shadowRoot?.querySelector('scanstitch-planar')?.shadowRoot;
    const map = run?.querySelector('[part~=map]') as Element;
    return [getComputedStyle(map).opacity, getComputedStyle(map).getPropertyValue('--accent')];
  });
  expect(seen).toEqual(['0.9', 'rgb(200, 0, 0)']);

  const leaving = await page.evaluateHandle(() => {
    const types: string[] = [];
    const dispatch = EventTarget.prototype.dispatchEvent;
    EventTarget.prototype.dispatchEvent = function (event) {
      if (event instanceof CustomEvent && event.composed) types.push(event.type);
      return dispatch.call(this, event);
    };
    return types;
  });
  await page.getByRole('group', { name: 'Panels' }).getByRole('button', { name: 'Scans' }).click();
  await page.getByRole('button', { name: '1.ply', exact: true }).click();
  await page.getByRole('button', { name: 'Look inside' }).click();
  await expect(page.getByRole('button', { name: 'Reset start' })).toBeVisible();
  expect((await leaving.jsonValue()).filter((type) => !type.startsWith('scanstitch-'))).toEqual([]);
});

/** What is wrong, the attributes that say so, and what is told. */
const WRONG: [string, string, RegExp][] = [
  ['a wrong address in a manifest', 'src="wrong.json"', /course\.example\/lesson\/missing\.ply answered 404/],
  ['a manifest that is none', 'src="page.json"', /page\.json is not a manifest: it is not JSON; it should read/],
  ['a manifest with a misspelt name', 'src="typo.json"', /typo\.json names no scans \(scan: not known\)/],
  [
    'another host that does not permit it',
    `src="${CLOSED}0.ply"`,
    /closed\/0\.ply could not be fetched: .*Access-Control-Allow-Origin/,
  ],
  ['no address', 'src="http://"', /http:\/\/ is not an address/],
  ['a broken list', `src='["0.ply"'`, /is not a list of addresses/],
  ['nothing to use', 'src="notes.pdf"', /there is no scan among notes\.pdf/],
  ['an unknown setting', 'src="0.ply 1.ply" settings="max_rnage=3"', /“max_rnage” is not a setting/],
  ['a setting that is not a number', 'src="0.ply 1.ply" settings="max_range=far"', /“max_range=far” is not a number/],
  ['an unknown preset', 'src="0.ply 1.ply" preset="best"', /“best” is not a preset: /],
  ['an unknown theme', 'src="0.ply 1.ply" theme="pink"', /“pink” is not a theme: auto, light, dark/],
  ['an unknown view', 'src="0.ply 1.ply" view="top"', /“top” is not a view: map, bev, icp/],
];
test('what is wrong with an element is told in it and by its own event, and the others beside it work', async ({
  course,
}) => {
  const body = WRONG.map(([, attributes], i) => `<scanstitch-app id="e${i}" ${attributes}></scanstitch-app>`).join('');
  await course.open(`<style>scanstitch-app { height: 400px }</style>${body}`, {
    ...scans(2),
    'wrong.json': JSON.stringify({ scans: ['0.ply', 'missing.ply'] }),
    'page.json': '<!doctype html>',
    'typo.json': JSON.stringify({ scan: ['0.ply'] }),
    'notes.pdf': '%PDF-1.7',
  });
  for (const [i, [name, attributes, message]] of WRONG.entries()) {
    const { detail } = await course.heardOf(`e${i}`, 'scanstitch-error');
    expect(detail.message, name).toMatch(message);
    const messages = course.page.locator(`#e${i}`).getByRole('region', { name: 'Messages' });
    await expect(messages, name).toContainText(message);
    // What is right is done all the same.
    if (attributes.includes('0.ply 1.ply')) await course.heardOf(`e${i}`, 'scanstitch-done');
  }
});
