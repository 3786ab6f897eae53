// @ts-check
/** Bags of ROS 1 against what the PyPI package rosbags reads in them, damaged ones, and what comes of them. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { LIMITS } from '../../npm/archive/directory.js';
import { recordingsOf } from '../../npm/bag/bag_recordings.js';
import { unpackBzip2 } from '../../npm/archive/bzip2.js';
import { decodeHeader, decodeImage, decodePoses, decodeScan } from '../../npm/bag/messages.js';
import { nanoseconds } from '../../npm/bag/stamps.js';
import { crc32 } from '../../npm/base/crc32.js';
import { bagFile, listOne, openOne } from './bag_files.mjs';
import { openBags } from '../../npm/bag/open.js';
import { bytesInMemory } from '../../npm/archive/open.js';
import { unpackWhole } from '../../npm/archive/packed.js';
import { DATA, ROOT, skipWithoutData } from './support.mjs';

const STORED = join(ROOT, 'tests', 'data', 'bags');
/** The streams of the test of bzip2. */
const RUNS =
  'QlpoOTFBWSZTWadK4RsAAAKRAIAgIAAACCAAIKptQZjFR4u5IpwoSFOlcI2AQlpoOTFBWSZTWba17pUAAAB/////////////////////////////////////////////sADFUgAAAAAAAAAAAAAAAAAAAAABMAmAAAAAAAAAAAAAAEwABMAEmAAmAAJgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAkwAEwABMAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAPwCAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8gISIjJCUmJygpKissLS4vMDEyMzQ1Njc4OTo7PD0+P0BBQkNERUZHSElKS0xNTk9QUVJTVFVWV1hZWltcXV5fYGFiY2RhYmNkZWZnaGlqa2xtbm9wcXJzdHV2d3h5ent8fX5/gIGCg4SFhoeIiYqLjI2Oj5CRkpWWl5iZmpucnZ6foKGio6SlpqeoqaqrrK2ur7CxsrO0tba3uLm6u7y9vr/AwcLDxMXGxcbHyMnKy8zNzs/Q0dLT1NXW19jZ2tvc3d7f4OHi4+Tl5ufo6err7O3u7/Dx8vP09fb3+Pn6+/z9F3JFOFCQtrXulQ=';
const PACKINGS = ['none', 'bz2', 'lz4'];
/** @typedef {{ type: string, count: number, first?: string, last?: string, times: number, messages: number, stamps?: number, numbers?: number }} Expected */
/** @type {Record<string, Record<string, Expected>>} */
const EXPECTED = JSON.parse(readFileSync(join(ROOT, 'tests', 'cli', 'ros1_expectations.json'), 'utf8'));

/** @param {string} packing */
function stored(packing) {
  return new Uint8Array(readFileSync(join(STORED, `ros1_${packing}.bag`)));
}

/** @param {bigint[]} times */
function timesSum(times) {
  return crc32(new Uint8Array(BigInt64Array.from(times).buffer));
}

/** Times and numbers of a message, as the script of the expectations has them. @param {string} type @param {Uint8Array} bytes */
function contents(type, bytes) {
  if (type === 'nav_msgs/msg/Odometry' || type === 'tf2_msgs/msg/TFMessage') {
    const poses = decodePoses(type, bytes);
    const numbers = poses.flatMap(({ pose }) => [...pose.translation, ...pose.rotation]);
    return { stamps: poses.map(({ stamp }) => nanoseconds(stamp)), numbers: Float64Array.from(numbers) };
  }
  const stamps = [nanoseconds(decodeHeader(bytes).stamp)];
  if (type === 'sensor_msgs/msg/Image') return { stamps, numbers: decodeImage(bytes).data };
  const { angleMin, angleIncrement, rangeMin, rangeMax, ranges } = decodeScan(bytes);
  return { stamps, numbers: Float32Array.of(angleMin, angleIncrement, rangeMin, rangeMax, ...ranges) };
}

/** @param {string} name @param {Uint8Array} bytes */
async function isAsRosbagsReads(name, bytes) {
  const { bag, notes } = await openOne(name, bytes);
  assert.deepEqual(notes, [], name);
  const expected = EXPECTED[name] ?? {};
  assert.deepEqual(bag.topics.map(({ name }) => name).sort(), Object.keys(expected).sort());
  for (const topic of bag.topics) {
    const known = /** @type {Expected} */ (expected[topic.name]);
    const where = `${name} ${topic.name}`;
    const span = topic.span && { first: topic.span.first.toString(), last: topic.span.last.toString() };
    assert.deepEqual(
      { type: topic.type, count: topic.count, ...span },
      { type: known.type, count: known.count, first: known.first, last: known.last },
      where,
    );
    const indexes = Array.from({ length: topic.count }, (_, index) => index);
    assert.equal(timesSum(indexes.map((index) => bag.time(topic, index))), known.times, where);
    const messages = await Promise.all(indexes.map((index) => bag.read(topic, index)));
    // Before each lies the header by which a message of ROS 1 is known here.
    assert.equal(crc32(Buffer.concat(messages.map((bytes) => bytes.subarray(4)))), known.messages, where);
    if (known.numbers === undefined) continue;
    const read = messages.map((bytes) => contents(topic.type, bytes));
    assert.equal(timesSum(read.flatMap(({ stamps }) => stamps)), known.stamps, where);
    const numbers = read.map(({ numbers: { buffer, byteOffset, byteLength } }) =>
      Buffer.from(buffer, byteOffset, byteLength),
    );
    assert.equal(crc32(Buffer.concat(numbers)), known.numbers, where);
  }
}

test('bags of ROS 1 hold what rosbags reads in them, packed or not', async () => {
  for (const packing of PACKINGS) await isAsRosbagsReads(`ros1_${packing}.bag`, stored(packing));
});

test('a bag of ROS 1 that a robot recorded holds what rosbags reads in it', { skip: skipWithoutData }, async () => {
  const name = 'mylaserdata3.bag';
  await isAsRosbagsReads(name, new Uint8Array(readFileSync(join(DATA, 'laser', 'ros1_bag', name))));
});

test('laser scans of ROS 1 come with the odometry, carried over to the laser by what /tf says', async () => {
  const [made] = await recordingsOf([await listOne('walk.bag', stored('lz4'))], { depth: null, scans: '/scan' });
  assert.deepEqual(made?.recording.scans, ['walk.bag/scan.log']);
  assert.equal(made.recording.odometry, 'walk.bag/odom.tum');
  const textOf = async (/** @type {string} */ path) => {
    return new TextDecoder().decode(await made.files.find((file) => file.path === path)?.read());
  };
  const scans = (await textOf('walk.bag/scan.log')).trim().split('\n');
  assert.equal(scans.length, 12);
  assert.equal(JSON.parse(scans[3] ?? '').readings[0].toFixed(5), (2 + Math.sin(0.03)).toFixed(5));
  const poses = (await textOf('walk.bag/odom.tum'))
    .trim()
    .split('\n')
    .map((line) => line.split(' ').map(Number));
  // The laser is mounted 0.2 m ahead and looks backwards.
  const [, x = 0, y = 0, , , , qz = 0, qw = 0] = poses[10] ?? [];
  assert.ok(Math.hypot(x - (1 + 0.2 * Math.cos(0.2)), y - 0.2 * Math.sin(0.2)) < 1e-9, `${x} ${y}`);
  assert.ok(Math.abs(Math.abs(2 * Math.atan2(qz, qw)) - (Math.PI + 0.2)) < 1e-9);
});

test('a bag that was not closed is read from its beginning', async () => {
  for (const packing of PACKINGS) {
    const whole = stored(packing);
    const bytes = whole.slice();
    const indexPosition = Buffer.from(bytes).indexOf('index_pos=') + 'index_pos='.length;
    bytes.fill(0, indexPosition, indexPosition + 8);
    const [{ bag, notes }, { bag: expected }] = [await openOne('a.bag', bytes), await openOne('a.bag', whole)];
    assert.deepEqual(
      notes.map(({ reason }) => reason),
      ['its recorder was not closed, so it was read from its beginning'],
    );
    assert.deepEqual(bag.topics, expected.topics);
  }
});

test('messages of a connection that nothing defines are counted as lost', async () => {
  const bytes = stored('none');
  // In the index section and in the chunks alike: the numbers of connections 0 become 9.
  let place = 0;
  const isDefinition = Buffer.from('op=\x07', 'latin1');
  const all = Buffer.from(bytes.buffer, bytes.byteOffset, bytes.length);
  for (;;) {
    place = all.indexOf(isDefinition, place);
    if (place < 0) break;
    const conn = all.lastIndexOf('conn=', place + 40);
    if (conn > place - 60 && all.readUInt32LE(conn + 5) === 0) all.writeUInt32LE(9, conn + 5);
    place += 4;
  }
  const { bag, notes } = await openOne('strays.bag', bytes);
  assert.equal(
    bag.topics.reduce((sum, { count }) => sum + count, 0),
    36,
  );
  assert.deepEqual(
    notes.map(({ reason, is_loss }) => [reason, is_loss]),
    [['12 messages belong to no topic and are left out', true]],
  );
});

/** Reads all of it: nothing but errors about the file may come. @param {string} name @param {Uint8Array} bytes */
async function readsOrTells(name, bytes) {
  const { bags, notes } = await openBags([bagFile(name, bytes)]);
  for (const bag of bags) {
    for (const topic of bag.topics) {
      for (let index = 0; index < topic.count; index += 1) {
        for (const reading of [bag.read(topic, index), bag.readHead(topic, index, 16)]) {
          await reading.catch((error) => assert.equal(error.name, 'ScanstitchError', `${name}: ${error.stack}`));
        }
      }
    }
  }
  return { bags, notes: [...notes, ...bags.flatMap((bag) => bag.notes)] };
}

test('every length that a cut-off bag of ROS 1 may have is borne and told', async () => {
  for (const packing of PACKINGS) {
    const whole = stored(packing);
    for (let end = 0; end < whole.length; end += 61) {
      const { notes } = await readsOrTells(`${packing}.bag`, whole.subarray(0, end));
      assert.ok(notes.length > 0, `${packing} cut at ${end} of ${whole.length} says nothing`);
    }
  }
});

test('what lies before the cut is used', async () => {
  const whole = stored('none');
  const { bag } = await openOne('cut.bag', whole.subarray(0, Math.floor(0.6 * whole.length)));
  const count = bag.topic('/scan')?.count ?? 0;
  assert.ok(count >= 3 && count < 12, `${count} of 12`);
});

test('every byte of a bag of ROS 1 may be wrong without a crash', async () => {
  for (const packing of PACKINGS) {
    const whole = stored(packing);
    const step = Math.floor(whole.length / 400);
    for (let place = 0; place < whole.length; place += step) {
      const damaged = whole.slice();
      damaged[place] = (damaged[place] ?? 0) ^ 0xff;
      await readsOrTells(`${packing}.bag`, damaged);
    }
  }
});

test('bzip2: several streams, runs, all bytes, and a size that is not what comes out', async () => {
  // Packed by bzip2 1.0.8: 300 times "a", then the bytes 0 to 255, in a stream each.
  const runs = Buffer.from(RUNS, 'base64');
  const expected = Buffer.concat([Buffer.alloc(300, 'a'), Buffer.from(Array.from({ length: 256 }, (_, byte) => byte))]);
  assert.deepEqual(Buffer.from(await unpackBzip2(runs, expected.length)), expected);
  await assert.rejects(unpackBzip2(runs, expected.length - 1), /more than its header says/);
  await assert.rejects(unpackBzip2(runs.subarray(0, runs.length - 9), expected.length), RangeError);
  const damaged = Buffer.from(runs);
  damaged[12] = (damaged[12] ?? 0) ^ 1; // of the checksum
  await assert.rejects(unpackBzip2(damaged, expected.length), /checksum/);
  await assert.rejects(unpackBzip2(Buffer.from('no bzip2'), 9), /does not begin with the signature of bzip2/);
  const few = { ...LIMITS, freeBytes: expected.length - 1, ratio: 0 };
  await assert.rejects(unpackWhole('a.bz2', bytesInMemory(runs), few), /a\.bz2: It unpacks to more than/);
});

test('a bag of the first version is refused with the way to convert it', async () => {
  const { notes } = await openOne('old.bag', new TextEncoder().encode('#ROSBAG V1.2\nwhatever'));
  assert.match(notes[0]?.reason ?? '', /version 1\.2|V1\.2.*rosbag fix/);
});
