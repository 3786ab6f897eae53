/**
 * The package as others use it: packed, installed into an empty project, bundled or not, and opened. webpack and esbuild are
 * installed from the registry where CI=true, and skipped otherwise.
 */
import { execFileSync, spawnSync } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { builtinModules } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, type Page, test } from '@playwright/test';
import { build } from 'vite';
import { neededPackages } from '../cli/support.mjs';
import { SAMPLE_FOLDER } from './scanstitch_page.js';
import { serve } from './static_server.mjs';

const ROOT = join(import.meta.dirname, '..', '..');
const BUNDLERS = ['webpack@5.112.2', 'webpack-cli@7.3.1', 'esbuild@0.28.2'];
const NAMES = ['0.ply', '1.ply', '2.ply'];

/** A page that uses all that the package exports; `engine` is what `load` is given. */
const source = (engine = '', imports = ''): string => `
import { load, Reconstruction } from 'scanstitch';
import { openRecording } from 'scanstitch/recording';
import 'scanstitch/element';
${imports}
const files = ${JSON.stringify(NAMES)}.map(async (path) => ({ path, blob: await (await fetch(path)).blob() }));
const recording = await openRecording(await Promise.all(files));
await load(${engine});
const reconstruction = new Reconstruction();
for (const path of recording.scans) reconstruction.add_scan(path, await recording.read(path));
while (reconstruction.step().stage !== 'done');
const element = Object.assign(document.createElement('scanstitch-app'), { src: '${NAMES.join(' ')}' });
document.body.append(element);
const { kind, result } = await element.run();
window.told = [recording.kind, reconstruction.result().frames.length, kind, result.frames.length];
`;

let project = '';

// One worker: each one would pack and install the package.
test.describe.configure({ mode: 'default' });

test.beforeAll(() => {
  test.setTimeout(300_000); // where it installs from the registry
  project = mkdtempSync(join(tmpdir(), 'scanstitch-consumers-'));
  const npm = (...args: string[]): string => {
    // What runs the tests has settings of its own for npm.
    const env = Object.fromEntries(Object.entries(process.env).filter(([name]) => !name.startsWith('npm_')));
    return execFileSync('npm', [...args, '--loglevel=error'], { cwd: project, encoding: 'utf8', env });
  };
  writeFileSync(join(project, 'package.json'), '{ "private": true, "type": "module" }');
  const packed = JSON.parse(npm('pack', '--json', '--offline', '--ignore-scripts', ROOT, ...neededPackages())) as {
    filename: string;
  }[];
  npm('install', '--offline', ...packed.map(({ filename }) => filename));
  if (process.env.CI) npm('install', '--prefer-offline', '--no-audit', '--no-fund', ...BUNDLERS);
});

test.afterAll(() => rmSync(project, { recursive: true, force: true }));

/** A page of a consumer in a folder of its own, with the scans beside it. */
function consumer(name: string, main: string): string {
  const folder = join(project, name);
  mkdirSync(join(folder, 'dist'), { recursive: true });
  for (const scan of NAMES) copyFileSync(join(SAMPLE_FOLDER, scan), join(folder, 'dist', scan));
  writeFileSync(join(folder, 'main.js'), main);
  return folder;
}

async function expectMap(page: Page, folder: string, path = ''): Promise<void> {
  const server = await serve(folder);
  const { port } = server.address() as { port: number };
  const faults: string[] = [];
  page.on('pageerror', (error) => faults.push(error.message));
  await page.goto(`http://localhost:${port}/${path}`);
  const told = (): Promise<unknown> => page.evaluate(() => (window as { told?: unknown }).told);
  await expect
    .poll(async () => faults.length > 0 || (await told()) !== undefined, {
      message: 'the page has told, or failed',
      timeout: 90_000,
    })
    .toBe(true);
  expect(faults).toEqual([]);
  expect(await told()).toEqual(['planar_scans', 3, 'planar', 3]);
  server.close();
}

/** As an import names it; libraries have events of names such as `node:create`. */
const MODULE_OF_NODE = new RegExp(`['"\`]node:(${builtinModules.join('|')})['"\`/]`);

function expectNothingOfNode(folder: string): void {
  const names = readdirSync(folder, { recursive: true, encoding: 'utf8' }).filter((name) => name.endsWith('.js'));
  expect(names.length).toBeGreaterThan(0);
  for (const name of names) expect(readFileSync(join(folder, name), 'utf8')).not.toMatch(MODULE_OF_NODE);
}

const page_of = (main: string): string => `<!doctype html><body><script type="module" src="${main}"></script>`;

test('Vite', async ({ page }) => {
  test.setTimeout(300_000);
  const folder = consumer('with-vite', source());
  writeFileSync(join(folder, 'index.html'), page_of('./main.js'));
  const options = { outDir: 'dist', emptyOutDir: false, target: 'es2022' };
  await build({ root: folder, configFile: false, logLevel: 'error', base: './', build: options });
  expectNothingOfNode(join(folder, 'dist'));
  await expectMap(page, join(folder, 'dist'));
});

test('a plain module script, without a bundler', async ({ page }) => {
  const folder = consumer('plain', source());
  const at = '../../node_modules';
  const imports = {
    scanstitch: `${at}/scanstitch/npm/browser.js`,
    'scanstitch/recording': `${at}/scanstitch/npm/recording_reader.js`,
    'scanstitch/element': `${at}/scanstitch/www/dist/standalone/scanstitch-app.js`,
    fflate: `${at}/fflate/esm/browser.js`,
  };
  const map = `<script type="importmap">${JSON.stringify({ imports })}</script>`;
  writeFileSync(join(folder, 'dist', 'index.html'), map + page_of('../main.js'));
  await expectMap(page, project, 'plain/dist/index.html');
});

/** Uses the types of all that the package exports, rightly and wrongly. */
const TYPED = `
import { load, Reconstruction, type ReconstructionResult } from 'scanstitch';
import 'scanstitch/element';
import type { ScanstitchElement, ScanstitchFault, ScanstitchResult } from 'scanstitch/element';
import { readRecording } from 'scanstitch/recording';

export async function lesson(files: FileList, paths: { path: string; blob: Blob }[]): Promise<ReconstructionResult> {
  const element: ScanstitchElement = document.createElement('scanstitch-app');
  const faults: ScanstitchFault[] = [];
  element.addEventListener('scanstitch-error', ({ detail }) => faults.push(detail));
  document.addEventListener('scanstitch-done', ({ detail }) => detail.elapsed_ms.toFixed());
  element.addEventListener('scanstitch-compared', ({ detail: [first] }) => first?.result.num_lost.toFixed());
  Object.assign(element, { view: 'strategies', offline: true, rememberSettings: true } satisfies Partial<ScanstitchElement>);
  // @ts-expect-error: no such theme
  element.theme = 'pink';
  // @ts-expect-error: no such view
  element.view = 'top';
  // @ts-expect-error: no such member
  element.start();
  await element.open(files);
  const { kind, result }: ScanstitchResult = await element.run();
  const x: number | undefined = kind === 'planar' ? result.frames[0]?.T_world_sensor.x : undefined;
  const positions: Float32Array | undefined = element.map_points?.positions;
  await load();
  // @ts-expect-error: no such setting
  new Reconstruction({ max_rnage: x });
  const reconstruction = new Reconstruction({ max_range: positions?.length ?? 20 });
  const recording = await readRecording(paths);
  for (const path of recording.scans) reconstruction.add_scan(path, await recording.read(path));
  return reconstruction.result();
}
`;

test('TypeScript', () => {
  writeFileSync(join(project, 'lesson.ts'), TYPED);
  const tsc = join(ROOT, 'node_modules', 'typescript', 'bin', 'tsc');
  const strictly = ['--noEmit', '--strict', '--target', 'es2022', '--lib', 'es2023,dom,dom.iterable', '--types', ''];
  for (const [module, resolution] of [
    ['esnext', 'bundler'],
    ['nodenext', 'nodenext'],
  ] as const) {
    const args = [tsc, ...strictly, '--module', module, '--moduleResolution', resolution, 'lesson.ts'];
    const { status, stdout } = spawnSync(process.execPath, args, { cwd: project, encoding: 'utf8' });
    expect([status, stdout]).toEqual([0, '']);
  }
});

test('webpack', async ({ page }) => {
  test.skip(!process.env.CI, 'installed where CI=true');
  test.setTimeout(600_000); // it takes long over scripts of megabytes
  const folder = consumer('with-webpack', source());
  const args = [
    'webpack',
    '--mode',
    'production',
    '--no-optimization-minimize',
    '--entry',
    './main.js',
    '--output-path',
    'dist',
  ];
  execFileSync('npx', ['--no-install', ...args], { cwd: folder });
  writeFileSync(join(folder, 'dist', 'index.html'), page_of('./main.js'));
  expectNothingOfNode(join(folder, 'dist'));
  await expectMap(page, join(folder, 'dist'));
});

test('esbuild', async ({ page }) => {
  test.skip(!process.env.CI, 'installed where CI=true');
  test.setTimeout(300_000);
  const folder = consumer('with-esbuild', source('engine', "import engine from 'scanstitch/scanstitch_bg.wasm';"));
  const args = [
    'esbuild',
    'main.js',
    '--bundle',
    '--splitting',
    '--minify',
    '--format=esm',
    '--loader:.wasm=file',
    '--outdir=dist',
  ];
  execFileSync('npx', ['--no-install', ...args], { cwd: folder });
  writeFileSync(join(folder, 'dist', 'index.html'), page_of('./main.js'));
  expectNothingOfNode(join(folder, 'dist'));
  await expectMap(page, join(folder, 'dist'));
});
