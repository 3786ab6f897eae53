// @ts-check
/** What a single file is, by its name and its first bytes. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { classify } from '../../npm/recording/classify.js';
import { readImage, readNpyShape, readPlyExtent } from '../../npm/recording/heads.js';
import { DEPTH16, encode, npy, PALETTE, PGM, SPACE } from './recording_files.mjs';
import { asciiPly } from './support.mjs';

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
