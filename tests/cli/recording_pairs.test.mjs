// @ts-check
/** Depth and colour images: which are which, what belongs together, in which order. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  count,
  DEPTH16,
  DEPTH8,
  JPEG,
  many,
  npy,
  pairsOf,
  PGM,
  png,
  RGB,
  tum,
  understandAll,
} from './recording_files.mjs';

test('rgb/N.png and depth/N.png with GT_pose.npy, inside a folder', async () => {
  const numbers = count(1, 12);
  const recording = await understandAll({
    ...many(numbers, (i) => `floor/rgb/${i}.png`, RGB),
    ...many(numbers, (i) => `floor/depth/${i}.png`, DEPTH8),
    'floor/GT_pose.npy': npy('12, 7'),
    'floor/.DS_Store': 'x',
    '__MACOSX/floor/rgb/._1.png': 'x',
  });
  assert.deepEqual(recording, {
    kind: 'depth_images',
    root: 'floor',
    depth_frames: numbers.map((i) => {
      return { name: `depth/${i}.png`, depth: `floor/depth/${i}.png`, color: `floor/rgb/${i}.png`, time: null };
    }),
    clouds: [],
    scans: [],
    logs: [],
    tables: [],
    reference: ['floor/GT_pose.npy'],
    odometry: null,
    intrinsics: null,
    image_size: { width: 640, height: 480 },
    notes: [],
  });
});

test('the header tells which folder holds the depth, whatever the folders are called', async () => {
  const swapped = await understandAll({
    ...many([1, 2], (i) => `rgb/${i}.png`, DEPTH16),
    ...many([1, 2], (i) => `depth/${i}.png`, RGB),
  });
  assert.deepEqual(
    pairsOf(swapped),
    [1, 2].map((i) => [`rgb/${i}.png`, `depth/${i}.png`]),
  );
  const nameless = await understandAll({
    ...many([1, 2], (i) => `a/${i}.png`, DEPTH8),
    ...many([1, 2], (i) => `b/${i}.png`, png(8, 6)),
  });
  assert.deepEqual(
    pairsOf(nameless),
    [1, 2].map((i) => [`a/${i}.png`, `b/${i}.png`]),
  );
});

test('grey pictures beside grey depth: 16 bits are depth, and then the names tell', async () => {
  const deeper = await understandAll({
    ...many([1, 2], (i) => `a/${i}.png`, DEPTH8),
    ...many([1, 2], (i) => `b/${i}.png`, DEPTH16),
  });
  assert.deepEqual(
    pairsOf(deeper),
    [1, 2].map((i) => [`b/${i}.png`, `a/${i}.png`]),
  );
  const named = await understandAll({
    ...many([1, 2], (i) => `left/${i}.png`, DEPTH8),
    ...many([1, 2], (i) => `depth/${i}.png`, DEPTH8),
  });
  assert.deepEqual(
    pairsOf(named),
    [1, 2].map((i) => [`depth/${i}.png`, `left/${i}.png`]),
  );
});

test('flat folders, however both kinds are named', async () => {
  const ways = /** @type {[(i: number) => string, (i: number) => string][]} */ ([
    [(i) => `${i}_depth.png`, (i) => `${i}_rgb.png`],
    [(i) => `depth_${`${i}`.padStart(3, '0')}.png`, (i) => `color_${i}.jpg`],
    [(i) => `dep${i}.png`, (i) => `img${i}.png`],
    [(i) => `frame-00000${i}.depth.png`, (i) => `frame-00000${i}.color.jpg`],
    [(i) => `depth16_cam2_${i}.pgm`, (i) => `rgb8_cam1_${i}.jpg`],
    [(i) => `${i}d.png`, (i) => `${i}.png`],
  ]);
  for (const [depth, colour] of ways) {
    const ending = (/** @type {string} */ name) => (name.endsWith('.jpg') ? JPEG : RGB);
    const recording = await understandAll({
      ...many([8, 9, 10, 11], depth, depth(1).endsWith('.pgm') ? PGM : DEPTH16),
      ...many([8, 9, 10, 11], colour, ending(colour(1))),
    });
    assert.deepEqual(pairsOf(recording).toSorted(), [8, 9, 10, 11].map((i) => [depth(i), colour(i)]).toSorted());
    assert.deepEqual(recording.notes, []);
  }
});

test('frames come in natural order', async () => {
  const recording = await understandAll(many([10, 9, 100, 1], (i) => `depth/d${i}.png`, DEPTH16));
  assert.deepEqual(
    recording.depth_frames.map(({ name }) => name),
    [1, 9, 10, 100].map((i) => `depth/d${i}.png`),
  );
  assert.deepEqual(
    recording.depth_frames.map(({ color }) => color),
    [null, null, null, null],
  );
});

test('different counts: what has a partner is paired by number, the rest is named', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3, 5], (i) => `depth/${i}.png`, DEPTH8),
    ...many([2, 3, 4, 5], (i) => `rgb/00${i}.png`, RGB),
    'rgb/007.png': RGB,
  });
  assert.deepEqual(pairsOf(recording), [
    ['depth/1.png', null],
    ['depth/2.png', 'rgb/002.png'],
    ['depth/3.png', 'rgb/003.png'],
    ['depth/5.png', 'rgb/005.png'],
  ]);
  assert.deepEqual(recording.notes, [
    { file: 'depth/1.png', reason: 'no colour picture with its number: used without colours' },
    { file: 'rgb/004.png', reason: 'not used: no depth image with its number' },
    { file: 'rgb/007.png', reason: 'not used: no depth image with its number' },
  ]);
});

test('many without a partner are told in one line', async () => {
  const { notes, depth_frames } = await understandAll({
    ...many(count(1, 20), (i) => `depth/${i}.png`, DEPTH8),
    ...many(count(11, 20), (i) => `rgb/${i}.png`, RGB),
  });
  assert.equal(depth_frames.length, 20);
  const reason =
    '10 of 20 depth images have no colour picture with their number and are used without colours (1.png, 2.png, 3.png, ...)';
  assert.deepEqual(notes, [{ file: 'depth', reason }]);
});

test('as many of both, numbered from another first number: paired in order, and told', async () => {
  const { notes, depth_frames } = await understandAll({
    ...many(count(0, 9), (i) => `depth/${i}.png`, DEPTH8),
    ...many(count(1, 10), (i) => `rgb/${i}.png`, RGB),
  });
  depth_frames.forEach(({ color }, i) => assert.equal(color, `rgb/${i + 1}.png`));
  assert.match(
    notes[0]?.reason ?? '',
    /^numbered from 1\.png, the depth images from 0\.png; .* paired in their order$/,
  );
});

test('folders that do not correspond at all: told, and the map has no colours', async () => {
  const { notes, depth_frames } = await understandAll({
    ...many(count(100, 109), (i) => `depth/${i}.png`, DEPTH8),
    ...many(count(1, 7), (i) => `rgb/${i}.png`, RGB),
  });
  assert.ok(depth_frames.every(({ color }) => color === null));
  assert.equal(notes.length, 1);
  assert.match(notes[0]?.reason ?? '', /^none of the 7 colour pictures belongs to one of the 10 depth images/);
});

test('TUM RGB-D: by time, each used once, within 0.02 s', async () => {
  const colours = [100, 100.033, 100.066, 100.3].map((time) => `rgb/${time.toFixed(6)}.png`);
  const depths = [100.01, 100.03, 100.05, 100.7].map((time) => `depth/${time.toFixed(6)}.png`);
  const recording = await understandAll({
    ...Object.fromEntries(colours.map((path) => [path, RGB])),
    ...Object.fromEntries(depths.map((path) => [path, DEPTH16])),
    'rgb.txt': `# color images\n${colours.map((path) => `${path.slice(4, 14)} ${path}\n`).join('')}`,
    'depth.txt': `# depth maps\n${depths.map((path) => `${path.slice(6, 16)} ${path}\n`).join('')}`,
    'groundtruth.txt': tum(900, 0),
    'accelerometer.txt': '# t ax ay az\n99.9 1 2 3\n100 1 2 3\n100.1 1 2 3\n',
  });
  assert.deepEqual(pairsOf(recording), [
    [depths[0], colours[0]],
    [depths[1], colours[1]],
    [depths[2], colours[2]],
    [depths[3], null],
  ]);
  assert.deepEqual(
    recording.depth_frames.map(({ time }) => time),
    [100.01, 100.03, 100.05, 100.7],
  );
  assert.deepEqual(recording.reference, ['groundtruth.txt']);
  assert.deepEqual(recording.notes, [
    { file: 'depth/100.700000.png', reason: 'no colour picture taken within 0.02 s of it: used without colours' },
    { file: 'rgb/100.300000.png', reason: 'not used: no depth image taken within 0.02 s of it' },
    { file: 'accelerometer.txt', reason: 'not used: neither an image nor a trajectory of this recording' },
  ]);
});

test('lists may have their times in nanoseconds', async () => {
  const at = (/** @type {number} */ milliseconds) => `${1305031102000 + milliseconds}000000`;
  const [colours, depths] = [
    [15, 48, 81].map((ms) => `rgb/${at(ms)}.png`),
    [0, 33, 66].map((ms) => `depth/${at(ms)}.png`),
  ];
  const list = (/** @type {string[]} */ paths) => paths.map((path) => `${/\d+/.exec(path)?.[0]} ${path}\n`).join('');
  const recording = await understandAll({
    ...Object.fromEntries(colours.map((path) => [path, RGB])),
    ...Object.fromEntries(depths.map((path) => [path, DEPTH16])),
    'rgb.txt': list(colours),
    'depth.txt': list(depths),
  });
  assert.deepEqual(
    pairsOf(recording),
    depths.map((path, index) => [path, colours[index]]),
  );
  assert.ok(Math.abs((recording.depth_frames[1]?.time ?? 0) - 1305031102.033) < 1e-5);
});

test('associations.txt decides, with its times', async () => {
  const recording = await understandAll({
    ...many([0, 1, 2], (i) => `depth/${i}.png`, DEPTH16),
    ...many([0, 1, 2], (i) => `rgb/${i}.png`, RGB),
    'associations.txt': '5.5 depth/0.png 5.51 rgb/1.png\n6.5 ./depth/1.png 6.51 rgb/2.png\n7 depth/2.png 7 rgb/9.png\n',
  });
  assert.deepEqual(
    recording.depth_frames.map(({ depth, color, time }) => [depth, color, time]),
    [
      ['depth/0.png', 'rgb/1.png', 5.5],
      ['depth/1.png', 'rgb/2.png', 6.5],
      ['depth/2.png', null, 7],
    ],
  );
  assert.deepEqual(
    recording.notes.map(({ file }) => file),
    ['depth/2.png', 'rgb/0.png', 'associations.txt'],
  );
});

test('nanoseconds since 1970 as names', async () => {
  const { depth_frames } = await understandAll(many([1, 2], (i) => `depth/1403636579${i}63555584.png`, DEPTH16));
  assert.deepEqual(
    depth_frames.map(({ time }) => time),
    [1403636579.163555584, 1403636579.263555584],
  );
});
