/** 200 pairs in mixed conventions, dropped on the page with a run open and without: the figures of evo. */
import type { Page } from '@playwright/test';
import type { EvaluationSummary } from '../../pkg/scanstitch.js';
import { EVO_FIGURES, farthestFromEvo, GROUPS } from '../cli/evo_cases.mjs';
import { EvaluationView } from './evaluation_view.js';
import { expect, test } from './scanstitch_page.js';

/** What the view keeps of a comparison. */
interface Comparison {
  name: string;
  summary: EvaluationSummary;
}
type Options = (typeof GROUPS)[number]['options'][number];

async function choose(evaluation: EvaluationView, page: Page, options: Options): Promise<void> {
  const { metric, relation, align, delta, unit } = options;
  const chosen = { Error: metric, Component: relation, Alignment: align, ...(unit && { 'Delta unit': unit }) };
  for (const [label, value] of Object.entries(chosen))
    await evaluation.answered(() => page.getByRole('combobox', { name: label, exact: true }).selectOption(value));
  const field = page.getByRole('spinbutton', { name: 'Delta', exact: true });
  if (delta === undefined || (await field.inputValue()) === String(delta)) return;
  await evaluation.answered(async () => {
    await field.fill(String(delta));
    await field.blur();
  });
}

/** In full: the table shows six digits. */
async function figures(evaluation: EvaluationView): Promise<Map<string, Record<string, number>>> {
  const all = await evaluation.view.evaluate((view) => {
    const { comparisons } = (view as unknown as { session: { comparisons: Comparison[] } }).session;
    return comparisons.map(({ name, summary: { statistics, num_errors } }) => ({
      name,
      ...statistics,
      num: num_errors,
    }));
  });
  return new Map(all.map(({ name, ...rest }) => [name, rest]));
}

/** How many pairs were compared; each of them is as evo has it. */
async function compareAll(evaluation: EvaluationView, page: Page, begin: () => Promise<void>): Promise<number> {
  let numCompared = 0;
  for (const [index, { reference, estimates, options }] of GROUPS.entries()) {
    await begin();
    await evaluation.drop([reference, ...estimates]);
    for (const [at, one] of options.entries()) {
      await choose(evaluation, page, one);
      const found = await figures(evaluation);
      for (const [which, { name }] of estimates.entries()) {
        const off = farthestFromEvo(found.get(name) ?? {}, EVO_FIGURES[index]?.[at]?.[which]);
        expect(off, `${reference.name}, ${name}, ${JSON.stringify(one)}`).toBeLessThanOrEqual(1e-9);
        numCompared++;
      }
    }
    await page.getByRole('button', { name: 'Remove all' }).click();
  }
  return numCompared;
}

test('without a run: 200 comparisons to 1e-9 of evo', async ({ empty: app, page }) => {
  test.setTimeout(120_000);
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  expect(await compareAll(evaluation, page, () => Promise.resolve())).toBe(200);
  expect(app.faults).toEqual([]);
});

test('with a run open: 200 comparisons to 1e-9 of evo', async ({ app, page }) => {
  test.setTimeout(120_000);
  const evaluation = new EvaluationView(page);
  await evaluation.answered(() => evaluation.open());
  await page.getByRole('button', { name: 'Remove all' }).click();
  const numCompared = await compareAll(evaluation, page, async () => {
    await evaluation.answered(() => evaluation.view.getByRole('button', { name: 'The open run' }).click());
    expect(await evaluation.column(/^estimate/)).toEqual(['this run']);
  });
  expect(numCompared).toBe(200);
  expect(app.faults).toEqual([]);
});
