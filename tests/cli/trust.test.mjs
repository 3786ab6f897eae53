// @ts-check
/** Names cannot hurt, nothing is dropped in silence, and only regular files are read. */
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { chmodSync, existsSync, mkdirSync, symlinkSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { append } from '../../npm/base/append.js';
import { table } from '../../npm/cli/command.js';
import { openInputs } from '../../npm/cli/inputs.js';
import { zipSync } from 'fflate';
import { convertFiles } from '../../npm/formats/convert.js';
import { lookUp } from '../../npm/base/look_up.js';
import { NAME_LENGTH, printable } from '../../npm/base/printable.js';
import { asciiPly, readReport, ROOM_FILES, ROOT, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

test('foreign text can neither begin a line, nor move the cursor, nor turn the writing', () => {
  const forged = 'a\nnote: all is well\r\x1b[2J\x1b]0;title\x07\u009b\u202egnp.exe\u2028\ud800';
  assert.equal(
    printable(forged),
    'a\\u000anote: all is well\\u000d\\u001b[2J\\u001b]0;title\\u0007\\u009b\\u202egnp.exe\\u2028\\ud800',
  );
  assert.equal(printable('Zimmer ü, 部屋 \u{1f600}.ply'), 'Zimmer ü, 部屋 \u{1f600}.ply');
  const start = process.cpuUsage();
  assert.ok(printable(`${'\x1b'.repeat(1e7)}.ply`).length <= 6 * NAME_LENGTH + 5);
  assert.match(printable(`first${'x'.repeat(1e7)}last`), /^firstx+ \.\.\. x+last$/);
  // Linear in the length, it takes hundredths of a second; other work on the machine counts for nothing.
  assert.ok(process.cpuUsage(start).user < 1e6);
});

test('names that every object has are in no table', () => {
  const table = { known: 1 };
  assert.equal(lookUp(table, 'known'), 1);
  for (const name of ['constructor', '__proto__', 'toString', '']) assert.equal(lookUp(table, name), undefined);
});

test('a file whose name holds escapes and line ends has one line, and no escape reaches the terminal', async (t) => {
  const folder = temporaryFolder(t);
  const name = 'b\x1b[2J\x1b]0;owned\x07ad\nnote: all is well.ply';
  writeFiles(folder, { ...ROOM_FILES, [name]: 'no PLY', 'odd\x1b[31m.ply': ROOM_FILES['0.ply'] ?? '' });
  const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', join(folder, 'out')]);
  assert.equal(status, 2);
  assert.doesNotMatch(stdout + stderr, /[^\n\P{Cc}]/u);
  assert.match(stderr, /^b\\u001b\[2J.*\\u000anote: all is well\.ply, /);
  assert.equal(stderr.trim().split('\n').length, 1, stderr);
  assert.match(stdout, /^odd\\u001b\[31m\.ply /m);
});

test('an option whose value is a name that every object has is refused before anything is computed', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  for (const name of ['constructor', '__proto__', 'toString']) {
    const out = join(folder, 'out');
    for (const [args, message] of /** @type {[string[], RegExp][]} */ ([
      [['--map-format', name], /--map-format \w+: it is one of ply/],
      [['--preset', name], /There is no preset/],
      [['--set', `${name}=1`], /there is no setting/],
      [['--topic', `${name}=/a`], /--topic/],
    ])) {
      const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', out, ...args]);
      assert.match(stderr, message);
      assert.doesNotMatch(stderr, /defect/);
      assert.equal(status, 1);
    }
    assert.ok(!existsSync(out));
  }
});

const hasPipes = process.platform !== 'win32';
/** Who reads from a pipe that nobody writes into waits without end (ms). */
const PIPE_DEADLINE_MS = 60_000;

test('pipes and devices are reported and not used', { skip: !hasPipes && 'no pipes' }, (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  const pipe = join(folder, 'pipe.ply');
  execFileSync('mkfifo', [pipe]);
  const out = join(folder, 'out');
  const reconstruct = ['reconstruct', folder, '--out', out];
  const named = [
    [pipe],
    ['--reference', pipe],
    ['--reference', '/dev/zero'],
    ['--odometry', '/dev/zero'],
    ['/dev/zero'],
  ];
  const others = [['evaluate', '/dev/zero', pipe], ['convert', '/dev/zero', join(folder, 'a.tum')]]; // prettier-ignore
  const runs = [reconstruct, ...named.map((args) => [...reconstruct, ...args]), ...others];
  // In one process of their own, which is ended when it waits.
  const script = `
    import { scanstitch } from ${JSON.stringify(join(import.meta.dirname, 'support.mjs'))};
    for (const args of ${JSON.stringify(runs)}) console.log(JSON.stringify(await scanstitch(args)));`;
  const options = /** @type {const} */ ({ encoding: 'utf8', timeout: PIPE_DEADLINE_MS, killSignal: 'SIGKILL' });
  const child = spawnSync(process.execPath, ['--input-type=module', '-e', script], options);
  assert.equal(child.status, 0, child.stderr);
  /** @type {{ status: number, stderr: string }[]} */
  const [inFolder, ...told] = child.stdout
    .trim()
    .split('\n')
    .map((line) => JSON.parse(line));
  assert.match(inFolder?.stderr ?? '', /pipe\.ply: not used: a pipe or a device, not a file\.$/m);
  assert.equal(inFolder?.status, 0);
  assert.equal(told.length, runs.length - 1);
  for (const [index, { status, stderr }] of told.entries()) {
    assert.match(stderr, /: A pipe or a device, not a file; save it as a file first\.$/m, runs[index + 1]?.join(' '));
    assert.equal(status, index < named.length ? 2 : 1);
  }
});

test('links that lead to themselves and a folder that may not be read: named, and the rest is used', (t) => {
  // Root may read everything.
  const user = process.getuid?.() === 0 ? { uid: 65534, gid: 65534 } : {};
  const run = (/** @type {string[]} */ ...args) =>
    spawnSync(process.execPath, [join(ROOT, 'npm', 'cli.js'), ...args], { encoding: 'utf8', ...user });
  if (run('--version').status !== 0 && 'uid' in user) {
    t.skip('this folder may be read by root alone');
    return;
  }
  const folder = temporaryFolder(t);
  chmodSync(folder, 0o755);
  const scans = join(folder, 'scans');
  mkdirSync(scans);
  writeFiles(scans, ROOM_FILES);
  symlinkSync('self.ply', join(scans, 'self.ply'));
  symlinkSync('nowhere.ply', join(scans, 'dangling.ply'));
  symlinkSync('.', join(scans, 'again'));
  mkdirSync(join(scans, 'locked'), { mode: 0 });
  const out = join(folder, 'out');
  mkdirSync(out);
  chmodSync(out, 0o777);
  const { status, stderr, stdout } = run('reconstruct', scans, '--out', out);
  chmodSync(join(scans, 'locked'), 0o755);
  assert.match(stderr, /self\.ply: This is a link that leads to itself\.$/m);
  assert.match(stderr, /dangling\.ply: There is no such file or folder\.$/m);
  assert.match(stderr, /^note: scans\/again: not used: a link to a folder that has been looked through\.$/m);
  assert.match(stderr, /locked: The file may not be read or written: permission denied\.$/m);
  assert.match(stdout, /^3 scans in /m);
  assert.equal(status, 2);
});

test('what is named and not used is complained of', async (t) => {
  const folder = temporaryFolder(t);
  const paths = writeFiles(folder, { ...ROOM_FILES, 'junk.pdf': 'x', 'broken.tum': '0 0 0 zero\n', 'more.xyz': 'x' });
  const out = join(folder, 'out');
  const run = (/** @type {string[]} */ ...args) => scanstitch(['reconstruct', ...args, '--out', out]);
  const named = await run(...paths);
  assert.equal(named.status, 2);
  assert.match(named.stderr, /^junk\.pdf: not used: not a PLY scan/m);
  assert.match(named.stderr, /^broken\.tum, line 1: /m);
  assert.match(named.stderr, /^more\.xyz: not used: /m);
  const options = await run(...paths.slice(0, 3), '--intrinsics', 'nope');
  assert.equal(options.status, 2);
  assert.match(options.stderr, /^--intrinsics nope: not used, for planar scans have no camera\.$/m);
});

test('of many files of which the same is to be said, the first are named', async (t) => {
  const folder = temporaryFolder(t);
  const junk = Array.from({ length: 25 }, (_, i) => [`${String.fromCharCode(97 + i)}.dat`, 'x']);
  writeFiles(folder, { ...ROOM_FILES, ...Object.fromEntries(junk) });
  const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', join(folder, 'out')]);
  assert.equal(status, 0);
  assert.match(stderr, /^note: \S+\/a\.dat, \S+\/b\.dat, \S+\/c\.dat and 22 others: not used: .+\n$/);
});

test('one locked file costs the archive nothing else', async (t) => {
  const folder = temporaryFolder(t);
  const bytes = (/** @type {string} */ text) => new TextEncoder().encode(text);
  const files = { ...ROOM_FILES, 'secret.ply': ROOM_FILES['0.ply'] ?? '' };
  const zip = zipSync(Object.fromEntries(Object.entries(files).map(([name, text]) => [name, bytes(text)])));
  const record = Buffer.from(zip).lastIndexOf('PK\x01\x02', undefined, 'latin1');
  zip[record + 8] = (zip[record + 8] ?? 0) | 1;
  const [path = ''] = writeFiles(folder, { 'scans.zip': zip });
  const { status, stdout, stderr } = await scanstitch(['reconstruct', path, '--out', join(folder, 'out')]);
  assert.equal(stderr, 'secret.ply: not used: protected by a password; unpack the archive with it.\n');
  assert.match(stdout, /^3 scans in /m);
  assert.equal(status, 2);
});

test('all planar scans lost: exit code 1, and nothing is written', async (t) => {
  const folder = temporaryFolder(t);
  const few = [0, 1, 2].map((i) => asciiPly([[1, 2, 0], [1.1, 2 + i, 0]])); // prettier-ignore
  writeFiles(folder, Object.fromEntries(few.map((scan, index) => [`${index}.ply`, scan])));
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  assert.match(stderr, /^scanstitch: No scan could be placed, so nothing was written\.$/m);
  assert.equal(status, 1);
  assert.ok(!existsSync(out));
});

test('a reference beside planar scans is compared with, as it is in space', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { ...ROOM_FILES, 'truth.tum': '0 0 0 0 0 0 0 1\n1 0.3 0.5 0 0 0 0 1\n2 0.5 1 0 0 0 0 1\n' });
  const out = join(folder, 'out');
  assert.equal((await scanstitch(['reconstruct', folder, '--out', out])).status, 0);
  assert.equal(readReport(out).comparison.num_matched, 3);
});

test('what stands in the place of a file without Git LFS is told, whatever its name', async (t) => {
  const folder = temporaryFolder(t);
  const pointer = 'version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n';
  for (const name of ['0.png', 'walk.mcap', 'scans.zip']) {
    const [path = ''] = writeFiles(folder, { [name]: pointer });
    const { status, stderr } = await scanstitch(['reconstruct', path, '--out', join(folder, 'out')]);
    assert.match(stderr, /Git LFS pointer.*git lfs pull/s, name);
    assert.equal(status, 1);
  }
});

test('planar scans on a map, in millimetres, or a hair off the plane', async (t) => {
  const folder = temporaryFolder(t);
  const changed = (/** @type {(x: number, y: number) => number[]} */ change) =>
    Object.fromEntries(
      Object.entries(ROOM_FILES).map(([name, text]) => {
        const rows = (text.split('end_header\n')[1] ?? '').trim().split('\n');
        return [
          name,
          asciiPly(rows.map((row) => change(.../** @type {[number, number]} */ (row.split(' ').map(Number))))),
        ];
      }),
    );
  const run = async (/** @type {Record<string, string>} */ files) => {
    writeFiles(folder, files);
    return scanstitch(['reconstruct', folder, '--out', join(folder, 'out')]);
  };
  for (const far of [20_000, 1e5, 1e6]) {
    const map = await run(changed((x, y) => [x + far, y + far, 0]));
    assert.match(map.stderr, /^0\.ply: The coordinates are those of a map.*Give clouds in the frame of the sensor/m);
    assert.equal(map.status, 1);
  }
  const millimetres = await run(changed((x, y) => [1000 * x, 1000 * y, 0]));
  assert.match(millimetres.stderr, /^0\.ply: Half of its points lie over 1000 m away, as in millimetres.*Give metres/m);
  assert.equal(millimetres.status, 1);
  const turned = await run(changed((x, y) => [x, y, 1e-9 * x]));
  assert.equal(turned.stderr, '');
  assert.match(turned.stdout, /^3 scans in /m);
});

test('a file that is gone when it is read costs the others nothing', async () => {
  const gone = async () => {
    throw Object.assign(new Error('no such file'), { code: 'ENOENT' });
  };
  const there = async () => new Uint8Array([1, 2, 3]);
  /** @type {import('../../npm/files/content.js').Content[]} */
  const all = [
    { path: 'a.bin', size: 64, read: gone, readHead: gone },
    { path: 'b.png', size: 3, read: there, readHead: there },
  ];
  const { files, notes } = await convertFiles(all, (content) => content);
  assert.deepEqual(
    files.map(({ path }) => path),
    ['b.png'],
  );
  assert.deepEqual(
    notes.map(({ file, reason, is_loss }) => [file, reason, is_loss]),
    [['a.bin', 'not used: no such file', true]],
  );
});

test('lists of any length are put together, and tables of any length laid out', () => {
  /** @type {number[]} */
  const list = [7];
  append(list, new Uint8Array(300_000));
  assert.equal(list.length, 300_001);
  const rows = Array.from({ length: 300_000 }, (_, at) => [String(at)]);
  assert.match(table(['scan'], rows, new Set()), /\n299999\n$/);
});

test('a folder with more files than a recording has, as the root of a disk, is refused at once', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, Object.fromEntries(Array.from({ length: 6 }, (_, at) => [`${at}.txt`, ''])));
  const refused = openInputs([folder], () => undefined, {}, 5);
  await assert.rejects(refused, /There are more than 5 files in this folder\. Name the folder of one recording\./);
  const { recording, close } = await openInputs([folder], () => undefined, {}, 6);
  assert.equal(recording.files.size, 6);
  await close();
});
