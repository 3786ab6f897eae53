/** Inputs made after bug reports, dropped on the page with nothing set: what the command line makes of them (tests/cli/reports.test.mjs). */
import { existsSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import type { ReconstructionResult, SpatialResult } from '../../pkg/scanstitch.js';
import { expect, type SpatialPage, test } from './spatial_page.js';

const REPORTS = join(import.meta.dirname, '../../../shared/data/reports');

interface Row<Result> {
  path: string;
  /** The number of frames, and how many of them are good. */
  counts: [all: number, good: number];
  said?: RegExp;
  check?: (result: Result) => void;
}

function pathLength(frames: readonly { T_world_sensor: { x: number; y: number } }[]): number {
  const places = frames.map(({ T_world_sensor: { x, y } }) => [x, y] as const);
  return places.slice(1).reduce((sum, [x, y], i) => sum + Math.hypot(x - places[i]![0], y - places[i]![1]), 0);
}

/** Off the origin of the room, with the shift that is told. */
const farRoom = (distance: number): Row<SpatialResult> => ({
  path: `far_room/${distance}m`,
  counts: [2, 2],
  ...(distance > 0 && { said: /coordinates of the clouds do not begin at the sensor/ }),
  check: ({ frames, origin }) => {
    expect(origin).toEqual(distance > 0 ? [distance, 0, 1] : [0, 0, 0]);
    expect(frames[1]?.T_world_sensor.qz).toBeCloseTo(Math.sin(Math.PI / 60), 3);
  },
});

const IN_SPACE: readonly Row<SpatialResult>[] = [
  ...[0, 20, 60].map(farRoom),
  {
    path: 'ply_millimetres',
    counts: [1, 1],
    said: /Unit of the clouds\s*Change\s*0.001 m/,
    check: ({ cloud_unit }) => expect(cloud_unit).toBe(0.001),
  },
  { path: 'ply_list_in_vertex', counts: [1, 1], check: ({ cloud_unit }) => expect(cloud_unit).toBe(1) },
  {
    path: 'utm_csv',
    counts: [2, 2],
    check: ({ frames, origin }) => {
      expect(origin.slice(0, 2)).toEqual([539_721, 4_065_743]);
      expect(Math.abs(frames[1]?.T_world_sensor.qz ?? 0)).toBeCloseTo(Math.sin(Math.PI / 240), 4);
    },
  },
  { path: 'already_in_map_frame', counts: [10, 10], said: /No motion: the clouds share one frame/ },
  {
    path: 'missing_frame',
    counts: [11, 11],
    said: /poses\/2\.txt: not used: there is no frame of its number/,
    check: ({ comparison }) => {
      expect(comparison?.num_matched).toBe(11);
      expect(comparison?.max).toBeLessThan(0.01);
    },
  },
  {
    path: 'stray_scanner',
    counts: [21, 13],
    check: ({ camera, comparison }) => {
      for (const [name, value] of [
        ['fx', 213.3],
        ['cx', 127.4],
        ['cy', 95.7],
      ] as const)
        expect(camera?.[name], name).toBeCloseTo(value, 1);
      expect(comparison?.name).toBe('odometry.csv');
    },
  },
  {
    path: 'colour_depth_sizes',
    counts: [1, 1],
    said: /5000 raw values per metre are assumed.*Set depth_scale to the right number/,
    check: ({ camera, depth_scale }) => {
      expect(depth_scale).toBe(5000);
      expect(camera).toEqual({ width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5 });
    },
  },
  {
    path: 'depth_5000_fy_negative',
    counts: [5, 1],
    said: /The frames fit each other best with a focal length of about 4[78]\d pixels.*Compute with fx 4[78]\d/s,
    check: ({ depth_scale, comparison, suggestion }) => {
      expect(depth_scale).toBe(5000);
      expect(suggestion?.setting).toBe('fx');
      expect(comparison?.convention).toContain('left-handed');
    },
  },
  ...['bunnyDouble', 'bunnyFloat', 'bunnyInt19', 'las2e57_no_images_tag', 'tinyCartesianFloatRgb'].map((name) => ({
    path: `e57/${name}.e57`,
    counts: [1, 1] as [number, number],
  })),
  { path: 'e57/tiny_spherical.e57', counts: [1, 1], said: /180 of its 360 points are marked as invalid/ },
  { path: 'laz/plane.laz', counts: [1, 1], said: /coordinates of the files/ },
  { path: 'laz/simple.las', counts: [1, 1] },
  { path: 'laz/simple.laz', counts: [1, 1] },
  { path: 'laz/vegetation_1_3.las', counts: [1, 1] },
];

const IN_THE_PLANE: readonly Row<ReconstructionResult>[] = [
  {
    path: 'laser_upside_down/upside_down_with_tf.bag',
    counts: [264, 264],
    said: /laser hangs upside down by \/tf: its readings are turned over/,
    check: ({ frames }) => expect(pathLength(frames)).toBeCloseTo(19.5, 0),
  },
  {
    path: 'laser_upside_down/negative_increment.bag',
    counts: [264, 264],
    check: ({ frames }) => expect(pathLength(frames)).toBeCloseTo(19.5, 0),
  },
  { path: 'laser_upside_down/clockwise_no_tf.bag', counts: [264, 0], said: /set laser_direction=mirrored/ },
  {
    path: 'rostopic_echo',
    counts: [40, 40],
    check: ({ frames }) => expect(pathLength(frames)).toBeCloseTo(11.6, 1),
  },
  {
    path: 'scan_matrix',
    counts: [65, 1],
    said: /Set wheel_track to it \(m\), for example wheel_track=0\.3.*labels of readings/s,
  },
  { path: 'bag_wrong_index/demo.bag', counts: [360, 360] },
  { path: 'rplidar_polar', counts: [372, 4] },
  {
    path: 'range_limit_jitter',
    counts: [551, 353],
    said: /Returns at 8\.18 m were taken for the sensor's range limit/,
  },
];

/** What has no frames that can be used. */
const REFUSED: readonly { path: string; said: RegExp }[] = [
  {
    path: 'e57/cartesian_invalid_state_single.e57',
    said: /2 of its 3 points are marked as invalid/,
  },
  { path: 'e57/corrupt_crc.e57', said: /this E57 cloud is damaged .*checksum.* Copy or export it again/ },
  { path: 'e57/empty_pc.e57', said: /there are no points in this E57 file\. Export it again with its scans/ },
  {
    path: 'e57/original_guids.e57',
    said: /All of its points are one and the same\.\s+Give scans or clouds of many points/,
  },
];

function filesOf(path: string): { name: string; content: Buffer }[] {
  const whole = join(REPORTS, path);
  if (statSync(whole).isFile()) return [{ name: path.replace(/^.*\//, ''), content: readFileSync(whole) }];
  return readdirSync(whole, { recursive: true, encoding: 'utf8' })
    .filter((name) => statSync(join(whole, name)).isFile())
    .map((name) => ({ name, content: readFileSync(join(whole, name)) }));
}

/** One row after the other on one page. */
async function dropAll<Result extends SpatialResult | ReconstructionResult>(
  spatial: SpatialPage,
  rows: readonly Row<Result>[],
): Promise<void> {
  for (const { path, counts, said, check } of rows) {
    await test.step(path, async () => {
      await spatial.drop(filesOf(path));
      const result = (await spatial.app.stitched()).result as unknown as Result;
      const good = result.frames.filter(({ status }) => status === 'good').length;
      expect([result.frames.length, good], path).toEqual(counts);
      if (said) await expect(spatial.page.locator('scanstitch-app'), path).toContainText(said);
      check?.(result);
    });
  }
}

test.describe('reports on the page', () => {
  test.skip(!existsSync(REPORTS), '../shared/data is absent');

  test('clouds and depth images', ({ spatial }) => dropAll(spatial, IN_SPACE));

  test('laser scans', ({ spatial }) => dropAll(spatial, IN_THE_PLANE));

  test('files without a point that can be used', async ({ spatial, page }) => {
    for (const { path, said } of REFUSED) {
      await spatial.drop(filesOf(path));
      await expect(page.locator('scanstitch-app'), path).toContainText(said);
    }
    expect(await spatial.app.numStitched()).toBe(0);
  });
});
