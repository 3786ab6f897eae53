/** What moved between two recordings that make one map: counted below the map and drawn on it. */
import { BUILDING, driveLog, driveOdometry } from '../cli/drive_log.mjs';
import { expectForEverybody } from './mended.js';
import { expect, test } from './scanstitch_page.js';

/** The building with a cupboard at the wall of its corridor, 0.8 m wide and 0.5 m deep. */
const WITH_CUPBOARD = BUILDING.replace('0,0 6,0', '0,0 3.6,0 3.6,0.5 4.4,0.5 4.4,0 6,0');
const NUM_SCANS = 90;
const rows = driveOdometry(0, NUM_SCANS);
const ODOMETRY = [...rows, ...rows.map((row, scan) => row.replace(/^\d+/, String(NUM_SCANS + scan)))].join('');

test('a cupboard that the second recording alone shows is counted and drawn, and can be hidden', async ({
  empty: app,
  page,
}) => {
  await app.drop([
    { name: 'monday.log', content: driveLog(BUILDING, 0, NUM_SCANS) },
    { name: 'tuesday.log', content: driveLog(WITH_CUPBOARD, 0, NUM_SCANS) },
    { name: 'odometry.txt', content: ODOMETRY },
  ]);
  await app.stitched();
  const legend = page.getByRole('list', { name: 'What moved' });
  await expect(legend).toHaveText(
    /tuesday\.log\s+against the recordings\s+before\s+it:\s+1 thing is new\s+0 things are gone/,
  );
  const shown = await app.picture();
  await page.getByRole('button', { name: 'Layers' }).click();
  const box = page.getByLabel('What moved', { exact: true }).and(page.locator('input'));
  await box.uncheck();
  await expect(legend).toBeHidden();
  expect(await app.picture()).not.toBe(shown);
  await box.check();
  await expect(legend).toBeVisible();

  await expectForEverybody(page);

  // One recording has nothing to be compared with.
  await app.drop([{ name: 'monday.log', content: driveLog(BUILDING, 0, NUM_SCANS) }]);
  await app.stitched();
  await expect(legend).toBeHidden();
});
