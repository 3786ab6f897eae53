// @ts-check
/** Memory and work follow the bytes that arrive, whatever a file claims: at most 20 times its size and 64 MB. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { closeSync, ftruncateSync, openSync, statSync, writeSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { constants, deflateRawSync } from 'node:zlib';
import { zipSync } from 'fflate';
import { unpackZstd } from '../../npm/archive/zstd.js';
import { openBags } from '../../npm/bag/open.js';
import { bytesInMemory } from '../../npm/archive/open.js';
import { unpackWhole } from '../../npm/archive/packed.js';
import { bagFile, db3Bytes, openOne } from './bag_files.mjs';
import { odometry, stampAt } from './bag_messages.mjs';
import { pack, record } from './bag_writer.mjs';
import { ROOT, temporaryFolder, writeFiles } from './support.mjs';

const CLI = join(ROOT, 'npm', 'cli.js');
/** Prints the most memory that was in use (kB). */
const METER = `data:text/javascript,import { writeSync } from 'node:fs';
process.on('exit', () => {
  const { maxRSS, userCPUTime } = process.resourceUsage();
  writeSync(2, 'peak ' + maxRSS + ' kB, ' + userCPUTime + ' us\\n');
});`;

/** Runs the command line; its most memory (bytes), and its processor's seconds. @param {string[]} args */
function measured(args) {
  const run = spawnSync(process.execPath, ['--import', METER, CLI, ...args], {
    encoding: 'utf8',
    timeout: 120_000,
    killSignal: 'SIGKILL',
  });
  const [, kilobytes, microseconds] = run.stderr.match(/peak (\d+) kB, (\d+) us/) ?? [];
  return { ...run, peak: 1024 * Number(kilobytes), seconds: 1e-6 * Number(microseconds) };
}

/** Of the program itself. */
const IDLE = measured(['settings']).peak;

/** @param {string} path @param {ReturnType<typeof measured>} run */
function assertModest(path, { peak, seconds, stderr }) {
  const most = IDLE + 20 * statSync(path).size + 2 ** 26;
  assert.ok(
    peak <= most,
    `${(peak / 2 ** 20).toFixed(0)} MB in use, at most ${(most / 2 ** 20).toFixed(0)}: ${stderr}`,
  );
  assert.ok(seconds < 20, `${seconds} s of the processor`);
}

/** A frame of Zstandard: so many runs of 128 kB, under a header that claims a size. @param {number} runs @param {number} claimed */
function zstdOfRuns(runs, claimed) {
  const block = (/** @type {number} */ i) => pack([3, ((2 ** 17) << 3) | (1 << 1) | Number(i === runs - 1)], [1, 0x80]);
  return pack([4, 0xfd2fb528], [1, 0b10100000], [4, claimed], ...Array.from({ length: runs }, (_, i) => block(i)));
}

/** A bag with chunks that unpack to these. @param {number} count @param {Uint8Array} packed @param {number} claimed */
function bagOfChunks(count, packed, claimed) {
  const content = pack([8, 0], [8, 0], [8, claimed], [4, 0], 'zstd', [8, packed.length], packed);
  const magic = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);
  return pack(magic, record(1, pack('ros2', 'tests')), ...Array.from({ length: count }, () => record(6, content)));
}

test('twenty chunks of Zstandard that claim a gigabyte each', (t) => {
  const folder = temporaryFolder(t);
  const cases = /** @type {[name: string, bag: Uint8Array, told: RegExp][]} */ ([
    [
      'lies.mcap',
      bagOfChunks(20, zstdOfRuns(60, 2 ** 30), 2 ** 30),
      /left out: The chunk at byte 34 cannot be unpacked \(no more than 7864320 bytes can come of it, not 1073741824\)\.$/m,
    ],
    [
      'many_lies.mcap',
      bagOfChunks(300, zstdOfRuns(1, 2 ** 30), 2 ** 30),
      /left out: The chunk at byte 34 cannot be unpacked \(no more than 131072 bytes can come of it, not 1073741824\)\.$/m,
    ],
    [
      'honest.mcap',
      bagOfChunks(20, zstdOfRuns(2 ** 13, 2 ** 30), 2 ** 30),
      /left out: The chunk at byte 34 cannot be unpacked \(\d+ bytes claim to unpack to 1073741824, and at most \d+ are accepted/,
    ],
    [
      'dense.mcap',
      bagOfChunks(400, zstdOfRuns(2 ** 6, 2 ** 23), 2 ** 23),
      /left out: Its chunks unpack to more than \d+ bytes, too much for its size\.$/m,
    ],
  ]);
  for (const [name, bag, told] of cases) {
    const [path = ''] = writeFiles(folder, { [name]: bag });
    const run = measured(['topics', path]);
    assert.match(run.stderr, told);
    assertModest(path, run);
  }
});

test('what a frame of Zstandard claims is compared with its blocks', async () => {
  await assert.rejects(unpackZstd(zstdOfRuns(2, 2 ** 30), 2 ** 30), /no more than 262144 bytes can come of it/);
  assert.equal((await unpackZstd(zstdOfRuns(2, 2 ** 18), 2 ** 18)).length, 2 ** 18);
  assert.equal((await unpackZstd(zstdOfRuns(2, 2 ** 18), null)).length, 2 ** 18);
  const two = Buffer.concat([zstdOfRuns(1, 2 ** 17), zstdOfRuns(2, 2 ** 18)]);
  assert.equal((await unpackZstd(two, 3 * 2 ** 17)).length, 3 * 2 ** 17, 'frames one after the other');
  for (let end = 1; end < 17; end += 1) {
    await assert.rejects(unpackZstd(zstdOfRuns(2, 9).subarray(0, end), null), { name: 'RangeError' });
  }
});

test('a whole file of Zstandard has the limits of archives: 64 MB of however few bytes', async () => {
  const open = (/** @type {number} */ runs) => unpackWhole('a.zst', bytesInMemory(zstdOfRuns(runs, runs * 2 ** 17)));
  assert.equal((await open(100)).bytes.length, 100 * 2 ** 17);
  await assert.rejects(open(520), /It unpacks to more than 6\d MB/);
});

test('a chunk of a gigabyte that is not packed is read in pieces', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'large.mcap');
  const file = openSync(path, 'w');
  const [count, dataBytes] = [1024, 2 ** 20];
  const each = 9 + 22 + dataBytes;
  let place = 0;
  const put = (/** @type {Uint8Array} */ bytes) => {
    writeSync(file, bytes, 0, bytes.length, place);
    place += bytes.length;
  };
  put(Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a));
  put(record(1, pack('ros2', 'tests')));
  put(record(3, pack([2, 1], 'sensor_msgs/msg/Image', 'ros2msg', [4, 0])));
  put(record(4, pack([2, 0], [2, 1], '/depth', 'cdr', [4, 0])));
  const head = pack([8, 0], [8, 0], [8, count * each], [4, 0], '', [8, count * each]);
  put(pack([1, 6], [8, head.length + count * each]));
  put(head);
  // The contents are holes of the file.
  for (let i = 0; i < count; i += 1) {
    put(pack([1, 5], [8, 22 + dataBytes], [2, 0], [4, i], [8, i], [8, i]));
    place += dataBytes;
  }
  put(pack([1, 0x0f], [8, 4], [4, 0]));
  ftruncateSync(file, place);
  closeSync(file);
  const run = measured(['topics', path]);
  assert.match(run.stdout, /\/depth +sensor_msgs\/msg\/Image +1024/);
  // The window of 64 kB is read anew for each of the messages: 64 MB, of which more or less is freed by then. The chunk is 1 GB.
  assert.ok(run.peak < IDLE + 2 ** 27, `${run.peak - IDLE} bytes`);
});

/** A ZIP archive of one file of 256 MB of zeros, packed a megabyte at a time. @param {string} name */
function zipOfZeros(name) {
  const [megabyte, count] = [2 ** 20, 256];
  const piece = deflateRawSync(new Uint8Array(megabyte), { finishFlush: constants.Z_SYNC_FLUSH });
  const end = Uint8Array.of(3, 0);
  const zip = Buffer.from(zipSync({ [name]: [Buffer.concat([...Array(count).fill(piece), end]), { level: 0 }] }));
  // It was stored as it is; now it is said to be deflated, in the file's own header and in the directory.
  const record = zip.lastIndexOf('PK\x01\x02', undefined, 'latin1');
  for (const header of [
    { method: 8, size: 22 },
    { method: record + 10, size: record + 24 },
  ]) {
    zip.writeUInt16LE(8, header.method);
    zip.writeUInt32LE(count * megabyte, header.size);
  }
  return zip;
}

test('an archive of zeros that is named as a cloud', (t) => {
  const folder = temporaryFolder(t);
  const [path = ''] = writeFiles(folder, { 'zeros.zip': zipOfZeros('0.ply') });
  const run = measured(['reconstruct', path, '--out', join(folder, 'out')]);
  assert.match(
    run.stderr,
    /0\.ply: not used: it would unpack from 1 MB to 256 MB, and at most \d+ MB are accepted of so little/,
  );
  assert.equal(run.status, 1);
  assertModest(path, run);
});

test('a bag cannot name more messages than its size allows', async () => {
  const topic = pack(
    record(3, pack([2, 1], 'a/msg/B', 'ros2msg', [4, 0])),
    record(4, pack([2, 0], [2, 1], '/a', 'cdr', [4, 0])),
  );
  const entries = new Uint8Array(16 * 2 ** 12);
  const index = record(7, pack([2, 0], [4, entries.length], entries));
  const magic = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);
  const body = pack(magic, record(1, pack('ros2', 'tests')), topic);
  // All chunk indexes point at the same message index.
  const chunkIndex = record(8, pack([8, 0], [8, 0], [8, 0], [8, 0], [4, 10], [2, 0], [8, body.length], [8, index.length], '', [8, 0], [8, 0])); // prettier-ignore
  const summary = pack(topic, ...Array.from({ length: 2000 }, () => chunkIndex));
  const start = body.length + index.length;
  const bytes = pack(body, index, summary, record(2, pack([8, start], [8, 0], [4, 0])), magic);
  const { bag, notes } = await openOne('a.mcap', bytes);
  assert.match(notes.map(({ reason }) => reason).join(), /its indexes are damaged/);
  assert.equal(bag?.topics[0]?.count ?? 0, 0);
});

test('a page of SQLite that claims more children than it has room for', async () => {
  const [TABLE_LEAF, TABLE_INTERIOR] = [0x0d, 0x05];
  const topics = [{ name: '/odom', type: 'nav_msgs/msg/Odometry' }];
  const messages = Array.from({ length: 50 }, (_, at) => ({
    ...{ topic: '/odom', time: BigInt(at) },
    data: odometry(stampAt(at), 'odom', 'base', [at, 0, 0, 0, 0, 0, 1]),
  }));
  const bag = db3Bytes(topics, messages);
  const pageSize = new DataView(bag.buffer, bag.byteOffset).getUint16(16);
  let numTold = 0;
  for (let page = pageSize; page < bag.length; page += pageSize) {
    if (bag[page] !== TABLE_LEAF && bag[page] !== TABLE_INTERIOR) continue;
    const damaged = Uint8Array.from(bag);
    damaged[page] = TABLE_INTERIOR;
    damaged.fill(0xff, page + 3, page + 5);
    const before = process.cpuUsage();
    const { bags } = await openBags([bagFile('claims.db3', damaged)]);
    const told = bags.flatMap(({ notes }) => notes.map(({ reason }) => reason)).join();
    assert.match(told, /cut off: messages that lay behind its end are left out \(20\d\d pages, the first is \d+\)/);
    numTold += 1;
    assert.ok(process.cpuUsage(before).user < 5e6, 'in 5 s of the processor');
  }
  assert.ok(numTold > 2);
});
