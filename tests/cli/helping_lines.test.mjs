// @ts-check
/** Files that cannot be used, or only in part: each gets a message with the remedy, and all others are read. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { mcapBytes } from './bag_files.mjs';
import { image, stampAt } from './bag_messages.mjs';
import { readReport, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const COLOR = '/camera/color/image_raw';

test('a bag of pictures without depth: which topic to record', async (t) => {
  const folder = temporaryFolder(t);
  const message = (/** @type {number} */ seconds) => ({
    topic: COLOR,
    time: BigInt(seconds) * 1_000_000_000n,
    data: image({ stamp: stampAt(seconds), width: 4, height: 3, encoding: 'rgb8', data: new Uint8Array(36) }),
  });
  const bytes = mcapBytes([{ name: COLOR, type: 'sensor_msgs/msg/Image' }], [1, 2, 3].map(message));
  const [bag = ''] = writeFiles(folder, { 'walk.mcap': bytes });
  const { status, stderr } = await scanstitch(['reconstruct', bag, '--out', folder]);
  assert.equal(status, 1);
  assert.match(stderr, /color\/image_raw: not used: pictures without depth images.*ros2 bag record .*depth/);
});

test('trajectories alone are sent where they are compared', async (t) => {
  const folder = temporaryFolder(t);
  const rows = Array.from({ length: 30 }, (_, i) => `${i} ${0.1 * i} 0 0 0 0 0 1\n`).join('');
  writeFiles(folder, { 'estimate.txt': rows });
  const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', folder]);
  assert.equal(status, 1);
  assert.match(stderr, /estimate\.txt: not used: numbers without a scan.*scanstitch evaluate/);
});

/** A drive along a room of 7 x 6 m: pose (m, rad) and ranges (m) of 181 beams. @param {number} scan */
function driven(scan) {
  const [x, heading] = [0.1 * scan, 0.3 * Math.sin(scan / 4)];
  const ranges = Array.from({ length: 181 }, (_, beam) => {
    const angle = heading + ((beam - 90) * Math.PI) / 180;
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    const end = Math.abs((dx > 0 ? 4 - x : -3 - x) / dx);
    return Math.min(end, Math.abs((dy > 0 ? (dx > 0.3 ? 2.2 : 3) : -3) / dy));
  });
  return { x, heading, ranges };
}

test('poses in degrees and metres beside ranges in millimetres: by names, by hand, and told where they are taken for others', async (t) => {
  const folder = temporaryFolder(t);
  const names = Array.from({ length: 181 }, (_, beam) => `r${beam}`).join(',');
  const table = (/** @type {string} */ heads) =>
    `${heads},${names}\n${Array.from({ length: 12 }, (_, scan) => {
      const { x, heading, ranges } = driven(scan);
      const beams = ranges.map((range) => Math.round(1000 * range)).join(',');
      return `${100 * scan},${x.toFixed(3)},0.000,${((180 / Math.PI) * heading).toFixed(2)},${beams}\n`;
    }).join('')}`;
  const [named = '', bare = ''] = writeFiles(folder, {
    'named.csv': table('time_ms,odom_x (m),odom_y (m),odom_yaw_deg'),
    'bare.csv': table('a,b,c,d'),
  });
  const run = async (/** @type {string[]} */ ...args) => {
    const { status, stderr } = await scanstitch(['reconstruct', ...args, '--out', folder]);
    const { x, theta } = readReport(folder).frames.at(-1).T_world_sensor;
    const { x: wanted, heading } = driven(11);
    // The first heading is the world's.
    assert.ok(Math.hypot(x - wanted, theta - heading) < 0.03, `${x} ${theta}`);
    return { status, stderr };
  };
  assert.match((await run(named)).stderr, /ranges=5:185,unit=mm,.*,time=1:ms,poses=2:3:4:m:deg/);
  const format = 'ranges=5:185,unit=mm,start=-90deg,step=1deg,time=1:ms';
  const good = await run(bare, '--table', `${format},odometry=2:3:4:m:deg`);
  assert.match(good.stderr, /The wheels' odometry in the log is used/);
  assert.doesNotMatch(good.stderr, /contradicts/);
  const wrong = await run(bare, '--table', `${format},odometry=2:3:4:m`);
  assert.match(wrong.stderr, /odometry contradicts the scans.*in metres and radians/);
});
