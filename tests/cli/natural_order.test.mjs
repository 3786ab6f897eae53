// @ts-check
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { compareNaturally } from '../../npm/base/natural_order.js';

test('names are ordered as people number them, folder by folder', () => {
  const ordered = [
    '',
    '0.ply',
    '1.ply',
    '02.ply',
    '2.ply',
    '10.ply',
    '99999999999999999998.ply',
    '99999999999999999999.ply',
    'B.ply',
    'c.ply',
    'scan/10.ply',
    'scan b/1.ply',
    'scan2/1.ply',
    'scan2/1b.ply',
    'scan10/0.ply',
  ];
  for (let rotation = 0; rotation < ordered.length; rotation += 1) {
    const shuffled = [...ordered.slice(rotation), ...ordered.slice(0, rotation)].reverse();
    assert.deepEqual(shuffled.sort(compareNaturally), ordered);
  }
});

test('it is an order: every name equals itself alone', () => {
  const names = ['1', '01', '001', '1a1', '01a1', '1a01', 'a1', 'A1', '1.5', '1.05', 'a/1', 'a', 'a/', 'a//1', 'a\\1'];
  for (const a of names) {
    for (const b of names) {
      const order = Math.sign(compareNaturally(a, b));
      assert.equal(order, -Math.sign(compareNaturally(b, a)) || 0, `${a} ${b}`);
      assert.equal(order === 0, a === b, `${a} ${b}`);
    }
  }
});
