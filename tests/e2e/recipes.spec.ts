/**
 * The recipes of docs/embedding.md, as they stand there: laser scans, depth images and a bag are opened, an event is heard and an
 * error is shown. Without CI=true each that needs nothing of a registry is run once.
 */
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import type { Server } from 'node:http';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { expect, type Page, test } from '@playwright/test';
import { build } from 'vite';
import { lessonPage } from '../../scripts/lesson.mjs';
import { bag, depthImages, type Files, type Heard, scans } from './course_page.js';
import { serve } from './static_server.mjs';

const ROOT = join(import.meta.dirname, '..', '..');
const DIST = join(ROOT, 'www', 'dist');
const DOCS = readFileSync(join(ROOT, 'docs', 'embedding.md'), 'utf8');
const FRAMEWORKS = ['react@19.3.1', 'react-dom@19.3.1', 'vue@3.5.45', '@vitejs/plugin-vue@6.0.11'];
const isWhole = Boolean(process.env.CI);

/** What is opened, and what comes of it: how many frames of which kind, or an error. */
interface Case {
  files: Files;
  told: ['planar' | 'spatial', number] | RegExp;
}

const CASES = {
  'laser scans': { files: scans(3), told: ['planar', 3] },
  'depth images': { files: depthImages(3), told: ['spatial', 3] },
  'a bag': { files: { 'room.mcap': bag(3) }, told: ['spatial', 3] },
  'an error': { files: { '0.ply': 'ply\nnot a cloud\n' }, told: /header/i },
} satisfies Record<string, Case>;
type CaseName = keyof typeof CASES;

/** What a recipe does by itself: the first of these runs always, the others where CI=true. */
const casesOf = (names: readonly CaseName[]): readonly CaseName[] => (isWhole ? names : names.slice(0, 1));

// One worker: each test would install the frameworks for itself.
test.describe.configure({ mode: 'default' });

let folder = '';
let server: Server;

test.beforeAll(async () => {
  test.setTimeout(600_000);
  folder = mkdtempSync(join(tmpdir(), 'scanstitch-recipes-'));
  server = await serve(folder);
  if (!isWhole) return;
  writeFileSync(join(folder, 'package.json'), '{ "private": true, "type": "module" }');
  const env = Object.fromEntries(Object.entries(process.env).filter(([name]) => !name.startsWith('npm_')));
  const options = ['--prefer-offline', '--no-audit', '--no-fund', '--loglevel=error'];
  execFileSync('npm', ['install', ...options, ...FRAMEWORKS], { cwd: folder, env });
  // The package as it is here: that it can be packed and installed is for consumers.spec.ts.
  symlinkSync(ROOT, join(folder, 'node_modules', 'scanstitch'));
});

test.afterAll(() => {
  server.close();
  rmSync(folder, { recursive: true, force: true });
});

/** The code of this language below a heading of the docs. */
function recipe(heading: string, language: string, fence = '```'): string {
  const section = DOCS.slice(DOCS.indexOf(`### ${heading}\n`));
  const code = new RegExp(`${fence}${language}\\n([^]*?)\\n${fence}`).exec(section)?.[1];
  if (code === undefined) throw new Error(`docs/embedding.md has no ${language} below ${heading}`);
  return code;
}

function write(path: string, content: string): void {
  mkdirSync(dirname(join(folder, path)), { recursive: true });
  writeFileSync(join(folder, path), content);
}

/** Opens a page of the recipe; homework.json and what it names are those of the case. */
async function expectTold(page: Page, path: string, { files, told }: Case): Promise<void> {
  const { port } = server.address() as { port: number };
  await page.route('**/scans/**', (route) => {
    const name = new URL(route.request().url()).pathname.split('/scans/')[1] ?? '';
    if (name === 'homework.json') return route.fulfill({ json: { files: Object.keys(files) } });
    return route.fulfill({ body: files[name] ?? '' });
  });
  await page.addInitScript(() => {
    window.heard = [];
    const hear = ({ type, detail }: { type: string; detail: unknown }): void => {
      if (/^scanstitch-(done|error)$/.test(type)) window.heard.push({ type, of: '', detail } as never);
    };
    addEventListener('scanstitch-done', (event) => hear(event as CustomEvent));
    addEventListener('scanstitch-error', (event) => hear(event as CustomEvent));
    addEventListener('message', ({ data }) => hear(data));
  });
  await page.goto(`http://localhost:${port}/${path}`);
  await page.waitForFunction(() => window.heard.length > 0, undefined, { timeout: 60_000 });
  const [first] = (await page.evaluate(() => window.heard)) as Heard[keyof Heard][];
  if (told instanceof RegExp) {
    expect(first).toMatchObject({ type: 'scanstitch-error', detail: { message: expect.stringMatching(told) } });
    const frame = page.frames().at(-1) ?? page.mainFrame();
    await expect(frame.getByRole('region', { name: 'Messages' })).toContainText(told);
  } else {
    expect(first?.type).toBe('scanstitch-done');
    const { kind, result } = (first as Heard['scanstitch-done']).detail;
    expect([kind, result.frames.length]).toEqual(told);
  }
}

for (const name of casesOf(['laser scans', 'an error'])) {
  test(`plain HTML: ${name}`, async ({ page }) => {
    write('plain/index.html', `<!doctype html><body>${recipe('Plain HTML', 'html')}`);
    linkTo('plain/scanstitch');
    await expectTold(page, 'plain/index.html', CASES[name]);
    if (name === 'laser scans') await expect(page.locator('#news')).toHaveText('3 frames');
  });
}

test("a look of one's own", async ({ page }) => {
  write('look/index.html', `<!doctype html><body>${recipe("A look of one's own", 'html')}`);
  linkTo('look/scanstitch');
  await expectTold(page, 'look/index.html', CASES['laser scans']);
  const app = page.locator('scanstitch-app');
  await expect(app.getByText('Robotics 101')).toBeVisible();
  await expect(app.getByRole('heading', { name: 'Exercise 3' })).toBeVisible();
  await expect(app.getByRole('button', { name: 'Export' }).first()).toHaveCSS('font-family', /Georgia/);
  const accent = await app.evaluate((element) => getComputedStyle(element).getPropertyValue('--scanstitch-accent'));
  expect(accent.trim()).toBe('#8b1e3f');
});

test('Jupyter Book and Sphinx', async ({ page }) => {
  const raw = /```\{raw\} html\n([^]*?)```/.exec(`${recipe('Jupyter Book and Sphinx', 'md', '````')}\n`)?.[1] ?? '';
  write('book/index.html', `<!doctype html><body><main>${raw}</main>`);
  mkdirSync(join(folder, 'book/_static'), { recursive: true });
  linkTo('book/_static/scanstitch');
  await expectTold(page, 'book/index.html', CASES['laser scans']);
});

function linkTo(path: string): void {
  rmSync(join(folder, path), { force: true });
  symlinkSync(DIST, join(folder, path));
}

// Of what a frame without an origin keeps scripts from, each kind of files needs something else.
for (const name of casesOf(['laser scans', 'depth images', 'a bag', 'an error'])) {
  test(`Moodle, Canvas and other frames: ${name}`, async ({ page }) => {
    const one = CASES[name];
    const element = readFileSync(join(DIST, 'standalone', 'scanstitch-app.js'), 'utf8');
    const paths = Object.entries(one.files).map(([name, content], i) => {
      // Of colours and depths with the same names, which a page of files cannot hold, the depths.
      const path = join(folder, 'lesson-files', String(i), name.replace(/.*\//, ''));
      mkdirSync(dirname(path), { recursive: true });
      writeFileSync(path, content);
      return name.includes('/rgb/') ? '' : path;
    });
    const files = paths.filter((path) => path !== '');
    write('frame/lesson.html', lessonPage(element, files, { title: 'Homework 2', settings: '' }));
    write('frame/index.html', `<!doctype html><body>${recipe('Moodle, Canvas and other frames', 'html')}`);
    await expectTold(page, 'frame/index.html', one);
    await expect(page.frameLocator('iframe').getByText('Homework 2')).toBeVisible();
  });
}

/** A page whose script Vite bundles. */
async function bundle(name: string, files: Record<string, string>, plugins: unknown[] = []): Promise<string> {
  for (const [path, content] of Object.entries(files)) write(`${name}/${path}`, content);
  write(
    `${name}/index.html`,
    '<!doctype html><body><div id="app"></div><script type="module" src="./main.jsx"></script>',
  );
  await build({
    root: join(folder, name),
    configFile: false,
    logLevel: 'error',
    base: './',
    plugins: plugins as never,
    build: { outDir: 'dist', minify: false },
  });
  return `${name}/dist/index.html`;
}

const REACT_MAIN = `import { createRoot } from 'react-dom/client';
import Lesson from './Lesson.jsx';
createRoot(document.querySelector('#app')).render(<Lesson src="scans/homework.json" />);`;

/** A framework, how its recipe is bundled, and what it opens there. */
const BUNDLED: [string, () => Promise<string>, CaseName[]][] = [
  [
    'React',
    () => bundle('react', { 'Lesson.jsx': recipe('React', 'jsx'), 'main.jsx': REACT_MAIN }),
    ['laser scans', 'depth images', 'an error'],
  ],
  [
    'Docusaurus',
    () => bundle('docusaurus', { 'Lesson.jsx': recipe('Docusaurus', 'jsx'), 'main.jsx': REACT_MAIN }),
    ['laser scans'],
  ],
  [
    'Vue',
    async () => {
      const main =
        "import { createApp } from 'vue'; import Lesson from './Lesson.vue'; createApp(Lesson).mount('#app');";
      const { default: vue } = await import(join(folder, 'node_modules/@vitejs/plugin-vue/dist/index.mjs'));
      const compilerOptions = { isCustomElement: (tag: string) => tag === 'scanstitch-app' };
      const files = { 'Lesson.vue': recipe('Vue', 'vue'), 'main.jsx': main };
      return bundle('vue', files, [vue({ template: { compilerOptions } })]);
    },
    ['laser scans', 'an error'],
  ],
];
for (const [name, prepare, cases] of BUNDLED) {
  test(name, async ({ page }) => {
    test.skip(!isWhole, 'installed where CI=true');
    test.setTimeout(240_000);
    const path = await prepare();
    for (const of_files of cases) {
      const { files, told } = CASES[of_files];
      await expectTold(page, path, { files, told });
      // What the recipe itself makes of the event.
      if (name !== 'Docusaurus')
        await expect(page.locator('#news')).toHaveText(told instanceof RegExp ? told : '3 frames');
      await page.unrouteAll();
    }
  });
}
