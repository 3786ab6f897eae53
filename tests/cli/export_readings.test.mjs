// @ts-check
/** What programs of others read in the exports: rosbags, GTSAM, GDAL, ezdxf, trimesh, and nav2's semantics by Pillow and PyYAML. */
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { ORIGIN, ROWS, SIDE, world, writeExports, YAW } from './exported_files.mjs';
import { ROOT, temporaryFolder } from './support.mjs';

const READINGS = JSON.parse(readFileSync(join(ROOT, 'tests', 'cli', 'export_readings.json'), 'utf8'));
const [WIDTH, HEIGHT] = [ROWS[0]?.length ?? 0, ROWS.length];
/** The cells in which the areas are. */
const isInArea = (/** @type {number} */ column, /** @type {number} */ row) =>
  row === 1 && (column === 1 || column === 2);

/** A value for each cell, from the lowest row up. @param {(column: number, row: number) => number} value */
const cells = (value) =>
  Array.from({ length: HEIGHT }, (_, row) => Array.from({ length: WIDTH }, (_, column) => value(column, row)));
/** What the map has in a cell. @param {Record<string, number>} values */
const ofMap = (values) => cells((column, row) => values[ROWS[HEIGHT - 1 - row]?.[column] ?? ''] ?? NaN);

/** @param {number[][]} actual @param {number[][]} expected */
function assertNear(actual, expected) {
  const round = (/** @type {number[][]} */ points) => points.map((point) => point.map((v) => Number(v.toFixed(3)) + 0));
  assert.deepEqual(round(actual), round(expected));
}

test('other programs read in the exports what was meant', async (t) => {
  const folder = temporaryFolder(t);
  const chiSquared = await writeExports(folder);
  /** @type {Record<string, any>} */
  const read = {};
  for (const [name, reading] of Object.entries(READINGS)) {
    const names = name.endsWith('.yaml') ? [name, name.replace('.yaml', '.pgm')] : [name];
    const digest = createHash('sha256');
    for (const each of names) digest.update(readFileSync(join(folder, each)));
    const remedy = `${name} is another file than the programs of others have read: see tests/cli/export_readings.py`;
    assert.equal(digest.digest('hex'), reading.sha256, remedy);
    read[name] = reading.read;
  }

  const expected = {
    'map.yaml': ofMap({ '#': 100, '.': 0, '?': -1 }),
    'keepout_mask.yaml': cells((column, row) => (isInArea(column, row) ? 100 : 0)),
    'speed_mask.yaml': cells((column, row) => (isInArea(column, row) ? 60 : 0)),
  };
  for (const [name, values] of Object.entries(expected)) {
    assert.deepEqual(read[name].cells, values, name);
    assertNear([[read[name].resolution, ...read[name].origin]], [[SIDE, ...ORIGIN, YAW]]);
  }

  const { '/map': map, '/path': path, '/scan_points': scans, '/tf': tf } = read['map.mcap'];
  assert.deepEqual(map.messages, [
    {
      time: '1700000000500000000',
      read: { size: [3, 2], resolution: 0.5, origin: [-1, 1.5, 0], cells: [0, 0, 100, 100, 0, -1] },
    },
  ]);
  const places = [
    [1, 2, 0],
    [3, 2, 0],
  ];
  assert.deepEqual(path.messages[0].read, places);
  // Each scan where /tf places it.
  const drawn = scans.messages.flatMap((/** @type {any} */ { time, read: { frame, points } }) => {
    const transforms = tf.messages.filter((/** @type {any} */ message) => message.time === time);
    const [[parent, child, [x, y], [sin, cos]]] = transforms[0].read;
    assert.deepEqual([parent, child], ['map', frame]);
    const turn = 2 * Math.atan2(sin, cos);
    return points.map((/** @type {number[]} */ [px = 0, py = 0]) => [
      x + px * Math.cos(turn) - py * Math.sin(turn),
      y + px * Math.sin(turn) + py * Math.cos(turn),
    ]);
  });
  assertNear(drawn, [
    [1, 3],
    [0, 2],
    [4, 2.5],
  ]);

  const { poses, chi_squared, optimum } = read['graph.g2o'];
  assert.equal(poses, 4);
  for (const value of [chi_squared, optimum]) assert.ok(Math.abs(value - chiSquared) < 1e-6 * chiSquared);

  const { transform, nodata, greys } = read['map.tif'];
  const [xx = 0, xy = 0, x0 = 0, yx = 0, yy = 0, y0 = 0] = transform;
  assertNear([[x0 + 3 * xx + 2 * xy, y0 + 3 * yx + 2 * yy]], [world(3, HEIGHT - 2)]);
  assert.deepEqual([nodata, greys.toReversed()], [205, ofMap({ '#': 0, '.': 254, '?': 205 })]);

  // The outside, the room and the pillar of two cells.
  const corners = [
    [0, 0, 6, 5],
    [1, 1, 5, 4],
    [2, 2, 4, 3],
  ].map(([left = 0, low = 0, right = 0, high = 0]) => [
    world(left, low),
    world(right, low),
    world(right, high),
    world(left, high),
  ]);
  const sorted = (/** @type {number[][][]} */ lines) =>
    lines.map((line) => line.toSorted(([ax = 0, ay = 0], [bx = 0, by = 0]) => ax - bx || ay - by)).flat();
  assertNear(sorted(read['walls.dxf']), sorted(corners));
  // 20 cells, 2.5 m high, in cubic millimetres.
  const { is_watertight, volume } = read['walls.stl'];
  assert.ok(is_watertight && Math.abs(volume - 1e9 * 20 * SIDE ** 2 * 2.5) < 1e-6 * volume);
});
