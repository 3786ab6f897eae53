/** The view of trajectories without a mouse, without eyes, in any colours, and on a phone. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expectNamedControls, findWeakContrast, tabbedThrough } from './access.js';
import { DATA, EvaluationView } from './evaluation_view.js';
import { expect, type InputFile, type ScanstitchPage, test } from './scanstitch_page.js';

const truth = readFileSync(join(DATA, 'reference.tum'), 'utf8');
const shaken = (size: number): string => {
  let line = 0;
  return truth.replace(/^(\S+) (\S+)/gm, (_, t, x) => `${t} ${Number(x) + size * Math.sin(line++)}`);
};
const HAND_INS: InputFile[] = [
  { name: 'truth.tum', content: truth },
  { name: 'anna/trajectory_of_the_second_exercise.tum', content: shaken(0.3) },
  { name: 'ben/pred.tum', content: shaken(0.1) },
  { name: 'cleo/pred.tum', content: 'words\nand more\n' },
];

async function handedIn(app: ScanstitchPage): Promise<EvaluationView> {
  const evaluation = new EvaluationView(app.page);
  await evaluation.open();
  await evaluation.drop(HAND_INS);
  return evaluation;
}

test('every control has a name, every figure its words, which can be read in light and in dark colours', async ({
  empty: app,
  page,
}) => {
  const evaluation = await handedIn(app);
  await expectNamedControls(page);
  for (const name of ['Paths', 'Error', 'Position', 'Orientation']) {
    const figure = evaluation.view.getByRole('group', { name, exact: true });
    await expect(figure).toHaveAccessibleDescription(/Arrow keys/);
  }
  await expect(evaluation.view.getByRole('img', { name: 'Histogram' })).toHaveAccessibleDescription(
    /of ben.pred\.tum: rmse/,
  );
  await expect(page.getByRole('table', { name: 'Estimates, ranked' }).getByRole('columnheader')).toHaveCount(15);
  await expect(page.getByRole('columnheader', { name: /^rmse/ })).toHaveAttribute('aria-sort', 'ascending');
  await expect(evaluation.view.getByRole('status').first()).toContainText('2 compared. ben/pred.tum: rmse 0.0');
  await expect(page.getByRole('alert')).toContainText('cleo/pred.tum');

  await page.setViewportSize({ width: 1400, height: 1300 });
  const expectLegible = async (colorScheme: 'light' | 'dark'): Promise<void> => {
    await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
    await expect(page.getByRole('button', { name: /^(Light|Dark) colours$/ })).toHaveAccessibleName(
      colorScheme === 'light' ? 'Dark colours' : 'Light colours',
    );
    expect(await page.evaluate(findWeakContrast)).toEqual([]);
  };
  await expectLegible('light');
  await expectLegible('dark');
  await page.getByRole('button', { name: 'Remove all' }).click();
  await expectLegible('dark');
  await expectLegible('light');
});

test('all is done by keys: an instant, the view, the order, the selection', async ({ empty: app, page }) => {
  const evaluation = await handedIn(app);
  // A mouse that rests on a figure marks an instant there whenever the page moves under it.
  await page.mouse.move(0, 0);
  const reached = await tabbedThrough(page, 80);
  const places = [/^Ground truth/, /^Alignment/, /^Copy CSV$/, /^ben/, /^Remove cleo/, /^Paths$/, /^Error$/].map(
    (name) => reached.findIndex((one) => name.test(one)),
  );
  expect(
    places.every((place) => place >= 0),
    reached.join(' | '),
  ).toBe(true);
  expect(places).toEqual([...places].sort((a, b) => a - b));

  await evaluation.view.getByRole('group', { name: 'Error', exact: true }).focus();
  for (const key of ['ArrowRight', 'ArrowRight', 'ArrowRight']) await page.keyboard.press(key);
  const readout = evaluation.view.locator('.readout');
  await expect(readout).toContainText(/^time .*, error .* m$/);
  const before = await readout.innerText();
  await page.keyboard.press('ArrowLeft');
  await expect(readout).not.toHaveText(before);

  const marked = (): Promise<string | null> => page.locator('.paths .marks line').getAttribute('x1');
  const place = await marked();
  await evaluation.view.getByRole('group', { name: 'Paths', exact: true }).focus();
  await page.keyboard.press('ArrowRight');
  await expect.poll(marked).not.toBe(place);
  await page.getByRole('button', { name: '3D' }).press('Enter');
  await expect(page.getByRole('button', { name: '3D' })).toHaveAttribute('aria-pressed', 'true');

  await page.getByRole('columnheader', { name: /^max/ }).getByRole('button').press('Enter');
  await expect(page.getByRole('columnheader', { name: /^max/ })).toHaveAttribute('aria-sort', 'ascending');
  await page.getByRole('button', { name: /^anna/ }).press('Enter');
  await expect(page.getByRole('button', { name: /^anna/ })).toHaveAttribute('aria-pressed', 'true');
});

test.describe('on a phone', () => {
  test.use({ viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });

  test('nothing is wider than the screen, and all is within reach', async ({ empty: app, page }, info) => {
    const evaluation = await handedIn(app);
    const overflow = (): Promise<number> =>
      evaluation.view.evaluate((view) => Math.max(view.scrollWidth, document.documentElement.scrollWidth));
    expect(await overflow()).toBe(360);
    await expectNamedControls(page);
    for (const name of ['Add files…', 'Copy CSV', 'Save errors as SVG', 'Remove cleo/pred.tum']) {
      await page.getByRole('button', { name }).scrollIntoViewIfNeeded();
      await expect(page.getByRole('button', { name })).toBeVisible();
    }
    await page.getByRole('button', { name: 'Zoom in' }).tap();
    await page.screenshot({ path: info.outputPath('phone.png') });
    const height = await evaluation.view.evaluate((view) => view.scrollHeight);
    await page.setViewportSize({ width: 360, height: Math.min(height + 60, 4000) });
    await page.screenshot({ path: info.outputPath('phone_all.png') });
  });
});
