// @ts-check
/** What lies beside the images: the true path and the camera. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { joinPoses } from '../../npm/recording/pose_file.js';
import { count, DEPTH16, encode, many, MATRIX, npy, tum, understandAll } from './recording_files.mjs';

/** @typedef {import('./recording_files.mjs').Contents} Contents */

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

test('a pose file for each frame, numbered from 1 where the frames count from 0, in their order; and that is told', async () => {
  const images = many(count(0, 5), (i) => `depth/${i}.png`, DEPTH16);
  const { reference, notes } = await understandAll({ ...images, ...many(count(1, 6), (i) => `pose/${i}.txt`, MATRIX) });
  assert.deepEqual(reference, count(1, 6).map((i) => `pose/${i}.txt`)); // prettier-ignore
  assert.match(notes[0]?.reason ?? '', /^numbered from 1\.txt, the frames from 0;/);
  const uneven = await understandAll({ ...images, ...many([1, 2, 3, 4, 5, 7], (i) => `pose/${i}.txt`, MATRIX) });
  assert.deepEqual(uneven.reference, []);
});

test('the camera: beside the images or above them, the depth one first', async () => {
  const images = many([1, 2], (i) => `scene/depth/${i}.png`, DEPTH16);
  const K = '585 0 320\n0 585 240\n0 0 1\n';
  const cases = /** @type {[Contents, string | null][]} */ ([
    [{ 'camera-intrinsics.txt': K }, 'camera-intrinsics.txt'],
    [{ 'scene/intrinsic_color.txt': K, 'scene/intrinsic_depth.txt': K }, 'scene/intrinsic_depth.txt'],
    [{ 'scene/depth/camera.json': '{"intrinsic_matrix":[525,0,0,0,525,0,319.5,239.5,1]}' }, 'scene/depth/camera.json'],
    [{ 'scene/calib.yaml': 'fx: 1' }, null],
    [{ 'scene/TUM1.yaml': 'Camera.fx: 517\nCamera.fy: 516\nCamera.cx: 318\nCamera.cy: 255\n' }, 'scene/TUM1.yaml'],
    [{ 'scene/settings.yaml': 'rate: 30\nname: 640 480 525 525\n' }, null],
    [{ 'scene/readme.txt': 'Recorded by hand.\nfx = 525\nfy = 525\ncx = 319.5\ncy = 239.5\n' }, 'scene/readme.txt'],
    [{ 'scene/numbers.txt': '525 525 319.5 239.5\n' }, null],
    [{ 'scene/camera_poses.txt': tum(2) }, null],
    [{ 'elsewhere/K.txt': K }, null],
  ]);
  for (const [files, expected] of cases) {
    const { intrinsics } = await understandAll({ ...images, ...files });
    assert.equal(intrinsics, expected, JSON.stringify(Object.keys(files)));
  }
});

test('a pose file for each frame becomes one text', () => {
  const joined = new TextDecoder().decode(joinPoses([encode(MATRIX.replaceAll('\n', '\r\n')), encode(MATRIX)]));
  assert.equal(joined.split('\n').length, 9);
});
