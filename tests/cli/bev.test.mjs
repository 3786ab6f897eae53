// @ts-check
/** `scanstitch bev` and the API beneath it: the published numbers, every output, refinement, bad input. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { ROOT, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** Marked in the top view, and where they are published to land in the front view. */
const MARKED = '145,87\n215,301\n356,372\n424,211\n295,70\n';
const PUBLISHED = [
  [204, 374],
  [225, 449],
  [351, 500],
  [356, 408],
  [273, 370],
];

await engine.load();

/** @param {string} name */
function preset(name) {
  const found = engine.bev_presets().find((one) => one.name === name);
  assert.ok(found);
  return structuredClone(found.scene);
}

test('a scene and points: the published integers, as CSV and as JSON', async (t) => {
  const folder = temporaryFolder(t);
  const [scene = '', points = ''] = writeFiles(folder, {
    'scene.json': JSON.stringify(preset('homework_numbers')),
    'points.csv': MARKED,
  });
  const csv = await scanstitch(['bev', '--scene', scene, '--points', points, '--truncate']);
  assert.deepEqual([csv.status, csv.stderr], [0, '']);
  const lines = csv.stdout.trim().split('\n');
  assert.equal(lines[0], 'number,top_u,top_v,x,y,z,front_u,front_v,status');
  const landed = lines.slice(1).map((line) => line.split(',').slice(6, 8).map(Number));
  assert.deepEqual(landed, PUBLISHED);

  const out = join(folder, 'projected.json');
  const json = await scanstitch(['bev', '--scene', scene, '--points', points, '--round', '--polygon', '--out', out]);
  assert.deepEqual([json.status, json.stdout], [0, '']);
  const report = JSON.parse(readFileSync(out, 'utf8'));
  assert.deepEqual(report.points[2].projected, [352, 501]);
  assert.equal(report.homography.length, 3);
  assert.equal(report.polygon.is_clipped, false);
  assert.equal(report.scene.front.width, 512);
  const [u = 0, v = 0, w = 1] = report.homography.map(
    (/** @type {[number, number, number]} */ [a, b, c]) => a * 145 + b * 87 + c,
  );
  assert.ok(Math.hypot(u / w - 204.6148282097649, v / w - 374.50994575045206) < 1e-9);
});

test('from stdin, with a preset, and back from the front view', () => {
  const run = (/** @type {string[]} */ args, /** @type {string} */ input) =>
    spawnSync(process.execPath, [join(ROOT, 'npm', 'cli.js'), 'bev', '--points', '-', ...args], {
      input,
      encoding: 'utf8',
    });
  const there = run(['--preset', 'homework_numbers'], MARKED);
  assert.equal(there.status, 0, there.stderr);
  const back = run(['--preset', 'homework_numbers', '--from', 'front'], there.stdout);
  assert.equal(back.status, 0, back.stderr);
  assert.match(back.stdout, /^number,front_u,front_v,x,y,z,top_u,top_v,status\n/);
  const rows = back.stdout.trim().split('\n').slice(1);
  for (const [index, line] of MARKED.trim().split('\n').entries()) {
    const [u = 0, v = 0] = line.split(',').map(Number);
    const [, , , , , , found_u = 0, found_v = 0] = (rows[index] ?? '').split(',').map(Number);
    assert.ok(Math.hypot(found_u - u, found_v - v) < 1e-8, rows[index]);
  }
});

test('points that the front view does not show are told, and have no pixel', () => {
  const view = new engine.BirdsEyeView(preset('homework_views'));
  const points = view.points(Float64Array.of(256, 128, 256, 400, 20, 240), 'top');
  assert.deepEqual(
    points.map(({ status }) => status),
    ['visible', 'behind_camera', 'outside_image'],
  );
  assert.equal(points[1]?.projected, null);
  assert.equal(view.points(Float64Array.of(256, 100), 'front')[0]?.status, 'no_ground');
  const { projected, cuts, is_clipped } = view.polygon(Float64Array.of(200, 60, 310, 60, 310, 400, 200, 400), 'top');
  assert.equal(is_clipped, true);
  assert.deepEqual(cuts, [false, false, true, false]);
  assert.ok(projected.every(([u, v]) => u >= -0.5 && u <= 511.5 && v >= -0.5 && v <= 511.5));
  assert.equal(view.segments(Float64Array.of(256, 60, 256, 400, 256, 300, 256, 400), 'top').length, 1);
  assert.equal(view.layout(10).top.height, 2.5);
  view.free();
});

test('pairs refine the front camera, and the refined scene is used', async (t) => {
  const folder = temporaryFolder(t);
  const truth = preset('homework_views');
  const view = new engine.BirdsEyeView(truth);
  const marked = [120, 40, 380, 60, 250, 120, 160, 130, 340, 25];
  const lines = view
    .points(Float64Array.from(marked), 'top')
    .map(({ marked, projected }) => [...marked, ...(projected ?? [])].join(','));
  view.free();
  const guess = structuredClone(truth);
  assert.equal(guess.front.pose.kind, 'euler');
  guess.front.pose.position[1] = 1.2;
  guess.front.pose.angles[0] = 0.05;
  const [scene = '', pairs = '', points = ''] = writeFiles(folder, {
    'scene.json': JSON.stringify(guess),
    'pairs.csv': `top_u,top_v,front_u,front_v\n${lines.join('\n')}\n`,
    'points.csv': '256,128\n',
  });
  const { status, stdout, stderr } = await scanstitch([
    ...['bev', '--scene', scene, '--pairs', pairs, '--points', points, '--refine', 'pitch,height', '--json'],
  ]);
  assert.equal(status, 0, stderr);
  assert.match(stderr, /^note: front camera turned up by -2\.865 degrees, raised by -0\.2000 m, .*rmse .* after\n/);
  const report = JSON.parse(stdout);
  assert.ok(Math.abs(report.scene.front.pose.position[1] - 1) < 1e-9);
  assert.ok(report.refinement.converged && report.refinement.rmse < 1e-6);
  assert.ok(Math.abs(report.points[0].projected[1] - 460.8) < 1e-6);
});

test('the same scene in other axes projects alike', () => {
  const scene = preset('homework_views');
  const marked = Float64Array.of(300, 100);
  const projected = (/** @type {import('../../npm/index.js').BevScene} */ scene) => {
    const view = new engine.BirdsEyeView(scene);
    const [point] = view.points(marked, 'top');
    view.free();
    assert.ok(point?.projected);
    return point.projected;
  };
  const [u, v] = projected(scene);
  for (const axes of /** @type {const} */ (['opencv', 'habitat', 'robotics', 'ros_optical'])) {
    const [other_u, other_v] = projected(engine.bev_in_axes(scene, axes));
    assert.ok(Math.hypot(other_u - u, other_v - v) < 1e-9, axes);
  }
});

test('bad input: one line each, exit code 1', async (t) => {
  const folder = temporaryFolder(t);
  const with_change = (/** @type {(scene: any) => void} */ change) => {
    const scene = preset('homework_views');
    change(scene);
    return JSON.stringify(scene);
  };
  const flat = [
    [1, 0, 0, 0],
    [0, 1, 0, 1],
    [2, 0, 0, 0],
    [0, 0, 0, 1],
  ];
  const [good = '', wide = '', singular = '', edge = '', words = '', prose = '', points = '', cut = ''] = writeFiles(
    folder,
    {
      'good.json': with_change(() => {}),
      'wide.json': with_change((scene) => {
        scene.front.intrinsics.field_of_view = Math.PI;
      }),
      'singular.json': with_change((scene) => {
        scene.front.pose = { kind: 'matrix', T_world_camera: flat };
      }),
      'edge.json': with_change((scene) => {
        scene.plane.height = 1;
      }),
      'words.json': with_change((scene) => {
        scene.top.width = 'wide';
      }),
      'prose.json': 'Dear professor,\n',
      'points.csv': MARKED,
      'cut.csv': '1,2\n3\n',
    },
  );
  const cases = /** @type {[string[], RegExp][]} */ ([
    [['--scene', wide, '--points', points], /front camera's field of view is 180 degrees/],
    [['--scene', singular, '--points', points], /front camera is singular/],
    [['--scene', edge, '--points', points], /ground passes through the front camera/],
    [['--scene', words, '--points', points], /words\.json, line 1: invalid type: string "wide"/],
    [['--scene', prose, '--points', points], /prose\.json, line 1: /],
    [['--scene', good, '--points', cut], /cut\.csv, line 2: The line has 1 of 2 numbers/],
    [['--scene', good, '--points', join(folder, 'none.csv')], /none\.csv: There is no such file/],
    [['--scene', good, '--points', points, '--out', join(folder, 'no', 'where.csv')], /where\.csv: /],
    [['--scene', good], /--points FILE/],
    [['--scene', good, '--points', points, '--round', '--truncate'], /not both/],
    [['--scene', good, '--preset', 'homework_views', '--points', points], /not both/],
    [['--preset', 'mine', '--points', points], /There are: homework_views, homework_numbers/],
    [['--scene', good, '--points', points, '--from', 'left'], /--from is one of top, front/],
    [['--scene', good, '--pairs', points], /points\.csv, line 1: The line has 2 of 4 numbers/],
  ]);
  for (const [args, message] of cases) {
    const { status, stdout, stderr } = await scanstitch(['bev', ...args]);
    assert.match(stderr, message);
    assert.equal(stderr.trim().split('\n').length, 1, stderr);
    assert.deepEqual([status, stdout], [1, '']);
  }
  assert.throws(() => engine.check_bev_image(preset('homework_views'), 'top', 640, 480), /640 x 480 .*512 x 512/);
});
