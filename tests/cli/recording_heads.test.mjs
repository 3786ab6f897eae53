// @ts-check
/** What a single file is, by its name and its first bytes. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { understand } from '../../npm/recording/understand.js';
import { classify, isColumn } from '../../npm/recording/classify.js';
import { readImage, readNpyShape, readPlyExtent } from '../../npm/files/heads.js';
import { DEPTH16, encode, npy, PALETTE, PGM, SPACE } from './recording_files.mjs';
import { asciiPly } from './support.mjs';

test('what planar files are for, by name and first bytes', () => {
  const role = (/** @type {string} */ name, text = '') => classify(name, encode(text)).role;
  assert.equal(role('a/B.PLY'), 'scan');
  assert.equal(role('no_extension', 'ply\r\nformat ascii 1.0'), 'scan');
  assert.equal(role('truth.tum'), 'reference');
  assert.equal(role('gt.csv', 'x,y,z\n1.5,2,0\n2,2,0\n'), 'reference');
  for (const name of ['x.npy', 'x.pcd', 'x.png', 'x.zip', 'x.doc']) assert.equal(role(name), 'ignored');
  const reason = (/** @type {string} */ name) => JSON.stringify(classify(name, encode('')));
  assert.match(reason('x.npy'), /holds neither scans nor points/);
  assert.match(reason('x.pcd'), /does not lie in the plane z = 0/);
  for (const name of ['x.bag', 'x.db3', 'x.mcap']) assert.match(reason(name), /a bag, which is opened by itself/);
  assert.deepEqual(classify('../.DS_Store', new Uint8Array()), { role: 'ignored', reason: null });
});

test('heads: images, arrays, clouds', () => {
  assert.deepEqual(readImage(DEPTH16), { format: 'PNG', channels: 'grey', bits: 16 });
  assert.deepEqual(readImage(PALETTE), { format: 'PNG', channels: 'palette', bits: 8 });
  assert.deepEqual(readImage(PGM), { format: 'PGM', channels: 'grey', bits: 16 });
  assert.deepEqual(readImage(encode('P6 640 480 255 ')), { format: 'PPM', channels: 'color', bits: 8 });
  assert.equal(readImage(encode('PNG, honestly')), null);
  assert.equal(readImage(DEPTH16.subarray(0, 20)), null);
  assert.deepEqual(readNpyShape(npy('80, 7')), [80, 7]);
  assert.deepEqual(readNpyShape(npy('80,')), [80]);
  assert.equal(readNpyShape(encode('shape')), null);
  assert.equal(readPlyExtent(encode(SPACE)), 'space');
  assert.equal(readPlyExtent(encode(asciiPly([[1, 2, 0]]))), 'plane');
  assert.equal(readPlyExtent(encode(asciiPly([]))), 'unknown');
  assert.equal(readPlyExtent(encode(asciiPly([[Number.NaN, Number.NaN, Number.NaN]]))), 'unseen');
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

test('a binary cloud whose faces come first is looked into behind them', () => {
  const header = (/** @type {string} */ format) =>
    `ply\nformat ${format} 1.0\nelement face 2\nproperty list uchar int vertex_indices\nproperty uchar kind\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n`;
  for (const [z, extent] of /** @type {const} */ ([
    [0, 'plane'],
    [0.25, 'space'],
  ])) {
    for (const littleEndian of [true, false]) {
      const body = new DataView(new ArrayBuffer(1 + 12 + 1 + (1 + 16 + 1) + 24));
      body.setUint8(0, 3);
      body.setUint8(14, 4);
      body.setFloat32(32 + 8, z, littleEndian);
      const head = encode(header(`binary_${littleEndian ? 'little' : 'big'}_endian`));
      assert.equal(readPlyExtent(Uint8Array.of(...head, ...new Uint8Array(body.buffer))), extent);
      assert.equal(readPlyExtent(Uint8Array.of(...head, ...new Uint8Array(body.buffer, 0, 20))), 'unknown');
    }
  }
});

test('graphs of poses and columns of numbers are named as such', async () => {
  const edges = 'EDGE2 0 9 1 0 0.5 100 0 100 400 0 0\n'.repeat(30);
  assert.match(JSON.stringify(classify('a.places.txt', encode(edges))), /relations between poses, without scans/);
  assert.equal(classify('a.log', encode(`VERTEX2 0 1 2 3\nROBOTLASER1 0 1\n${edges}`)).role, 'scan');
  const column = Array.from({ length: 50 }, (_, at) => `${2 + Math.sin(at)}\n`).join('');
  const times = Array.from({ length: 50 }, (_, at) => `${100 + at}.5\n`).join('');
  assert.deepEqual(
    [column, times, '1\n2\n'].map((text) => isColumn(encode(text))),
    [true, false, false],
  );
  assert.equal(classify('scan_0.txt', encode(column), true).role, 'scan');
  const file = (/** @type {string} */ path) => ({ path, size: column.length });
  const read = async () => encode(column);
  // Alone it may be a scan, and is asked about; of several it is not known what they are.
  assert.deepEqual((await understand([file('scan_0.txt')], read)).tables, ['scan_0.txt']);
  const { kind, notes } = await understand([file('scan_0.txt'), file('scan_1.txt')], read);
  assert.equal(kind, 'nothing');
  assert.match(notes[0]?.reason ?? '', /a number a line; .* give one alone/);
});
