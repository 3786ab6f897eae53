// @ts-check
/** An inertial unit in a bag: its angular velocities go into the files of the clouds, turned into the frame of the lidar. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { openRecording } from '../../npm/recording_reader.js';
import { mcapBytes } from './bag_files.mjs';
import { imu, pointCloud, stampAt, transforms } from './bag_messages.mjs';

/** @typedef {import('./bag_writer.mjs').MessageToWrite} MessageToWrite */

const nanoseconds = (/** @type {number} */ seconds) => BigInt(Math.round(seconds * 1e9));
/** A quarter turn about z. @type {[number, number, number, number, number, number, number]} */
const TURNED = [1, 0, 0, 0, 0, Math.SQRT1_2, Math.SQRT1_2];

/**
 * The readings (time, x, y, z) in the file of each cloud, and what is said. A cloud each 0.1 s from 100 s on; a reading each 0.02 s.
 * @param {{ hasTf?: boolean, isMissing?: boolean, wishes?: Record<string, string | null> }} [options]
 */
async function opened({ hasTf = true, isMissing = false, wishes = {} } = {}) {
  /** @type {[string, number, number][]} */
  const fields = [['x', 0, 7], ['y', 4, 7], ['z', 8, 7]]; // prettier-ignore
  const cloud = { width: 4, fields, pointStep: 12, data: new Uint8Array(48), frame: 'lidar' };
  /** @type {MessageToWrite[]} */
  const messages = [];
  const put = (/** @type {string} */ topic, /** @type {number} */ time, /** @type {Uint8Array} */ data) =>
    messages.push({ topic, time: nanoseconds(time), data });
  if (hasTf) {
    const mounted = [stampAt(100), 'base', 'imu_link', TURNED];
    const level = [stampAt(100), 'base', 'lidar', [0, 0, 1, 0, 0, 0, 1]];
    put('/tf_static', 100, transforms(/** @type {never} */ ([mounted, level])));
  }
  for (let index = 0; index < 5; index += 1) {
    put('/points', 100 + index / 10, pointCloud({ ...cloud, stamp: stampAt(100 + index / 10) }));
  }
  for (let index = 0; index < 40; index += 1) {
    const time = 99.9 + index / 50;
    for (const name of ['/imu', '/camera/imu']) {
      put(name, time, imu(stampAt(time), 'imu_link', [1, 0, name === '/imu' ? index / 100 : 9], isMissing));
    }
  }
  const topics = [
    { name: '/points', type: 'sensor_msgs/msg/PointCloud2' },
    { name: '/imu', type: 'sensor_msgs/msg/Imu' },
    { name: '/camera/imu', type: 'sensor_msgs/msg/Imu' },
    ...(hasTf ? [{ name: '/tf_static', type: 'tf2_msgs/msg/TFMessage' }] : []),
  ];
  const recording = await openRecording([{ path: 'r.mcap', blob: new Blob([mcapBytes(topics, messages)]) }], {
    topics: wishes,
  });
  const readings = [];
  for (const path of recording.clouds) {
    const text = new TextDecoder('latin1').decode(await recording.read(path));
    const lines = text.split('\n').filter((line) => line.startsWith('# gyro '));
    readings.push(lines.map((line) => line.split(' ').slice(2).map(Number)));
  }
  return { readings, said: recording.notes.map(({ file, reason }) => `${file}: ${reason}`).join('\n') };
}

test('readings stand in the file of each cloud, from the one before it to the one after it, in the frame of the lidar', async () => {
  const { readings, said } = await opened();
  assert.equal(said, '');
  assert.equal(readings.length, 5);
  const [, second = []] = readings;
  const times = second.map(([time = Number.NaN]) => time);
  assert.ok(Math.min(...times) <= -0.1 && Math.min(...times) > -0.2, `${times}`);
  assert.ok(Math.max(...times) >= 0.1 && Math.max(...times) < 0.2, `${times}`);
  for (const [time = 0, x, y, z] of second) {
    // About x of the unit is about y of the lidar.
    assert.ok(Math.abs(x ?? 9) < 1e-7 && Math.abs((y ?? 9) - 1) < 1e-7, `${x} ${y}`);
    assert.ok(Math.abs((z ?? 9) - (time + 0.2) / 2) < 1e-6, `${time} ${z}`);
  }
});

test('axes without a transform are taken for those of the lidar, which is said; none is used where none is wished for', async () => {
  const { readings, said } = await opened({ hasTf: false });
  assert.match(said, /\/imu: no \/tf tells how imu_link lies in lidar: taken for the same/);
  assert.equal(readings[1]?.[0]?.[1], 1);
  const without = await opened({ wishes: { imu: null } });
  assert.deepEqual([without.readings, without.said], [[[], [], [], [], []], '']);
  const other = await opened({ wishes: { imu: '/camera/imu' } });
  assert.equal(other.readings[1]?.[0]?.[3], 9);
});

test('a unit that says that it measures no angular velocity gives none', async () => {
  assert.deepEqual((await opened({ isMissing: true })).readings[1], []);
});
