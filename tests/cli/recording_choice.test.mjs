// @ts-check
/** Folders with more than one recording of depth images: which is taken, and what becomes of the rest. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { count, DEPTH16, DEPTH8, many, npy, pairsOf, RGB, understandAll } from './recording_files.mjs';

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
    { file: 'depth_vis/1.png to 3.png', reason: 'not used: images that no frame needs' },
    { file: 'semantic/1.png to 3.png', reason: 'not used: images that no frame needs' },
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
    'not used: another recording, of 3 depth images; one is used at a time, the longest: home/second, with 5';
  assert.deepEqual(recording.notes, [{ file: 'home/first', reason }]);
});

test('a second kind of depth beside the first is told apart by its files', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `home/depth/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `home/depth_predicted/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `home/rgb/${i}.png`, RGB),
  });
  assert.ok(recording.depth_frames.every(({ depth }) => depth.startsWith('home/depth/')));
  const reason = 'not used: another recording, of 3 depth images; one is used at a time, the longest: home, with 3';
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
