/** Inputs made after bug reports, dropped on the page with nothing set: what the command line makes of them (tests/cli/reports.test.mjs). */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { SpatialResult } from '../../pkg/scanstitch.js';
import { expect, test } from './spatial_page.js';

const REPORTS = join(import.meta.dirname, '../../../shared/data/reports');

interface Row {
  path: string;
  /** The number of frames, and how many of them are good. */
  counts: [all: number, good: number];
  said: RegExp;
  check?: (result: SpatialResult) => void;
}

const ROWS: readonly Row[] = [
  {
    path: 'far_room/60m',
    counts: [2, 2],
    said: /coordinates of the clouds do not begin at the sensor/,
    check: ({ frames, origin }) => {
      expect(origin).toEqual([60, 0, 1]);
      expect(frames[1]?.T_world_sensor.qz).toBeCloseTo(Math.sin(Math.PI / 60), 3);
    },
  },
  {
    path: 'ply_millimetres',
    counts: [1, 1],
    said: /Unit of the clouds\s*Change\s*0.001 m/,
    check: ({ cloud_unit }) => expect(cloud_unit).toBe(0.001),
  },
  { path: 'laz/plane.laz', counts: [1, 1], said: /coordinates of the files/ },
  { path: 'laser_upside_down/clockwise_no_tf.bag', counts: [264, 0], said: /set laser_direction=mirrored/ },
];

function filesOf(path: string): { name: string; content: Buffer }[] {
  const whole = join(REPORTS, path);
  const names = /\.\w+$/.test(path) ? [''] : readdirSync(whole);
  return names.map((name) => ({ name: name || path.replace(/^.*\//, ''), content: readFileSync(join(whole, name)) }));
}

for (const { path, counts, said, check } of ROWS) {
  test(`${path} on the page`, async ({ spatial, page }) => {
    test.skip(!existsSync(REPORTS), '../shared/data is absent');
    await spatial.drop(filesOf(path));
    const { result } = await spatial.stitched();
    const good = result.frames.filter(({ status }) => status === 'good').length;
    expect(result.frames).toHaveLength(counts[0]);
    expect(good).toBe(counts[1]);
    await expect(page.locator('scanstitch-app')).toContainText(said);
    check?.(result);
  });
}
