// @ts-check
/** What a folder is: layouts of recordings as people have them, and folders that are none. */
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { join, relative } from 'node:path';
import { test } from 'node:test';
import { joinPoses, understand } from '../../npm/recording.js';
import { classify } from '../../npm/recording/classify.js';
import { readImage, readNpyShape, readPlyExtent } from '../../npm/recording/heads.js';
import { asciiPly, ROOM_FILES, ROOT } from './support.mjs';

const RGBD = join(ROOT, '..', 'shared', 'data', 'rgbd');
const skip = existsSync(RGBD) ? false : '../shared/data is absent';

/** @typedef {Record<string, string | Uint8Array>} Contents */

/** Understands made-up files, of which no more than the asked-for beginnings are read. @param {Contents} contents */
function understandAll(contents) {
  const bytes = new Map(
    Object.entries(contents).map(([path, content]) => [path, typeof content === 'string' ? encode(content) : content]),
  );
  const files = [...bytes].map(([path, { length }]) => ({ path, size: length }));
  return understand(files, async (path, length) => (bytes.get(path) ?? new Uint8Array()).subarray(0, length));
}

/** @param {string} text */
function encode(text) {
  return new TextEncoder().encode(text);
}

/** The beginning of a PNG of 640 x 480. @param {number} bits @param {0 | 2 | 3 | 4 | 6} colourType */
function png(bits, colourType) {
  const head = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, 0x49, 0x48, 0x44, 0x52, 0, 0, 2, 128, 0, 0, 1, 224,
  ];
  return Uint8Array.of(...head, bits, colourType, 0, 0, 0);
}

const DEPTH8 = png(8, 0);
const DEPTH16 = png(16, 0);
const RGB = png(8, 2);
const PALETTE = png(8, 3);
const JPEG = Uint8Array.of(0xff, 0xd8, 0xff, 0xe0, 0, 16);
const PGM = encode('P5\n# made by hand\n640 480\n65535\n');

/** Files `name(i)` of the same content. @param {number[]} numbers @param {(i: number) => string} name @param {string | Uint8Array} content */
function many(numbers, name, content) {
  return Object.fromEntries(numbers.map((i) => [name(i), content]));
}

/** @param {number} from @param {number} to */
function count(from, to) {
  return Array.from({ length: to - from + 1 }, (_, i) => from + i);
}

/** @param {import('../../npm/recording.js').Recording} recording */
function pairsOf({ depth_frames }) {
  return depth_frames.map(({ depth, color }) => [depth, color]);
}

/** A NumPy array's header and nothing else. @param {string} shape */
function npy(shape) {
  const header = `{'descr': '<f8', 'fortran_order': False, 'shape': (${shape}), }`.padEnd(117) + '\n';
  return Uint8Array.of(0x93, ...encode('NUMPY'), 1, 0, 118, 0, ...encode(header));
}

/** @param {number} rows */
function tum(rows, from = 0) {
  return count(0, rows - 1)
    .map((i) => `${from + i} ${i} 0 0 0 0 0 1\n`)
    .join('');
}

const MATRIX = '1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n';

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
    reference: ['floor/GT_pose.npy'],
    odometry: null,
    intrinsics: null,
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
    { file: 'rgb/004.png', reason: 'left aside: no depth image with its number' },
    { file: 'rgb/007.png', reason: 'left aside: no depth image with its number' },
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
    { file: 'rgb/100.300000.png', reason: 'left aside: no depth image taken within 0.02 s of it' },
    { file: 'accelerometer.txt', reason: 'left aside: neither an image nor a trajectory of this recording' },
  ]);
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

test('pictures derived from the depth or the colours are neither', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `depth/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `depth_vis/${i}.png`, RGB),
    ...many([1, 2, 3], (i) => `semantic/${i}.png`, DEPTH8),
    ...many([1, 2, 3], (i) => `images/${i}.png`, RGB),
  });
  assert.deepEqual(
    pairsOf(recording),
    [1, 2, 3].map((i) => [`depth/${i}.png`, `images/${i}.png`]),
  );
  assert.deepEqual(recording.notes, [
    { file: 'depth_vis/1.png to 3.png', reason: 'left aside: images that no frame needs' },
    { file: 'semantic/1.png to 3.png', reason: 'left aside: images that no frame needs' },
  ]);
});

test('several recordings: the longest with its own colours and truth, the others named', async () => {
  const floor = (/** @type {string} */ name, /** @type {number} */ frames) => ({
    ...many(count(1, frames), (i) => `${name}/depth/${i}.png`, DEPTH8),
    ...many(count(1, frames), (i) => `${name}/rgb/${i}.png`, RGB),
    [`${name}/gt.npy`]: npy(`${frames}, 4, 4`),
  });
  const recording = await understandAll({ ...floor('home/first', 3), ...floor('home/second', 5) });
  assert.equal(recording.root, 'home/second');
  assert.equal(recording.depth_frames.length, 5);
  assert.ok(recording.depth_frames.every(({ color }) => color?.startsWith('home/second/rgb/')));
  assert.deepEqual(recording.reference, ['home/second/gt.npy']);
  const reason =
    'left aside: another recording, of 3 depth images; one is used at a time, the longest: home/second, with 5';
  assert.deepEqual(recording.notes, [{ file: 'home/first', reason }]);
});

test('a second kind of depth beside the first is told apart by its files', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `home/depth/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `home/depth_predicted/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `home/rgb/${i}.png`, RGB),
  });
  assert.ok(recording.depth_frames.every(({ depth }) => depth.startsWith('home/depth/')));
  const reason = 'left aside: another recording, of 3 depth images; one is used at a time, the longest: home, with 3';
  assert.deepEqual(recording.notes, [{ file: 'home/depth_predicted/1.png to 3.png', reason }]);
});

test('the truth of another recording is not taken', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `a/depth/${i}.png`, DEPTH8),
    ...many([1, 2], (i) => `b/depth/${i}.png`, DEPTH8),
    ...many([1, 2], (i) => `b/rgb/${i}.png`, RGB),
    'b/GT_pose.npy': npy('3, 7'),
  });
  assert.equal(recording.root, 'a');
  assert.deepEqual(recording.reference, []);
  assert.ok(recording.depth_frames.every(({ color }) => color === null));
});

test('8-bit colours given as depth: told, with the remedy', async () => {
  for (const [image, words] of /** @type {const} */ ([
    [RGB, /called depth, but holds 8-bit colours, not distances.*save the depth itself as grey PNG/],
    [PALETTE, /called depth, but holds the numbers of a palette/],
    [JPEG, /called depth, but holds a JPEG picture/],
  ])) {
    const recording = await understandAll({
      ...many([1, 2, 3], (i) => `depth/${i}.png`, image),
      ...many([1, 2, 3], (i) => `rgb/${i}.png`, RGB),
    });
    assert.equal(recording.kind, 'nothing');
    assert.equal(recording.notes.length, 1);
    assert.equal(recording.notes[0]?.file, 'depth/1.png to 3.png');
    assert.match(recording.notes[0]?.reason ?? '', words);
  }
});

test('depth in forms that are not read is told', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `depth/${i}.exr`, 'v/1'),
    ...many([1, 2, 3], (i) => `rgb/${i}.png`, RGB),
  });
  assert.equal(recording.kind, 'nothing');
  assert.deepEqual(
    recording.notes.map(({ file }) => file),
    ['depth/1.exr to 3.exr'],
  );
  assert.match(recording.notes[0]?.reason ?? '', /read from PNG, PGM and PFM/);
});

test('pictures without depth, an empty folder, a text: nothing, and why', async () => {
  const pictures = await understandAll(many(count(1, 30), (i) => `holiday/IMG_${i}.jpg`, JPEG));
  assert.equal(pictures.kind, 'nothing');
  assert.deepEqual(pictures.notes, [
    {
      file: 'holiday/IMG_1.jpg to IMG_30.jpg',
      reason: '30 pictures, and no depth image with them; a map needs the depth image of each picture, a grey PNG',
    },
  ]);
  assert.deepEqual(await understandAll({}).then(({ kind, notes }) => ({ kind, notes })), {
    kind: 'nothing',
    notes: [],
  });
  const text = await understandAll({ 'notes.pdf': 'x' });
  assert.deepEqual(text.notes, [
    { file: 'notes.pdf', reason: 'left aside: neither a scan, nor a cloud, nor a depth image' },
  ]);
});

test('one broken image among those looked into changes nothing', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3, 4, 5], (i) => `depth/${i}.png`, DEPTH16),
    ...many([1, 2, 3, 4, 5], (i) => `rgb/${i}.png`, RGB),
    'depth/1.png': '',
    'depth/5.png': RGB,
  });
  assert.equal(recording.depth_frames.length, 5);
  assert.deepEqual(recording.depth_frames[0], {
    name: 'depth/1.png',
    depth: 'depth/1.png',
    color: 'rgb/1.png',
    time: null,
  });
});

test('of several trajectories, the one that fits the frames and is called the truth', async () => {
  const images = many(count(1, 6), (i) => `depth/${i}.png`, DEPTH16);
  const cases = /** @type {[Contents, string[]][]} */ ([
    [{ 'trajectory.log': MATRIX.repeat(6), 'odometry.log': MATRIX.repeat(6) }, ['odometry.log']],
    [{ 'gt.txt': tum(5), 'poses.txt': tum(6) }, ['poses.txt']],
    [{ 'estimate.txt': tum(6), 'notes.txt': 'three little words\n' }, []],
    [{ 'GT_pose.npy': npy('4, 7') }, ['GT_pose.npy']],
    [{ 'data.csv': 't,x,y,z,qx,qy,qz,qw\n' + tum(6).replaceAll(' ', ',') }, ['data.csv']],
    [{ 'weights.npy': npy('6, 128'), 'walk.tum': tum(6) }, ['walk.tum']],
    [{ 'poses.txt': tum(6).replace('0 0 0 1', 'nan nan nan nan') }, ['poses.txt']],
    [many(count(1, 6), (i) => `pose/${i}.txt`, MATRIX), count(1, 6).map((i) => `pose/${i}.txt`)],
  ]);
  for (const [files, expected] of cases) {
    const { reference } = await understandAll({ ...images, ...files });
    assert.deepEqual(reference, expected, JSON.stringify(Object.keys(files)));
  }
});

test('pose files with a gap: told, and not used', async () => {
  const { reference, notes } = await understandAll({
    ...many(count(1, 6), (i) => `frame-${i}.depth.png`, DEPTH16),
    ...many([1, 2, 4, 5, 6], (i) => `frame-${i}.pose.txt`, MATRIX),
  });
  assert.deepEqual(reference, []);
  assert.equal(notes.length, 1);
  assert.match(notes[0]?.reason ?? '', /1 of 6 frames have no such file \(number 3 first\)/);
});

test('the camera: beside the images or above them, the depth one first', async () => {
  const images = many([1, 2], (i) => `scene/depth/${i}.png`, DEPTH16);
  const K = '585 0 320\n0 585 240\n0 0 1\n';
  const cases = /** @type {[Contents, string | null][]} */ ([
    [{ 'camera-intrinsics.txt': K }, 'camera-intrinsics.txt'],
    [{ 'scene/intrinsic_color.txt': K, 'scene/intrinsic_depth.txt': K }, 'scene/intrinsic_depth.txt'],
    [{ 'scene/depth/camera.json': '{"intrinsic_matrix":[1,0,0,0,1,0,2,2,1]}' }, 'scene/depth/camera.json'],
    [{ 'scene/calib.yaml': 'fx: 1' }, null],
    [{ 'scene/camera_poses.txt': tum(2) }, null],
    [{ 'elsewhere/K.txt': K }, null],
  ]);
  for (const [files, expected] of cases) {
    const { intrinsics } = await understandAll({ ...images, ...files });
    assert.equal(intrinsics, expected, JSON.stringify(Object.keys(files)));
  }
});

test('planar scans, their trajectory, and a word about everything else', async () => {
  const recording = await understandAll({
    ...Object.fromEntries(Object.entries(ROOM_FILES).map(([name, text]) => [`room/${name}`, text])),
    'room/a.tum': tum(3),
    'room/b.txt': '1 2\n3 4\n',
    'room/readme.txt': 'Scans of a room\n',
    'room/photo.png': RGB,
    'room/notes.pdf': 'x',
    'room/no_extension': ROOM_FILES['0.ply'] ?? '',
  });
  assert.equal(recording.kind, 'planar_scans');
  assert.deepEqual(recording.scans, ['room/0.ply', 'room/1.ply', 'room/2.ply', 'room/no_extension']);
  assert.deepEqual(recording.reference, ['room/a.tum']);
  assert.deepEqual(recording.notes, [
    { file: 'room/b.txt', reason: 'left aside: one reference trajectory is used at a time, here room/a.tum' },
    { file: 'room/notes.pdf', reason: 'left aside: not a PLY scan and not a trajectory (.tum or .txt)' },
    { file: 'room/photo.png', reason: 'left aside: an image, not a laser scan' },
    {
      file: 'room/readme.txt',
      reason: 'left aside: holds neither scans nor lines of numbers that could be a trajectory',
    },
  ]);
});

test('a laser log is a scan file whatever it is called, and odometry beside it is told by its name', async () => {
  const flaser = 'FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 1 host 1\n';
  const recording = await understandAll({
    'drive/robot.log': `# CARMEN\n${flaser}`,
    'drive/robot.odometry.txt': '0 0 0 0\n1 0.1 0 0\n',
    'drive/truth.txt': '0 0 0 0\n1 0.1 0 0\n',
    'drive/other_odom.txt': '0 0 0 0\n1 0.1 0 0\n',
    'drive/server.log': 'started\nstopped\n',
  });
  assert.equal(recording.kind, 'planar_scans');
  assert.deepEqual(recording.scans, ['drive/robot.log']);
  assert.deepEqual(recording.reference, ['drive/truth.txt']);
  assert.equal(recording.odometry, 'drive/other_odom.txt');
  assert.deepEqual(
    recording.notes.map(({ file }) => file),
    ['drive/robot.odometry.txt', 'drive/server.log'],
  );
  const csm = await understandAll({
    'scans.json': '{"nrays": 2, "min_theta": 0, "max_theta": 1, "readings": [1, 2]}\n',
  });
  assert.deepEqual([csm.kind, csm.scans], ['planar_scans', ['scans.json']]);
});

const SPACE = asciiPly([
  [1, 2, 0],
  [1, 2, 0.5],
]);

test('PLY files in space and PCD files are clouds; one of them among planar scans is told by the engine', async () => {
  const clouds = await understandAll({
    ...many([1, 2, 10], (i) => `walk/${i}.ply`, SPACE),
    'walk/map.ply': SPACE,
    'walk/gt.txt': MATRIX.repeat(3),
    'other/1.pcd': '# .PCD\n',
  });
  assert.equal(clouds.kind, 'clouds');
  assert.deepEqual(
    clouds.clouds,
    [1, 2, 10].map((i) => `walk/${i}.ply`),
  );
  assert.deepEqual(clouds.reference, ['walk/gt.txt']);
  assert.deepEqual(
    clouds.notes.map(({ file }) => file),
    ['other/1.pcd', 'walk/map.ply'],
  );
  assert.equal((await understandAll({ 'a.pcd': '# .PCD\n', 'b.pcd': '# .PCD\n' })).kind, 'clouds');
  assert.deepEqual((await understandAll({ '1/c.ply': SPACE, '2/c.ply': SPACE })).clouds, ['1/c.ply', '2/c.ply']);
  assert.equal((await understandAll({ ...ROOM_FILES, 'bad.ply': SPACE })).kind, 'planar_scans');
});

test('results of an earlier run are no input', async () => {
  const results = { 'out/trajectory.tum': tum(3), 'out/map.ply': SPACE, 'out/report.json': '{}' };
  const recording = await understandAll({ ...many([1, 2, 3], (i) => `depth/${i}.png`, DEPTH8), ...results });
  assert.deepEqual(recording.reference, []);
  assert.deepEqual(recording.notes, []);
  assert.equal((await understandAll(results)).kind, 'nothing');
});

test('a file that cannot be read is told, and the rest goes on', async () => {
  const files = ['0.ply', '1.ply', 'truth.txt'].map((path) => ({ path, size: 10 }));
  const recording = await understand(files, async (path) => {
    if (path !== '1.ply') throw new Error('gone');
    return encode(ROOM_FILES['1.ply'] ?? '');
  });
  assert.deepEqual(recording.scans, ['0.ply', '1.ply']);
  assert.deepEqual(
    recording.notes.map(({ file }) => file),
    ['0.ply', 'truth.txt'],
  );
});

test('a gigabyte of images: a few beginnings are read', async () => {
  const files = count(1, 5000).flatMap((i) => {
    return ['rgb', 'depth'].map((folder) => ({ path: `${folder}/${i}.png`, size: 200_000 }));
  });
  let read = 0;
  const recording = await understand(files, async (path, length) => {
    read += length;
    return path.startsWith('rgb') ? RGB : DEPTH16;
  });
  assert.equal(recording.depth_frames.length, 5000);
  assert.ok(read < 100_000, `${read} bytes were asked for`);
});

test('what planar files are for, by name and first bytes', () => {
  const role = (/** @type {string} */ name, text = '') => classify(name, encode(text)).role;
  assert.equal(role('a/B.PLY'), 'scan');
  assert.equal(role('no_extension', 'ply\r\nformat ascii 1.0'), 'scan');
  assert.equal(role('truth.tum'), 'reference');
  assert.equal(role('gt.csv', 'x,y,z\n1.5,2,0\n2,2,0\n'), 'reference');
  for (const name of ['x.npy', 'x.pcd', 'x.png', 'x.zip', 'x.doc']) assert.equal(role(name), 'ignored');
  assert.deepEqual(classify('../.DS_Store', new Uint8Array()), { role: 'ignored', reason: null });
});

test('heads: images, arrays, clouds', () => {
  assert.deepEqual(readImage(DEPTH16), { format: 'PNG', channels: 'grey', bits: 16 });
  assert.deepEqual(readImage(PALETTE), { format: 'PNG', channels: 'palette', bits: 8 });
  assert.deepEqual(readImage(PGM), { format: 'PGM', channels: 'grey', bits: 16 });
  assert.deepEqual(readImage(encode('P6 640 480 255 ')), { format: 'PPM', channels: 'colour', bits: 8 });
  assert.equal(readImage(encode('PNG, honestly')), null);
  assert.equal(readImage(DEPTH16.subarray(0, 20)), null);
  assert.deepEqual(readNpyShape(npy('80, 7')), [80, 7]);
  assert.deepEqual(readNpyShape(npy('80,')), [80]);
  assert.equal(readNpyShape(encode('shape')), null);
  assert.equal(readPlyExtent(encode(SPACE)), 'space');
  assert.equal(readPlyExtent(encode(asciiPly([[1, 2, 0]]))), 'plane');
  assert.equal(readPlyExtent(encode(asciiPly([]))), 'unknown');
  assert.equal(readPlyExtent(encode('ply\nformat ascii 1.0\n')), 'unknown');
  for (const [z, extent] of /** @type {const} */ ([
    [0, 'plane'],
    [0.25, 'space'],
  ])) {
    const header = encode(asciiPly([], 2).replace('ascii', 'binary_big_endian'));
    const body = new DataView(new ArrayBuffer(48));
    body.setFloat64(16, z);
    assert.equal(readPlyExtent(Uint8Array.of(...header, ...new Uint8Array(body.buffer))), extent);
  }
});

test('a pose file for each frame becomes one text', () => {
  const joined = new TextDecoder().decode(joinPoses([encode(MATRIX.replaceAll('\n', '\r\n')), encode(MATRIX)]));
  assert.equal(joined.split('\n').length, 9);
});

/** @param {string} folder */
async function understandFolder(folder) {
  const entries = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
  const files = entries.map((entry) => {
    const path = join(entry.path, entry.name);
    return { path: relative(folder, path), size: statSync(path).size };
  });
  return understand(files, async (path, length) => readFileSync(join(folder, path)).subarray(0, length));
}

test('the recorded sets', { skip }, async () => {
  const expected = /** @type {[string, number, string[] | number, string | null][]} */ ([
    ['apartment_first_floor', 80, ['GT_pose.npy'], null],
    ['apartment_second_floor', 123, ['GT_pose.npy'], null],
    ['fusion_demo50', 50, 50, 'camera-intrinsics.txt'],
    ['redwood5', 5, ['odometry.log'], 'camera.json'],
  ]);
  for (const [name, frames, reference, intrinsics] of expected) {
    const recording = await understandFolder(join(RGBD, name));
    assert.equal(recording.kind, 'depth_images');
    assert.equal(recording.depth_frames.length, frames, name);
    assert.ok(recording.depth_frames.every(({ color }) => color !== null));
    if (typeof reference === 'number') assert.equal(recording.reference.length, reference);
    else assert.deepEqual(recording.reference, reference);
    assert.equal(recording.intrinsics, intrinsics);
    assert.equal(recording.notes.length, name === 'redwood5' ? 3 : 0);
  }
});
