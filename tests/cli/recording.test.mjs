// @ts-check
/** What a folder is: planar scans, laser logs, clouds, results of an earlier run; and the recorded sets. */
import assert from 'node:assert/strict';
import { readFileSync, readdirSync, statSync } from 'node:fs';
import { join, relative } from 'node:path';
import { test } from 'node:test';
import { understand } from '../../npm/recording/understand.js';
import { count, DEPTH16, DEPTH8, encode, many, MATRIX, RGB, SPACE, tum, understandAll } from './recording_files.mjs';
import { DATA, ROOM_FILES, skipWithoutData } from './support.mjs';

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
    { file: 'room/b.txt', reason: 'not used: one reference trajectory is used at a time, here room/a.tum' },
    { file: 'room/notes.pdf', reason: 'not used: not a PLY scan and not a trajectory (.tum or .txt)' },
    { file: 'room/photo.png', reason: 'not used: an image, not a laser scan' },
    {
      file: 'room/readme.txt',
      reason: 'not used: holds neither scans nor lines of numbers that could be a trajectory',
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

/** @param {string} folder */
async function understandFolder(folder) {
  const entries = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile());
  const files = entries.map((entry) => {
    const path = join(entry.parentPath ?? entry.path, entry.name); // the former in newer versions of Node
    return { path: relative(folder, path), size: statSync(path).size };
  });
  return understand(files, async (path, length) => readFileSync(join(folder, path)).subarray(0, length));
}

test('the recorded sets', { skip: skipWithoutData }, async () => {
  const expected = /** @type {[string, number, string[] | number, string | null][]} */ ([
    ['apartment_first_floor', 80, ['GT_pose.npy'], null],
    ['apartment_second_floor', 123, ['GT_pose.npy'], null],
    ['fusion_demo50', 50, 50, 'camera-intrinsics.txt'],
    ['redwood5', 5, ['odometry.log'], 'camera.json'],
  ]);
  for (const [name, frames, reference, intrinsics] of expected) {
    const recording = await understandFolder(join(DATA, 'rgbd', name));
    assert.equal(recording.kind, 'depth_images');
    assert.equal(recording.depth_frames.length, frames, name);
    assert.ok(recording.depth_frames.every(({ color }) => color !== null));
    if (typeof reference === 'number') assert.equal(recording.reference.length, reference);
    else assert.deepEqual(recording.reference, reference);
    assert.equal(recording.intrinsics, intrinsics);
    assert.equal(recording.notes.length, name === 'redwood5' ? 3 : 0);
  }
});
