/**
 * The notebook: a wheel in a virtual environment with JupyterLab, NumPy clouds and files in, poses out. Installed from the registry where
 * CI=true and Python 3 is there; skipped otherwise.
 */
import { type ChildProcess, execFileSync, spawn, spawnSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { expect, type Locator, test } from '@playwright/test';
import { makeWheel } from '../../scripts/wheel.mjs';
import { bag, depthImages } from './course_page.js';
import { SAMPLE_FOLDER } from './scanstitch_page.js';

const has_python = spawnSync('python3', ['-c', 'import venv, ensurepip']).status === 0;
const PACKAGES = ['jupyterlab>=4', 'anywidget>=0.9', 'numpy'];

test.skip(!process.env.CI, 'installed where CI=true');
test.skip(!has_python, 'Python 3 is not there');
test.describe.configure({ timeout: 600_000 });

let folder = '';
let jupyter: ChildProcess | null = null;
let port = 0;

test.beforeAll(async () => {
  test.setTimeout(600_000);
  folder = mkdtempSync(join(tmpdir(), 'scanstitch-notebook-'));
  const venv = process.env.NOTEBOOK_VENV ?? join(folder, 'venv');
  if (!process.env.NOTEBOOK_VENV) execFileSync('python3', ['-m', 'venv', venv]);
  // What is imported once is compiled then, not all that is installed.
  const options = ['--quiet', '--no-compile', '--disable-pip-version-check'];
  const pip = (...args: string[]): Buffer => execFileSync(join(venv, 'bin', 'pip'), ['install', ...options, ...args]);
  if (!process.env.NOTEBOOK_VENV) pip(...PACKAGES);
  pip('--no-deps', '--force-reinstall', makeWheel());
  writeFileSync(join(folder, 'scans.ipynb'), notebook());
  const files = { ...depthImages(3), 'room.mcap': bag(3), 'wrong.ply': 'ply\nnot a cloud\n' };
  for (const [name, content] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, name)), { recursive: true });
    writeFileSync(join(folder, name), content);
  }
  port = await freePort();
  const args = ['lab', '--no-browser', '--allow-root', `--port=${port}`, '--ServerApp.port_retries=0'];
  const open = ['--IdentityProvider.token=', `--ServerApp.root_dir=${folder}`, '--LabApp.news_url=null'];
  const env = { ...process.env, HOME: folder, JUPYTER_CONFIG_DIR: join(folder, 'config') };
  jupyter = spawn(join(venv, 'bin', 'jupyter'), [...args, ...open], { env, stdio: 'ignore' });
  await expect
    .poll(
      () =>
        fetch(`http://localhost:${port}/api`).then(
          ({ ok }) => ok,
          () => false,
        ),
      { timeout: 180_000 },
    )
    .toBe(true);
});

test.afterAll(async () => {
  const ended = new Promise((resolve) => jupyter?.once('exit', resolve));
  jupyter?.kill('SIGINT');
  jupyter?.kill('SIGTERM');
  await Promise.race([ended, new Promise((resolve) => setTimeout(resolve, 10_000))]);
  rmSync(folder, { recursive: true, force: true });
});

/** The first cell shows the widget, the second one reads what came of it. */
function notebook(): string {
  const cells = [
    `import numpy as np
from scanstitch import Scanstitch
scans = [np.loadtxt(f"${SAMPLE_FOLDER}/{i}.ply", skiprows=7) for i in range(10)]
widget = Scanstitch(scans, settings="strategy=joint", height=240)
widget`,
    'print(widget.error, type(widget.poses).__name__, widget.poses.shape, widget.map_points.shape, set(widget.statuses))\n' +
      'print(np.round(widget.poses[1], 1))',
    'images = Scanstitch(files=["room"], height=240)\nimages',
    'bag = Scanstitch(files=["room.mcap"], height=240)\nbag',
    'wrong = Scanstitch(files=["wrong.ply"], height=240)\nwrong',
    'print(images.poses.shape, images.statuses, bag.poses.shape, bag.statuses, wrong.poses, wrong.error)',
  ];
  const made = cells.map((source, i) => ({
    cell_type: 'code',
    id: `c${i}`,
    metadata: {},
    outputs: [],
    execution_count: null,
    source,
  }));
  const kernelspec = { name: 'python3', display_name: 'Python 3 (ipykernel)', language: 'python' };
  return JSON.stringify({ cells: made, metadata: { kernelspec }, nbformat: 4, nbformat_minor: 5 });
}

function freePort(): Promise<number> {
  return new Promise((resolve) => {
    const probe = createServer().listen(0, () => {
      const { port } = probe.address() as { port: number };
      probe.close(() => resolve(port));
    });
  });
}

test('ten NumPy scans, depth images, a bag and a broken file in a notebook', async ({ page }) => {
  await page.addInitScript(() => {
    for (const type of ['done', 'error']) {
      let count = 0;
      addEventListener(`scanstitch-${type}`, () => document.body.setAttribute(`data-${type}`, String(++count)));
    }
  });
  const cell = (index: number): Locator => page.locator('.jp-CodeCell').nth(index);
  const run = async (index: number): Promise<void> => {
    await cell(index).locator('.cm-content').click();
    await page.keyboard.press('Shift+Enter');
  };
  const expectHeard = (type: string, count: number): Promise<void> =>
    expect(page.locator('body')).toHaveAttribute(`data-${type}`, String(count), { timeout: 180_000 });
  await page.goto(`http://localhost:${port}/lab/tree/scans.ipynb`);
  await page.getByText('Python 3 (ipykernel) | Idle').waitFor({ timeout: 180_000 });
  await run(0);
  await expect(page.locator('scanstitch-app').first()).toBeVisible({ timeout: 180_000 });
  await expectHeard('done', 1);
  await run(1);
  const output = (index: number): Locator => cell(index).locator('.jp-OutputArea-output');
  await expect(output(1)).toContainText("ndarray (10, 3) (1798, 2) {'good'}", { timeout: 30_000 });
  await expect(output(1)).toContainText(/\[ 0\.1 +1\.  +-0\.1\]/);
  await run(2);
  await expectHeard('done', 2);
  await run(3);
  await expectHeard('done', 3);
  await run(4);
  await expectHeard('error', 1);
  await run(5);
  const good = "(3, 4, 4) ['good', 'good', 'good']";
  await expect(output(5)).toContainText(`${good} ${good} None wrong.ply: `, { timeout: 30_000 });
});
