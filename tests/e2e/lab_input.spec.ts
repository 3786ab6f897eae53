/** Bad input of the ICP lab: each kind has its own message, and the lab stays usable. */
import { expect, type Locator, type Page } from '@playwright/test';
import { ply, room, test } from './scanstitch_page.js';

const lab = (page: Page): Locator => page.locator('scanstitch-lab');
const heading = (page: Page): Locator => lab(page).getByRole('tabpanel').getByRole('heading', { level: 2 });
const message = (page: Page): Locator => lab(page).getByRole('region', { name: 'Messages' });

interface Given {
  name: string;
  content: string | Buffer;
}

async function give(page: Page, ...files: Given[]): Promise<void> {
  await lab(page)
    .locator('input[type=file]')
    .setInputFiles(files.map(({ name, content }) => ({ name, mimeType: '', buffer: Buffer.from(content) })));
}

async function dismissed(page: Page): Promise<void> {
  await lab(page).getByRole('button', { name: 'Dismiss the messages' }).click();
  await expect(message(page)).toBeHidden();
}

const scan = (x: number): string => ply(room(8, 5).map(([px, py]) => [px - x, py, 0] as const));

test('clouds that cannot be registered are told one by one', async ({ app: { page } }) => {
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await expect(heading(page)).toHaveText('At the start');
  const good = { name: '0.ply', content: scan(0) };

  await give(page, good, { name: '1.ply', content: ply([]) });
  await expect(message(page)).toContainText('The source has no finite point');
  await dismissed(page);

  await give(page, good, { name: 'far.ply', content: scan(100) });
  await expect(message(page)).toContainText('The clouds do not overlap from this start');
  await expect(message(page)).toContainText(/within (0\.50? m|500\smm)/);
  await dismissed(page);
  // The view is still there: dragged home, the same two register.
  await expect(lab(page).getByRole('application', { name: 'The two clouds' })).toBeVisible();

  const spatial = ply(Array.from({ length: 60 }, (_, i) => [Math.cos(i), Math.sin(2 * i), Math.sin(3 * i)] as const));
  await give(page, good, { name: 'cube.ply', content: spatial });
  await expect(message(page)).toContainText(/plan/i);
  await dismissed(page);

  await give(page, good, { name: '1.ply', content: scan(0.2) });
  // The clouds before are at their start as well, until these are read.
  await expect(lab(page).getByLabel('Source', { exact: false }).first()).toHaveValue('1.ply');
  await expect(heading(page)).toHaveText('At the start');
  await lab(page).getByRole('button', { name: 'One iteration on (.)' }).click();
  await expect(heading(page)).toHaveText(/^(After iteration 1|At the end)$/);
});

test('poses of an own ICP that are none are told one by one', async ({ app: { page } }) => {
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await expect(heading(page)).toHaveText('At the start');
  const turn = (angle: number, x: number, y: number): number[][] => [
    [Math.cos(angle), -Math.sin(angle), x],
    [Math.sin(angle), Math.cos(angle), y],
    [0, 0, 1],
  ];
  const transposed = (rows: number[][]): number[][] => rows.map((row, i) => row.map((_, k) => rows[k]?.[i] ?? 0));
  for (const [name, poses, words] of [
    [
      'cut.csv',
      [
        [1, 0, 0, 1, 0],
        [0, 1, 0, 0, 0],
      ],
      /Poses of cut\.csv: its rows have 5 numbers/,
    ],
    [
      'stretched.json',
      [
        [
          [1, 0.2, 0],
          [0.4, 1, 0],
          [0, 0, 1],
        ],
      ],
      /not rigid/,
    ],
    ['scaled.json', [turn(0, 1, 0).map((row, i) => row.map((value) => (i < 2 ? 2 * value : value)))], /scales by 2/],
    ['transposed.json', [transposed(turn(0.1, 0.5, 0.2))], /transposed: its translation stands in the last row/],
    ['empty.json', [], /no matrix in it/],
  ] as const) {
    const content = name.endsWith('csv') ? poses.map((row) => row.join(',')).join('\n') : JSON.stringify(poses);
    await give(page, { name, content });
    await expect(message(page)).toContainText(words);
    await dismissed(page);
    await expect(heading(page)).toHaveText('At the start');
  }
  // In millimetres they are poses, but of another size.
  await give(page, {
    name: 'millimetres.json',
    content: JSON.stringify([turn(0.01, 150_000, 0), turn(0.02, 200_000, 0)]),
  });
  await expect(lab(page).locator('.fault')).toContainText(/millimetres|another unit/);
});

test('clouds in space without normals: the form names the metric that they are registered by', async ({
  app: { page },
}) => {
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await expect(heading(page)).toHaveText('At the start');
  const wavy = (shift: number): string =>
    ply(
      Array.from({ length: 900 }, (_, i) => {
        const [x, y] = [0.1 * (i % 30), 0.1 * Math.floor(i / 30)];
        return [x + shift, y, 0.3 * Math.sin(2 * x) * Math.cos(3 * y)] as const;
      }),
    );
  await give(page, { name: 'a.ply', content: wavy(0) }, { name: 'b.ply', content: wavy(0.05) });
  await expect(lab(page).locator('.method')).toHaveText('Point to point');
  await lab(page).getByRole('tab', { name: 'Methods' }).click();
  const metric = lab(page).getByLabel('Error metric');
  await expect(metric).toHaveValue('point_to_point');
  // Another setting leaves it.
  await lab(page).getByLabel('Iteration limit').fill('20');
  await page.keyboard.press('Tab');
  await expect(metric).toHaveValue('point_to_point');
  await expect(lab(page).locator('.method')).toHaveText('Point to point');
});

test('what is said of a start goes with it', async ({ app: { page } }) => {
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await give(page, { name: '0.ply', content: scan(0) }, { name: '1.ply', content: scan(0.2) });
  await expect(lab(page).getByLabel('Source', { exact: false }).first()).toHaveValue('1.ply');
  await expect(heading(page)).toHaveText('At the start');
  const stage = lab(page).getByRole('application', { name: 'The two clouds' });
  await stage.focus();
  for (let i = 0; i < 200; i++) await page.keyboard.press('ArrowUp');
  await page.keyboard.press('Enter');
  await expect(message(page)).toContainText('from this start');
  await expect(lab(page).locator('.facts')).not.toContainText('NaN');
  await lab(page).getByRole('button', { name: 'Reset start' }).click();
  await expect(message(page)).toBeHidden();
});

test('clouds of hundreds of thousands of points are thinned, and that is told', async ({ app: { page } }) => {
  test.slow();
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await expect(heading(page)).toHaveText('At the start');
  const count = 310_000;
  const cloud = (): Buffer => {
    const values = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) {
      // A floor with waves, a point every two centimetres.
      const [x, y] = [0.02 * (i % 600), 0.02 * Math.floor(i / 600)];
      values.set([x, y, 0.2 * Math.sin(x) * Math.cos(y)], 3 * i);
    }
    const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n`;
    return Buffer.concat([Buffer.from(head), Buffer.from(values.buffer)]);
  };
  await give(page, { name: 'large_0.ply', content: cloud() }, { name: 'large_1.ply', content: cloud() });
  await expect(message(page)).toContainText(/A cloud of 310\D?000 points: both are thinned/, { timeout: 60_000 });
  await expect(heading(page)).toHaveText('At the start', { timeout: 60_000 });
  await expect(lab(page).locator('.method')).toHaveText(/Point to/);
  const pairs = await lab(page).locator('dt:has-text("Pairs") + dd').innerText();
  expect(Number(pairs.replace(/\(.*/, '').replaceAll(/\D/g, ''))).toBeLessThan(100_000);
});
