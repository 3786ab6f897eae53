/** Tables of ranges whose columns cannot be told: a dialog asks, shows what comes of it, and leaves nothing when cancelled. */
import { gzipSync } from 'node:zlib';
import { join } from 'node:path';
import { readFileSync } from 'node:fs';
import { expectNamedControls, findWeakContrast } from './access.js';
import { expect, test } from './scanstitch_page.js';

/** Ranges (m) in a room of 7 x 6 m with a cupboard, from x (m) along it. */
function ranges(x: number, beams: number, from: number, to: number): number[] {
  return Array.from({ length: beams }, (_, beam) => {
    const angle = from + ((to - from) * beam) / (beams - 1);
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    const to_end = dx > 0 ? (4 - x) / dx : (-3 - x) / dx;
    const to_side = dy > 0 ? (dx > 0.3 ? 2.2 : 3) / dy : -3 / dy;
    return Math.min(Math.abs(to_end), Math.abs(to_side));
  });
}

const HALF = Math.PI / 2;
const PLACES = [0, 0.15, 0.3, 0.45, 0.6];

test('readings of no known laser: the angles are asked for, and kept in the link', async ({ app, page }) => {
  // Milliseconds, then 333 readings in mm over 166 degrees, apart by semicolons.
  const lines = PLACES.map((x, scan) => {
    const view = (83 * Math.PI) / 180;
    return [1000 + 100 * scan, ...ranges(x, 333, -view, view).map((range) => Math.round(1000 * range))].join(';');
  });
  await app.drop([{ name: 'sweeps.txt', content: `# robot 7\n${lines.join('\n')}\n` }]);
  const dialog = page.getByRole('dialog', { name: /columns of sweeps\.txt/ });
  await expect(dialog).toContainText('No known laser has 333 readings');
  await expect(dialog.getByLabel('First column')).toHaveValue('2');
  await expect(dialog.getByLabel('Unit')).toHaveValue('mm');
  await expect(dialog.getByLabel('Times are in')).toHaveValue('ms');
  await expect(dialog.getByRole('img')).toHaveAccessibleName('Scan 1: 333 of 333 readings with a return');
  // Key by key over another value: a minus sign alone is no number yet.
  await dialog.getByLabel('First (°)').fill('5');
  await dialog.getByLabel('First (°)').press('ControlOrMeta+a');
  await dialog.getByLabel('First (°)').pressSequentially('-83');
  await dialog.getByLabel('Step (°)').fill('0.5');
  await expect(dialog).toContainText('333 readings over 166°');
  await expect(dialog.getByLabel('On the command line')).toHaveValue(
    '--table ranges=2:334,unit=mm,start=-83deg,step=0.5deg,time=1:ms',
  );
  await expectNamedControls(page);
  expect(await page.evaluate(findWeakContrast)).toEqual([]);
  await dialog.getByRole('button', { name: 'Read 5 scans' }).click();
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(5);
  expect(result.frames[4]?.T_world_sensor?.x).toBeCloseTo(0.6, 1);
  await expect(page.getByRole('region', { name: 'Table' })).toContainText('ranges=2:334,unit=mm,start=-83deg');
  expect(page.url()).toContain('table=ranges');
  // The same table again is read as the link says, without a question.
  await app.drop([{ name: 'sweeps.txt', content: `${lines.join('\n')}\n` }]);
  expect((await app.stitched()).result.frames).toHaveLength(5);
});

test('a format that fits nothing is told, and cancelling leaves what was there', async ({ app, page }) => {
  const before = await app.scanNames();
  const line = ranges(0, 50, -HALF, HALF)
    .map((range) => range.toFixed(2))
    .join(' ');
  await app.drop([{ name: 'odd.dat', content: `${line}\n`.repeat(3) }]);
  const dialog = page.getByRole('dialog');
  await dialog.getByLabel('Last column').fill('70');
  await expect(dialog.getByRole('alert')).toContainText("but the table's format needs 70");
  await expect(dialog.getByRole('button', { name: /^Read/ })).toBeDisabled();
  await page.keyboard.press('Escape');
  await expect(dialog).toBeHidden();
  // The next run is that of the scans that were there.
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.frames).toHaveLength(10);
  expect(await app.scanNames()).toEqual(before);
  expect(page.url()).not.toContain('table=');
});

test('an angle and a distance a line, of a laser that turns clockwise', async ({ app, page }) => {
  const rows = PLACES.flatMap((x) =>
    ranges(x, 180, -Math.PI, Math.PI - Math.PI / 90)
      .map((range, beam) => `${2 * beam - 180},${Math.round(1000 * range)},15`)
      .reverse(),
  );
  await app.drop([{ name: 'turns.csv', content: `${rows.join('\n')}\n` }]);
  expect((await app.stitched()).result.frames).toHaveLength(5);
  await page.getByRole('button', { name: 'Change the columns' }).click();
  const dialog = page.getByRole('dialog');
  await expect(dialog.getByLabel('Each line is')).toHaveValue('reading');
  await dialog.getByLabel('Unit').selectOption('cm');
  await dialog.getByLabel('Range column').fill('2');
  await dialog.getByLabel('Angle column').fill('1');
  await expect(dialog.getByLabel('On the command line')).toHaveValue(/^--table range=2,angle=1:1deg/);
  // The change and the click in one: it has not been tried out by then.
  await dialog.getByLabel('Unit').evaluate((select: HTMLSelectElement) => {
    select.value = 'mm';
    select.dispatchEvent(new Event('change', { bubbles: true }));
    select.form?.requestSubmit();
  });
  await expect(dialog).toBeHidden();
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(5);
  expect(result.frames.every(({ status }) => status === 'good')).toBe(true);
});

test('inches and gon, as a surveyor has them', async ({ app, page }) => {
  const rows = PLACES.flatMap((x) =>
    ranges(x, 200, -Math.PI, Math.PI - Math.PI / 100).map(
      (range, beam) => `${2 * beam - 200},${(range / 0.0254).toFixed(1)},7`,
    ),
  );
  await app.drop([{ name: 'survey.csv', content: `${rows.join('\n')}\n` }]);
  const dialog = page.getByRole('dialog');
  await dialog.getByLabel('Range column').fill('2');
  await dialog.getByLabel('Angle column').fill('1');
  await dialog.getByLabel('Angles are').selectOption('gon');
  await dialog.getByLabel('Unit').selectOption('inches');
  await expect(dialog.getByLabel('On the command line')).toHaveValue(/angle=1:0\.9deg,unit=in/);
  // What the engine understood is shown as what was chosen.
  await expect(dialog.getByLabel('Angles are')).toHaveValue('0.9deg');
  await dialog.getByRole('button', { name: 'Read 5 scans' }).click();
  const { result } = await app.stitched();
  expect(result.frames.every(({ status }) => status === 'good')).toBe(true);
  expect(result.frames[4]?.T_world_sensor?.x).toBeCloseTo(0.6, 1);
});

test('arrays of MATLAB, scans packed by gzip: read at once, and changed afterwards', async ({ app, page }) => {
  const mat = readFileSync(join(import.meta.dirname, '../data/mat/columns.mat'));
  await app.drop([{ name: 'columns.mat', content: mat }]);
  expect((await app.stitched()).result.frames).toHaveLength(4);
  // The line with the button says how it was read, and no message says it again.
  await expect(page.getByRole('region', { name: 'Table' })).toContainText('odometry=2:3:4');
  await expect(page.getByText('A table of ranges')).toHaveCount(0);
  await page.getByRole('button', { name: 'Change the columns' }).click();
  const dialog = page.getByRole('dialog');
  await expect(dialog.getByLabel('Columns of')).toHaveValue('odometry');
  await dialog.getByLabel('Columns of').selectOption('');
  await dialog.getByRole('button', { name: 'Read 4 scans' }).click();
  expect((await app.stitched()).result.frames).toHaveLength(4);
  await expect(page.getByRole('region', { name: 'Table' })).not.toContainText('odometry=');
  const line = PLACES.map((x) =>
    ranges(x, 181, -HALF, HALF)
      .map((range) => range.toFixed(3))
      .join('\t'),
  );
  await app.drop([{ name: 'scans.tsv.gz', content: gzipSync(`${line.join('\n')}\n`) }]);
  expect((await app.stitched()).result.frames).toHaveLength(5);
});

test("an archive of NumPy's arrays is read at once", async ({ app }) => {
  const content = readFileSync(join(import.meta.dirname, '../data/npy/scans.npz'));
  await app.drop([{ name: 'scans.npz', content }]);
  expect((await app.stitched()).result.frames).toHaveLength(3);
});

test('on a phone and in the dark the dialog fits', async ({ app, page }, info) => {
  await page.setViewportSize({ width: 390, height: 780 });
  await page.emulateMedia({ colorScheme: 'dark' });
  const line = ranges(0, 333, -Math.PI, Math.PI)
    .map((range) => range.toFixed(2))
    .join(' ');
  await app.drop([{ name: 'odd.dat', content: `${line}\n`.repeat(3) }]);
  const dialog = page.getByRole('dialog');
  await expect(dialog.getByRole('button', { name: 'Read 3 scans' })).toBeEnabled();
  const overflow = await dialog.evaluate((element) => element.scrollWidth - element.clientWidth);
  expect(overflow).toBeLessThanOrEqual(0);
  await info.attach('dialog', { body: await page.screenshot(), contentType: 'image/png' });
});

test('positions alone are told to be a trajectory, by the names of their columns or a negative number, and are not asked about as ranges', async ({
  empty: app,
  page,
}) => {
  for (const content of [
    `x [m],y [m]\n${PLACES.map((x) => `${x + 1},${2 * x + 1}\n`).join('')}`,
    PLACES.map((x) => `${x} ${-2 * x}\n`).join(''),
  ]) {
    await app.drop([{ name: 'walk.csv', content }]);
    await expect(app.messages).toContainText('This is a trajectory, but there are no scans to compare with it yet');
    await expect(page.getByRole('dialog')).toBeHidden();
    await app.messages.getByRole('button', { name: 'Dismiss the messages' }).click();
  }
});
