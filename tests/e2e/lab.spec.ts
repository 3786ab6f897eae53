/** The ICP lab: from the page to stepped iterations, from other starts, by other methods. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator, Page } from '@playwright/test';
import { IcpLab, lab_scene, load, PointCloud, register } from '../../npm/index.js';
import { expectNamedControls, findWeakContrast } from './access.js';
import { expect, overflowOf, ply, room, SAMPLE_FOLDER, ScanstitchPage, test as base } from './scanstitch_page.js';

/** `follow`: opens a link to the lab; script errors fail the test. */
const test = base.extend<{ follow: (link: string) => Promise<unknown> }>({
  follow: async ({ page }, use) => {
    const { faults } = new ScanstitchPage(page);
    await use((link) => page.goto(link));
    expect(faults).toEqual([]);
  },
});

interface TraceFile {
  options: Parameters<typeof register>[2];
  T_target_source: number[][];
  costs: number[];
  iterations: { H: number[]; b: number[]; x: number[]; source: number[]; rejected_source: number[] }[];
}

const lab = (page: Page): Locator => page.locator('scanstitch-lab');
const stage = (page: Page): Locator => page.getByRole('application', { name: 'The two clouds' });
const heading = (page: Page): Locator => lab(page).getByRole('tabpanel').getByRole('heading', { level: 2 });

/** Opens the lab on the first two scans, at its start. */
async function look(page: Page): Promise<void> {
  await page.getByRole('button', { name: 'ICP', exact: true }).click();
  await expect(heading(page)).toHaveText('At the start');
}

async function exported(page: Page, item: RegExp): Promise<Buffer> {
  await lab(page).getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: item }).click();
  return readFileSync(await (await download).path());
}

const trace = async (page: Page): Promise<TraceFile> =>
  JSON.parse((await exported(page, /^Trace/)).toString()) as TraceFile;

/** x and y of a pose's translation. */
const place = (rows: readonly number[] | undefined): [number, number] => [rows?.[3] ?? 0, rows?.[7] ?? 0];

test('an iteration is stepped, and is the one that the engine does; a step past the end rests there', async ({
  app: { page },
}) => {
  await look(page);
  await lab(page).getByRole('button', { name: 'One iteration on (.)' }).click();
  await expect(heading(page)).toHaveText('After iteration 1');
  await expect(page.getByRole('status').filter({ hasText: 'After iteration 1 of' })).not.toHaveCount(0);
  const given = await trace(page);
  await load();
  const cloud = (i: number): PointCloud =>
    PointCloud.from_ply(readFileSync(join(SAMPLE_FOLDER, `${i}.ply`)), `${i}.ply`);
  const result = register(cloud(1), cloud(0), given.options);
  expect(given.T_target_source).toHaveLength(result.iterations + 1);
  // JSON knows no negative zero.
  expect(given.T_target_source.at(-1)).toEqual(result.T_target_source.map((value) => value + 0));
  // The last iteration is the one that was looked at, too: H x = -b.
  for (const { H, b, x } of given.iterations.slice(1, 4)) {
    [0, 1, 2].forEach((row) => {
      const sum = [0, 1, 2].reduce((total, k) => total + (H[3 * row + k] ?? 0) * (x[k] ?? 0), 0);
      expect(sum).toBeCloseTo(-(b[row] ?? 0), 1);
    });
  }

  // A step past the end, while the source moves to it, rests at the end.
  const slider = lab(page).getByRole('slider', { name: 'Iteration' });
  await stage(page).focus();
  await page.keyboard.press('End');
  await expect(heading(page)).toHaveText('At the end');
  await page.keyboard.press(',');
  await page.keyboard.press('.');
  await page.keyboard.press('.');
  await expect(heading(page)).toHaveText('At the end');
  await expect(slider).toHaveValue((await slider.getAttribute('max')) ?? '');
});

test('the figures stand under the iteration that they are of, however long it takes', async ({ app: { page } }) => {
  await look(page);
  const wrong = await page.evaluate(async () => {
    const root = document.querySelector('scanstitch-app')?.shadowRoot;
    const view = root?.querySelector('scanstitch-lab') as unknown as {
      shadowRoot: ShadowRoot;
      session: {
        trace: { costs: number[] };
        at: number;
        stepBy(direction: 1): void;
        client: { ask(question: string, ...given: unknown[]): Promise<unknown> };
      };
    };
    const { session } = view;
    // No iteration is answered before the test says so, nor the next one, which the lab asks for in advance.
    const answer = session.client.ask.bind(session.client);
    let open = (): void => undefined;
    const shut = (): Promise<void> => new Promise((resolve) => (open = resolve));
    let gate = shut();
    session.client.ask = async (question, ...given) => {
      if (question === 'traced_iteration') await gate;
      return answer(question, ...given);
    };
    const panel = view.shadowRoot.querySelector('scanstitch-lab-side')?.shadowRoot;
    const seen: string[] = [];
    let num_read = 0;
    const titleOf = (): string => panel?.querySelector('h2')?.textContent ?? '';
    const look = (): void => {
      const title = titleOf();
      const at = title === 'At the start' ? 0 : Number(/^After iteration (\d+)$/.exec(title)?.[1]);
      const cost = panel?.querySelector('.facts dd')?.textContent ?? '';
      const right = session.trace.costs[at]?.toPrecision(3) ?? '';
      if (cost) num_read++;
      if (cost && Number.parseFloat(cost.replace('−', '-')) !== Number(right))
        seen.push(`${title}: ${cost.trim()}, not ${right}`);
    };
    /** Looks at every frame that is drawn, until it holds. */
    const until = async (holds: () => boolean): Promise<void> => {
      for (;;) {
        look();
        if (holds()) return;
        await new Promise(requestAnimationFrame);
      }
    };
    for (let i = 1; i <= 3; i++) {
      session.stepBy(1);
      await until(() => session.at === i);
      // What is drawn of that, before the figures are there.
      let num_drawn = 0;
      await until(() => num_drawn++ === 2);
      if (titleOf() === `After iteration ${i}`) continue; // the first was there in advance
      const let_answer = open;
      gate = shut();
      let_answer();
      await until(() => titleOf() === `After iteration ${i}`);
    }
    return session.at === 3 && num_read > 0 ? seen : [`at ${session.at}, ${num_read} costs read`];
  });
  expect(wrong).toEqual([]);
  await expect(heading(page)).toHaveText('After iteration 3');
});

test('another start by keyboard: pairs follow, and it runs home', async ({ app: { page } }) => {
  await look(page);
  const home = place((await trace(page)).T_target_source.at(-1));
  const pairs = lab(page).locator('dt:has-text("Pairs") + dd');
  const before = await pairs.innerText();
  await stage(page).focus();
  for (let i = 0; i < 4; i++) await page.keyboard.press('Shift+ArrowLeft');
  for (let i = 0; i < 3; i++) await page.keyboard.press('[');
  await expect(heading(page)).toHaveText('Before the start');
  await expect(pairs).not.toHaveText(before);
  // A step leaves the start that the source was moved to.
  const run_from_here = page.getByRole('button', { name: /^Run from here/ });
  await page.keyboard.press('.');
  await expect(run_from_here).toBeHidden();
  await expect(heading(page)).not.toHaveText('Before the start');
  for (let i = 0; i < 4; i++) await page.keyboard.press('Shift+ArrowLeft');
  await expect(heading(page)).toHaveText('Before the start');
  await page.keyboard.press('Enter');
  await expect(run_from_here).toBeHidden();
  await stage(page).focus();
  await page.keyboard.press('End');
  await expect(heading(page)).toHaveText('At the end');
  const [x, y] = place((await trace(page)).T_target_source.at(-1));
  expect(Math.hypot(x - home[0], y - home[1])).toBeLessThan(0.05);
});

test('the mouse takes hold of the source, and letting go runs it', async ({ app: { page } }) => {
  await look(page);
  const first = await trace(page);
  const box = await stage(page).boundingBox();
  if (!box) throw new Error('The stage has no size.');
  await lab(page).getByRole('button', { name: 'Drag the source' }).click();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 30, box.y + box.height / 2 + 10, { steps: 6 });
  await expect(heading(page)).toHaveText('Before the start');
  await page.mouse.up();
  await expect(heading(page)).not.toHaveText('Before the start');
  const moved = await trace(page);
  const [from, to] = [place(first.T_target_source[0]), place(moved.T_target_source[0])];
  expect(Math.hypot(from[0] - to[0], from[1] - to[1])).toBeGreaterThan(0.1);
});

test('cost and basin are drawn, and a place of them is started from', async ({ app: { page } }) => {
  await look(page);
  await lab(page).getByRole('tab', { name: 'Cost' }).click();
  const map = lab(page).getByRole('group', { name: 'Cost over two unknowns' });
  await expect(lab(page).getByText(/\d+ × \d+ poses, /)).toBeVisible({ timeout: 20_000 });
  await expect(lab(page).getByRole('heading', { name: /local minim/ })).toBeVisible();
  await map.focus();
  for (let i = 0; i < 5; i++) await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Enter');
  await lab(page).getByRole('tab', { name: 'Step' }).click();
  const { T_target_source } = await trace(page);
  const [start, end] = [place(T_target_source[0]), place(T_target_source.at(-1))];
  expect(Math.hypot(start[0] - end[0], start[1] - end[1])).toBeGreaterThan(0.005);

  await lab(page).getByRole('tab', { name: 'Basin' }).click();
  await expect(
    lab(page)
      .getByText(/of these starts lead to the same result as this run/)
      .first(),
  ).toBeVisible({ timeout: 60_000 });
});

test('own files: dropped, opened, stepped in three clicks', async ({ app, page }) => {
  const scan = (shift: number): string => ply(room(8, 5).map(([x, y]) => [x - shift, y, 0] as const));
  await app.drop([
    { name: 'a/0.ply', content: scan(0) },
    { name: 'a/1.ply', content: scan(0.2) },
  ]);
  await app.stitched();
  await look(page);
  await expect(lab(page).getByLabel('Source', { exact: false }).first()).toHaveValue(/1\.ply$/);
  await lab(page).getByRole('button', { name: 'One iteration on (.)' }).click();
  await expect(page.getByRole('status').filter({ hasText: 'After iteration 1 of' })).not.toHaveCount(0);
  const { T_target_source } = await trace(page);
  expect(place(T_target_source.at(-1))[0]).toBeCloseTo(0.2, 1);
});

test('a link opens a scene with its question and its methods', async ({ follow, page }) => {
  await follow('./#icp&scene=outliers');
  const question = lab(page).getByRole('region', { name: 'Question' });
  await expect(question).toContainText('Outliers');
  await question.getByText('Answer').click();
  await expect(question).toContainText('The squares of a few large residuals');
  await lab(page).getByRole('tab', { name: 'Methods' }).click();
  await expect(lab(page).getByRole('table', { name: 'Methods' }).getByRole('row')).toHaveCount(3);
  const outliers = page.url();
  const film = await exported(page, /^Film/);
  expect(film.subarray(1, 4).toString('latin1')).toBe('PNG');
  expect(film.includes('acTL') && film.includes('fdAT')).toBe(true);
  expect((await exported(page, /^Picture, SVG/)).toString()).toMatch(/^<svg[^]*<path/);
  // Another scene, typed into the address of the open page, and the first one again.
  await page.evaluate(() => (location.hash = '#icp&scene=corridor'));
  await expect(question).toContainText('A bare corridor');
  await expect.poll(() => page.url()).toContain('scene=corridor');
  await page.goto(outliers);
  await expect(question).toContainText('Outliers');
});

type Fault = 'transposed rotation' | 'old pairs' | 'centroid not rotated';

/** Point to point between nearest points within half a metre, as a student writes it: 3 x 3 matrices, one an iteration. */
function ownIcp(source: Float64Array, target: Float64Array, num_iterations: number, fault?: Fault): number[][] {
  let [c, s, x, y] = [1, 0, 0, 0];
  let old: [number, number][] = [];
  return Array.from({ length: num_iterations }, () => {
    const pairs: [number, number, number, number][] = [];
    const chosen: [number, number][] = [];
    for (let i = 0; i < source.length; i += 3) {
      const [px, py] = [
        c * (source[i] ?? 0) - s * (source[i + 1] ?? 0) + x,
        s * (source[i] ?? 0) + c * (source[i + 1] ?? 0) + y,
      ];
      const kept = fault === 'old pairs' && old.length > 0 ? old.find(([point]) => point === i) : undefined;
      if (kept) pairs.push([px, py, target[kept[1]] ?? 0, target[kept[1] + 1] ?? 0]);
      if (fault === 'old pairs' && old.length > 0) continue;
      let [best, least] = [-1, 0.5];
      for (let k = 0; k < target.length; k += 3) {
        const distance = Math.hypot((target[k] ?? 0) - px, (target[k + 1] ?? 0) - py);
        if (distance < least) [best, least] = [k, distance];
      }
      if (best < 0) continue;
      pairs.push([px, py, target[best] ?? 0, target[best + 1] ?? 0]);
      chosen.push([i, best]);
    }
    if (chosen.length > 0) old = chosen;
    const mean = (i: number): number => pairs.reduce((sum, pair) => sum + (pair[i] ?? 0), 0) / pairs.length;
    const [px, py, qx, qy] = [mean(0), mean(1), mean(2), mean(3)];
    const [a, b] = pairs.reduce(
      ([dots, crosses], [u, v, w, z]) => {
        const [du, dv, dw, dz] = [u - px, v - py, w - qx, z - qy];
        return [dots + du * dw + dv * dz, crosses + du * dz - dv * dw];
      },
      [0, 0],
    ) as [number, number];
    const turn = (fault === 'transposed rotation' ? -1 : 1) * Math.atan2(b, a);
    const [tc, ts] = [Math.cos(turn), Math.sin(turn)];
    [c, s] = [tc * c - ts * s, ts * c + tc * s];
    const [mx, my] = fault === 'centroid not rotated' ? [px, py] : [tc * px - ts * py, ts * px + tc * py];
    [x, y] = [tc * x - ts * y + qx - mx, ts * x + tc * y + qy - my];
    return [c, -s, x, s, c, y, 0, 0, 1];
  });
}

test('own poses are followed step by step, and three faults are told apart', async ({ follow, page }) => {
  await follow('./#icp&scene=partial_overlap');
  await expect(heading(page)).toHaveText('At the start');
  const scene = lab_scene('partial_overlap');
  // The clouds as the loop uses them.
  await load();
  const [source, target] = [PointCloud.from_positions(scene.source), PointCloud.from_positions(scene.target)];
  const engine = new IcpLab(source, target, scene.methods[0]);
  const drop = async (name: string, fault?: Fault): Promise<void> => {
    const rows = ownIcp(engine.source_points(), engine.target_points(), 8, fault);
    const buffer = Buffer.from(JSON.stringify(rows));
    await lab(page)
      .locator('input[type=file]')
      .setInputFiles([{ name, mimeType: '', buffer }]);
  };
  await drop('mine.json');
  await expect(lab(page).getByText('All 8 steps agree')).toBeVisible();
  await expect(lab(page).getByText(/Your file has 8 iterations, our run \d+ from the same start/)).toBeVisible();
  for (const [fault, words, parts] of [
    ['transposed rotation', /^The solution\. The rotation of the step is transposed/, 1],
    ['old pairs', /^The pairs\. The pairs are those of the first iteration/, 2],
    ['centroid not rotated', /^The solution\. The translation is the difference of the centroids/, 1],
  ] as const) {
    await drop(`${fault.replaceAll(' ', '_')}.json`, fault);
    await expect(lab(page).locator('.fault')).toHaveText(words);
    await expect(lab(page).getByText(`They diverge at iteration ${parts}.`)).toBeVisible();
  }
  await lab(page)
    .locator('input[type=file]')
    .setInputFiles([{ name: 'bad.csv', mimeType: '', buffer: Buffer.from('1,2,3\n4,5,6\n7,8,9\n') }]);
  await expect(lab(page).getByRole('region', { name: 'Messages' })).toContainText(/bad\.csv/i);
});

test('methods side by side, on a phone in the dark', async ({ app: { page } }) => {
  await look(page);
  await lab(page).getByRole('tab', { name: 'Methods' }).click();
  await lab(page).getByLabel('Add a method').selectOption('textbook');
  const table = lab(page).getByRole('table', { name: 'Methods' });
  await expect(table.getByRole('row')).toHaveCount(3);
  await expect(table.getByRole('row').nth(2)).toContainText('Point to point');
  await table.getByRole('button', { name: /^Remove Point to point/ }).click();
  await expect(table.getByRole('row')).toHaveCount(2);
  await page.getByRole('button', { name: 'Dark colours' }).click();
  await expectNamedControls(page);
  await expect.poll(() => page.evaluate(findWeakContrast)).toEqual([]);
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await overflowOf(page)).toBeLessThanOrEqual(0);
  await expect(lab(page).getByRole('button', { name: 'Play the iterations (space bar)' })).toBeInViewport();
});

test('the correlative search is followed block by block, and ICP runs from its best pose', async ({
  app: { page },
}) => {
  await look(page);
  const home = place((await trace(page)).T_target_source.at(-1));
  await stage(page).focus();
  for (let i = 0; i < 40; i++) await page.keyboard.press('ArrowLeft');
  await page.keyboard.press('Enter');
  await expect(page.getByRole('button', { name: /^Run from here/ })).toBeHidden();
  const start = place((await trace(page)).T_target_source[0]);
  await lab(page).getByRole('tab', { name: 'Search' }).click();
  const readout = lab(page)
    .getByText(/^Block [\d\s]+ of [\d\s]+:/)
    .first();
  await expect(readout).toBeVisible();
  await lab(page).getByRole('slider', { name: 'Block' }).focus();
  await page.keyboard.press('Home');
  await expect(readout).toHaveText(/^Block 1 of [\d\s]+: .* wide, heading/);
  await page.keyboard.press('End');
  await expect(readout).toHaveText(/^Block ([\d\s]+) of \1:/);
  await lab(page)
    .getByRole('button', { name: /^Run ICP from the best pose/ })
    .click();
  await expect.poll(async () => place((await trace(page)).T_target_source[0])).not.toEqual(start);
  const { T_target_source } = await trace(page);
  const [from, to] = [place(T_target_source[0]), place(T_target_source.at(-1))];
  expect(Math.hypot(from[0] - home[0], from[1] - home[1]), 'a grid of 0.1 m').toBeLessThan(0.15);
  expect(Math.hypot(to[0] - home[0], to[1] - home[1])).toBeLessThan(0.05);
});

test('a scan is looked into as the run registered it', async ({ app, page }) => {
  const cells = app.row('4.ply').getByRole('cell');
  const columns = await app.table.getByRole('columnheader').allInnerTexts();
  const iterations = columns.findIndex((name) => /^iterations/.test(name));
  // The row's header is the first column.
  const count = await cells.nth(iterations - 1).innerText();
  await app.row('4.ply').getByRole('button', { name: '4.ply', exact: true }).click();
  await page.getByRole('button', { name: 'Look inside' }).click();
  await expect(heading(page)).toHaveText('At the start');
  await expect(lab(page).getByLabel('Target', { exact: false }).first()).toHaveValue('map before 4.ply');
  await expect(lab(page).getByText(`${count} iterations, converged`)).toBeVisible();
  const end = async (): Promise<unknown> => (await trace(page)).T_target_source.at(-1);
  const to_the_map = await end();
  await lab(page).getByLabel('Target', { exact: false }).first().selectOption({ label: '3.ply' });
  await expect.poll(end).not.toEqual(to_the_map);
  await expect(heading(page)).toHaveText('At the start');
  await expect(lab(page).getByLabel('Target', { exact: false }).first()).toHaveValue(/(^|\/)3\.ply$/);
});

test('a link holds all methods, and asks for own files again', async ({ follow, page }) => {
  const beside = encodeURIComponent('metric=point_to_point');
  await follow(`./#icp&source=b.ply&target=a.ply&start=0.1,0,0&tab=method&beside=${beside}&robust_kernel=none`);
  const region = lab(page).getByRole('region', { name: 'Messages' });
  await expect(region).toContainText('This link is about b.ply and a.ply');
  const scan = (shift: number): Buffer => Buffer.from(ply(room(8, 5).map(([x, y]) => [x - shift, y, 0] as const)));
  await lab(page)
    .locator('input[type=file]')
    .setInputFiles([
      { name: 'a.ply', mimeType: '', buffer: scan(0) },
      { name: 'b.ply', mimeType: '', buffer: scan(0.2) },
    ]);
  const table = lab(page).getByRole('table', { name: 'Methods' });
  await expect(table.getByRole('row')).toHaveCount(3);
  await expect(table.getByRole('row').nth(2)).toContainText('Point to point');
  const { T_target_source, options } = await trace(page);
  expect(place(T_target_source[0])).toEqual([0.1, 0]);
  expect(options?.robust_kernel).toBe('none');
  expect(page.url()).toContain('beside=metric%3Dpoint_to_point');
});

test('what a panel or clouds in space do not have is not offered, and answers are folded again', async ({
  follow,
  page,
}) => {
  await follow('./#icp&scene=free_plane&tab=degeneracy');
  const question = lab(page).getByRole('region', { name: 'Question' });
  await question.getByText('Answer').click();
  await expect(question.locator('details p')).toBeVisible();
  await lab(page).getByRole('button', { name: 'Export' }).click();
  await expect(page.getByRole('menuitem')).toHaveText([/Copy link/, /Picture, PNG/, /Film/, /Trace/]);
  await page.keyboard.press('Escape');
  const film = await exported(page, /^Film/);
  expect(film.includes('acTL') && film.includes('fdAT')).toBe(true);
  await lab(page).getByRole('button', { name: 'Examples' }).click();
  await page.getByRole('menuitem', { name: /^Outliers/ }).click();
  await expect(question).toContainText('Outliers');
  await expect(question.locator('details p')).toBeHidden();
});
