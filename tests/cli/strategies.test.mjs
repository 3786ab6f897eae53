// @ts-check
/** `scanstitch strategies` on a made-up room: the table, the files, and what is refused. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { WALK, walkFiles } from './depth_room.mjs';
import { ROOT, scanstitch, temporaryFolder } from './support.mjs';

/** @param {import('node:test').TestContext} t */
function room(t) {
  const folder = temporaryFolder(t);
  for (const [path, contents] of Object.entries(walkFiles())) {
    mkdirSync(dirname(join(folder, 'walk', path)), { recursive: true });
    writeFileSync(join(folder, 'walk', path), contents);
  }
  return { folder, walk: join(folder, 'walk') };
}

/** Rows of a CSV file by the names of their columns; no cell of these has a comma. @param {string} path */
function readCsv(path) {
  const [heads = [], ...rows] = readFileSync(path, 'utf8')
    .trimEnd()
    .split('\n')
    .map((line) => line.split(','));
  return rows.map((row) => Object.fromEntries(heads.map((head, index) => [head, row[index] ?? ''])));
}

test('the default set: a line a strategy, in the table and in the file', async (t) => {
  const { folder, walk } = room(t);
  const [out, frames] = [join(folder, 'table.csv'), join(folder, 'frames.csv')];
  const { status, stdout, stderr } = await scanstitch(['strategies', walk, '--out', out, '--frames', frames]);
  assert.equal(status, 0, stderr);
  const names = ['plain', 'voxels_0.1', 'voxels_0.3', 'planar', 'golden_data', 'adaptive', 'together'];
  const lines = stdout.trimEnd().split('\n');
  assert.match(lines[0] ?? '', /^strategy +Frames +Lost +Map points +Map size \(MB\) +Median time \(ms\)/);
  assert.deepEqual(
    lines.slice(1).map((line) => line.split(/\s+/)[0]),
    names,
  );
  const rows = readCsv(out);
  assert.deepEqual(
    rows.map(({ strategy }) => strategy),
    names,
  );
  for (const row of rows) {
    assert.equal(Number(row.frames), WALK.length);
    assert.equal(Number(row.lost), 0, row.strategy);
    assert.equal(Number(row.map_bytes), 24 * Number(row.map_points));
    assert.ok(Number(row.ape_mean) < 0.05, `${row.strategy}: ${row.ape_mean}`);
    assert.ok(Number(row.ms_median) > 0 && row.ms_slope !== '' && Number(row.ms_slope_error) >= 0);
  }
  assert.ok(Number(rows[0]?.map_bytes) > 3 * Number(rows[1]?.map_bytes));
  assert.equal(rows[3]?.motion, 'planar');
  const perFrame = readCsv(frames);
  assert.equal(perFrame.length, names.length * WALK.length);
  assert.ok(perFrame.every(({ ms, error }) => Number(ms) > 0 && error !== ''));
});

test('strategies of one’s own, as JSON', async (t) => {
  const { walk } = room(t);
  const own = 'voxels_0.1, kept=mean, crop_distance=2';
  const { status, stdout, stderr } = await scanstitch([
    'strategies',
    walk,
    '--strategies',
    'planar',
    '--strategy',
    own,
    '--json',
  ]);
  assert.equal(status, 0, stderr);
  const results = JSON.parse(stdout);
  assert.deepEqual(
    results.map((/** @type {{ name: string }} */ { name }) => name),
    ['planar', own],
  );
  assert.equal(results[1].settings.kept, 'mean');
  assert.equal(results[1].settings.crop_distance, 2);
  assert.equal(results[0].milliseconds.length, WALK.length);
  assert.equal(results[0].comparison.num_matched, WALK.length);
  assert.ok(results[0].sharpness.mean_plane_variance > 0);
});

test('planar scans: the presets of the reconstruction, and settings of one’s own', async (t) => {
  const { folder } = room(t);
  const [out, frames] = [join(folder, 'table.csv'), join(folder, 'frames.csv')];
  const own = 'sharpest, metric=point_to_point';
  const scans = join(ROOT, 'www/samples/corridor');
  const args = ['strategies', scans, '--strategies', 'sharpest,homework', '--strategy', own];
  const { status, stdout, stderr } = await scanstitch([...args, '--out', out, '--frames', frames]);
  assert.equal(status, 0, stderr);
  assert.match(
    stdout,
    /^strategy +Frames +Lost +Doubtful +Map points +Median time \(ms\) +Total time \(ms\) +Sharpness/,
  );
  const rows = readCsv(out);
  assert.equal(rows.length, 3);
  assert.match(stdout, /\nsharpest, metric=point_to_point +10 /);
  const [sharpest, homework] = rows;
  for (const row of rows.slice(0, 2)) {
    assert.equal(row.frames, '10');
    assert.ok(Number(row.ms_total) > 0 && Number(row.ape_mean) < 0.05, row.strategy);
  }
  assert.ok(Number(homework?.ape_mean) > 3 * Number(sharpest?.ape_mean));
  assert.ok(Number(homework?.mean_residual) > Number(sharpest?.mean_residual));
  const perFrame = readCsv(frames);
  assert.equal(perFrame.length, 30);
  // The poses are those of a reconstruction.
  const made = await scanstitch(['reconstruct', scans, '--preset', 'homework', '--out', join(folder, 'homework')]);
  assert.equal(made.status, 0, made.stderr);
  const report = JSON.parse(readFileSync(join(folder, 'homework', 'report.json'), 'utf8'));
  const [{ x }] = report.frames.slice(-1).map((/** @type {any} */ frame) => frame.T_world_sensor);
  const last = perFrame.filter(({ strategy }) => strategy === 'homework').at(-1);
  assert.equal(Number(last?.x), x);
});

test('what cannot be is one line', async (t) => {
  const { folder, walk } = room(t);
  /** @type {[string[], RegExp][]} */
  const cases = [
    [['strategies'], /No input was given/],
    [['strategies', walk, '--strategies', 'fastest'], /no preset "fastest" for strategies\. There are: plain, /],
    [
      ['strategies', join(ROOT, 'www/samples/corridor'), '--strategies', 'plain'],
      /no preset "plain" for planar scans\. There are: sharpest, /,
    ],
    [['strategies', walk, '--strategy', 'planar, kept=last'], /kept is one of first, newest, mean/],
    [['strategies', walk, '--strategy', 'planar, map_voxel_size=0'], /map_voxel_size = 0 is out of its limits/],
    [['strategies', folder, '--recording', 'nowhere'], /there is no such folder/],
    [['strategies', join(folder, 'none')], /no such file/],
    [['reconstruct', walk, '--map-format', 'las'], /--map-format las: it is one of ply, ply-ascii, pcd, /],
  ];
  for (const [args, expected] of cases) {
    const { status, stdout, stderr } = await scanstitch(args);
    assert.equal(status, 1, args.join(' '));
    assert.match(stderr, expected);
    assert.equal(stdout, '');
  }
});

test('maps in every format hold the same points', async (t) => {
  await engine.load();
  const { folder, walk } = room(t);
  const maps = [];
  for (const format of ['ply', 'ply-ascii', 'pcd', 'pcd-ascii', 'pcd-compressed']) {
    const out = join(folder, format);
    const made = await scanstitch(['reconstruct', walk, '--out', out, '--map-format', format]);
    assert.equal(made.status, 0, made.stderr);
    const name = `map.${format.slice(0, 3)}`;
    const map = readFileSync(join(out, name));
    const head = map.subarray(0, 600).toString('latin1');
    const encoding = /^(?:format|DATA) (\w+)/m.exec(head)?.[1];
    const expected = { ply: 'binary_little_endian', 'ply-ascii': 'ascii', pcd: 'binary', 'pcd-ascii': 'ascii' };
    assert.equal(encoding, expected[/** @type {keyof typeof expected} */ (format)] ?? 'binary_compressed');
    const cloud = engine.PointCloud.read(map, name);
    maps.push({ size: map.length, points: cloud.positions(), normals: cloud.normals(), colors: cloud.colors() });
    cloud.free();
  }
  const [{ size: _, ...first }, ...others] = /** @type {[typeof maps[0], ...typeof maps]} */ (maps);
  assert.ok(first.points.length > 100_000);
  for (const { size, ...other } of others) assert.deepEqual(other, first);
  const files = [join(folder, 'ply', 'map.ply'), join(folder, 'pcd-compressed', 'map.pcd')];
  const [ply, pcd] = JSON.parse((await scanstitch(['map-quality', ...files, '--json'])).stdout);
  assert.equal(pcd.mean_map_entropy, ply.mean_map_entropy);
  assert.ok((maps[4]?.size ?? 0) < (maps[2]?.size ?? 0));
});
