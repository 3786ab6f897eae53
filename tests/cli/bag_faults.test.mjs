// @ts-check
/** Bags that are damaged, cut off or odd: what is wrong is named, and the rest is used. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { recordingsOf } from '../../npm/bag/bag_recordings.js';
import { decodePoses } from '../../npm/bag/messages.js';
import { openBags } from '../../npm/bag/open.js';
import { understand } from '../../npm/recording/understand.js';
import { bagFile, db3Bytes, listOne, mcapBytes, openOne } from './bag_files.mjs';
import { cameraInfo, image, laserScan, odometry, stampAt } from './bag_messages.mjs';
import { ROOT, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const DEPTH = { name: '/camera/depth/image_raw', type: 'sensor_msgs/msg/Image' };
const CAMERA = { name: '/camera/depth/camera_info', type: 'sensor_msgs/msg/CameraInfo' };
const ODOMETRY = { name: '/odom', type: 'nav_msgs/msg/Odometry' };
const [WIDTH, HEIGHT] = [32, 24];

/** @param {number} seconds */
const nanoseconds = (seconds) => BigInt(Math.round(seconds * 1e9));

/** @param {number} seconds @param {Partial<Parameters<typeof image>[0]>} [changes] */
function depthAt(seconds, changes = {}) {
  const data = new Uint8Array(2 * WIDTH * HEIGHT).fill(7);
  const shape = { stamp: stampAt(seconds), width: WIDTH, height: HEIGHT, encoding: '16UC1', data };
  return { topic: DEPTH.name, time: nanoseconds(seconds), data: image({ ...shape, ...changes }) };
}

/** @param {number} seconds */
function cameraAt(seconds) {
  return {
    topic: CAMERA.name,
    time: nanoseconds(seconds),
    data: cameraInfo(stampAt(seconds), WIDTH, HEIGHT, [30, 30, 16, 12]),
  };
}

/** @param {number} count */
function walk(count) {
  return Array.from({ length: count }, (_, index) => [depthAt(10 + index / 10), cameraAt(10 + index / 10)]).flat();
}

/** The recording of the only bag, and the bytes of its files. @param {Uint8Array} bytes @param {import('../../npm/bag/topics.js').Wishes} [wishes] */
async function recordingOf(bytes, wishes = {}) {
  const [made] = await recordingsOf([await listOne('walk.mcap', bytes)], wishes);
  if (!made) throw new Error('no recording');
  return made;
}

test('a bag that was cut off: told where, and what lies before that is used', async () => {
  const whole = mcapBytes([DEPTH, CAMERA], walk(20), { chunkBytes: 8000 });
  for (const share of [0.3, 0.62, 0.95]) {
    const end = Math.floor(share * whole.length);
    const { bag, notes } = await openOne('walk.mcap', whole.subarray(0, end));
    assert.equal(notes.length, 1);
    assert.match(notes[0]?.reason ?? '', new RegExp(`cut off or damaged at byte \\d+ of ${end}`));
    const count = bag.topic(DEPTH.name)?.count ?? 0;
    assert.ok(count > 20 * (share - 0.3) && count < 20, `${count} of 20 at ${share}`);
    for (const topic of bag.topics) {
      for (let index = 0; index < topic.count; index += 1) await bag.read(topic, index);
    }
  }
  const database = db3Bytes([DEPTH, CAMERA], walk(20));
  const { bag, notes } = await openOne('walk.db3', database.subarray(0, Math.floor(0.6 * database.length)));
  assert.match(notes.map(({ reason }) => reason).join('; '), /cut off after \d+ of \d+ bytes/);
  assert.equal(bag.topics.length, 2);
  const depth = bag.topic(DEPTH.name);
  // The table's root lies in front; of its rows some are gone, and some lost their ends.
  assert.ok(depth && depth.count > 0 && depth.count <= 20);
  const read = await Promise.allSettled(Array.from({ length: depth.count }, (_, index) => bag.read(depth, index)));
  assert.ok(read.some(({ status }) => status === 'fulfilled'));
  for (const result of read) {
    if (result.status === 'rejected') assert.match(result.reason.message, /cut off or damaged/);
  }
});

test('every length that a cut-off bag may have is borne', async () => {
  for (const [name, bytes] of /** @type {const} */ ([
    ['bag.mcap', mcapBytes([DEPTH, CAMERA], walk(2))],
    ['bag.db3', db3Bytes([DEPTH, CAMERA], walk(2))],
  ])) {
    for (let end = 0; end < bytes.length; end += 61) {
      const { bag, notes } = await openOne(name, bytes.subarray(0, end));
      assert.ok(notes.length > 0, `${name} cut at ${end} of ${bytes.length} says nothing`);
      for (const topic of bag.topics) {
        for (let index = 0; index < topic.count; index += 1) {
          await bag.read(topic, index).catch((error) => assert.equal(error.name, 'ScanstitchError'));
        }
      }
    }
  }
});

test('every byte may be wrong without a crash', async () => {
  const packed = (/** @type {string} */ name) =>
    new Uint8Array(readFileSync(join(ROOT, 'tests', 'data', 'bags', name)));
  for (const [name, bytes] of /** @type {const} */ ([
    ['bag.mcap', mcapBytes([DEPTH, CAMERA], walk(1))],
    ['bag.db3', db3Bytes([DEPTH, CAMERA], walk(2))],
    ['zstd.mcap', packed('zstd.mcap')],
    ['lz4.mcap', packed('lz4.mcap')],
  ])) {
    const step = Math.max(1, Math.floor(bytes.length / 400));
    for (let place = 0; place < bytes.length; place += step) {
      const damaged = bytes.slice();
      damaged[place] = (damaged[place] ?? 0) ^ 0xff;
      const { bags } = await openBags([bagFile(name, damaged)]);
      for (const bag of bags) {
        for (const topic of bag.topics.filter(({ count }) => count < 100)) {
          for (let index = 0; index < topic.count; index += 1) {
            await bag.read(topic, index).catch((error) => {
              assert.equal(error.name, 'ScanstitchError', `${name}, byte ${place}: ${error.stack}`);
            });
          }
        }
      }
    }
  }
});

test('a chunk with a wrong checksum is named and passed over', async () => {
  const messages = walk(20);
  for (const isIndexed of [true, false]) {
    const bytes = mcapBytes([DEPTH, CAMERA], messages, { chunkBytes: 8000, isIndexed });
    // Within the pixels of the first image.
    bytes[900] = 99;
    const { recording, files } = await recordingOf(bytes);
    const results = await Promise.allSettled(
      recording.depth_frames.map(({ depth }) => files.find(({ path }) => path === depth)?.read()),
    );
    const problems = [
      ...recording.notes.map(({ reason }) => reason),
      ...results.flatMap((result) => (result.status === 'rejected' ? [result.reason.message] : [])),
    ];
    assert.match(problems.join('\n'), /The chunk at byte \d+ has another checksum than the one written in it/);
    const good = results.filter(({ status }) => status === 'fulfilled').length;
    assert.ok(good >= 14 && good < 20, `${good} of 20 frames are left`);
  }
});

test('a summary that is damaged is told, and the bag is read without it', async (t) => {
  const bytes = mcapBytes([DEPTH, CAMERA], walk(5));
  bytes[bytes.length - 60] = (bytes[bytes.length - 60] ?? 0) ^ 1;
  const { bag, notes } = await openOne('walk.mcap', bytes);
  assert.match(notes[0]?.reason ?? '', /summary is damaged, so it was read from its beginning/);
  assert.deepEqual(
    bag.topics.map(({ count }) => count),
    [5, 5],
  );
  const [path = ''] = writeFiles(temporaryFolder(t), { 'walk.mcap': bytes });
  const { status, stderr } = await scanstitch(['topics', path]);
  assert.match(stderr, /^note: walk\.mcap: its summary is damaged/m);
  assert.equal(status, 0, 'nothing is lost');
});

test('a message that is shorter than it says is named; the others are used', async (t) => {
  const messages = walk(5);
  const short = depthAt(10.2);
  messages[4] = { ...short, data: short.data.subarray(0, 500) };
  messages[6] = depthAt(10.3, { data: new Uint8Array(100) });
  const { recording, files } = await recordingOf(mcapBytes([DEPTH, CAMERA], messages));
  assert.equal(recording.depth_frames.length, 5);
  const read = (/** @type {number} */ frame) => {
    return (
      files.find(({ path }) => path === recording.depth_frames[frame]?.depth)?.read() ??
      Promise.reject(new Error('no file'))
    );
  };
  await assert.rejects(
    read(2),
    /Message 3 of \/camera\/depth\/image_raw: The message is shorter than its header says: its data of 1536 bytes/,
  );
  await assert.rejects(
    read(3),
    /Message 4 .* The image is shorter than its header says: 32 x 24 pixels take 1536 bytes, and it has 100/,
  );
  assert.equal((await read(4)).length, 'P5\n32 24\n65535\n'.length + 1536);
  // All of it through the command: named, and the rest placed or not for reasons of its own.
  const [path = ''] = writeFiles(temporaryFolder(t), { 'walk.mcap': mcapBytes([DEPTH, CAMERA], messages) });
  const { stderr } = await scanstitch(['reconstruct', path, '--out', join(temporaryFolder(t), 'out')]);
  assert.match(stderr, /Message 3 of \/camera\/depth\/image_raw: The message is shorter/);
  assert.doesNotMatch(stderr, /defect/);
});

test('rows of a .db3 bag that are damaged or have no integer time are left out and told', async () => {
  const whole = db3Bytes([DEPTH], [depthAt(10.1), depthAt(10.2), depthAt(10.3)]);
  const time = Buffer.alloc(8);
  time.writeBigInt64BE(nanoseconds(10.2));
  // The header of the row: its size, then the types of id, topic, time and data (two bytes); topic and time take 8 bytes each.
  const header = Buffer.from(whole).indexOf(time) - 8 - 6;
  const [INTEGER, REAL, TEXT_OF_8_BYTES] = [6, 7, 29];
  assert.deepEqual([...whole.subarray(header, header + 4)], [6, 0, INTEGER, INTEGER]);
  for (const [at, value, told] of /** @type {const} */ ([
    [0, 0x7f, /some of its rows cannot be read and are left out/],
    [3, REAL, /1 messages have no topic or no integer time/],
    [3, TEXT_OF_8_BYTES, /1 messages have no topic or no integer time/],
  ])) {
    const damaged = whole.slice();
    damaged[header + at] = value;
    const { bag, notes } = await openOne('walk.db3', damaged);
    assert.equal(bag.topics[0]?.count, 2);
    assert.match(notes.map(({ reason }) => reason).join(), told);
  }
});

test('time that runs backwards is told, and order is made of it', async () => {
  const swapped = [depthAt(10), depthAt(10.2), depthAt(10.1), depthAt(10.3)];
  swapped.forEach((message, index) => Object.assign(message, { time: nanoseconds(20 + index) }));
  const one = await recordingOf(mcapBytes([DEPTH], swapped));
  assert.deepEqual(
    one.recording.depth_frames.map(({ time }) => time),
    [10, 10.1, 10.2, 10.3],
  );
  assert.match(one.recording.notes.map(({ reason }) => reason).join(), /time runs backwards at 1 message/);

  const twice = [...walk(3), ...walk(6)].map((message, index) => ({ ...message, time: nanoseconds(20 + index) }));
  const two = await recordingOf(mcapBytes([DEPTH, CAMERA], twice));
  assert.equal(two.recording.depth_frames.length, 6, 'distinct times, from whichever round');
  const again = [...walk(30), ...walk(20)].map((message, index) => ({ ...message, time: nanoseconds(20 + index) }));
  const { recording } = await recordingOf(mcapBytes([DEPTH, CAMERA], again));
  assert.equal(recording.depth_frames.length, 30);
  assert.match(
    recording.notes.map(({ reason }) => reason).join(),
    /time jumps back once; the longest stretch is used, 30 of 50/,
  );

  const set = [10, 10.2, 5.4, 5.6].map((at, index) => ({ ...depthAt(at), time: nanoseconds(20 + index / 5) }));
  const { recording: whole } = await recordingOf(mcapBytes([DEPTH], set));
  assert.deepEqual(
    whole.depth_frames.map(({ time }) => time),
    [20, 20.2, 20.4, 20.6],
    'a clock that was set',
  );

  const unset = [1, 2, 3].map((index) => ({ ...depthAt(0), time: nanoseconds(index) }));
  const recorded = await recordingOf(mcapBytes([DEPTH], unset));
  assert.deepEqual(
    recorded.recording.depth_frames.map(({ time }) => time),
    [1, 2, 3],
    'by when they were recorded',
  );
});

test('scans and odometry of a clock that was set have the times of recording', async () => {
  const topics = [{ name: '/scan', type: 'sensor_msgs/msg/LaserScan' }, ODOMETRY];
  const messages = [50, 50.5, 12, 12.5].flatMap((at, index) => {
    const time = nanoseconds(20 + index / 2);
    const scan = laserScan(stampAt(at), 0, 0.1, [0.1, 9], [1, 2, 3]);
    const pose = odometry(stampAt(at), 'odom', 'laser', [index, 0, 0, 0, 0, 0, 1]);
    return [
      { topic: '/scan', time, data: scan },
      { topic: '/odom', time, data: pose },
    ];
  });
  const { files } = await recordingOf(mcapBytes(topics, messages));
  const [odom, scan] = await Promise.all(
    ['odom.tum', 'scan.log'].map(async (name) => {
      const read = files.find(({ path }) => path.endsWith(name))?.read;
      return new TextDecoder()
        .decode(await read?.())
        .trim()
        .split('\n');
    }),
  );
  const times = [20, 20.5, 21, 21.5];
  assert.deepEqual(scan?.map((line) => JSON.parse(line).timestamp), times.map((time) => [Math.floor(time), 1e6 * (time % 1)])); // prettier-ignore
  assert.deepEqual(
    odom?.map((line) => Number(line.split(' ')[0])),
    times,
  );
  assert.deepEqual(odom?.map((line) => Number(line.split(' ')[1])), [0, 1, 2, 3]); // prettier-ignore
});

test('depth without CameraInfo: the camera is asked for, and one in a file is taken', async () => {
  const made = await recordingOf(mcapBytes([DEPTH], [depthAt(1), depthAt(2)]));
  const listed = made.files.map(({ path, size }) => ({ path, size, given: made.recording }));
  const bare = await understand(listed, async () => new Uint8Array());
  assert.match(
    bare.notes.map(({ reason }) => reason).join(),
    /no CameraInfo .* in a file beside the bag, or set field_of_view/,
  );
  const file = new TextEncoder().encode('30 30 16 12\n');
  const beside = await understand([...listed, { path: 'camera-intrinsics.txt', size: file.length }], async () => file);
  assert.equal(beside.intrinsics, 'camera-intrinsics.txt');
  assert.doesNotMatch(beside.notes.map(({ reason }) => reason).join(), /no CameraInfo/);
});

test('what is no bag of ROS 2 is told with what to do', async () => {
  const text = (/** @type {string} */ value) => new TextEncoder().encode(value.padEnd(200, '.'));
  for (const [name, bytes, reason] of /** @type {const} */ ([
    ['old.bag', text('#ROSBAG V1.2\n'), /version V1\.2.*rosbag fix/],
    [
      'packed.db3.zstd',
      Uint8Array.of(0x28, 0xb5, 0x2f, 0xfd, 0, 0, 0, 0),
      /cannot be unpacked: it is cut off.*pack it again/,
    ],
    ['notes.mcap', text('hello'), /neither a bag of ROS 1 nor an SQLite or MCAP file/],
    ['empty.db3', new Uint8Array(), /empty/],
  ])) {
    const { notes, numBags } = await openOne(name, bytes);
    assert.equal(numBags, 0);
    assert.match(notes[0]?.reason ?? '', reason);
  }
});

test('a bag that is packed as a whole is read', async () => {
  const bytes = mcapBytes([DEPTH, ODOMETRY], [depthAt(1), depthAt(2)]);
  for (const [name, packed] of /** @type {const} */ ([
    ['walk.mcap.zstd', zstdOf(bytes)],
    ['walk.mcap.gz', gzipSync(bytes)],
  ])) {
    const { notes, numBags } = await openOne(name, packed);
    assert.deepEqual([notes, numBags], [[], 1], name);
  }
});

/** Zstandard of blocks that are not compressed. @param {Uint8Array} bytes */
function zstdOf(bytes) {
  const blocks = Array.from({ length: Math.ceil(bytes.length / 2 ** 16) }, (_, at) => {
    const block = bytes.subarray(at * 2 ** 16, (at + 1) * 2 ** 16);
    const isLast = (at + 1) * 2 ** 16 >= bytes.length;
    const header = (block.length << 3) | (isLast ? 1 : 0);
    return Buffer.concat([Uint8Array.of(header & 0xff, (header >> 8) & 0xff, header >> 16), block]);
  });
  // Without the size of what comes out, and with a window of 128 kB.
  return Buffer.concat([Uint8Array.of(0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3), ...blocks]);
}

test('wishes that cannot be granted are told', async () => {
  const bytes = mcapBytes([DEPTH, ODOMETRY], [depthAt(1), depthAt(2)]);
  await assert.rejects(
    recordingOf(bytes, { depth: '/nothing' }),
    /no topic \/nothing\. It has \/camera\/depth\/image_raw, \/odom/,
  );
  await assert.rejects(
    recordingOf(bytes, { clouds: DEPTH.name }),
    /cannot be used as clouds.* It can be used as depth/,
  );
  await assert.rejects(recordingOf(bytes, { depth: DEPTH.name, clouds: DEPTH.name }), /one of depth and clouds/);
});

test('chunks packed by zstd and by lz4 hold what was put in', async () => {
  for (const name of ['zstd.mcap', 'lz4.mcap']) {
    const { bag, notes } = await openOne(name, new Uint8Array(readFileSync(join(ROOT, 'tests', 'data', 'bags', name))));
    assert.deepEqual(notes, []);
    const topic = bag.topic('/odom');
    assert.ok(topic && topic.count === 40);
    for (let index = 0; index < 40; index += 1) {
      const [pose] = decodePoses(topic.type, await bag.read(topic, index));
      const expected = { translation: [0.1 * index, 0.2, 0.3], rotation: [0, 0, 0.6, 0.8] };
      assert.deepEqual([pose?.frame, pose?.child, pose?.pose], ['odom', 'base', expected]);
      assert.equal(
        bag.time(topic, index),
        BigInt(100 + Math.floor(index / 10)) * 1_000_000_000n + BigInt(index % 10) * 100_000_000n,
      );
    }
  }
});

test('each way of laying messages down gives the same bag', async () => {
  const messages = [
    ...walk(40),
    ...Array.from({ length: 3000 }, (_, i) => {
      const time = 10 + i / 1000;
      return {
        topic: ODOMETRY.name,
        time: nanoseconds(time),
        data: odometry(stampAt(time), 'odom', 'base', [i, 0, 0, 0, 0, 0, 1]),
      };
    }),
  ];
  const topics = [DEPTH, CAMERA, ODOMETRY];
  const bags = await Promise.all([
    openOne('a.mcap', mcapBytes(topics, messages)),
    openOne('b.mcap', mcapBytes(topics, messages, { isIndexed: false, chunkBytes: 5000 })),
    openOne('c.mcap', mcapBytes(topics, messages, { hasChunks: false })),
    openOne('d.mcap', mcapBytes(topics, messages, { hasChunks: false, isIndexed: false })),
    openOne('e.db3', db3Bytes(topics, messages)),
  ]);
  for (const { bag, notes } of bags) {
    assert.deepEqual(notes, [], bag.path);
    for (const { name, type } of topics) {
      const topic = bag.topic(name);
      const expected = messages.filter(({ topic }) => topic === name).sort((a, b) => Number(a.time - b.time));
      assert.ok(topic && topic.type === type && topic.count === expected.length, `${bag.path} ${name}`);
      for (const [index, { time, data }] of expected.entries()) {
        if (index % 7 !== 0) continue;
        assert.equal(bag.time(topic, index), time);
        assert.deepEqual(Buffer.from(await bag.read(topic, index)), Buffer.from(data), `${bag.path} ${name} ${index}`);
        const head = await bag.readHead(topic, index, 40);
        assert.deepEqual(Buffer.from(head.subarray(0, 40)), Buffer.from(data.subarray(0, 40)));
      }
    }
  }
});

/**
 * The write-ahead log of a recorder that was not closed: all pages of a file, with a commit behind each of `commits` of them.
 * @param {Uint8Array} whole @param {readonly number[]} commits numbers of pages, ascending; the last one is the end
 */
function logOf(whole, commits) {
  const size = new DataView(whole.buffer, whole.byteOffset).getUint16(16);
  const log = new Uint8Array(32 + (24 + size) * (commits.at(-1) ?? 0));
  const view = new DataView(log.buffer);
  let [a, b] = [0, 0];
  const add = (/** @type {number} */ start, /** @type {number} */ length) => {
    for (let at = start; at < start + length; at += 8) {
      a = (a + view.getUint32(at) + b) >>> 0;
      b = (b + view.getUint32(at + 4) + a) >>> 0;
    }
    return [a, b];
  };
  const put = (/** @type {number} */ at, /** @type {number[]} */ words) =>
    words.forEach((word, k) => view.setUint32(at + 4 * k, word));
  put(0, [0x377f0683, 3_007_000, size, 0, 11, 12]);
  put(24, add(0, 24));
  for (let page = 1; page <= (commits.at(-1) ?? 0); page += 1) {
    const at = 32 + (page - 1) * (24 + size);
    put(at, [page, commits.includes(page) ? page : 0, 11, 12]);
    log.set(whole.subarray((page - 1) * size, page * size), at + 24);
    add(at, 8);
    put(at + 16, add(at + 24, size));
  }
  return { log, size };
}

test('the messages that a recorder had not yet written into its bag are read from the log beside it', async () => {
  const whole = db3Bytes([DEPTH, CAMERA], walk(20));
  const numPages = whole.length / new DataView(whole.buffer, whole.byteOffset).getUint16(16);
  const { log, size } = logOf(whole, [numPages]);
  const open = async (/** @type {Uint8Array} */ bytes, /** @type {Uint8Array} */ beside) => {
    const files = [
      bagFile('walk.db3', bytes),
      bagFile('walk.db3-wal', beside),
      bagFile('walk.db3-shm', new Uint8Array(8)),
    ];
    const { bags, notes } = await openBags(files);
    return { counts: bags.flatMap(({ topics }) => topics.map(({ count }) => count)), bags, notes };
  };
  const { counts, bags, notes } = await open(whole.subarray(0, size), log);
  assert.deepEqual(notes, []);
  assert.deepEqual(counts, [20, 20]);
  const [bag] = bags;
  const topic = bag?.topic(DEPTH.name);
  assert.ok(bag && topic);
  const { bags: others } = await openBags([bagFile('walk.db3', whole)]);
  const other = others[0]?.topic(DEPTH.name);
  assert.ok(other);
  assert.deepEqual(await bag.read(topic, 19), await others[0]?.read(other, 19));
  // What was not committed, or not written whole, is none of the bag.
  const torn = log.slice();
  torn[log.length - 1] = (torn.at(-1) ?? 0) ^ 1;
  for (const beside of [torn, log.subarray(0, log.length - 1), new Uint8Array()]) {
    assert.deepEqual((await open(whole, beside)).counts, [20, 20]);
  }
  const wrong = await open(whole, new Uint8Array(100).fill(7));
  assert.match(wrong.notes[0]?.reason ?? '', /no write-ahead log of SQLite/);
  const alone = await openBags([bagFile('walk.db3-wal', log)]);
  assert.match(alone.notes[0]?.reason ?? '', /walk\.db3, which is not here/);
});
