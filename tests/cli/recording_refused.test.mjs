// @ts-check
/** Images that cannot be used as depth: each is told, with what to do. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { colourPng } from './depth_room.mjs';
import { count, DEPTH16, JPEG, many, PALETTE, RGB, understandAll } from './recording_files.mjs';
import { ROOM_FILES } from './support.mjs';

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

test('colours that are shades throughout are depth, where they are called so', async () => {
  const shades = colourPng(
    Uint8Array.from({ length: 3 * 32 * 4 }, (_, at) => 7 * Math.floor(at / 3)),
    32,
  );
  const tinted = colourPng(
    Uint8Array.from({ length: 3 * 32 * 4 }, (_, at) => 7 * Math.floor(at / 3) + Number(at === 380)),
    32,
  );
  const kindOf = async (/** @type {Uint8Array} */ image) =>
    (await understandAll(many([1, 2, 3], (i) => `depth/${i}.png`, image))).kind;
  assert.deepEqual(await Promise.all([shades, tinted, shades.subarray(0, shades.length - 20)].map(kindOf)), [
    'depth_images',
    'nothing',
    'nothing',
  ]);
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
    { file: 'notes.pdf', reason: 'not used: neither a scan, nor a cloud, nor a depth image' },
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

test('a series of images none of which can be read is told, with its first fault', async () => {
  const recording = await understandAll({
    ...many([1, 2, 3], (i) => `depth/${i}.png`, DEPTH16),
    ...many([1, 2, 3], (i) => `rgb/${i}.png`, RGB.subarray(0, 20)),
  });
  assert.equal(recording.depth_frames.length, 3);
  assert.deepEqual(recording.notes, [
    {
      file: 'rgb/1.png to 3.png',
      reason: 'not used: 1.png: this PNG cannot be read: it is cut off at byte 20; copy or export it again',
    },
  ]);
});

test('the text of a program is no table, whatever numbers stand in it', async () => {
  const table = `# angle range\n${Array.from({ length: 40 }, (_, at) => `${at} 1.${at}\n`).join('')}`;
  const { scans } = await understandAll({ ...ROOM_FILES, 'reader.js': table, 'scan.txt': table });
  assert.ok(scans.includes('scan.txt') && !scans.includes('reader.js'), scans.join());
});
