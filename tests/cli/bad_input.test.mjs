// @ts-check
/** Bad input: one line that names the file and the place, and nothing else is lost. */
import assert from 'node:assert/strict';
import { existsSync, mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import {
  asciiPly,
  HALL,
  ROOM_FILES,
  ROOM_POSES,
  readReport,
  roomScan,
  scanstitch,
  temporaryFolder,
  writeFiles,
} from './support.mjs';

const GOOD = ROOM_FILES['0.ply'] ?? '';

/** What each bad file is, and what the line about it must say. */
const BAD_FILES = /** @type {Record<string, [string | Uint8Array, RegExp]>} */ ({
  'cut off': [GOOD.slice(0, GOOD.length / 2), /^bad\.ply, line \d+: .*180/],
  'cut off, binary': [binaryPly(100).subarray(0, 700), /^bad\.ply, byte \d+: .*100/],
  'claims 4 billion points': [asciiPly([[1, 2, 0]], 4_000_000_000), /^bad\.ply.*4000000000/],
  'text named .ply': ['Dear professor,\nplease find my homework attached.\n', /^bad\.ply, (line 1|byte 0): /],
  'no finite coordinate': [asciiPly(Array(20).fill([Number.NaN, 1, 0])), /^bad\.ply: .*20 .*finite/],
  'no points': [asciiPly([]), /^bad\.ply: .*no points/],
  'a cloud in space': [
    asciiPly([
      [1, 2, 0],
      [1, 2, 0.5],
      [3, 4, 1],
    ]),
    /^bad\.ply: .*0\.5/,
  ],
  'no bytes': ['', /^bad\.ply: /],
});

const PNG_SIGNATURE = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
const PNG_HEADER = Buffer.concat([PNG_SIGNATURE, Buffer.from([0, 0, 0, 13]), Buffer.from('IHDR'), Buffer.alloc(8, 1)]);

/** What each broken image is, and what the line about it must say. */
const BROKEN_IMAGES = /** @type {Record<string, [name: string, contents: string | Uint8Array, message: RegExp]>} */ ({
  'a PNG cut off in its header': [
    'depth.png',
    PNG_HEADER.subarray(0, 20),
    /^depth\.png: .*PNG cannot be read.* byte 20/,
  ],
  'a PNG of an unknown kind': [
    'depth.png',
    Buffer.concat([PNG_HEADER, Buffer.from([16, 9])]),
    /^depth\.png: .*PNG cannot be read.* byte 25 .*colour type 9/,
  ],
  'a text named .png': ['depth.png', 'Dear all', /^depth\.png: .*PNG cannot be read.* byte 0 .*"Dear all"/],
  'an empty PNG': ['depth.png', '', /^depth\.png: .*PNG cannot be read.* empty/],
  'a text named .jpg': ['photo.jpg', 'Dear all', /^photo\.jpg: .*JPEG cannot be read.* byte 0/],
});

for (const [what, [name, contents, message]] of Object.entries(BROKEN_IMAGES)) {
  test(`${what}, alone: named with what to do`, async (t) => {
    const folder = temporaryFolder(t);
    writeFiles(folder, { [name]: contents });
    const { status, stderr } = await scanstitch(['reconstruct', join(folder, name), '--out', join(folder, 'out')]);
    assert.equal(status, 1);
    assert.match(stderr, message);
    assert.match(stderr, /copy or export it again/);
    assert.ok(!existsSync(join(folder, 'out')));
  });
}

/** 24 bytes a point. @param {number} count */
function binaryPly(count) {
  const text = asciiPly([], count).replace('ascii', 'binary_little_endian');
  return Buffer.concat([Buffer.from(text), Buffer.alloc(24 * count)]);
}

for (const [what, [contents, message]] of Object.entries(BAD_FILES)) {
  test(`${what}: named on stderr, the good files are reconstructed`, async (t) => {
    const folder = temporaryFolder(t);
    writeFiles(folder, { ...ROOM_FILES, 'bad.ply': contents });
    const out = join(folder, 'out');
    const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
    assert.match(stderr, message);
    assert.equal(stderr.trim().split('\n').length, 1, `one line: ${stderr}`);
    assert.equal(status, 2);
    assert.match(stdout, /^3 scans in /m);
    assert.equal(readReport(out).frames.length, 3);
  });

  test(`${what}, alone: nothing is written`, async (t) => {
    const folder = temporaryFolder(t);
    const [path = ''] = writeFiles(folder, { 'bad.ply': contents });
    const out = join(folder, 'out');
    const { status, stdout, stderr } = await scanstitch(['reconstruct', path, '--out', out]);
    // Alone, a cloud in space is one.
    assert.match(stderr, what === 'a cloud in space' ? /^bad\.ply: .*too few to register it/ : message);
    assert.match(stderr, /^scanstitch: No (scan could be used|frame could be placed)/m);
    assert.equal(stdout, '');
    assert.equal(status, 1);
    assert.ok(!existsSync(out));
  });
}

test('some NaN coordinates: the rest of the scan is used, and the number is told', async (t) => {
  const folder = temporaryFolder(t);
  const holes = GOOD.split('\n').map((line, index) => ([30, 31, 90].includes(index) ? 'nan nan 0' : line));
  writeFiles(folder, { ...ROOM_FILES, '0.ply': holes.join('\n') });
  const out = join(folder, 'out');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  assert.match(stderr, /^note: 0\.ply: 3 of its 180 points have coordinates that are not finite/);
  assert.match(stdout, /^537 of 540 points used; dropped: 3 not finite$/m);
  assert.equal(readReport(out).frames[0].cleaning.non_finite, 3);
  assert.equal(status, 0);
});

test('a single scan makes a map, and that there is no motion is told', async (t) => {
  const folder = temporaryFolder(t);
  const [path = ''] = writeFiles(folder, { 'lonely.ply': GOOD });
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['reconstruct', path, '--out', out]);
  assert.match(stderr, /^note: .*lonely\.ply/);
  assert.equal(readReport(out).frames.length, 1);
  assert.equal(status, 0);
});

test('two scans without overlap: the one that cannot be placed is named', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { '0room.ply': GOOD, '1hall.ply': roomScan([0, 0, 0], HALL) });
  const out = join(folder, 'out');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  assert.match(stderr, /^1hall\.ply: This scan could not be placed: .{20,}\.$/m);
  assert.match(stdout, /^1hall\.ply .* lost$/m);
  assert.equal(readReport(out).frames[1].status, 'lost');
  assert.equal(status, 2);
});

test('a file that is missing, and a folder without scans', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  mkdirSync(join(folder, 'empty'));
  const [missing, empty] = [join(folder, 'missing.ply'), join(folder, 'empty')];
  const { status, stderr } = await scanstitch(['reconstruct', missing, empty, folder, '--out', join(folder, 'out')]);
  assert.deepEqual(stderr.trim().split('\n'), [
    `${missing}: There is no such file or folder.`,
    `${empty}: There is no file in this folder.`,
  ]);
  assert.equal(status, 2);
});

test('a reference that is none: told, and the scans are reconstructed', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { ...ROOM_FILES, 'truth.tum': '0 0 0 0 0 0 0 1\n1 0.3 zero 0 0 0 0 1\n' });
  for (const [reference, message] of /** @type {const} */ ([
    ['truth.tum', /^truth\.tum, line 2: .*zero/],
    ['absent.tum', /^absent\.tum: There is no such file/],
  ])) {
    const out = join(folder, reference, '..', 'out');
    const args = ['reconstruct', folder, '--reference', join(folder, reference), '--out', out];
    const { status, stderr } = await scanstitch(args);
    assert.match(stderr, message);
    assert.equal(status, 2);
    assert.equal(readReport(out).comparison, null);
  }
});

test('results that cannot be written: one line', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { ...ROOM_FILES, occupied: 'a file' });
  const out = join(folder, 'occupied');
  const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  const [note, told] = stderr.split(/(?<=\n)/);
  assert.match(note ?? '', /^note: .*occupied: not used/);
  assert.equal(
    told,
    `scanstitch: ${out}: The results could not be written. There is a file where a folder should be.\n`,
  );
  assert.equal(status, 1);
});

test('wrong commands: one line each, exit code 1', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { '0.ply': roomScan(ROOM_POSES[0]) });
  const cases = /** @type {[string[], RegExp][]} */ ([
    [
      [],
      /No command was given\. There are: reconstruct, edit, localize, export, evaluate, convert, map-quality, consistency, strategies, live, optimize, bev, icp, topics, settings/,
    ],
    [['reconstrukt'], /There is no command "reconstrukt"/],
    [['reconstruct'], /No input was given/],
    [['reconstruct', ''], /An argument is empty\. See: scanstitch reconstruct --help/],
    [['reconstruct', folder, '--out', ''], /--out: the value is empty/],
    [['reconstruct', folder, '--outt', 'x'], /--outt.*See: scanstitch reconstruct --help/],
    [['reconstruct', folder, '--preset', 'best'], /There is no preset "best" for planar scans\. There are: sharpest/],
    [['reconstruct', folder, '--set', 'max_range'], /--set max_range: write it as name=value/],
    [['reconstruct', folder, '--set', 'maxrange=3'], /there is no setting maxrange for planar scans/],
    [['reconstruct', folder, '--set', 'max_range=far'], /max_range is a number in m/],
    [['reconstruct', folder, '--set', 'max_range=1e9'], /max_range = 1000000000 .*1000/],
    [['reconstruct', folder, '--set', 'max_iterations=2.5'], /max_iterations is a whole number/],
    [['reconstruct', folder, '--set', 'metric=euclid'], /metric is one of point_to_line, point_to_point/],
    [['settings', 'extra'], /extra/],
  ]);
  for (const [args, message] of cases) {
    const { status, stdout, stderr } = await scanstitch(args, folder);
    assert.match(stderr, /^scanstitch: .+\n$/);
    assert.equal(stderr.trim().split('\n').length, 1, stderr);
    assert.match(stderr, message);
    assert.equal(stdout, '');
    assert.equal(status, 1);
  }
  assert.ok(!existsSync(join(folder, 'scanstitch-out')));
});
