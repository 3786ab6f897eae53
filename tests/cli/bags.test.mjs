// @ts-check
/** Bags of ROS 2 that others recorded, against what the PyPI package rosbags reads in them, and what comes of them. */
import assert from 'node:assert/strict';
import { copyFileSync, mkdirSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { zipSync } from 'fflate';
import { decodeCamera, decodeCloud, decodeHeader, decodeImage, decodePoses } from '../../npm/bag/messages.js';
import { nanoseconds } from '../../npm/bag/stamps.js';
import { crc32 } from '../../npm/base/crc32.js';
import { bagFile, openOne } from './bag_files.mjs';
import { openBags } from '../../npm/bag/open.js';
import {
  DATA,
  readReport,
  ROOT,
  scanstitch,
  skipWithoutData as skip,
  temporaryFolder,
  writeFiles,
} from './support.mjs';

const BAGS = join(DATA, 'bags');
const DERIVED = join(BAGS, 'derived_depth_pointcloud');

/** @typedef {{ type: string, count: number, first?: string, last?: string, times: number, messages: number, stamps?: number, numbers?: number }} Expected */
/** @type {Record<string, Record<string, Expected>>} */
const EXPECTED = JSON.parse(readFileSync(join(ROOT, 'tests', 'cli', 'bag_expectations.json'), 'utf8'));
const POSES = ['nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped', 'tf2_msgs/msg/TFMessage'];

/** Little endian, one after the other. @param {bigint[]} times */
function times(times) {
  return crc32(new Uint8Array(BigInt64Array.from(times).buffer));
}

/** What a message holds: its times, and its numbers as bytes. @param {string} type @param {Uint8Array} bytes */
function contents(type, bytes) {
  if (POSES.includes(type)) {
    const poses = decodePoses(type, bytes);
    const numbers = poses.flatMap(({ pose }) => [...pose.translation, ...pose.rotation]);
    return {
      stamps: poses.map(({ stamp }) => nanoseconds(stamp)),
      numbers: new Uint8Array(Float64Array.from(numbers).buffer),
    };
  }
  const stamps = [nanoseconds(decodeHeader(bytes).stamp)];
  if (type === 'sensor_msgs/msg/Image') return { stamps, numbers: decodeImage(bytes).data };
  if (type === 'sensor_msgs/msg/PointCloud2') return { stamps, numbers: decodeCloud(bytes).data };
  return { stamps, numbers: new Uint8Array(Float64Array.from(decodeCamera(bytes).k).buffer) };
}

test('every bag holds what rosbags reads in it: topics, counts, times, messages, numbers', { skip }, async () => {
  const paths = Object.keys(EXPECTED);
  assert.equal(paths.length, 9);
  for (const path of paths) {
    const { bag, notes } = await openOne(path, readFileSync(join(BAGS, path)));
    assert.deepEqual(notes, [], path);
    const expected = EXPECTED[path] ?? {};
    assert.deepEqual(bag.topics.map(({ name }) => name).sort(), Object.keys(expected).sort(), path);
    for (const topic of bag.topics) {
      const known = /** @type {Expected} */ (expected[topic.name]);
      const where = `${path} ${topic.name}`;
      assert.equal(topic.type, known.type, where);
      assert.equal(topic.count, known.count, where);
      assert.equal(topic.span?.first.toString(), known.first, where);
      assert.equal(topic.span?.last.toString(), known.last, where);
      const indexes = Array.from({ length: topic.count }, (_, index) => index);
      assert.equal(times(indexes.map((index) => bag.time(topic, index))), known.times, where);
      const messages = await Promise.all(indexes.map((index) => bag.read(topic, index)));
      assert.equal(crc32(Buffer.concat(messages)), known.messages, where);
      if (known.numbers === undefined) continue;
      const read = messages.map((bytes) => contents(topic.type, bytes));
      assert.equal(times(read.flatMap(({ stamps }) => stamps)), known.stamps, where);
      assert.equal(crc32(Buffer.concat(read.map(({ numbers }) => numbers))), known.numbers, where);
    }
  }
});

test('topics are listed, and what is not used is told with its reason', { skip }, async () => {
  const { status, stdout } = await scanstitch(['topics', BAGS]);
  assert.equal(status, 0);
  assert.match(stdout, /^\/camera\/depth\/image_raw +sensor_msgs\/msg\/Image +10 +30\.0 +depth +640 x 480, 16UC1$/m);
  assert.match(stdout, /^\/camera\/depth\/image_raw .* 640 x 480, 32FC1$/m);
  assert.match(stdout, /^\/camera\/depth\/camera_info .* camera /m);
  assert.match(stdout, /^\/velodyne_points .* clouds +69088 points of x y z intensity$/m);
  assert.match(stdout, /^\/test_topic .* messages of this type are not used$/m);
  assert.match(stdout, /^\/test_topic .* serialised as wrong_format, and only cdr and ros1 are read/m);
});

test(
  'bags of types that are not used, and of another middleware, are named, and nothing breaks',
  { skip },
  async (t) => {
    const out = temporaryFolder(t);
    for (const [bag, reason] of [
      ['rosbag2_resources/sqlite3_cdr_test', /\/array_topic \(test_msgs\/msg\/Arrays\).*not used/],
      ['rosbag2_resources/sqlite3_wrong_rmw_test', /serialised as wrong_format/],
      ['rosbag2_resources/mcap_talker', /\/topic \(std_msgs\/msg\/String\)/],
      ['nav2_turtlebot.mcap', /no topic of this bag can be used/],
    ]) {
      const { status, stderr } = await scanstitch(['reconstruct', join(BAGS, String(bag)), '--out', out]);
      assert.equal(status, 1, stderr);
      assert.match(stderr, /** @type {RegExp} */ (reason));
      assert.doesNotMatch(stderr, /defect/);
    }
  },
);

/** Positions of the frames, m. @param {string} folder */
function positions(folder) {
  /** @type {{ T_world_sensor: { x: number, y: number, z: number } }[]} */
  const frames = readReport(folder).frames;
  return frames.map(({ T_world_sensor: { x, y, z } }) => [x, y, z]);
}

/** @param {number[][]} a @param {number[][]} b */
function largestDistance(a, b) {
  assert.equal(a.length, b.length);
  return Math.max(...a.map((p, i) => Math.hypot(...p.map((value, axis) => value - (b[i]?.[axis] ?? Number.NaN)))));
}

/** @param {string[]} args @param {string} out */
async function reconstruct(args, out) {
  const { status, stderr } = await scanstitch(['reconstruct', ...args, '--out', out]);
  assert.equal(status, 0, stderr);
  return positions(out);
}

test('depth in bags gives the trajectory of the frames it was made from', { skip }, async (t) => {
  const folder = temporaryFolder(t);
  const frames = join(DATA, 'rgbd', 'fusion_demo50');
  mkdirSync(join(folder, 'frames'));
  // The bags hold the first ten.
  const names = readdirSync(join(frames, 'rgbd-frames'))
    .filter((name) => name.endsWith('.depth.png'))
    .sort()
    .slice(0, 10);
  for (const name of names) copyFileSync(join(frames, 'rgbd-frames', name), join(folder, 'frames', name));
  copyFileSync(join(frames, 'camera-intrinsics.txt'), join(folder, 'frames', 'camera-intrinsics.txt'));
  const expected = await reconstruct([join(folder, 'frames')], join(folder, 'expected'));
  for (const bag of ['depth_16UC1_db3', 'depth_32FC1_mcap']) {
    const found = await reconstruct([join(DERIVED, bag), join(DERIVED, 'depth_gt_tum.txt')], join(folder, bag));
    const distance = largestDistance(found, expected);
    t.diagnostic(`${bag}: at most ${(1000 * distance).toFixed(3)} mm from the frames' trajectory`);
    assert.ok(distance < 0.005);
    const { comparison } = readReport(join(folder, bag));
    assert.equal(comparison.num_matched, 10, 'the true path beside the bag is found, and matched by time');
    assert.ok(comparison.max < 0.01, `${comparison.max} m from the truth`);
  }
});

test('clouds in bags give the registration of the clouds they were made from', { skip }, async (t) => {
  const folder = temporaryFolder(t);
  mkdirSync(join(folder, 'pair'));
  copyFileSync(join(DATA, 'lidar', 'kitti_pair', 'target.ply'), join(folder, 'pair', '0.ply'));
  copyFileSync(join(DATA, 'lidar', 'kitti_pair', 'source.ply'), join(folder, 'pair', '1.ply'));
  const expected = await reconstruct([join(folder, 'pair')], join(folder, 'expected'));
  for (const bag of ['pointcloud2_kitti_pair_db3', 'pointcloud2_kitti_pair_mcap']) {
    const distance = largestDistance(await reconstruct([join(DERIVED, bag)], join(folder, bag)), expected);
    t.diagnostic(`${bag}: ${(1000 * distance).toFixed(3)} mm from the registration of the PLY files`);
    assert.ok(distance < 0.005);
  }
});

test('a bag inside a ZIP archive is opened', { skip }, async (t) => {
  const folder = temporaryFolder(t);
  const bag = join(DERIVED, 'pointcloud2_kitti_pair_mcap', 'pointcloud2_kitti_pair_mcap.mcap');
  const [zip] = writeFiles(folder, { 'pair.zip': zipSync({ 'run/pair.mcap': new Uint8Array(readFileSync(bag)) }) });
  const { status, stdout } = await scanstitch(['topics', zip ?? '']);
  assert.equal(status, 0);
  assert.match(stdout, /^run\/pair\.mcap\n.*\n\/velodyne_points .* clouds /);
  assert.equal((await reconstruct([zip ?? ''], join(folder, 'out'))).length, 2);
});

test('files of one bag are one, with or without metadata.yaml', { skip }, async () => {
  const path = 'rosbag2_resources/sqlite3_cdr_test/cdr_test_0.db3';
  const bytes = new Uint8Array(readFileSync(join(BAGS, path)));
  const { bags, notes } = await openBags([bagFile('walk/walk_0.db3', bytes), bagFile('walk/walk_1.db3', bytes)]);
  assert.deepEqual(notes, []);
  assert.equal(bags.length, 1);
  assert.deepEqual(
    bags[0]?.topics.map(({ name, count }) => [name, count]),
    [
      ['/array_topic', 8],
      ['/test_topic', 6],
    ],
  );
  const metadata = new TextEncoder().encode(
    'x:\n  relative_file_paths:\n    - walk_0.db3\n    - other.db3\n    - gone.db3\n',
  );
  const listed = await openBags([
    bagFile('walk/walk_0.db3', bytes),
    bagFile('walk/other.db3', bytes),
    bagFile('walk/metadata.yaml', metadata),
  ]);
  assert.equal(listed.bags[0]?.topics[0]?.count, 8);
  assert.deepEqual(
    listed.notes.map(({ file }) => file),
    ['walk/gone.db3'],
  );
});
