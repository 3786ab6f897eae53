// @ts-check
/** Inputs made after bug reports, with nothing set: what must come out, and what must be said. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { test } from 'node:test';
import { e57Clouds, lasOfLaz } from '../../npm/formats/packed_clouds.js';
import { lasCloud } from '../../npm/formats/las.js';
import { DATA, moved, scanstitch, skipWithoutData as skip, temporaryFolder, writeFiles } from './support.mjs';

const REPORTS = join(DATA, 'reports');

/** @typedef {{ x: number, y: number, z: number, theta: number, qx: number, qy: number, qz: number, qw: number }} Pose */
/** @typedef {{ name: string, index: number, status: string, T_world_sensor: Pose, std: { x: number, y: number, theta: number } }} Frame */
/** @typedef {{ status: number, said: string, out: string, report: any, frames: Frame[] }} Outcome */

/** @param {import('node:test').TestContext} t @param {string[]} args paths from the folder of the reports, and options @returns {Promise<Outcome>} */
async function reconstruct(t, ...args) {
  const out = join(temporaryFolder(t), 'out');
  const [path = '', ...options] = args;
  const { status, stdout, stderr } = await scanstitch([
    'reconstruct',
    resolve(REPORTS, path),
    '--out',
    out,
    ...options,
  ]);
  const report = status === 1 ? null : JSON.parse(readFileSync(join(out, 'report.json'), 'utf8'));
  return { status: status ?? -1, said: `${stderr}\n${stdout}`, out, report, frames: report?.frames ?? [] };
}

/** @param {Frame[]} frames @param {string} status */
function count(frames, status) {
  return frames.filter((frame) => frame.status === status).length;
}

/** @param {Frame[]} frames */
function pathLength(frames) {
  const places = frames.map(({ T_world_sensor: { x, y, z = 0 } }) => [x, y, z]);
  const step = (/** @type {number[]} */ a, /** @type {number[]} */ b) =>
    Math.hypot(...a.map((v, i) => v - (b[i] ?? 0)));
  return places.slice(1).reduce((sum, place, i) => sum + step(place, places[i] ?? place), 0);
}

/** @param {number} value @param {number} expected @param {number} tolerance @param {string} [what] */
function near(value, expected, tolerance, what = '') {
  assert.ok(Math.abs(value - expected) <= tolerance, `${what}: ${value}, not ${expected} +- ${tolerance}`);
}

for (const distance of [0, 20, 60]) {
  test(`far_room/${distance}m: the same accuracy`, { skip }, async (t) => {
    const { frames } = await reconstruct(t, `far_room/${distance}m`);
    assert.equal(count(frames, 'good'), 2);
    const { T_world_sensor: pose } = /** @type {Frame} */ (frames[1]);
    const corner = moved(pose, [distance, 0, 0]);
    near(Math.hypot(...corner.map((value, i) => value - ([distance + 0.25, 0.12, 0][i] ?? 0))), 0, 2e-3, 'the corner');
    near(2 * Math.acos(pose.qw), (6 * Math.PI) / 180, 2e-4, 'the turn');
  });
}

/** The points of the pair at its origin, which are those of a sensor, and moved: the turn and the place of the corner, m. */
test('far_room/0m moved by up to 1,000 km: the same answer to 1 mm', { skip }, async (t) => {
  /** @type {number[][]} */
  const corners = [];
  for (const distance of [0, 20, 60, 1000, 1e6]) {
    const folder = temporaryFolder(t);
    writeFiles(
      folder,
      Object.fromEntries(
        ['0.ply', '1.ply'].map((name) => [name, movedCloud(join(REPORTS, 'far_room/0m', name), distance)]),
      ),
    );
    const { frames } = await reconstruct(t, folder);
    assert.equal(count(frames, 'good'), 2);
    const { T_world_sensor: pose } = /** @type {Frame} */ (frames[1]);
    const corner = moved(pose, [distance, 0, 0]).map((value, i) => value - (i === 0 ? distance : 0));
    corners.push(corner);
    near(2 * Math.acos(pose.qw), (6 * Math.PI) / 180, 2e-4, `the turn at ${distance} m`);
  }
  for (const [x = NaN, y = NaN, z = NaN] of corners) {
    const [first = []] = corners;
    near(Math.hypot(x - (first[0] ?? 0), y - (first[1] ?? 0), z - (first[2] ?? 0)), 0, 1e-3, 'beside the one at 0 m');
    near(Math.hypot(x - 0.25, y - 0.12, z), 0, 2e-3, 'beside the truth');
  }
});

/** Points of single precision, moved along x, in double precision. @param {string} path @param {number} distance m */
function movedCloud(path, distance) {
  const bytes = readFileSync(path);
  const end = bytes.indexOf('end_header') + 11;
  const header = bytes.subarray(0, end).toString('latin1').replaceAll('float', 'double');
  const count = (bytes.length - end) / 4;
  const values = Float64Array.from(
    { length: count },
    (_, i) => bytes.readFloatLE(end + 4 * i) + (i % 3 === 0 ? distance : 0),
  );
  return Buffer.concat([Buffer.from(header), Buffer.from(values.buffer)]);
}

const OTHER_UNIT = /--set cloud_unit=NUMBER/;
const SCALE_ASKED = /Set depth_scale to the right number/;
const OTHER_FOCAL_LENGTH = /fit each other best with a focal length of about \d+ pixels, not with the 525 .*: set fx=/;
const TRACK_ASKED = /Set wheel_track to it \(m\), for example wheel_track=0\.3/;

/**
 * `mended`: what the same input says where nothing is set, and no longer with these arguments, which it names.
 * @type {readonly { path: string, args?: string[], mended?: RegExp, check: (outcome: Outcome) => void }[]}
 */
const ROWS = [
  {
    path: 'ply_millimetres',
    check: ({ said, report }) => {
      assert.equal(report.cloud_unit, 0.001);
      assert.match(said, /a unit is 0\.001 m \(assumed; supported by the size of the scene\)/);
      assert.match(said, OTHER_UNIT);
    },
  },
  {
    path: 'ply_millimetres',
    args: ['--set', 'cloud_unit=0.001'],
    mended: OTHER_UNIT,
    check: ({ said }) => assert.match(said, /Clouds: a unit is 0\.001 m\n/),
  },
  {
    path: 'ply_list_in_vertex',
    check: ({ report, frames }) => {
      assert.equal(count(frames, 'good'), 1);
      assert.equal(report.cloud_unit, 1);
    },
  },
  {
    path: 'utm_csv',
    check: ({ frames, out }) => {
      assert.equal(count(frames, 'good'), 2);
      const pose = /** @type {Frame} */ (frames[1]).T_world_sensor;
      const pivot = [539_721.63, 4_065_742.305, 0];
      // The files' names put the moved one first.
      const motion = moved(pose, pivot).map((value, i) => value - (pivot[i] ?? 0));
      [-0.35, 0.2, -0.05].forEach((expected, i) => near(motion[i] ?? NaN, expected, 5e-3, 'xyz'[i]));
      near(2 * Math.acos(pose.qw), (1.5 * Math.PI) / 180, 2e-4, 'the turn');
      const head = readFileSync(join(out, 'map.ply')).subarray(0, 400).toString('latin1');
      assert.match(head, /property double x[^]*property uchar red/);
    },
  },
  {
    path: 'already_in_map_frame',
    check: ({ said, frames }) => {
      assert.equal(count(frames, 'good'), 10);
      assert.match(said, /No motion: the clouds share one frame/);
    },
  },
  {
    path: 'missing_frame',
    check: ({ said, report, frames }) => {
      assert.match(said, /poses\/2\.txt: not used: there is no frame of its number/);
      assert.ok(report.comparison.num_matched === 11 && report.comparison.max < 0.01);
      near(frames[1]?.T_world_sensor.x ?? NaN, 0.5, 0.01, 'the step over the missing frame');
    },
  },
  ...['upside_down_with_tf', 'negative_increment'].map((name) => ({
    path: `laser_upside_down/${name}.bag`,
    check: (/** @type {Outcome} */ { said, frames }) => {
      assert.deepEqual([count(frames, 'good'), /hangs upside down/.test(said)], [264, name.startsWith('upside')]);
      near(pathLength(frames), 19.5, 0.1, 'path');
      assert.match(said, /odom\.tum gives the first guess/);
    },
  })),
  {
    path: 'laser_upside_down/clockwise_no_tf.bag',
    check: ({ said, frames }) => {
      assert.equal(count(frames, 'good'), 0);
      assert.match(said, /mirror image of what the scans saw.*set laser_direction=mirrored/);
    },
  },
  {
    path: 'laser_upside_down/clockwise_no_tf.bag',
    args: ['--set', 'laser_direction=mirrored'],
    mended: /set laser_direction=mirrored/,
    check: ({ frames }) => assert.equal(count(frames, 'good'), 264),
  },
  {
    path: 'stray_scanner',
    check: ({ report }) => {
      const { fx, cx, cy } = report.camera;
      near(fx, 213.3, 0.05, 'fx');
      near(cx, 127.4, 0.05, 'cx');
      near(cy, 95.7, 0.05, 'cy');
      assert.equal(report.comparison?.name, 'odometry.csv');
    },
  },
  {
    path: 'colour_depth_sizes',
    check: ({ said, report }) => {
      const { fx, cx, cy } = report.camera;
      assert.deepEqual([fx, cx, cy, report.depth_scale], [262.5, 159.5, 119.5, 5000]);
      assert.match(said, /5000 raw values per metre are assumed/);
      assert.match(said, SCALE_ASKED);
    },
  },
  {
    path: 'colour_depth_sizes',
    args: ['--set', 'depth_scale=5000'],
    mended: SCALE_ASKED,
    check: ({ said }) => assert.match(said, /1 good, 0 doubtful/),
  },
  {
    path: 'scan_matrix',
    check: ({ said, frames }) => {
      assert.equal(frames.length, 65);
      assert.match(said, /scan_partition\.csv: not used: labels/);
      assert.match(said, /scan_partition_labels\.csv: not used: labels/);
      assert.match(said, TRACK_ASKED);
    },
  },
  {
    path: 'scan_matrix',
    args: ['--set', 'wheel_track=0.3'],
    mended: TRACK_ASKED,
    check: ({ said }) => assert.match(said, /odom\.csv gives the first guess/),
  },
  {
    path: 'scan_matrix',
    args: ['--set', 'wheel_track=0.3', '--set', 'odometry=file'],
    check: ({ frames }) => assert.equal(frames.length, 65),
  },
  {
    path: 'bag_wrong_index/demo.bag',
    check: ({ frames }) => assert.equal(count(frames, 'good'), 360),
  },
  {
    path: 'depth_5000_fy_negative',
    check: ({ said, report, frames }) => {
      assert.equal(report.depth_scale, 5000);
      assert.match(said, /if the depth scale is 5000 .* and the focal length is 525 pixels, which nothing/);
      // With 525 pixels one frame would be good 2.8 m off.
      assert.equal(count(frames, 'good'), 1);
      assert.match(said, OTHER_FOCAL_LENGTH);
      near(report.suggestion.value, 481.2, 3, 'fx');
      assert.match(report.comparison.convention, /left-handed/);
    },
  },
  {
    path: 'depth_5000_fy_negative',
    args: ['--set', 'fx=480'],
    mended: OTHER_FOCAL_LENGTH,
    check: ({ report, frames }) => {
      assert.ok(count(frames, 'good') >= 4);
      for (const [at, { name, status }] of frames.entries())
        assert.ok(
          status !== 'good' || report.comparison.errors[at] < 0.015,
          `${name}: ${report.comparison.errors[at]} m`,
        );
    },
  },
  {
    path: 'depth_5000_fy_negative',
    args: ['--set', 'fx=481.2', '--set', 'fy=-480', '--set', 'depth_scale=5000'],
    check: ({ report, frames }) => {
      assert.equal(count(frames, 'good'), 5);
      assert.match(report.comparison.convention, /left-handed/);
      assert.ok(report.comparison.aligned.rmse < 0.012, `${report.comparison.aligned.rmse} m`);
    },
  },
  {
    path: 'rplidar_polar',
    check: ({ said, frames }) => {
      assert.equal(frames.length, 372);
      assert.match(said, /angle=3:-1deg,unit=mm/);
    },
  },
  {
    path: 'rostopic_echo',
    check: ({ frames }) => {
      assert.equal(count(frames, 'good'), 40);
      near(pathLength(frames), 11.6, 0.1, 'path');
      // Driving along x from scan 24 to 27, the end of the corridor is out of range.
      for (const { index, std } of frames.slice(1)) {
        assert.ok(index >= 24 && index <= 27 ? std.x > 0.05 : std.x < 0.05, `${index}: ${std.x} m`);
        assert.ok(std.y < 0.02 && std.theta < 0.01, `${index}: ${std.y} m, ${std.theta} rad`);
      }
    },
  },
  {
    path: 'range_limit_jitter',
    args: ['--set', 'odometry=log'],
    check: ({ said, frames }) => {
      assert.match(said, /Returns at 8\.18 m were taken for the sensor's range limit/);
      near(pathLength(frames), 57.8, 0.3, 'path');
    },
  },
  ...['bunnyDouble', 'bunnyFloat', 'bunnyInt19', 'tinyCartesianFloatRgb'].map((name) => ({
    path: `e57/${name}.e57`,
    check: (/** @type {Outcome} */ { frames }) => assert.equal(count(frames, 'good') + count(frames, 'lost'), 1),
  })),
  {
    path: 'e57/tiny_spherical.e57',
    check: ({ said, frames }) => {
      assert.equal(frames.length, 1);
      assert.match(said, /180 of its 360 points are marked as invalid/);
    },
  },
  { path: 'e57/corrupt_crc.e57', check: ({ said }) => assert.match(said, /this E57 cloud is damaged .*checksum/) },
  { path: 'e57/empty_pc.e57', check: ({ said }) => assert.match(said, /there are no points in this E57 file/) },
  ...['simple.las', 'simple.laz', 'plane.laz', 'vegetation_1_3.las'].map((name) => ({
    path: `laz/${name}`,
    check: (/** @type {Outcome} */ { frames }) => assert.equal(count(frames, 'good'), 1),
  })),
];

for (const { path, args = [], mended, check } of ROWS) {
  test(`${[path, ...args].join(' ')}`, { skip }, async (t) => {
    const outcome = await reconstruct(t, path, ...args);
    if (mended) assert.doesNotMatch(outcome.said, mended);
    check(outcome);
  });
}

test('E57 and LAZ have all their points, in double precision where they are large', { skip }, async () => {
  const read = (/** @type {string} */ path) => new Uint8Array(readFileSync(join(REPORTS, path)));
  const countsOf = async (/** @type {string} */ name) =>
    (await e57Clouds(name, read(`e57/${name}.e57`))).map(({ count }) => count);
  for (const [name, count] of /** @type {const} */ ([
    ['bunnyDouble', 30_571],
    ['bunnyFloat', 30_571],
    ['bunnyInt19', 30_571],
    ['tinyCartesianFloatRgb', 2090],
    // Half of its 360 are marked as invalid.
    ['tiny_spherical', 180],
  ]))
    assert.deepEqual(await countsOf(name), [count], name);
  const [{ ply: coloured } = { ply: new Uint8Array() }] = await e57Clouds('a', read('e57/tinyCartesianFloatRgb.e57'));
  assert.match(new TextDecoder('latin1').decode(coloured.subarray(0, 300)), /property uchar red/);

  const [simple, packed] = [read('laz/simple.las'), await lasOfLaz('simple.laz', read('laz/simple.laz'))];
  assert.deepEqual(lasCloud('simple.laz', packed), lasCloud('simple.las', simple));
  assert.match(new TextDecoder('latin1').decode(lasCloud('simple.las', simple).subarray(0, 90)), /vertex 1065\n/);
  const plane = lasCloud('plane.laz', await lasOfLaz('plane.laz', read('laz/plane.laz')));
  const header = new TextDecoder('latin1').decode(plane.subarray(0, 400)).indexOf('end_header') + 11;
  const view = new DataView(plane.buffer, plane.byteOffset + header);
  const easts = Array.from({ length: view.byteLength / 24 }, (_, point) => view.getFloat64(24 * point, true));
  const [west, east] = easts.reduce(([low, high], x) => [Math.min(low, x), Math.max(high, x)], [Infinity, -Infinity]);
  assert.ok(west > 1.4e6 && Math.abs(east - west - 2.1) < 0.2, `${west} to ${east}`);
});
