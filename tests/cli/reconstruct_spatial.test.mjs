// @ts-check
/** `scanstitch reconstruct` on depth images and clouds: a made-up room, recorded ones, and all that can be wrong. */
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { zipSync } from 'fflate';
import { colourPng, greyPng, see, SIZE, truthOf, WALK, walkFiles } from './depth_room.mjs';
import { untilInterrupt } from '../../npm/cli/command.js';
import { nothingComputed } from '../../npm/cli/reconstruct_spatial.js';
import { asciiPly, DATA, ROOT, readReport, scanstitch, skipWithoutData as skip, temporaryFolder } from './support.mjs';

const FILES = walkFiles();
/** The camera that took them. */
const CAMERA = { fx: 96, fy: 96, ppx: 96, ppy: 96, width: 192, height: 192, depth_scale: 0.001 };
/** What is assumed without it is said in every run, and tested in depth_reading.test.mjs. @param {string} line */
const isAssumption = (line) => line.startsWith('note: No file says ');

/** Writes files, and the folders they lie in. @param {string} folder @param {Record<string, Uint8Array | string>} files */
function writeTree(folder, files) {
  for (const [path, contents] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), contents);
  }
  return folder;
}

/**
 * Runs it on these files.
 * @param {import('node:test').TestContext} t
 * @param {Record<string, Uint8Array | string>} files
 * @param {string[]} options
 */
async function reconstruct(t, files, options = []) {
  const folder = temporaryFolder(t);
  const out = join(folder, 'result');
  const input = writeTree(join(folder, 'walk'), files);
  const run = await scanstitch(['reconstruct', input, '--out', out, '--workers', '0', ...options]);
  return {
    ...run,
    input,
    out,
    notes: run.stderr
      .trim()
      .split('\n')
      .filter((line) => line !== '' && !isAssumption(line)),
  };
}

/** @param {string} out */
function outputs(out) {
  return ['trajectory.tum', 'map.ply'].map((name) => readFileSync(join(out, name)));
}

/** @param {string} folder @returns {import('../../npm/index.js').SpatialResult} */
function resultIn(folder) {
  return readReport(folder);
}

test('a room: every output is written, well formed, and right', async (t) => {
  const files = { ...FILES, 'camera.json': JSON.stringify(CAMERA) };
  const { status, stdout, stderr, out } = await reconstruct(t, files, ['--workers', '2']);
  assert.equal(stderr, '');
  assert.equal(status, 0);
  const { frames, comparison, camera } = resultIn(out);
  assert.deepEqual(
    frames.map(({ name, status }) => [name, status]),
    WALK.map((_, i) => [`depth/${i + 1}.png`, 'good']),
  );
  assert.ok(comparison && comparison.name === 'groundtruth.txt' && comparison.num_matched === WALK.length);
  assert.ok(comparison.max < 0.01, `${comparison.max} m from the truth`);
  assert.ok(camera?.width === SIZE && Math.abs(camera.fx - SIZE / 2) < 1e-9);

  const lines = readFileSync(join(out, 'trajectory.tum'), 'utf8').trim().split('\n');
  const numbers = lines.filter((line) => !line.startsWith('#')).map((line) => line.split(' ').map(Number));
  assert.equal(numbers.length, WALK.length);
  WALK.forEach(([x, y, z], index) => {
    const [, ...estimate] = numbers[index] ?? [];
    assert.ok(Math.hypot((estimate[0] ?? 9) - x, (estimate[1] ?? 9) - y, (estimate[2] ?? 9) - z) < 0.01, lines[index]);
  });
  const map = readFileSync(join(out, 'map.ply'));
  const header = map.subarray(0, map.indexOf('end_header\n')).toString();
  for (const property of ['x', 'nx', 'red']) assert.match(header, new RegExp(`^property \\w+ ${property}$`, 'm'));
  assert.ok(map.length > 27 * Number(header.match(/^element vertex (\d+)$/m)?.[1]), 'the map holds its points');

  assert.match(
    stdout,
    /^frame +x \(m\) +y \(m\) +z \(m\) +turn \(deg\) +inliers +rmse \(mm\) +ms +error \(mm\) +status$/m,
  );
  assert.match(stdout, /^depth\/6\.png +0\.1\d\d +0\.0\d\d +0\.3\d\d +12\.\d\d +\d+ +\d+\.\d +\d+\.\d +\d\.\d +good$/m);
  assert.match(
    stdout,
    /^6 of 6 frames in \d+ ms, \d+\.\d ms a frame with 2 workers \(read .*, prepare .*, register .*\)$/m,
  );
  assert.match(stdout, /^6 good, 0 doubtful, 0 lost$/m);
  assert.match(stdout, /^Camera: 192 x 192 pixels, fx 96, fy 96, cx 96, cy 96$/m);
  assert.match(stdout, /^Depth: 1000 raw values per metre, rounded$/m);
  assert.match(
    stdout,
    /^Map, stitched in \d+ ms; in voxels of 1 cm: \d+ points, \d\.\d MB; 2 cm: .*; 5 cm: .*; 10 cm: /m,
  );
  assert.match(
    stdout,
    /^Distance to groundtruth\.txt: mean 0\.00\d\d m, rmse .* over 6 of 6 frames, first poses aligned$/m,
  );
  assert.match(stdout, /^ {2}read as: .*camera/m);
});

test('the same bytes with any number of workers, from a folder and a ZIP, with and without the truth', async (t) => {
  const { input, out } = await reconstruct(t, FILES);
  const expected = outputs(out);
  const zip = join(dirname(input), 'walk.zip');
  writeFileSync(
    zip,
    zipSync(Object.fromEntries(Object.entries(FILES).map(([path, contents]) => [`a/${path}`, Buffer.from(contents)]))),
  );
  const { 'groundtruth.txt': truth, ...images } = FILES;
  const bare = writeTree(join(dirname(input), 'bare'), images);
  const ways = [
    [input, '--workers', '1'],
    [input, '--workers', '4'],
    [zip, '--workers', '2'],
    [zip, '--workers', '0'],
    [bare, '--workers', '2'],
  ];
  for (const [index, args] of ways.entries()) {
    const other = join(dirname(input), `result${index}`);
    const { status, stderr } = await scanstitch(['reconstruct', ...args, '--out', other]);
    assert.equal(status, 0, stderr);
    assert.deepEqual(outputs(other), expected, args.join(' '));
    assert.equal(resultIn(other).comparison === null, args[0] === bare);
  }
});

test('a reference that is named comes before the one that is found; a folder of poses is one', async (t) => {
  const shifted = WALK.map(([x, y, z, yaw], i) => /** @type {const} */ ([i === 5 ? x + 0.5 : x, y, z, yaw]));
  const { input, out } = await reconstruct(t, { ...FILES, 'other/shifted.tum': truthOf(shifted) });
  const before = outputs(out);
  const named = await scanstitch([
    'reconstruct',
    input,
    '--out',
    out,
    '--reference',
    join(input, 'other', 'shifted.tum'),
  ]);
  assert.match(named.stdout, /^Distance to shifted\.tum: .*max 0\.[45]/m);
  assert.deepEqual(outputs(out), before);

  const poses = WALK.map(([x, y, z, yaw]) => {
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    return `${c} 0 ${s} ${x}\n0 1 0 ${y}\n${-s} 0 ${c} ${z}\n0 0 0 1\n`;
  });
  const folder = writeTree(
    join(dirname(input), 'poses'),
    Object.fromEntries(poses.map((pose, i) => [`${i}.txt`, pose])),
  );
  const matrices = await scanstitch(['reconstruct', input, '--out', out, '--reference', folder]);
  assert.equal(matrices.status, 0, matrices.stderr);
  assert.match(matrices.stdout, /^Distance to poses: mean 0\.00/m);
});

test('settings, presets and the camera reach the engine', async (t) => {
  const camera = '48 0 96\n0 48 96\n0 0 1\n';
  const options = ['--preset', 'fast', '--set', 'map_voxel_size=0.1', '--set', 'max_range=2.5'];
  const { out, input, stdout } = await reconstruct(t, { ...FILES, 'intrinsics.txt': camera }, options);
  const { settings } = resultIn(out);
  assert.equal(settings.map_voxel_size, 0.1);
  assert.equal(settings.max_range, 2.5);
  assert.match(stdout, /^Camera: .* fx 48, fy 48, cx 96, cy 96$/m);
  writeFileSync(join(dirname(input), 'k.txt'), '96 96 96 96');
  const named = await scanstitch(['reconstruct', input, '--out', out, '--intrinsics', join(dirname(input), 'k.txt')]);
  assert.match(named.stdout, /^Camera: .* fx 96,/m);
});

test('wrong options are told in one line, and nothing is written', async (t) => {
  const folder = temporaryFolder(t);
  const input = writeTree(join(folder, 'walk'), FILES);
  const out = join(folder, 'out');
  for (const [options, message] of /** @type {[string[], RegExp][]} */ ([
    [
      ['--preset', 'sharpest'],
      /There is no preset "sharpest" for depth images and clouds\. There are: best, course, fast/,
    ],
    [['--set', 'metric=point_to_line'], /metric is one of point_to_plane, gicp/],
    [['--set', 'voxel_size=-1'], /voxel_size/],
    [['--workers', 'many'], /--workers many: this is a number of threads/],
    [['--intrinsics', join(folder, 'absent.txt')], /absent\.txt: There is no such file/],
    [['--intrinsics', join(input, 'groundtruth.txt')], /groundtruth\.txt: /],
    [['--recording', 'upstairs'], /--recording upstairs: there is no such folder/],
  ])) {
    const { status, stderr, stdout } = await scanstitch(['reconstruct', input, '--out', out, ...options]);
    assert.match(stderr, message);
    assert.match(stderr, /^scanstitch: .+\n$/);
    assert.equal(stdout, '');
    assert.equal(status, 1);
  }
  assert.ok(!existsSync(out));
});

test('several recordings: the longest, or the one that is named', async (t) => {
  const short = Object.fromEntries(Object.entries(FILES).filter(([path]) => /\/[123]\.png$/.test(path)));
  const both = {
    ...Object.fromEntries(Object.entries(FILES).map(([path, contents]) => [`up/${path}`, contents])),
    ...Object.fromEntries(Object.entries(short).map(([path, contents]) => [`down/${path}`, contents])),
  };
  const { input, out, notes } = await reconstruct(t, both);
  assert.deepEqual(notes, [
    'note: walk/down: not used: another recording, of 3 depth images; one is used at a time, the longest: walk/up, with 6.',
  ]);
  assert.equal(resultIn(out).frames.length, 6);
  const named = await scanstitch(['reconstruct', input, '--out', out, '--recording', 'down']);
  assert.deepEqual(
    named.stderr.split('\n').filter((line) => line !== '' && !isAssumption(line)),
    [],
  );
  assert.equal(resultIn(out).frames.length, 3);
});

/** Each bad file, the frames that remain, and the line about it. @type {[string, Record<string, Uint8Array | string>, number, RegExp][]} */
const BAD = [
  ['a truncated PNG', { 'depth/3.png': FILES['depth/3.png']?.slice(0, 1000) ?? '' }, 5, /^depth\/3\.png.*: .*cut off/m],
  ['an empty PNG first', { 'depth/1.png': '' }, 5, /^depth\/1\.png.*: /m],
  [
    'all-zero depth',
    { 'depth/2.png': greyPng(new Uint16Array(SIZE * SIZE)) },
    5,
    /^depth\/2\.png: All depths are zero/m,
  ],
  [
    'another size',
    { 'depth/4.png': greyPng(new Uint16Array(64 * 64).fill(900), 64) },
    5,
    /^depth\/4\.png: .*64 x 64 pixels, the first one has 192 x 192/m,
  ],
  [
    'colours among the depth',
    { 'depth/5.png': colourPng(see([0, 0, 0, 0]).colours) },
    5,
    /^depth\/5\.png.*: .*(colour|RGB)/im,
  ],
  [
    'colours of another size',
    { 'rgb/2.png': colourPng(new Uint8Array(3 * 64 * 64), 64) },
    6,
    /^note: depth\/2\.png: its colours are left out: .*rgb\/2\.png: .*64 x 64/m,
  ],
  [
    'broken colours',
    { 'rgb/2.png': 'no picture' },
    6,
    /^note: depth\/2\.png: its colours are left out: .*rgb\/2\.png/m,
  ],
  [
    'no colours',
    { 'rgb/2.png': '' },
    6,
    /^note: depth\/2\.png: its colours are left out: .*rgb\/2\.png: The file is empty/m,
  ],
];

for (const [what, files, remaining, message] of BAD) {
  test(`${what}: told, and the other frames are reconstructed`, async (t) => {
    const { status, stderr, notes, out } = await reconstruct(t, { ...FILES, ...files });
    assert.match(stderr, message);
    assert.equal(notes.length, 1, stderr);
    assert.equal(status, remaining === 6 ? 0 : 2);
    const { frames, comparison } = resultIn(out);
    assert.equal(frames.length, remaining);
    assert.ok(frames.every(({ status }) => status === 'good'));
    assert.ok(comparison && comparison.num_matched === remaining && comparison.max < 0.02, `${comparison?.max} m`);
  });
}

test('different counts of depth and colour: what belongs together is used, the rest is named', async (t) => {
  const { 'depth/6.png': gone, 'rgb/2.png': other, ...rest } = FILES;
  const { status, notes, out } = await reconstruct(t, { ...rest, 'groundtruth.txt': truthOf(WALK.slice(0, 5)) });
  assert.equal(status, 0);
  assert.deepEqual(notes, [
    'note: walk/depth/2.png: no colour picture with its number: used without colours.',
    'note: walk/rgb/6.png: not used: no depth image with its number.',
  ]);
  assert.equal(resultIn(out).frames.length, 5);
});

test('a truth that does not fit: told, and the estimate is the same', async (t) => {
  const { out } = await reconstruct(t, FILES);
  const expected = outputs(out);
  for (const [truth, message] of /** @type {[string, RegExp][]} */ ([
    [truthOf(WALK.slice(0, 4)), /^groundtruth\.txt: .*4 poses.*6 frames/m],
    ['not a trajectory\n', /^$/],
  ])) {
    const { 'groundtruth.txt': _, ...images } = FILES;
    const name = message.source === '^$' ? 'readme.txt' : 'groundtruth.txt';
    const other = await reconstruct(t, { ...images, [name]: truth.replaceAll(/^\d /gm, '') });
    assert.match(other.stderr, name === 'readme.txt' ? /^note: walk\/readme\.txt: not used/ : message);
    assert.equal(other.status, name === 'readme.txt' ? 0 : 2);
    assert.equal(resultIn(other.out).comparison, null);
    assert.deepEqual(outputs(other.out), expected);
  }
  const nan = await reconstruct(t, {
    ...FILES,
    'groundtruth.txt': truthOf(WALK).replace(/^2 .*$/m, '2 nan nan nan 0 0 0 1'),
  });
  assert.match(nan.stderr, /^(note: )?groundtruth\.txt.*(nan|finite|line 3)/im);
  assert.deepEqual(outputs(nan.out), expected);
});

test('8-bit colours given as depth, pictures alone, an empty folder: nothing is written, and why', async (t) => {
  const picture = FILES['rgb/1.png'] ?? '';
  const pictures = Object.fromEntries([1, 2, 3].flatMap((i) => [[`rgb/${i}.png`, picture]]));
  const coloured = Object.fromEntries([1, 2, 3].flatMap((i) => [[`depth/${i}.png`, picture]]));
  for (const [files, message] of /** @type {[Record<string, Uint8Array | string>, RegExp][]} */ ([
    [{ ...pictures, ...coloured }, /^walk\/depth\/1\.png to 3\.png: called depth, but holds 8-bit colours.*grey PNG/],
    [pictures, /^walk\/rgb\/1\.png to 3\.png: 3 pictures, and no depth image with them/],
    [{ 'notes.txt': 'hello' }, /^walk\/notes\.txt: not used/],
  ])) {
    const { status, notes, stdout, out } = await reconstruct(t, files);
    assert.match(notes[0] ?? '', message);
    assert.match(notes[1] ?? '', /^scanstitch: Neither scans nor depth images nor clouds were found/);
    assert.equal(stdout, '');
    assert.equal(status, 1);
    assert.ok(!existsSync(out));
  }
  const empty = temporaryFolder(t);
  const { status, stderr } = await scanstitch(['reconstruct', empty]);
  assert.match(stderr, /^.*: There is no file in this folder\.\nscanstitch: Neither/);
  assert.equal(status, 1);
});

test('no depth in any frame: each is told, nothing is written', async (t) => {
  const zeros = greyPng(new Uint16Array(SIZE * SIZE));
  const { status, notes, out } = await reconstruct(
    t,
    Object.fromEntries([1, 2, 3].map((i) => [`depth/${i}.png`, zeros])),
  );
  assert.equal(notes.length, 4);
  assert.match(notes[3] ?? '', /^scanstitch: No frame could be used/);
  assert.equal(status, 1);
  assert.ok(!existsSync(out));
});

test('archives that are none, or hostile, are told', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'walk.zip');
  writeFileSync(path, 'not an archive');
  const { status, stderr } = await scanstitch(['reconstruct', path]);
  assert.match(
    stderr,
    /^walk\.zip: not used: this is not a ZIP archive, or its end is missing\. Download or pack it again\.\n/,
  );
  assert.equal(status, 1);
});

test('a damaged image in an archive is told, the others are used', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'walk.zip');
  const zip = Buffer.from(
    zipSync(
      Object.fromEntries(
        Object.entries(FILES).map(([name, contents]) => [name, [Buffer.from(contents), { level: 0 }]]),
      ),
    ),
  );
  const place = zip.indexOf('depth/4.png') + 600;
  zip[place] = (zip[place] ?? 0) ^ 1;
  writeFileSync(path, zip);
  const { status, stderr } = await scanstitch(['reconstruct', path, '--out', join(folder, 'out')]);
  assert.match(stderr, /^depth\/4\.png: Its checksum is not the one that walk\.zip has for it\./);
  assert.equal(status, 2);
  assert.equal(resultIn(join(folder, 'out')).frames.length, 5);
});

test('clouds in space, PLY and PCD: placed', async (t) => {
  const nameOf = (/** @type {number} */ i) => (i < 3 ? `${i}.ply` : `${i}.pcd`);
  const { status, stderr, stdout, out } = await reconstruct(t, {
    ...Object.fromEntries(WALK.map((pose, i) => [nameOf(i), (i < 3 ? asciiPly : asciiPcd)(cloudOf(pose))])),
    'gt.tum': truthOf(WALK),
  });
  assert.equal(status, 0, stderr);
  const { frames, comparison } = resultIn(out);
  assert.deepEqual(
    frames.map(({ name }) => name),
    WALK.map((_, i) => nameOf(i)),
  );
  assert.ok(comparison && comparison.max < 0.03, `${comparison?.max} m from the truth`);
  assert.doesNotMatch(stdout, /^Camera/m);
});

/** @param {number[][]} points */
function asciiPcd(points) {
  const header = `VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH ${points.length}\nHEIGHT 1\n`;
  return `${header}VIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${points.length}\nDATA ascii\n${points.map((point) => `${point.join(' ')}\n`).join('')}`;
}

/** The points of a view in the camera's frame. @param {import('./depth_room.mjs').Pose} pose */
function cloudOf(pose) {
  const { depth } = see(pose);
  return Array.from(depth).flatMap((value, pixel) => {
    if (pixel % 2 === 1 || Math.floor(pixel / SIZE) % 2 === 1) return [];
    const z = value / 1000;
    return [
      [(((pixel % SIZE) - SIZE / 2) / (SIZE / 2)) * z, ((Math.floor(pixel / SIZE) - SIZE / 2) / (SIZE / 2)) * z, z],
    ];
  });
}

test('Ctrl-C: what is computed is written, and it is told', { skip: process.platform === 'win32' }, async (t) => {
  const folder = temporaryFolder(t);
  // Frames are prepared a few ahead: when this one is told to be broken, others are placed.
  const images = Array.from({ length: 300 }, (_, i) => {
    return [`depth/${i}.png`, i === 40 ? '' : (FILES[`depth/${(i % 6) + 1}.png`] ?? '')];
  });
  const input = writeTree(join(folder, 'walk'), Object.fromEntries(images));
  const out = join(folder, 'out');
  const args = ['reconstruct', input, '--out', out, '--workers', '2'];
  const child = spawn(process.execPath, [join(ROOT, 'npm', 'cli.js'), ...args], {
    stdio: ['ignore', 'ignore', 'pipe'],
  });
  let stderr = '';
  child.stderr.on('data', (data) => {
    if (stderr === '') child.kill('SIGINT');
    stderr += data;
  });
  const [code] = await once(child, 'close');
  const numDone = Number(stderr.match(/^Stopped after (\d+) of 300 frames; these are written\.$/m)?.[1]);
  assert.ok(numDone > 0 && numDone < 300, stderr);
  assert.equal(code, 2);
  assert.equal(resultIn(out).frames.length, numDone);
});

test('Ctrl-C before a frame is placed: told, and another one ends the program', async () => {
  const isStopped = await untilInterrupt(async (signal) => {
    assert.equal(process.listenerCount('SIGINT'), 1);
    process.emit('SIGINT');
    assert.equal(process.listenerCount('SIGINT'), 0);
    return signal.aborted;
  });
  assert.equal(
    nothingComputed({ isStopped }).message,
    'Stopped before the first frame was placed, so nothing was computed.',
  );
});

/** Mean distance to the truth that each recording must stay under, and the largest step to the frame before (m, deg). */
const BARS = /** @type {const} */ ([
  ['rgbd/apartment_first_floor', 80, 0.06],
  ['rgbd/fusion_demo50', 50, 0.04],
  ['rgbd/redwood5', 5, 0.04],
]);

for (const [name, count, mean] of BARS) {
  test(`${name}: within ${mean} m of the truth, nothing set`, { skip }, async (t) => {
    const out = temporaryFolder(t);
    const { status, stderr } = await scanstitch(['reconstruct', join(DATA, name), '--out', out]);
    assert.equal(status, 0, stderr);
    const { frames, comparison } = resultIn(out);
    assert.equal(frames.length, count);
    assert.ok(comparison && comparison.num_matched === count);
    assert.ok(comparison.mean <= mean, `mean L2 ${comparison.mean} m`);
    frames.forEach(({ name, T_world_sensor }, i) => {
      const [before, truth, truthBefore] = [
        frames[i - 1]?.T_world_sensor,
        comparison.reference[i],
        comparison.reference[i - 1],
      ];
      if (!before || !truth || !truthBefore) return;
      const axes = /** @type {const} */ (['x', 'y', 'z']);
      const wrong = axes.map((axis) => T_world_sensor[axis] - before[axis] - truth[axis] + truthBefore[axis]);
      assert.ok(Math.hypot(...wrong) <= 0.2, `${name}: the step is wrong by ${Math.hypot(...wrong)} m`);
      const turns = [comparison.rotation_errors[i] ?? 0, comparison.rotation_errors[i - 1] ?? 0];
      assert.ok(Math.abs((turns[0] ?? 0) - (turns[1] ?? 0)) <= (10 * Math.PI) / 180, `${name}: ${turns}`);
    });
  });
}

test('two clouds of a car: near the transform that was published', { skip }, async (t) => {
  const out = temporaryFolder(t);
  const { status, stderr } = await scanstitch([
    'reconstruct',
    join(DATA, 'lidar', 'kitti_pair'),
    '--out',
    out,
    '--set',
    'voxel_size=0.25',
  ]);
  assert.equal(status, 0, stderr);
  const pose = resultIn(out).frames[1]?.T_world_sensor;
  assert.ok(pose);
  // The file maps the source into the target; the world here is the source.
  const published = readFileSync(join(DATA, 'lidar', 'kitti_pair', 'T_target_source.txt'), 'utf8')
    .trim()
    .split(/\s+/)
    .map(Number);
  const at = (/** @type {number} */ row, /** @type {number} */ column) => published[4 * row + column] ?? Number.NaN;
  const inverse = [0, 1, 2].map((column) => -[0, 1, 2].reduce((sum, row) => sum + at(row, column) * at(row, 3), 0));
  const distance = Math.hypot(pose.x - (inverse[0] ?? 9), pose.y - (inverse[1] ?? 9), pose.z - (inverse[2] ?? 9));
  assert.ok(distance < 0.03, `${distance} m off`);
});
