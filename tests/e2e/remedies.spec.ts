/** What messages on the page say to do is there, and helps; the same inputs on the command line: tests/cli/remedies.test.mjs and reports.test.mjs. */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { REMEDY_CASES } from '../cli/remedy_cases.mjs';
import type { ScanstitchPage } from './scanstitch_page.js';
import { expect, test } from './scanstitch_page.js';
import { drawNothing } from './spatial_page.js';

const REPORTS = join(import.meta.dirname, '../../../shared/data/reports');

interface Remedy {
  files: () => Record<string, string | Uint8Array>;
  /** With nothing set, and no longer afterwards. */
  said: RegExp;
  apply: (app: ScanstitchPage) => Promise<unknown>;
  /** Nothing is computed before it is applied. */
  isRefused?: boolean;
  /** All frames are good afterwards. */
  areGood?: boolean;
}

const made = (name: string) => () => REMEDY_CASES[name]?.files ?? {};
const reported = (folder: string) => () =>
  Object.fromEntries(
    readdirSync(join(REPORTS, folder), { recursive: true, encoding: 'utf8' })
      .filter((name) => /\.\w+$/.test(name))
      .map((name) => [name, readFileSync(join(REPORTS, folder, name))]),
  );
/** Unfolds all settings. */
const unfold = (app: ScanstitchPage) =>
  app.page.locator('details').evaluateAll((all) => all.forEach((one) => ((one as HTMLDetailsElement).open = true)));
const choice = (label: string, value: string) => async (app: ScanstitchPage) => {
  await unfold(app);
  await app.setting(label).selectOption(value);
};
const number = (label: string, value: string) => async (app: ScanstitchPage) => {
  await unfold(app);
  await app.setting(label).fill(value);
  await app.setting(label).blur();
};

const button = (name: RegExp) => (app: ScanstitchPage) => app.page.getByRole('button', { name }).click();

const REMEDIES: Record<string, Remedy> = {
  'set laser_direction': {
    files: made('a log that does not keep to its format, with bearings that fall'),
    said: /if clockwise, set laser_direction=mirrored/,
    apply: choice('Direction of readings', 'mirrored'),
    areGood: true,
  },
  'set depth_values where it is taken for inverted': {
    files: made('depth that is taken for inverted'),
    said: /If that is wrong, set depth_values=depth/,
    apply: choice('Depth values', 'depth'),
  },
  'set depth_values where it is taken for inverse': {
    files: made('inverse depth'),
    said: /or set depth_values, if that is wrong/,
    isRefused: true,
    apply: choice('Depth values', 'depth'),
  },
  'set wheel_track': {
    files: reported('scan_matrix'),
    said: /Set wheel_track to it \(m\), for example wheel_track=0\.3/,
    apply: number('Wheel track', '0.3'),
  },
  'compute with another fx': {
    files: made('a narrower view than rendered images have'),
    said: /The frames fit each other best with a focal length of about/,
    apply: button(/^Compute with fx/),
    areGood: true,
  },
  'choose another unit of clouds': {
    files: made('clouds in centimetres'),
    said: /No file says the unit of the clouds' coordinates/,
    apply: button(/^0\.01\s*m/),
    areGood: true,
  },
  'change the columns of a table': {
    files: made('columns without names'),
    said: /give step=-1deg,start=90deg/,
    apply: async ({ page }) => {
      await page.getByRole('button', { name: 'Change the columns' }).click();
      const dialog = page.getByRole('dialog');
      await dialog.getByLabel('First (°)').fill('90');
      await dialog.getByLabel('Step (°)').fill('-1');
      await dialog.getByRole('button', { name: 'Read 8 scans' }).click();
    },
    areGood: true,
  },
  'read a number a line as a scan': {
    files: made('a number a line'),
    said: /may make one scan of 181 readings/,
    isRefused: true,
    apply: ({ page }) => page.getByRole('dialog').getByRole('button', { name: 'Read 1 scan' }).click(),
  },
  'set depth_scale': {
    files: reported('colour_depth_sizes'),
    said: /Set depth_scale to the right number/,
    apply: async ({ page }) => {
      await page.getByRole('button', { name: 'Another scale…' }).click();
      const dialog = page.getByRole('dialog', { name: /What is assumed/ });
      await dialog.getByRole('spinbutton', { name: 'Depth scale, raw values per metre' }).fill('5000');
      await dialog.getByRole('button', { name: 'Compute again' }).click();
    },
  },
};

for (const [name, { files, said, isRefused, areGood, apply }] of Object.entries(REMEDIES)) {
  test(`${name}: helps`, async ({ page, empty: app }) => {
    test.skip(!existsSync(REPORTS), '../shared/data is absent');
    await drawNothing(page);
    await app.drop(Object.entries(files()).map(([name, content]) => ({ name, content: Buffer.from(content) })));
    if (!isRefused) await app.stitched();
    const element = page.locator('scanstitch-app');
    await expect(element).toContainText(said);
    await apply(app);
    const { frames } = (await app.stitched()).result;
    expect(frames.length).toBeGreaterThan(0);
    if (areGood) expect(frames.map(({ status }) => status)).toEqual(frames.map(() => 'good'));
    await expect(element).not.toContainText(said);
  });
}
