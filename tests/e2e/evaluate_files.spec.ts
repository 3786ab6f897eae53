/** What may lie beside two trajectories: times, relations, a folder of poses, maps, the frames themselves, a zip. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { strToU8, zipSync } from 'fflate';
import { fileInMemory } from '../../npm/files/content.js';
import { trajectoriesAmong } from '../../npm/recording/trajectories.js';
import { EvaluationView } from './evaluation_view.js';
import { expect, type InputFile, ply, test } from './scanstitch_page.js';
import { test as spatial_test } from './spatial_page.js';
import { recording, truth } from './spatial_recording.js';

const part = (name: string, text: string) => fileInMemory(name, new TextEncoder().encode(text));
const LINE = '0.1 1 2 3 0 0 0 1\n';
const MATRIX = '1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n';

test('what a file is for is told by its name and its beginning', async () => {
  const found = await trajectoriesAmong([
    part('run/10.txt', MATRIX),
    part('run/9.txt', MATRIX),
    part('anna/pred.txt', LINE.repeat(3)),
    part('ben/pred.txt', LINE.repeat(3)),
    part('one.txt', MATRIX),
    part('times.txt', '0.0\n0.1\n0.2\n'),
    part('loops.txt', '0.1 0.2 1 0 0 0 0 0.5\n'),
    part('b/2.ply', 'ply\n'),
    part('b/10.ply', 'ply\n'),
  ]);
  expect(found.trajectories.map(({ name, paths }) => [name, paths])).toEqual([
    ['run', ['run/9.txt', 'run/10.txt']],
    ['anna/pred.txt', ['anna/pred.txt']],
    ['ben/pred.txt', ['ben/pred.txt']],
    ['one.txt', ['one.txt']],
  ]);
  expect(found.times).toBe('times.txt');
  expect(found.relations).toBe('loops.txt');
  expect(found.maps).toEqual(['b/2.ply', 'b/10.ply']);
  // Eight columns are a trajectory unless the name says otherwise; a graph says so itself.
  expect((await trajectoriesAmong([part('est.txt', LINE)])).relations).toBeNull();
  expect((await trajectoriesAmong([part('with_loop_closure.txt', LINE)])).relations).toBeNull();
  const graph = await trajectoriesAmong([part('est.txt', 'EDGE2 0 1 1 0 0 1 0 0 1 0 1\n')]);
  expect(graph.relations).toBe('est.txt');
});

/** A curved path: the number of each pose, and its turn about z. */
const POSES = Array.from({ length: 12 }, (_, i) => ({
  x: 2 * Math.sin(i / 6),
  y: 0.3 * i,
  z: 0.05 * i * i * 0.2,
  turn: 0.1 * i,
}));
const kitti = (off: number): string =>
  POSES.map(({ x, y, z, turn }) => {
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    return `${[c, -s, 0, x + off * Math.sin(17 * y), s, c, 0, y, 0, 0, 1, z].join(' ')}\n`;
  }).join('');

test('times for KITTI files, relations with loops, and a folder with one pose a file', async ({ empty: app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  const times = POSES.map((_, i) => `${(100 + i / 10).toFixed(6)}\n`).join('');
  const edge = (i: number, j: number): string => {
    const [a, b] = [POSES[i] as (typeof POSES)[0], POSES[j] as (typeof POSES)[0]];
    const [c, s] = [Math.cos(a.turn), Math.sin(a.turn)];
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const half = (b.turn - a.turn) / 2;
    const motion = [c * dx + s * dy, -s * dx + c * dy, b.z - a.z, 0, 0, Math.sin(half), Math.cos(half)];
    return `EDGE_SE3:QUAT ${i} ${j} ${motion.join(' ')}\n`;
  };
  const rows = kitti(0.02).trim().split('\n');
  const folder = rows.map((row, i): InputFile => {
    const n = row.split(' ');
    const matrix = [n.slice(0, 4), n.slice(4, 8), n.slice(8, 12), [0, 0, 0, 1]];
    return { name: `mine/frame-${i}.pose.txt`, content: matrix.map((line) => `${line.join(' ')}\n`).join('') };
  });
  await evaluation.drop([
    { name: 'gt.txt', content: kitti(0) },
    { name: 'est.txt', content: kitti(0.05) },
    { name: 'times.txt', content: times },
    { name: 'relations.g2o', content: edge(0, 1) + edge(1, 2) + edge(0, 11) },
    { name: 'readme.md', content: 'words' },
  ]);
  await expect(evaluation.view.locator('.problems')).toContainText(
    'Skipped, as neither trajectories nor maps: readme.md',
  );
  await expect(page.getByLabel('over').locator('option:checked')).toHaveText('time');
  expect(await evaluation.column(/^relations$/)).toEqual(['3']);
  expect(Number((await evaluation.column(/^relations \(m\)/))[0])).toBeGreaterThan(1e-3);
  expect(Number((await evaluation.column(/^relations \(deg\)/))[0])).toBeLessThan(1e-3);
  await evaluation.answered(() => page.getByLabel('loops only').check());
  expect(await evaluation.column(/^relations$/)).toEqual(['1']);
  // A corrected file of the same name counts.
  const firstTime = (): Promise<number | undefined> =>
    evaluation.view.evaluate((view) => {
      const { session } = view as unknown as { session: { result: { comparisons: { stamps: Float64Array }[] } } };
      return session.result.comparisons[0]?.stamps[0];
    });
  expect(await firstTime()).toBe(100);
  const corrected = POSES.map((_, i) => `${(200 + i / 10).toFixed(6)}\n`).join('');
  await evaluation.drop([{ name: 'times.txt', content: corrected }]);
  expect(await firstTime()).toBe(200);
  await evaluation.answered(() => page.getByRole('button', { name: 'Remove times.txt' }).click());
  await expect(page.getByLabel('over').locator('option:checked')).toHaveText('number of the pose');
  await evaluation.answered(() => page.getByRole('button', { name: 'Remove relations.g2o' }).click());

  const packed = zipSync(Object.fromEntries(folder.map(({ name, content }) => [name, strToU8(String(content))])));
  await evaluation.drop([{ name: 'hand-in.zip', content: Buffer.from(packed) }]);
  expect((await evaluation.column(/^estimate/)).some((name) => name.endsWith('mine'))).toBe(true);
  await expect(evaluation.rows).toHaveCount(2);
  // The folder is off by less.
  expect((await evaluation.column(/^estimate/))[0]).toMatch(/mine$/);
  expect(app.faults).toEqual([]);
});

/** Three walls of a corner, seen from a pose; the points are the same for all, with some noise of their own. */
function corner(pose: (typeof POSES)[0], seed: number): string {
  const [c, s] = [Math.cos(pose.turn), Math.sin(pose.turn)];
  const random = (i: number) => Math.abs(Math.sin(12.9898 * i + 78.233 * seed) * 43758.5453) % 1;
  return ply(
    Array.from({ length: 1500 }, (_, i) => {
      const [u, v] = [3 * random(i), 3 * random(i + 5000)];
      const [wx, wy, wz] = [
        [u, v, 0],
        [u, 0, v],
        [0, u, v],
      ][i % 3] as [number, number, number];
      const [dx, dy] = [wx - pose.x, wy - pose.y];
      return [c * dx + s * dy, -s * dx + c * dy, wz - pose.z] as const;
    }),
  );
}

test('maps are judged without a truth, and frames by the poses that place them', async ({ empty: app, page }) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  const table = page.getByRole('table', { name: 'Sharpness of maps' });
  const blurred = (size: number) =>
    ply(
      Array.from({ length: 3000 }, (_, i) => {
        const random = (k: number) => Math.abs(Math.sin(12.9898 * i + k) * 43758.5453) % 1;
        return [2 * random(1), 2 * random(2), size * (random(3) - 0.5)] as const;
      }),
    );
  await evaluation.offer([
    { name: 'crisp.ply', content: blurred(0.01) },
    { name: 'blurred.ply', content: blurred(0.1) },
  ]);
  await expect(table.getByRole('rowheader')).toHaveText(['blurred.ply', 'crisp.ply']);
  const entropies = (await table.locator('tbody tr td:nth-child(2)').allInnerTexts()).map(Number);
  expect(entropies[1]).toBeLessThan((entropies[0] as number) - 1);

  await page.getByRole('button', { name: 'Remove all' }).click();
  const frames = POSES.map((pose, i) => ({ name: `scans/${i}.ply`, content: corner(pose, i) }));
  await evaluation.drop([...frames, { name: 'gt.txt', content: kitti(0) }, { name: 'est.txt', content: kitti(0.05) }]);
  await expect(table.getByRole('rowheader')).toHaveText(['gt.txt', 'est.txt']);
  const residuals = (await table.locator('tbody tr td:nth-child(2)').allInnerTexts()).map(Number);
  expect(residuals[0]).toBeLessThan(10);
  expect(residuals[1]).toBeGreaterThan((residuals[0] as number) + 5);
  expect(app.faults).toEqual([]);
});

test('a run without a truth waits for it, and its map can be judged', async ({ app, page }) => {
  await page.getByRole('button', { name: /^Remove the ground truth/ }).click();
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  await expect(evaluation.view.getByRole('heading', { name: 'Drop the ground truth of this run' })).toBeVisible();
  await expect(evaluation.view.locator('select')).toHaveCount(0);
  await page.getByRole('button', { name: 'Measure this run’s map' }).click();
  await expect(page.getByRole('table', { name: 'Sharpness of maps' }).getByRole('rowheader')).toHaveText([
    'this run.ply',
  ]);
  const content = readFileSync(join(import.meta.dirname, '../../www/samples/corridor/truth.tum'));
  await evaluation.drop([{ name: 'truth.tum', content }]);
  expect(await evaluation.column(/^estimate/)).toEqual(['this run']);
  expect(Number((await evaluation.column(/^mean L2/))[0])).toBeLessThan(0.01);
  expect(app.faults).toEqual([]);
});

spatial_test('a run in space opens with its truth, as the run itself compares them', async ({ spatial, page }) => {
  await spatial.drop([...recording(8), truth(8)]);
  const { result } = await spatial.stitched();
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  expect(await evaluation.column(/^estimate/)).toEqual(['this run']);
  const [mean] = await evaluation.column(/^mean L2/);
  expect(Number(mean)).toBeCloseTo(result.comparison?.mean ?? -1, 5);
  expect(spatial.app.faults).toEqual([]);
});
