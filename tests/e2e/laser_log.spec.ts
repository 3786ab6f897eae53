/** Laser logs on the page: many scans from one file, odometry beside it, the grid, stop and resume. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { expect, test } from './scanstitch_page.js';
import { bearings, LAST, PLACES, rangesAt } from '../cli/layout_room.mjs';
import { stopAfter } from './stop.js';

/** Of 1464: in these a loop closes. */
const NUM_SCANS = 600;
const FREIBURG = join(import.meta.dirname, '../../../shared/data/laser/fr079');

/** A robot that drives 5 cm a scan ahead in a room, as CARMEN logs it. */
function smallLog(num_scans: number): string {
  const lines = Array.from({ length: num_scans }, (_, scan) => {
    const x = 0.05 * scan;
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      const angle = ((beam - 90) * Math.PI) / 180;
      const to_side = 3 / Math.max(Math.abs(Math.sin(angle)), 1e-9);
      const to_end = (4 - x) / Math.max(Math.cos(angle), 1e-9);
      return Math.min(to_side, to_end, beam > 20 && beam < 40 ? 2.2 : 50).toFixed(2);
    });
    return `FLASER 180 ${ranges.join(' ')} ${x} 0 0 ${x} 0 0 ${scan} robot ${scan}`;
  });
  return `# a room\n${lines.join('\n')}\n`;
}

test('a log is many scans with a reference, its grid is a layer and an export, and a wrong one is told with its line', async ({
  empty: app,
  page,
}) => {
  const odometry = Array.from({ length: 12 }, (_, i) => `${i};${50 * i},5;0,0;0,0`);
  await app.drop([
    { name: 'room.log', content: smallLog(12) },
    { name: 'room.odometry.csv', content: ['frame;x [mm];y [mm];yaw_deg', ...odometry].join('\n') },
  ]);
  const { result } = await app.stitched();
  await expect(app.messages).toBeHidden();
  expect(result.odometry_refusal).toBeNull();
  expect(result.frames).toHaveLength(12);
  expect(result.frames[11]?.name).toBe('room.log #11');
  expect(result.frames.every(({ status }) => status === 'good')).toBe(true);
  expect(result.comparison?.name).toBe('the poses in the log');
  expect(result.comparison?.max).toBeLessThan(0.05);
  await expect(page.locator('.count')).toHaveText('12 scans');

  const before = await app.picture();
  await page.getByRole('button', { name: 'Layers' }).click();
  await page.getByLabel(/Occupancy in place/).check();
  await expect.poll(() => app.picture()).not.toBe(before);
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('menuitem', { name: /Occupancy grid/ }).click();
  expect((await download).suggestedFilename()).toBe('occupancy_grid.zip');

  await app.drop([{ name: 'bad.log', content: 'FLASER 3 1 2 3 0 0 0 0 0 0\nFLASER 3 1 x 3 0 0 0 0 0 0\n# end\n' }]);
  await expect(app.messages).toContainText('bad.log');
  await expect(app.messages).toContainText('line 2');
});

test('odometry in degrees is told with the remedy, and the scans are placed without it', async ({ empty: app }) => {
  const turning = (scan: number): number => (3 * scan * Math.PI) / 180;
  const lines = Array.from({ length: 40 }, (_, scan) => {
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      const angle = turning(scan) + ((beam - 90) * Math.PI) / 180;
      const to_side = 3 / Math.max(Math.abs(Math.sin(angle)), 1e-9);
      return Math.min(to_side, (Math.cos(angle) > 0 ? 4 : 2) / Math.max(Math.abs(Math.cos(angle)), 1e-9)).toFixed(3);
    });
    return `FLASER 180 ${ranges.join(' ')}`;
  });
  const rows = (scale: number) => lines.map((_, scan) => `${scan} 0 0 ${turning(scan) * scale}`).join('\n');
  await app.drop([
    { name: 'drive.log', content: `${lines.join('\n')}\n` },
    { name: 'drive.odometry.txt', content: rows(180 / Math.PI) },
  ]);
  const { result } = await app.stitched();
  expect(result.frames.every(({ status }) => status === 'good')).toBe(true);
  await expect(app.messages).toContainText('drive.odometry.txt');
  await expect(app.messages).toContainText('Its headings are degrees');
  await expect(app.messages).toContainText('Give them in radians');
});

test('scans of a building, stopped before all are placed and again in the search for loops, and resumed', async ({
  empty: app,
  page,
}, info) => {
  test.skip(!existsSync(FREIBURG), '../shared/data is absent');
  const beginning = (name: string, scan: RegExp) => {
    const lines = readFileSync(join(FREIBURG, name), 'utf8').split('\n');
    const after = [...lines.keys()].filter((at) => scan.test(lines[at] ?? ''))[NUM_SCANS];
    return { name, content: `${lines.slice(0, after).join('\n')}\n` };
  };
  await app.drop([beginning('fr079.log', /^ROBOTLASER1/), beginning('fr079.odometry.txt', /^\d/)]);
  await stopAfter(page, 'scanstitch-planar', 20);
  const stopped = page.locator('scanstitch-planar .activity');
  await expect(stopped).toContainText('Stopped: partial map');
  await page.getByRole('button', { name: 'Continue' }).click();
  await stopAfter(page, 'scanstitch-planar', 20, 'Searching for loop closures');
  await expect(stopped).toContainText('Stopped: all registered, not yet optimised');
  await page.getByRole('button', { name: 'Continue' }).click();
  const { result, timing } = await app.stitched();
  info.annotations.push({ type: 'computing', description: `${timing.total.toFixed(0)} ms` });
  expect(result.frames).toHaveLength(NUM_SCANS);
  expect(result.comparison?.mean).toBeLessThan(0.08);
  await info.attach('map', { body: await page.screenshot(), contentType: 'image/png' });
});

test('scans as other programs write them: points by their scan, planar PCD, a turn of a laser whose sense is open', async ({
  empty: app,
}) => {
  const along = bearings(360, 0, 1);
  const points = PLACES.map((place) =>
    rangesAt(place, along).map((range, beam) => [
      range * Math.cos(along[beam] ?? 0),
      range * Math.sin(along[beam] ?? 0),
    ]),
  );
  const rows = points.flatMap((of, scan) => of.map(([x = 0, y = 0]) => `${scan},${x.toFixed(3)},${y.toFixed(3)}\n`));
  const pcds = points.map((of, scan) => ({
    name: `scan_${scan}.pcd`,
    content: `VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 360\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 360\nDATA ascii\n${of.map(([x = 0, y = 0]) => `${x.toFixed(4)} ${y.toFixed(4)} 0\n`).join('')}`,
  }));
  const turns = PLACES.flatMap((place) =>
    rangesAt(place, along).map((range, beam) => `${beam},${Math.round(1000 * range)},15\n`),
  );
  for (const [files, status] of [
    [[{ name: 'points.csv', content: `scan_id,x,y\n${rows.join('')}` }], 'good'],
    [pcds, 'good'],
    [[{ name: 'lidar.csv', content: `angle,distance,quality\n${turns.join('')}` }], 'doubtful'],
  ] as const) {
    await app.drop([...files]);
    const { frames } = (await app.stitched()).result;
    expect(frames.map((frame) => frame.status)).toEqual(PLACES.map(() => status));
    const { x = 0, y = 0 } = frames.at(-1)?.T_world_sensor ?? {};
    expect(Math.hypot(x - LAST[0], y - LAST[1])).toBeLessThan(0.01);
  }
});
