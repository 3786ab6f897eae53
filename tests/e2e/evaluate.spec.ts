/** The second view: trajectories against the truth. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { DATA, EvaluationView, file, SHARED } from './evaluation_view.js';
import { noteAnswers } from './answers.js';
import { hold } from './held.js';
import { expect, test } from './scanstitch_page.js';

test('two files dropped: the rmse of evo, figures saved as PNG and SVG', async ({ empty: app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await evaluation.drop([file(DATA, 'estimate.tum'), file(DATA, 'reference.tum')]);
  await expect(evaluation.view.locator('select').first().locator('option:checked')).toHaveText('reference.tum');
  await page.getByText('Matching of poses').click();
  await evaluation.answered(async () => {
    await page.getByLabel('Maximum time difference (s)').fill('0.05');
    await page.getByLabel('Maximum time difference (s)').blur();
  });
  await evaluation.answered(async () => {
    await page.getByLabel('Time offset (s)').fill('-0.25');
    await page.getByLabel('Time offset (s)').blur();
  });
  await evaluation.answered(async () => {
    await page.getByLabel('Align on the first n poses (0: all)').fill('20');
    await page.getByLabel('Align on the first n poses (0: all)').blur();
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

test('hand-in mode: many estimates are ranked, sorted, copied and removed', async ({ empty: app, page, context }) => {
  await context.grantPermissions(['clipboard-read', 'clipboard-write']);
  const evaluation = new EvaluationView(page);
  await evaluation.open();
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
  const ranked = ['ben/pred.tum', 'cleo/pred.tum', 'anna/pred.tum'];
  expect(await evaluation.column(/^estimate/)).toEqual([...ranked, 'dirk/pred.tum']);
  // The row of what could not be compared says why, and no rank.
  await expect(evaluation.rows.last()).toHaveText(/^\s*–\s*dirk\/pred\.tum\s*Line 2: /);
  await expect(page.getByRole('alert')).toContainText('dirk/pred.tum');
  await page.getByRole('columnheader', { name: /^max/ }).getByRole('button').click();
  await page.getByRole('columnheader', { name: /^max/ }).getByRole('button').click();
  expect(await evaluation.column(/^estimate/)).toEqual([...ranked.reverse(), 'dirk/pred.tum']);
  await page.getByRole('button', { name: 'Copy Markdown' }).click();
  await expect(evaluation.view.getByText('The table was copied as Markdown.')).toBeAttached();
  const copied = await page.evaluate(() => navigator.clipboard.readText());
  expect(copied.split('\n')[2]).toMatch(/^\| 1 \| anna\/pred\.tum \| 90\/90 \| /);
  expect(copied.split('\n')[5]).toMatch(/^\| – \| dirk\/pred\.tum \| – .* Line 2: /);
  await page.getByRole('button', { name: 'Copy CSV' }).click();
  await expect(evaluation.view.getByText('The table was copied as CSV.')).toBeAttached();
  expect(await page.evaluate(() => navigator.clipboard.readText())).toMatch(
    /^rank,estimate,poses,rmse \(m\),.*,reason\n1,anna\/pred\.tum,90\/90,/,
  );
  await evaluation.answered(() => page.getByRole('button', { name: 'Remove ben/pred.tum' }).click());
  await expect(evaluation.rows).toHaveCount(3);
  expect(app.faults).toEqual([]);
});

test('a run opens with its reference; hovering one figure marks the others; an empty view offers a sample and the run', async ({
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
  const marks = (name: string) => page.locator(`.${name} scanstitch-figure .marks`).locator('line, circle').count();
  for (const name of ['paths', 'errors', 'positions', 'angles']) expect(await marks(name), name).toBeGreaterThan(0);
  await page.screenshot({ path: info.outputPath('evaluate.png') });
  await page.getByRole('button', { name: 'Remove all' }).click();
  const start = page.getByRole('region', { name: 'No trajectories yet' });
  await expect(evaluation.view.locator('select')).toHaveCount(0);
  await evaluation.answered(() => start.getByRole('button', { name: 'Show a sample' }).click());
  expect(await evaluation.column(/^estimate/)).toEqual(['joint.tum', 'scan_to_map.tum', 'scan_to_scan.tum']);
  await page.getByRole('button', { name: 'Remove all' }).click();
  await evaluation.answered(() => start.getByRole('button', { name: 'The open run' }).click());
  expect(await evaluation.column(/^estimate/)).toEqual(['this run']);
  await page.getByRole('button', { name: 'Map', exact: true }).click();
  await expect(page.getByRole('group', { name: 'Map' })).toBeVisible();
  expect(app.faults).toEqual([]);
});

test('real recordings against the truth', async ({ empty: app, page }, info) => {
  test.skip(!existsSync(SHARED), '../shared/data is absent');
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await evaluation.drop(
    ['KITTI_00_gt.txt', 'KITTI_00_ORB.txt', 'KITTI_00_SPTAM.txt'].map((name) => file(SHARED, name)),
  );
  expect(await evaluation.column(/^rmse/)).toContain('1.30345');
  await page.setViewportSize({ width: 1400, height: 1500 });
  await page.screenshot({ path: info.outputPath('kitti.png') });
  expect(app.faults).toEqual([]);
});

test('an answer that comes after its trajectories were removed is not shown', async ({ app, page }) => {
  await noteAnswers(page);
  await page.reload();
  await page.waitForFunction(() => window.stitched.length > 0);
  const release = await hold(page, '**/evaluate-worker*.js');
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  await release();
  await page.waitForFunction(() =>
    window.answers.some(({ values }) => values.some((value) => Object.hasOwn(Object(value), 'comparisons'))),
  );
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  expect(await page.evaluate(() => window.evaluations)).toEqual([]);
  await expect(evaluation.view.getByRole('status')).not.toContainText('compared');
  expect(app.faults).toEqual([]);
});

test('twenty thousand poses are drawn, and one is marked under the mouse', async ({ empty, page }) => {
  const trajectory = (noise: number): string =>
    Array.from({ length: 20_000 }, (_, i) => {
      const [x, y] = [30 * Math.sin(i / 4000) + noise * Math.sin(0.37 * i), 20 * Math.sin(i / 6000)];
      return `${(i / 100).toFixed(2)} ${x.toFixed(6)} ${y.toFixed(6)} 0 0 0 0 1\n`;
    }).join('');
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await evaluation.drop([
    { name: 'gt.tum', content: trajectory(0) },
    { name: 'est.tum', content: trajectory(0.05) },
  ]);
  await expect(evaluation.rows.locator('td').nth(2)).toHaveText('20000/20000');
  await page.locator('.errors scanstitch-figure').hover();
  await expect(evaluation.view.locator('.readout')).toContainText('error');
  expect(empty.faults).toEqual([]);
});
