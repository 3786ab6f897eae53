// @ts-check
/** `scanstitch live`: what a stream leaves is what a bag of the same messages would give, however the stream ends. */
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { bytesInMemory } from '../../npm/archive/open.js';
import { openBags } from '../../npm/bag/open.js';
import { cameraInfo, image, laserScan, odometry, pointCloud, stampAt } from './bag_messages.mjs';
import { writeMcap } from './bag_writer.mjs';
import { see, SIZE, WALK } from './depth_room.mjs';
import { listen, playFoxglove, playRosbridge } from './live_servers.mjs';
import { ROOM_POSES, roomScan, scanstitch, temporaryFolder } from './support.mjs';

/** @typedef {import('./bag_writer.mjs').TopicToWrite} TopicToWrite @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */
/** @typedef {{ topics: TopicToWrite[], messages: MessageToWrite[] }} Recorded */

const SECOND = 1_000_000_000n;
const at = (/** @type {number} */ index) => ({ stamp: stampAt(100 + index), time: BigInt(100 + index) * SECOND + 5n });

/** A depth camera with its CameraInfo. @returns {Recorded} */
function depthWalk() {
  const [depth, camera] = ['/camera/depth/image_rect_raw', '/camera/depth/camera_info'];
  const half = SIZE / 2;
  const messages = WALK.flatMap((pose, index) => {
    const { stamp, time } = at(index);
    const data = new Uint8Array(see(pose).depth.buffer);
    const info = cameraInfo(stamp, SIZE, SIZE, [half, half, half, half]);
    const picture = image({ stamp, width: SIZE, height: SIZE, encoding: '16UC1', data, step: 2 * SIZE });
    return [
      { topic: camera, time, data: info },
      { topic: depth, time, data: picture },
    ];
  });
  const type = (/** @type {string} */ name) => `sensor_msgs/msg/${name}`;
  return {
    topics: [
      { name: depth, type: type('Image') },
      { name: camera, type: type('CameraInfo') },
    ],
    messages,
  };
}

/** What a lidar would see in the same room. @returns {Recorded} */
function cloudWalk() {
  const topic = '/points';
  const messages = WALK.map((pose, index) => {
    const { stamp, time } = at(index);
    const { depth } = see(pose);
    const points = Float32Array.from({ length: (3 * SIZE * SIZE) / 4 }, (_, number) => {
      const point = Math.floor(number / 3);
      const [u, v] = [(2 * point) % SIZE, 2 * Math.floor((2 * point) / SIZE)];
      const z = (depth[v * SIZE + u] ?? 0) / 1000;
      return [((u - SIZE / 2) / (SIZE / 2)) * z, ((v - SIZE / 2) / (SIZE / 2)) * z, z][number % 3] ?? 0;
    });
    /** @type {[string, number, number][]} */
    const fields = [['x', 0, 7], ['y', 4, 7], ['z', 8, 7]]; // prettier-ignore
    const data = new Uint8Array(points.buffer);
    return { topic, time, data: pointCloud({ stamp, width: points.length / 3, fields, pointStep: 12, data }) };
  });
  return { topics: [{ name: topic, type: 'sensor_msgs/msg/PointCloud2' }], messages };
}

/** A laser and the wheels. @returns {Recorded} */
function laserDrive() {
  const messages = ROOM_POSES.flatMap((pose, index) => {
    const { stamp, time } = at(index);
    const points = roomScan(pose).split('end_header\n')[1]?.trim().split('\n').map((line) => line.split(' ').map(Number)); // prettier-ignore
    const ranges = (points ?? []).map(([x = 0, y = 0]) => Math.hypot(x, y));
    const [x, y, heading] = pose;
    const wheels = odometry(stamp, 'odom', 'laser', [x, y, 0, 0, 0, Math.sin(heading / 2), Math.cos(heading / 2)]);
    return [
      { topic: '/odom', time, data: wheels },
      { topic: '/scan', time, data: laserScan(stamp, 0, Math.PI / 179, [0.05, 30], ranges) },
    ];
  });
  const topics = [
    { name: '/scan', type: 'sensor_msgs/msg/LaserScan' },
    { name: '/odom', type: 'nav_msgs/msg/Odometry' },
  ];
  return { topics, messages };
}

/** Runs the command with this server and `reconstruct` with a bag of the same messages. @param {import('node:test').TestContext} t @param {string} url @param {Recorded} recorded */
async function both(t, url, { topics, messages }) {
  const folder = temporaryFolder(t);
  const bag = join(folder, 'bag.mcap');
  writeMcap(bag, topics, messages);
  const live = await scanstitch(['live', url, '--out', join(folder, 'live')]);
  const ofBag = await scanstitch(['reconstruct', bag, '--out', join(folder, 'bag')]);
  const trajectory = (/** @type {string} */ name) => readFileSync(join(folder, name, 'trajectory.tum'), 'utf8');
  return { live, ofBag, folder, trajectory };
}

/** The topics of the recording that a stream left. @param {string} folder */
async function recorded(folder) {
  const bytes = new Uint8Array(readFileSync(join(folder, 'stream.mcap')));
  const { bags, notes } = await openBags([{ path: 'stream.mcap', source: async () => bytesInMemory(bytes) }]);
  return { topics: bags[0]?.topics.map(({ name, type, count }) => [name, type, count]) ?? [], notes };
}

for (const [name, recording, play] of /** @type {const} */ ([
  ['a depth camera on a Foxglove bridge', depthWalk(), playFoxglove],
  ['a lidar on a Foxglove bridge', cloudWalk(), playFoxglove],
  ['a laser and wheels on rosbridge', laserDrive(), playRosbridge],
])) {
  test(`${name}: the trajectory is that of a bag of its messages, byte for byte`, async (t) => {
    const url = await play(t, recording.topics, recording.messages);
    const { live, ofBag, folder, trajectory } = await both(t, url, recording);
    assert.deepEqual([live.status, ofBag.status], [0, 0], live.stderr + ofBag.stderr);
    assert.equal(trajectory('live'), trajectory('bag'));
    const { topics, notes } = await recorded(join(folder, 'live'));
    const counts = recording.topics.map(({ name, type }) => {
      return [name, type, recording.messages.filter(({ topic }) => topic === name).length];
    });
    assert.deepEqual([topics, notes], [counts.sort(), []]);
    if (play === playRosbridge) return;
    // Every frame is either in the growing map or counted as too fast for it.
    const [, placed, dropped] = live.stdout.match(/^(\d+) frames were registered as they came; (\d+) came/m) ?? [];
    assert.equal(Number(placed) + Number(dropped), WALK.length);
    assert.ok(Number(placed) > 0);
  });
}

test('a stream that breaks, with half a message and a topic whose type changes: told, and nothing is lost', async (t) => {
  const { topics, messages } = cloudWalk();
  const url = await playFoxglove(t, topics, messages, (connection, server) => {
    connection.send(Buffer.of(1, 1, 0, 0));
    connection.send('{"op": "advert');
    server.removeChannel(1);
    server.addChannel({ topic: '/points', schemaName: 'sensor_msgs/msg/LaserScan', encoding: 'cdr', schema: '' });
    // What was sent goes out first.
    connection.send('', () => connection.terminate());
  });
  const { live, folder, trajectory } = await both(t, url, { topics, messages });
  assert.equal(live.status, 2, live.stderr);
  for (const told of [
    /the connection broke/,
    /a message was not understood: it ends after 4 bytes/,
    /a message was not understood: .*JSON/,
    /\/points was sensor_msgs\/msg\/PointCloud2 and is sensor_msgs\/msg\/LaserScan: kept as two topics/,
  ])
    assert.match(live.stderr, told);
  assert.equal(trajectory('live'), trajectory('bag'));
  const { topics: kept } = await recorded(join(folder, 'live'));
  assert.deepEqual(kept, [['/points', 'sensor_msgs/msg/PointCloud2', messages.length]]);
});

test('servers that are none of a robot are told, with what they offer', async (t) => {
  const folder = temporaryFolder(t);
  const run = (/** @type {string} */ url) => scanstitch(['live', url, '--out', folder]);
  writeFileSync(join(folder, 'stream.mcap'), 'an earlier recording');
  const echo = await listen(t, { handleProtocols: () => false }, (connection) => {
    connection.send('hello');
    connection.close(1000);
  });
  const other = await run(echo);
  assert.equal(other.status, 1);
  assert.match(other.stderr, /neither the protocol of Foxglove nor that of rosbridge/);
  assert.match(other.stderr, /a message was not understood/);
  const closed = await run(echo.replace(/:\d+$/, ':9'));
  assert.match(closed.stderr, /nobody answers there with a WebSocket/);
  const clouds = [{ name: '/points', type: 'foxglove.PointCloud', format: 'protobuf' }];
  const foreign = await playFoxglove(
    t,
    [...clouds, { name: '/scan', type: 'sensor_msgs/msg/LaserScan' }],
    [],
    (connection) => {
      connection.close(1000);
    },
  );
  const unread = await scanstitch(['live', foreign, '--out', folder, '--seconds', '1']);
  assert.match(unread.stderr, /nothing was recorded. It offers \/points \(foxglove.PointCloud, protobuf\)/);
  assert.equal(readFileSync(join(folder, 'stream.mcap'), 'utf8'), 'an earlier recording');
  for (const args of [[], ['localhost'], ['ws://a', 'ws://b'], ['ws://a', '--seconds', 'soon']]) {
    assert.equal((await scanstitch(['live', ...args])).status, 1);
  }
});
