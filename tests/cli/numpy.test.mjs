// @ts-check
/** Arrays of NumPy, as it writes them (tests/data/npy/make_npy.py), and what they are told to be. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { zipSync } from 'fflate';
import { convertFiles } from '../../npm/formats/convert.js';
import { polarTable } from '../../npm/formats/polar.js';
import { fileInMemory } from '../../npm/files/content.js';
import { ROOT } from './support.mjs';

const ARRAYS = join(ROOT, 'tests', 'data', 'npy');

/** What files become. @param {Record<string, Uint8Array>} files */
async function converted(files) {
  const contents = Object.entries(files).map(([path, bytes]) => fileInMemory(path, bytes));
  return convertFiles(contents, (made) => made);
}

/** @param {string} name */
const array = (name) => new Uint8Array(readFileSync(join(ARRAYS, name)));
const textOf = (/** @type {Uint8Array} */ bytes) => new TextDecoder('latin1').decode(bytes);

/** An array of doubles, row by row. @param {number[]} shape @param {number[]} values */
function npy(shape, values) {
  const dict = `{'descr': '<f8', 'fortran_order': False, 'shape': (${shape.join(', ')},), }`.padEnd(117) + '\n';
  const head = Uint8Array.of(
    0x93,
    ...new TextEncoder().encode('NUMPY'),
    1,
    0,
    118,
    0,
    ...new TextEncoder().encode(dict),
  );
  return Uint8Array.of(...head, ...new Uint8Array(Float64Array.from(values).buffer));
}

test('an archive of ranges, angles and times is a table of scans', async () => {
  const { files, notes } = await converted({ 'scans.npz': array('scans.npz') });
  assert.deepEqual(notes, []);
  const [first = '', row = ''] = textOf((await files[0]?.read()) ?? new Uint8Array()).split('\n');
  assert.equal(first, '# table: ranges=2:37,start=-90deg,step=5deg,time=1');
  const numbers = row.split(' ').map(Number);
  assert.deepEqual(
    [numbers.length, numbers[0], numbers[1]?.toFixed(6), numbers[36]?.toFixed(6)],
    [37, 0, '2.000000', '2.350000'],
  );
});

test('an archive of nothing but lists of points is a cloud each', async () => {
  const points = (/** @type {number} */ count) =>
    npy(
      [count, 3],
      Array.from({ length: 3 * count }, (_, i) => i % 7),
    );
  const zipped = (/** @type {Record<string, Uint8Array>} */ arrays) => converted({ 'clouds.npz': zipSync(arrays) });
  const { files, notes } = await zipped({ 'a.npy': points(40), 'b.npy': points(50) });
  assert.deepEqual(
    [notes, files.map(({ path, isCloud }) => [path, isCloud])],
    [
      [],
      [
        ['clouds_a.npy', true],
        ['clouds_b.npy', true],
      ],
    ],
  );
  assert.match(textOf((await files[1]?.read()) ?? new Uint8Array()), /^ply\n[^]*element vertex 50\n/);
  const other = await zipped({ 'ranges.npy': npy([2, 40], Array(80).fill(2)), 'points.npy': points(40) });
  assert.deepEqual(
    other.files.map(({ path }) => path),
    ['clouds.txt'],
  );
});

test('a stack of lists of points is a planar scan or a cloud each', async () => {
  for (const [columns, ending] of /** @type {const} */ ([
    [2, 'ply'],
    [3, 'npy'],
  ])) {
    const values = Array.from({ length: 3 * 30 * columns }, (_, i) => i);
    const { files, notes } = await converted({ 'scans.npy': npy([3, 30, columns], values) });
    assert.deepEqual(notes, []);
    assert.deepEqual(
      files.map(({ path, isCloud }) => [path, isCloud]),
      [0, 1, 2].map((at) => [`scans_00000${at}.${ending}`, columns === 3 ? true : undefined]),
    );
    const bytes = (await files[2]?.read()) ?? new Uint8Array();
    const text = textOf(bytes);
    assert.match(text, /^ply\n[^]*element vertex 30\n/);
    const start = text.indexOf('end_header\n') + 'end_header\n'.length;
    const Numbers = text.includes('property double x') ? Float64Array : Float32Array;
    const [x, y, z] = new Numbers(bytes.slice(start, start + 3 * Numbers.BYTES_PER_ELEMENT).buffer);
    assert.deepEqual([x, y, z], [60 * columns, 60 * columns + 1, columns === 3 ? 60 * columns + 2 : 0]);
  }
});

test('a stack of depth images is an image each, and an archive with one and its colours a frame', async () => {
  const { files } = await converted({ 'depth.npy': array('depth.npy') });
  assert.deepEqual(
    files.map(({ path }) => path),
    ['depth_000000.pgm', 'depth_000001.pgm'],
  );
  const second = (await files[1]?.read()) ?? new Uint8Array();
  const header = 'P5\n32 24\n65535\n';
  assert.equal(textOf(second.subarray(0, header.length)), header);
  const view = new DataView(second.buffer, second.byteOffset + header.length);
  assert.deepEqual([view.getUint16(0), view.getUint16(2 * 32 * 23)], [1100, 1123]);
  const frame = await converted({ '0000.npz': array('0000.npz') });
  assert.deepEqual(
    frame.files.map(({ path }) => path),
    ['0000_depth.pfm', '0000_rgb.ppm'],
  );
  const pfm = (await frame.files[0]?.read()) ?? new Uint8Array();
  const values = new DataView(pfm.buffer, pfm.byteOffset + pfm.length - 4 * 32 * 24);
  // The last row comes first.
  assert.equal(values.getFloat32(0, true), Math.fround(1.023));
  const ppm = (await frame.files[1]?.read()) ?? new Uint8Array();
  assert.deepEqual([...ppm.subarray(-3)], [10, 20, 30]);
});

test('the camera and the poses in an archive of images are files beside them', async () => {
  const numbers = (/** @type {number} */ count) => Array.from({ length: count }, (_, at) => at);
  const archive = zipSync({
    'depth.npy': npy([2, 24, 24], Array(2 * 24 * 24).fill(1.5)),
    'K.npy': npy([3, 3], [585, 0, 320, 0, 585, 240, 0, 0, 1]),
    'poses.npy': npy([2, 4, 4], numbers(32)),
    'gains.npy': npy([3, 3], numbers(9)),
  });
  const { files } = await converted({ 'room/data.npz': archive });
  assert.deepEqual(
    files.map(({ path }) => path),
    ['room/data_depth_000000.pfm', 'room/data_depth_000001.pfm', 'room/camera-intrinsics.txt', 'room/GT_pose.npy'],
  );
  assert.equal(textOf((await files[2]?.read()) ?? new Uint8Array()), '585 0 320\n0 585 240\n0 0 1\n');
  assert.deepEqual(await files[3]?.read(), npy([2, 4, 4], numbers(32)));
});

test('arrays of two columns are points or readings, of three clouds, of one scans; poses stay what they are', async () => {
  const rows = Array.from({ length: 40 }, (_, at) => at);
  const circle = rows.flatMap((at) => [3 * Math.cos(at / 20), 2 * Math.sin(at / 20)]);
  const readings = rows.flatMap((at) => [(at - 20) / 20, 2 + at / 100]);
  const cloud = rows.flatMap((at) => [at / 10, Math.sin(at), Math.cos(at)]);
  const { files, notes } = await converted({
    'a/points.npy': npy([40, 2], circle),
    'b/readings.npy': npy([40, 2], readings),
    'c/0.npy': npy([40, 3], cloud),
    'c/1.npy': npy([40, 3], cloud),
    'd/scan_0.npy': npy([40], rows),
    'e/odometry.npy': npy([40, 3], cloud),
    'f/GT_pose.npy': npy([40, 7], Array(280).fill(0.5)),
    'g/objects.npy': array('objects.npy'),
  });
  assert.deepEqual(
    files.map(({ path, isCloud = false }) => [path, isCloud]),
    [
      ['a/points.ply', false],
      ['b/readings.txt', false],
      ['c/0.npy', true],
      ['c/1.npy', true],
      ['d/scan_0.txt', false],
      ['e/odometry.npy', false],
      ['f/GT_pose.npy', false],
    ],
  );
  assert.match(
    textOf((await files[1]?.read()) ?? new Uint8Array()),
    /^# table: range=2,angle=1:rad\nangle,range\n-1,2\n/,
  );
  assert.match(notes[0]?.reason ?? '', /does not hold plain numbers/);
});

test('tables of two columns: bearings are even, the x of points is not', () => {
  const rows = Array.from({ length: 360 }, (_, at) => at);
  const decode = (/** @type {Uint8Array | null} */ bytes) => bytes && textOf(bytes).split('\n');
  const turned = decode(polarTable(rows.map((at) => [(270 + at) % 360, 1500 + at])));
  // One turn that begins at 270 degrees is one scan.
  assert.deepEqual([turned?.[0], turned?.[2], turned?.[361]], ['# table: range=2,angle=1:deg', '270,1500', '629,1859']);
  const two = decode(polarTable([...rows, ...rows].map((at) => [at, 2])));
  assert.deepEqual([two?.length, two?.[362], two?.[722]], [724, '0,2', '# direction: unknown']);
  assert.equal(polarTable(rows.map((at) => [3 * Math.cos(at / 57), 3 * Math.sin(at / 57) + 4])), null);
  assert.equal(polarTable(rows.map((at) => [at / 100, at % 2 === 0 ? -1 : 1])), null);
});

test('no array is believed to be longer than its file, and of long ones each row is read once', async () => {
  const { files, notes } = await converted({ 'depth.npy': npy([1e9, 24, 24], [1]) });
  assert.match(notes.map(({ reason }) => reason).join(), /1000000000 x 24 x 24 numbers is cut off/);
  assert.ok(files.length <= 1);
  const rows = Array.from({ length: 300_000 }, (_, at) => [at, at % 7]);
  const before = process.cpuUsage();
  assert.equal(polarTable(rows), null);
  // It takes tenths of a second; to read all rows again for each of them takes minutes.
  assert.ok(process.cpuUsage(before).user < 10e6, 'in 10 s of the processor');
});
