/** Trajectories dropped beside an open run: what is compared with what, how, and what is said of it. */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { DATA, EvaluationView, file } from './evaluation_view.js';
import { expect, test } from './scanstitch_page.js';
import { test as spatial_test } from './spatial_page.js';
import { recording, truth } from './spatial_recording.js';

const FLIGHTS = join(import.meta.dirname, '../../../shared/data/reports/ten_runs');

/** The rows of a TUM file with the quaternions multiplied by i from the right: half a turn of the sensor about its x axis. */
function otherAxes(tum: string): string {
  return tum.replaceAll(/^(.*) (\S+) (\S+) (\S+) (\S+)$/gm, (_, head, x, y, z, w) => `${head} ${w} ${z} ${-y} ${-x}`);
}

spatial_test('the run’s ground truth in other axes is no error, however it is aligned', async ({ spatial, page }) => {
  await spatial.drop([...recording(8), truth(8)]);
  await spatial.stitched();
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  await expect(page.getByLabel('Alignment')).toHaveValue('origin');
  const content = otherAxes(String(truth(8).content));
  await evaluation.drop([{ name: 'converted.tum', content }]);
  await expect(page.getByLabel('Alignment')).toHaveValue('se3');
  expect(await evaluation.column(/^estimate/)).toEqual(['converted.tum', 'this run']);
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('origin'));
  await evaluation.answered(() => page.getByLabel('Component').selectOption('rotation_angle_deg'));
  expect(Number((await evaluation.column(/^mean L2/))[0])).toBeLessThan(1e-6);
  expect(Number((await evaluation.column(/^max/))[0])).toBeLessThan(1e-4);
  await expect(
    evaluation.view.getByText(/Read in other conventions than their files have: converted\.tum/),
  ).toBeVisible();
  await evaluation.rows.getByRole('button', { name: 'converted.tum', exact: true }).click();
  await expect(evaluation.view.getByText(/converted\.tum: .*x, y, z of the estimate are x, -y, -z/)).toBeVisible();
  // The remedy that the note names.
  await expect(evaluation.view.getByText(/Choose “as read” under “Matching of poses”/)).toBeVisible();
  await page.getByText('Matching of poses', { exact: true }).click();
  await evaluation.answered(() => page.getByLabel('Axes, quaternions, handedness').selectOption('as_read'));
  expect(Math.max(...(await evaluation.column(/^mean L2/)).map(Number))).toBeGreaterThan(0.1);
  expect(spatial.app.faults).toEqual([]);
});

test('ten flights dropped beside the sample’s run: compared among themselves, as on the command line', async ({
  app,
  page,
}) => {
  test.skip(!existsSync(FLIGHTS), '../shared/data is absent');
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  const names = readdirSync(FLIGHTS).sort();
  await evaluation.drop(names.map((name) => ({ name, content: readFileSync(join(FLIGHTS, name)) })));
  await expect(evaluation.view.getByText('of another recording than the open run')).toBeVisible();
  await expect(evaluation.view.getByText(/9 compared with stamped_ba_estimate0\.txt/)).toBeVisible();
  const estimates = await evaluation.column(/^estimate/);
  const rmse = (await evaluation.column(/^rmse/)).map((value) => Number(value).toFixed(4));
  const expected = ['0.0365', '0.0186', '0.0186', '0.0165', '0.0273', '0.1454', '0.0290', '0.0183', '0.0255'];
  const found = names.slice(1).map((name) => rmse[estimates.indexOf(name)]);
  expect(found).toEqual(expected);
  expect(app.faults).toEqual([]);
});

test('one of another recording beside the run, taken as the ground truth: by time and SE(3)', async ({ app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  await evaluation.drop([file(DATA, 'reference.tum')]);
  await expect(evaluation.rows).toHaveCount(2);
  await evaluation.drop([file(DATA, 'estimate.tum')]);
  await evaluation.answered(() => evaluation.view.getByLabel('Ground truth').selectOption('reference.tum'));
  await page.getByText('Matching of poses', { exact: true }).click();
  await expect(page.getByLabel('Alignment')).toHaveValue('se3');
  await expect(page.getByLabel('Poses matched by')).toHaveValue('auto');
  await evaluation.answered(async () => {
    await page.getByLabel('Time offset (s)').fill('-0.25');
    await page.getByLabel('Time offset (s)').blur();
  });
  // The run is of another recording, and refused.
  await expect(evaluation.rows).toHaveCount(3);
  await expect(evaluation.rows.first()).toContainText('estimate.tum');
  await expect(evaluation.rows.nth(1)).toContainText('No time of the estimate is within');
  expect(app.faults).toEqual([]);
});

test('positions alone have no first pose to align at: they are aligned by SE(3), and that is said', async ({
  app,
  page,
}) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  const at = (i: number): string => `${Math.cos(i / 9)} ${Math.sin(i / 5)} ${i / 50}`;
  const lines = (line: (i: number) => string): string => Array.from({ length: 40 }, (_, i) => `${line(i)}\n`).join('');
  await evaluation.drop([
    { name: 'truth.xyz', content: lines(at) },
    { name: 'mine.tum', content: lines((i) => `${i} ${at(i)} 0 0 0 1`) },
  ]);
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('origin'));
  await expect(page.getByLabel('Alignment')).toHaveValue('se3');
  await expect(evaluation.view.getByText(/positions alone.*All are aligned by SE\(3\) instead/)).toBeVisible();
  expect(Number((await evaluation.column(/^rmse/))[0])).toBeLessThan(1e-6);
  await expect(evaluation.view.getByRole('region', { name: 'Paths' })).toBeVisible();
  expect(app.faults).toEqual([]);
});

test('interpolation is offered where times differ, and Sim(3) shows its scale', async ({ app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await page.getByRole('button', { name: 'Remove all' }).click();
  const path = (num: number, interval: number, first: number, scale: number) =>
    Array.from({ length: num }, (_, i) => {
      const t = first + interval * i;
      return `${t} ${scale * Math.cos(t)} ${scale * Math.sin(0.7 * t)} ${scale * 0.1 * t} 0 0 0 1\n`;
    }).join('');
  await evaluation.drop([
    { name: 'truth.tum', content: path(200, 0.05, 0, 1) },
    { name: 'mine.tum', content: path(50, 0.2, 0.005, 0.5) },
  ]);
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('sim3'));
  expect(Number((await evaluation.column(/^scale/))[0])).toBeCloseTo(2, 3);
  const [before = ''] = await evaluation.column(/^rmse/);
  await expect(
    evaluation.view.getByText(/every 0\.050 s and the estimate every 0\.200 s; the times .* differ by 0\.0050 s/),
  ).toBeVisible();
  // The remedy that the note names.
  await expect(evaluation.view.getByText('Tick “interpolate” under “Matching of poses”')).toBeVisible();
  await page.getByText('Matching of poses', { exact: true }).click();
  await evaluation.answered(() => page.getByLabel('interpolate').check());
  const [after = ''] = await evaluation.column(/^rmse/);
  expect(Number(after)).toBeLessThan(Number(before) / 3);
  expect(app.faults).toEqual([]);
});

/** A folder of the reports. */
const report = (name: string) => join(FLIGHTS, '..', name);

test('a monocular result whose rows count the frames: paired by number, as published', async ({ empty: app, page }) => {
  test.skip(!existsSync(FLIGHTS), '../shared/data is absent');
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await evaluation.drop([
    { name: 'gt/09.txt', content: readFileSync(join(report('kitti_13_columns'), 'gt/09.txt')) },
    { name: '09.txt', content: readFileSync(join(report('kitti_13_columns'), '09.txt')) },
  ]);
  await evaluation.answered(() => page.getByLabel('Alignment').selectOption('sim3'));
  expect(await evaluation.column(/^poses/)).toEqual([expect.stringMatching(/^1589/)]);
  expect(Number((await evaluation.column(/^rmse/))[0])).toBeCloseTo(8.38662, 5);
  expect(Number((await evaluation.column(/^scale/))[0])).toBeCloseTo(20.985, 2);
  expect(app.faults).toEqual([]);
});

for (const [kind, rmse, said] of [
  ['line', 0, /turned about it at will/],
  ['static', 0.00756, /rotation and scale are not determined/],
] as const) {
  test(`a path that is a ${kind === 'line' ? 'straight line' : 'point'}: aligned as far as it can be, and the rest is told`, async ({
    empty: app,
    page,
  }) => {
    test.skip(!existsSync(FLIGHTS), '../shared/data is absent');
    const evaluation = new EvaluationView(page);
    await evaluation.open();
    await evaluation.drop(['gt', 'est'].map((which) => file(report('straight_and_static'), `${kind}_${which}.txt`)));
    await evaluation.answered(() => page.getByLabel('Alignment').selectOption('sim3'));
    expect(Number((await evaluation.column(/^rmse/))[0])).toBeCloseTo(rmse, 5);
    await evaluation.rows.getByRole('button').first().click();
    await expect(evaluation.view.getByText(said)).toBeVisible();
    expect(app.faults).toEqual([]);
  });
}
