// @ts-check
/** `scanstitch live`: what a stream leaves is what a bag of the same messages would give, however the stream ends. */
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { bytesInMemory } from '../../npm/archive/open.js';
import { openBags } from '../../npm/bag/open.js';
import { keptFrom, socketAddress } from '../../npm/live/address.js';
import { writeMcap } from './bag_writer.mjs';
import { WALK } from './depth_room.mjs';
import { cloudWalk, depthWalk, laserDrive } from './live_recordings.mjs';
import { listen, playFoxglove, playRosbridge } from './live_servers.mjs';
import { scanstitch, temporaryFolder } from './support.mjs';

/** @typedef {import('./live_recordings.mjs').Recorded} Recorded */

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

test('addresses: what is typed, and what a browser keeps a page from', () => {
  /** @type {[typed: string, meant: string | RegExp, pageProtocol?: string][]} */
  const cases = [
    ['ws://localhost:8765', 'ws://localhost:8765/'],
    [' robot.local:9090 ', 'ws://robot.local:9090/'],
    ['http://10.0.0.5:8765/path', 'ws://10.0.0.5:8765/path'],
    ['https://robot.example', 'wss://robot.example/'],
    ['', /No address was given/],
    ['ftp://robot', /ftp:\/\/robot is no address of a WebSocket/],
    ['ws://a b', /is no address/],
    ['ws://localhost:8765', 'ws://localhost:8765/', 'https:'],
    ['127.0.0.1:9090', 'ws://127.0.0.1:9090/', 'https:'],
    ['[::1]:9090', 'ws://[::1]:9090/', 'https:'],
    ['wss://robot.example', 'wss://robot.example/', 'https:'],
    ['ws://robot.local:9090', /this machine only, not to robot.local/, 'https:'],
    ['ws://localhost.thief.example', /this machine only/, 'https:'],
  ];
  for (const [typed, meant, pageProtocol = 'http:'] of cases) {
    const url = socketAddress(typed);
    const problem = url instanceof URL ? keptFrom(url, pageProtocol) : url;
    if (typeof meant === 'string') assert.deepEqual([String(url), problem], [meant, null], typed);
    else assert.match(problem?.problem ?? '', meant, typed);
  }
});
