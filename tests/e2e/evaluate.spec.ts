/** The second view: trajectories against the truth. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator, Page } from '@playwright/test';
import { expect, type InputFile, test } from './scanstitch_page.js';

const DATA = join(import.meta.dirname, '../data/evaluation');
const SHARED = join(import.meta.dirname, '../../../shared/data/trajectories');

function file(folder: string, name: string): InputFile {
  return { name, content: readFileSync(join(folder, name)) };
}

class EvaluationView {
  /** Milliseconds of the worker, one for each answer on the screen. */
  constructor(readonly page: Page) {}

  async open(): Promise<void> {
    await this.page.evaluate(() => {
      const seen: number[] = [];
      Object.assign(window, { evaluations: seen });
      addEventListener('evaluation-drawn', (event) => seen.push((event as CustomEvent).detail.elapsed_ms));
    });
    await this.page.getByRole('button', { name: 'Evaluate' }).click();
    await expect(this.view).toBeVisible();
  }

  get view(): Locator {
    return this.page.locator('scanstitch-evaluate');
  }

  get rows(): Locator {
    return this.page.getByRole('table', { name: 'Estimates, ranked' }).locator('tbody tr');
  }

  /** The text of a column, from the top. */
  async column(name: RegExp): Promise<string[]> {
    const heads = await this.page.getByRole('table', { name: 'Estimates, ranked' }).locator('th').allInnerTexts();
    const index = heads.findIndex((head) => name.test(head));
    return this.rows.locator(`td:nth-child(${index + 1})`).allInnerTexts();
  }

  async drop(files: readonly InputFile[]): Promise<number> {
    return this.answered(async () => {
      const sent = files.map(({ name, content }) => ({ name, base64: Buffer.from(content).toString('base64') }));
      const transfer = await this.page.evaluateHandle((given) => {
        const all = new DataTransfer();
        for (const { name, base64 } of given) {
          all.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
        }
        return all;
      }, sent);
      const target = this.view.locator('.evaluate');
      await target.dispatchEvent('dragenter', { dataTransfer: transfer });
      await target.dispatchEvent('drop', { dataTransfer: transfer });
    });
  }

  /** Does something, and waits until the figures that follow from it are on the screen; the worker's time (ms). */
  async answered(action: () => Promise<unknown>): Promise<number> {
    const seen = () => this.page.evaluate(() => (window as unknown as { evaluations?: number[] }).evaluations ?? []);
    const before = (await seen()).length;
    await action();
    await expect.poll(async () => (await seen()).length, { timeout: 30_000 }).toBeGreaterThan(before);
    return (await seen()).at(-1) ?? Number.NaN;
  }
}

test('two files dropped: the rmse of evo, figures saved as PNG and SVG', async ({ app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  await evaluation.drop([file(DATA, 'estimate.tum'), file(DATA, 'reference.tum')]);
  await expect(evaluation.view.locator('select').first().locator('option:checked')).toHaveText('reference.tum');
  await evaluation.answered(async () => {
    await page.getByLabel('Largest time difference (s)').fill('0.05');
    await page.getByLabel('Largest time difference (s)').blur();
  });
  await evaluation.answered(async () => {
    await page.getByLabel('Time offset (s)').fill('-0.25');
    await page.getByLabel('Time offset (s)').blur();
  });
  await evaluation.answered(async () => {
    await page.getByLabel('Align by the first n').fill('20');
    await page.getByLabel('Align by the first n').blur();
  });
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('sim3'));
  const evo = JSON.parse(readFileSync(join(DATA, 'evo.json'), 'utf8'));
  const { results } = evo.cases.find(
    (one: { align: string; max_diff: number }) => one.align === '-as 20' && one.max_diff === 0.05,
  );
  const expected = Number(results['APE translation_part'].rmse.toPrecision(6));
  await expect.poll(() => evaluation.column(/^rmse/)).toEqual([String(expected)]);

  for (const [name, form, start] of [
    ['paths', 'PNG', '\x89PNG'],
    ['errors', 'SVG', '<svg '],
    ['angles', 'SVG', '<svg '],
  ] as const) {
    const saving = page.waitForEvent('download');
    await page.getByRole('button', { name: `Save ${name} as ${form}` }).click();
    const download = await saving;
    expect(download.suggestedFilename()).toBe(`${name}.${form.toLowerCase()}`);
    const content = readFileSync((await download.path()) as string);
    expect(content.toString('latin1').startsWith(start)).toBe(true);
    expect(content.length).toBeGreaterThan(2000);
    if (form === 'SVG') expect(content.toString()).toContain('<polyline');
  }
  await evaluation.answered(() => page.getByLabel('Error').first().selectOption('rpe'));
  expect(app.faults).toEqual([]);
});

test('hand-in mode: many estimates are ranked, sorted, copied and removed', async ({ app, page, context }) => {
  await context.grantPermissions(['clipboard-read', 'clipboard-write']);
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  const truth = readFileSync(join(DATA, 'reference.tum'), 'utf8');
  const shaken = (size: number) => {
    let line = 0;
    return truth.replace(/^(\S+) (\S+)/gm, (_, t, x) => `${t} ${Number(x) + size * Math.sin(line++)}`);
  };
  await evaluation.drop([
    { name: 'anna/pred.tum', content: shaken(0.3) },
    { name: 'ben/pred.tum', content: shaken(0.1) },
    { name: 'cleo/pred.tum', content: shaken(0.2) },
    { name: 'dirk/pred.tum', content: 'no trajectory at all, but words\nand more of them\n' },
    { name: 'truth.tum', content: truth },
  ]);
  expect(await evaluation.column(/^estimate/)).toEqual(['ben/pred.tum', 'cleo/pred.tum', 'anna/pred.tum']);
  await expect(page.getByRole('alert')).toContainText('dirk/pred.tum');
  await page.getByRole('columnheader', { name: /^max/ }).getByRole('button').click();
  await page.getByRole('columnheader', { name: /^max/ }).getByRole('button').click();
  expect(await evaluation.column(/^estimate/)).toEqual(['anna/pred.tum', 'cleo/pred.tum', 'ben/pred.tum']);
  await page.getByRole('button', { name: 'Copy Markdown' }).click();
  const copied = await page.evaluate(() => navigator.clipboard.readText());
  expect(copied.split('\n')[2]).toMatch(/^\| 1 \| anna\/pred\.tum \| 90 \| /);
  await evaluation.answered(() => page.getByRole('button', { name: 'Remove ben/pred.tum' }).click());
  await expect(evaluation.rows).toHaveCount(2);
  expect(app.faults).toEqual([]);
});

test('a run of the reconstruction opens with its reference; hovering one figure marks the others', async ({
  app,
  page,
}, info) => {
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  expect(await evaluation.column(/^estimate/)).toEqual(['this run']);
  const figure = page.locator('.errors scanstitch-figure');
  const box = await figure.boundingBox();
  if (!box) throw new Error('The figure of errors has no size.');
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await expect(evaluation.view.locator('.readout')).toContainText('error');
  const marks = (name: string) =>
    page.locator(`.${name} scanstitch-figure .marks`).evaluate((canvas: HTMLCanvasElement) => {
      const pixels = canvas.getContext('2d')?.getImageData(0, 0, canvas.width, canvas.height).data ?? [];
      return pixels.some((value) => value > 0);
    });
  for (const name of ['paths', 'errors', 'positions', 'angles']) expect(await marks(name), name).toBe(true);
  await page.screenshot({ path: info.outputPath('evaluate.png') });
  await page.getByRole('button', { name: 'Back to the map' }).click();
  await expect(page.getByRole('group', { name: 'Map' })).toBeVisible();
  expect(app.faults).toEqual([]);
});

test('real trajectories of a hundred thousand poses', async ({ app, page }, info) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  const line = (index: number, noise: number) => {
    const s = index / 4000;
    const [x, y, z] = [30 * Math.sin(s), 20 * Math.sin(0.61 * s), 2 * Math.cos(0.3 * s)];
    const off = noise * Math.sin(index * 0.37);
    return `${index / 100} ${x + off} ${y} ${z - off} 0 0 ${Math.sin(s / 2)} ${Math.cos(s / 2)}\n`;
  };
  const text = (noise: number) => Array.from({ length: 100_000 }, (_, index) => line(index, noise)).join('');
  const elapsed = await evaluation.drop([
    { name: 'gt.tum', content: text(0) },
    { name: 'est.tum', content: text(0.05) },
  ]);
  const redrawn = await page.evaluate(async () => {
    const host = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-evaluate');
    const select = host?.shadowRoot?.querySelectorAll('select')[1] as HTMLSelectElement;
    const start = performance.now();
    const drawn = new Promise((resolve) => addEventListener('evaluation-drawn', resolve, { once: true }));
    select.value = 'sim3';
    select.dispatchEvent(new Event('change'));
    await drawn;
    await new Promise(requestAnimationFrame);
    return performance.now() - start;
  });
  info.annotations.push({ type: 'another alignment, compared and drawn', description: `${redrawn.toFixed(0)} ms` });
  info.annotations.push({ type: 'worker, reading and comparing', description: `${elapsed.toFixed(0)} ms` });
  await expect(evaluation.rows).toHaveCount(1);
  const frame = await page.evaluate(async () => {
    const host = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector('scanstitch-evaluate');
    const figure = host?.shadowRoot?.querySelector('.errors scanstitch-figure');
    const start = performance.now();
    for (let i = 0; i < 30; i++) {
      figure?.dispatchEvent(new CustomEvent('figure-pointer', { detail: { x: 100 + 10 * i, y: 80 } }));
      await new Promise(requestAnimationFrame);
    }
    return (performance.now() - start) / 30;
  });
  info.annotations.push({ type: 'a frame while hovering', description: `${frame.toFixed(1)} ms` });
  expect(app.faults).toEqual([]);
});

test('real recordings against the truth', async ({ app, page }, info) => {
  test.skip(!existsSync(SHARED), '../shared/data is absent');
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  await evaluation.drop(
    ['KITTI_00_gt.txt', 'KITTI_00_ORB.txt', 'KITTI_00_SPTAM.txt'].map((name) => file(SHARED, name)),
  );
  expect(await evaluation.column(/^rmse/)).toContain('1.30345');
  await page.setViewportSize({ width: 1400, height: 1500 });
  await page.screenshot({ path: info.outputPath('kitti.png') });
  expect(app.faults).toEqual([]);
});
