// @ts-check
/** One registration looked into, and somebody's own ICP beside it. */
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { bestRotation, difference, multiplied, moved, poseOf, sumsOf } from '../../npm/base/matrices.js';
import { DATA, SAMPLES, scanstitch, skipWithoutData, temporaryFolder, writeFiles } from './support.mjs';

await engine.load();

const [SOURCE, TARGET] = ['3.ply', '2.ply'].map((name) => join(SAMPLES, name));
/** What an ICP of twenty lines does: all pairs, all of the same weight. @type {Partial<import('../../npm/index.js').RegistrationOptions>} */
const PLAIN = {
  metric: 'point_to_point',
  robust_kernel: 'none',
  max_correspondence_distance: 1e6,
  max_normal_angle: Math.PI,
};

/** The clouds of a scene. @param {string} name */
function sceneClouds(name) {
  const { source, target } = engine.lab_scene(name);
  return [engine.PointCloud.from_positions(source), engine.PointCloud.from_positions(target)];
}

/**
 * Point-to-point ICP as a student writes it.
 * @param {Float32Array | Float64Array} source
 * @param {Float32Array | Float64Array} target
 * @param {string} fault
 */
function studentsIcp(source, target, fault = '') {
  const points = (/** @type {Float32Array | Float64Array} */ xyz) =>
    Array.from({ length: xyz.length / 3 }, (_, i) => [...xyz.subarray(3 * i, 3 * i + 3)]);
  const [p, q] = [points(source), points(target)];
  let T = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const poses = [];
  /** @type {number[][]} */
  let partners = [];
  for (let iteration = 0; iteration < 12; iteration++) {
    const now = p.map((point) => moved(T, point));
    if (iteration === 0 || fault !== 'pairs') partners = now.map((point) => nearest(q, point));
    const { p0, q0, covariance } = sumsOf(
      now,
      partners,
      now.map(() => 1),
    );
    const zero = [0, 0, 0];
    let R = bestRotation(fault === 'centroid' ? covariance(zero, zero) : covariance(p0, q0));
    if (fault === 'transposed') R = [0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => R[i] ?? 0);
    const turned = moved(poseOf(R, zero), p0);
    T = multiplied(
      poseOf(
        R,
        q0.map((x, i) => x - (turned[i] ?? 0)),
      ),
      T,
    );
    poses.push(T);
  }
  return poses;
}

/** @param {number[][]} points @param {number[]} point */
function nearest(points, point) {
  const [x = 0, y = 0, z = 0] = point;
  let [best, least] = [point, Infinity];
  for (const other of points) {
    const squared = ((other[0] ?? 0) - x) ** 2 + ((other[1] ?? 0) - y) ** 2 + ((other[2] ?? 0) - z) ** 2;
    if (squared < least) [best, least] = [other, squared];
  }
  return best;
}

test('an own ICP is followed, and planted faults are told apart', () => {
  const scene = engine.lab_scene('outliers');
  const [source, target] = sceneClouds('outliers');
  assert.ok(source && target);
  const compared = engine.compare_own_icp(source, target, studentsIcp(scene.source, scene.target), PLAIN);
  assert.equal(compared.steps.length, 12);
  assert.equal(compared.fault, null);
  const off = Math.max(...compared.steps.flatMap(({ rotation, translation }) => [rotation, translation]));
  assert.ok(off < 1e-9, `${off}`);
  for (const [fault, kind, name] of [
    ['transposed', 'solution', 'transposed_rotation'],
    ['pairs', 'pairs', 'pairs_of_the_start'],
    ['centroid', 'solution', 'centroids_not_subtracted'],
  ]) {
    const { fault: found } = engine.compare_own_icp(
      source,
      target,
      studentsIcp(scene.source, scene.target, fault),
      PLAIN,
    );
    assert.deepEqual([found?.kind, found?.name], [kind, name], fault);
  }
  // The same poses beside a registration that weighs its pairs.
  const weighed = { ...PLAIN, robust_kernel: /** @type {const} */ ('cauchy') };
  const { fault } = engine.compare_own_icp(source, target, studentsIcp(scene.source, scene.target), weighed);
  assert.deepEqual([fault?.kind, fault?.name], ['weights', 'weights']);
  const limited = { ...PLAIN, max_correspondence_distance: 0.2 };
  const rejected = engine.compare_own_icp(source, target, studentsIcp(scene.source, scene.target), limited);
  assert.deepEqual([rejected.fault?.kind, rejected.fault?.name], ['pairs', 'rejection']);
  const millimetres = studentsIcp(scene.source, scene.target).map((T) =>
    T.map((x, i) => (i % 4 === 3 && i < 12 ? x * 1000 : x)),
  );
  assert.equal(engine.compare_own_icp(source, target, millimetres, PLAIN).fault?.name, 'unit');
  source.free();
  target.free();
});

test('an own ICP on doubles is followed to 1e-9, and a planted fault is told', { skip: skipWithoutData }, () => {
  const files = Array.from({ length: 10 }, (_, i) => readFileSync(join(DATA, 'laser', 'zju10', `${i}.ply`)));
  const clouds = files.map((bytes, i) => engine.PointCloud.read(bytes, `${i}.ply`));
  const doubles = files.map((bytes) =>
    Float64Array.from(String(bytes).split('end_header')[1]?.trim().split(/\s+/) ?? []),
  );
  for (const i of [1, 4, 7]) {
    const [source, target] = [doubles[i], doubles[i - 1]];
    const pair = /** @type {const} */ ([clouds[i], clouds[i - 1]]);
    assert.ok(source && target && pair[0] && pair[1]);
    const { steps, fault } = engine.compare_own_icp(pair[0], pair[1], studentsIcp(source, target), PLAIN);
    const off = Math.max(...steps.flatMap(({ rotation, translation }) => [rotation, translation]));
    assert.ok(off < 1e-9 && fault === null, `scan ${i}: ${off}`);
    const turned = engine.compare_own_icp(pair[0], pair[1], studentsIcp(source, target, 'transposed'), PLAIN);
    assert.equal(turned.fault?.name, 'transposed_rotation', `scan ${i}`);
  }
  clouds.forEach((cloud) => cloud.free());
});

test('where two points are equally near, an own ICP may take the other one', () => {
  const flat = (/** @type {number[][]} */ points) => Float32Array.from(points.flatMap(([x = 0, y = 0]) => [x, y, 0]));
  const target = [
    [-1, 0],
    [1, 0],
    [-1, 2],
    [1, 2],
    [0.5, 3],
    [3, 1],
    [-2, -1],
  ];
  // The first point lies in the middle between the first two of the target.
  const source = [[0, 0], ...target.slice(1).map(([x = 0, y = 0]) => [x + 0.25, y + 0.125])];
  const clouds = [source, target].map((points) => engine.PointCloud.from_positions(flat(points)));
  const [a, b] = clouds;
  assert.ok(a && b);
  for (const fault of ['', 'transposed', 'pairs']) {
    const theirs = studentsIcp(flat(source), flat(target.toReversed()), fault);
    const { fault: found, parts_at } = engine.compare_own_icp(a, b, theirs, PLAIN);
    const expected = { '': null, transposed: 'transposed_rotation', pairs: 'pairs_of_the_start' }[fault];
    assert.equal(found?.name ?? null, expected, `${fault}: ${parts_at}`);
  }
  clouds.forEach((cloud) => cloud.free());
});

test('poses of an own ICP are read from CSV, JSON and npy, and refused with the reason', () => {
  const [c, s] = [Math.cos(0.3), Math.sin(0.3)];
  const plane = [c, -s, 1, s, c, 2, 0, 0, 1];
  const space = [c, -s, 0, 1, s, c, 0, 2, 0, 0, 1, 0, 0, 0, 0, 1];
  const bytes = (/** @type {string} */ text) => new TextEncoder().encode(text);
  const rows = (/** @type {number[]} */ m, /** @type {number} */ n) =>
    Array.from({ length: m.length / n }, (_, i) => m.slice(n * i, n * i + n).join(','));
  const read = (/** @type {string} */ text, name = 'own.csv') => engine.read_own_poses(bytes(text), name);
  assert.deepEqual(read(`${plane.join(' ')}\n${plane.join(' ')}\n`), [space, space]);
  assert.deepEqual(read(`${rows(plane, 3).join('\n')}\n\n${rows(plane, 3).join('\n')}\n`), [space, space]);
  assert.deepEqual(read(JSON.stringify({ poses: [space, space] }), 'own.json'), [space, space]);
  const header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 3), }".padEnd(117) + '\n';
  const npy = Buffer.concat([
    Buffer.from([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, 118, 0]),
    Buffer.from(header),
    Buffer.from(Float64Array.from([...plane, ...plane]).buffer),
  ]);
  assert.deepEqual(engine.read_own_poses(npy, 'own.npy'), [space, space]);

  const transposed = [c, s, 0, -s, c, 0, 1, 2, 1];
  const refused = /** @type {[string, RegExp][]} */ ([
    [transposed.join(' '), /transposed/],
    [plane.with(0, 2 * c).join(' '), /not rigid/],
    [plane.map((x, i) => (i % 3 < 2 && i < 6 ? x * 1000 : x)).join(' '), /scales by 1000/],
    [[1, 0, 0, 0, -1, 0, 0, 0, 1].join(' '), /reflection/],
    [plane.with(2, Number.NaN).join(' '), /not finite/],
    [`${rows(plane, 3).join('\n')}\n1,0,0\n`, /not whole matrices/],
    ['1 2 3 4 5', /rows have 5 numbers/],
    ['', /no matrix/],
  ]);
  for (const [text, message] of refused) assert.throws(() => read(text), message, text);
  assert.throws(() => engine.read_own_poses(bytes('x'), 'own.npy'), /not an npy/);
  assert.throws(() => read('{', 'own.json'), /not JSON/);
});

test('the basin holds where single runs end', () => {
  const { source, target, T_reference } = engine.lab_scene('outliers');
  const [a, b] = [engine.PointCloud.from_positions(source), engine.PointCloud.from_positions(target)];
  const grid = { T_center: T_reference, axes: [1, 2, 0], half_widths: [1, 1, 0.6], size: [15, 15, 5] };
  const basin = engine.basin_of_attraction(a, b, { metric: 'point_to_line', grid, reference: T_reference });
  const lab = new engine.IcpLab(a, b, { metric: 'point_to_line' });
  const offset = (/** @type {number} */ axis, /** @type {number} */ at) => {
    const [n = 1, width = 0] = [grid.size[axis], grid.half_widths[axis]];
    return (width * (2 * at - (n - 1))) / (n - 1);
  };
  // Every fourth; a row has 15.
  const nodes = Array.from({ length: Math.ceil(basin.labels.length / 4) }, (_, i) => 4 * i);
  let home = 0;
  for (const node of nodes) {
    const [x, y, theta] = [node % 15, Math.floor(node / 15) % 15, Math.floor(node / 225)];
    const start = lab.pose_at(
      Float64Array.from(T_reference),
      Float64Array.from([offset(2, theta), offset(0, x), offset(1, y)]),
    );
    const { poses, end_reason } = lab.trace(start);
    const end = basin.ends.T_target_source.subarray(16 * node, 16 * node + 16);
    const { rotation, translation } = difference(poses.at(-1) ?? start, end);
    // A start as 16 numbers is rounded in its last place.
    assert.ok(rotation < 1e-9 && translation < 1e-9, `start ${node}: ${rotation} ${translation}`);
    const at_rest = end_reason === 'converged' || end_reason === 'cycle';
    assert.equal(basin.labels[node] !== -1, at_rest, `start ${node}: ${end_reason}`);
    const off = difference(T_reference, end);
    if (basin.labels[node] === 0) assert.ok(off.translation < 0.1 && off.rotation < 0.05, `start ${node}`);
    home += Number(basin.labels[node] === 0);
  }
  assert.ok(home > 0.1 * nodes.length && home < 0.9 * nodes.length, `${home} of ${nodes.length} end home`);
  for (const thing of [a, b, lab]) thing.free();
});

test('scanstitch icp prints every iteration and writes the trace, the landscape and the basin', async (t) => {
  const folder = temporaryFolder(t);
  const files = ['trace.json', 'landscape.png', 'basin.png'].map((name) => join(folder, name));
  const [trace = '', landscape = '', basin = ''] = files;
  const own = writeFiles(folder, { 'own.csv': '1 0 0\n0 1 0\n0 0 1\n' })[0] ?? '';
  const { status, stdout, stderr } = await scanstitch([
    ...['icp', SOURCE ?? '', TARGET ?? '', '--trace', trace, '--landscape', landscape, '--basin', basin],
    ...['--size', '9,7', '--own', own],
  ]);
  assert.equal(stderr, '');
  assert.equal(status, 0);
  assert.match(stdout, /iteration +pairs/);
  assert.match(stdout, /ended: converged/);
  assert.match(stdout, /% of 63 starts end here/);
  const { iterations, trace: traced, T_target_source } = JSON.parse(readFileSync(trace, 'utf8'));
  assert.equal(traced.length, iterations);
  assert.deepEqual(traced.at(-1).summary.T_next, T_target_source);
  assert.equal(traced[0].source.length, traced[0].summary.num_inliers);
  for (const path of [landscape, basin]) assert.equal(readFileSync(path).subarray(1, 4).toString(), 'PNG');
});

test('scanstitch icp refuses what it cannot register, each with its reason', async (t) => {
  const ply = (/** @type {string[]} */ points) =>
    `ply\nformat ascii 1.0\nelement vertex ${points.length}\nproperty float x\nproperty float y\nproperty float z\nend_header\n${points.join('\n')}\n`;
  const [spatial = '', empty = '', far = '', own = ''] = writeFiles(temporaryFolder(t), {
    'spatial.ply': ply(['0 0 1', '1 0 0', '0 1 2']),
    'empty.ply': ply([]),
    'far.ply': ply(['900 900 0', '901 900 0', '902 901 0']),
    'own.csv': '1 2\n3 4\n',
  });
  const target = TARGET ?? '';
  const refused = /** @type {[string[], RegExp][]} */ ([
    [[spatial, target], /The target is planar, the other cloud is not/],
    [[empty, target], /no finite point|no points/i],
    [[target], /Give a source and a target/],
    [[target, target, '--set', 'metric=gicp'], /do not fit planar clouds/],
    [[target, target, '--set', 'nonsense=1'], /nonsense/],
    [[target, target, '--own', own], /rows have 2 numbers/],
  ]);
  for (const [args, message] of refused) {
    const { status, stderr } = await scanstitch(['icp', ...args]);
    assert.equal(status, 1, args.join(' '));
    assert.match(stderr, message);
  }
  const { status, stdout, stderr } = await scanstitch(['icp', far, target]);
  assert.equal(status, 2);
  assert.match(stdout, /ended: no_step/);
  assert.match(stderr, /The clouds do not overlap from this start/);
});

test('scanstitch icp thins clouds that would take minutes, says so, and takes all points where told', async (t) => {
  const folder = temporaryFolder(t);
  const count = 310_000;
  const cloud = (/** @type {number} */ shift) => {
    const values = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) {
      const [x, y] = [0.02 * (i % 600), 0.02 * Math.floor(i / 600)];
      values.set([x + shift, y, 0.2 * Math.sin(x) * Math.cos(y)], 3 * i);
    }
    const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n`;
    return Buffer.concat([Buffer.from(head), Buffer.from(values.buffer)]);
  };
  writeFileSync(join(folder, '0.ply'), cloud(0));
  writeFileSync(join(folder, '1.ply'), cloud(0.05));
  const pairs = (/** @type {string} */ stdout) => Number(/^ +1 +(\d+)/m.exec(stdout)?.[1]);
  const thinned = await scanstitch(['icp', '1.ply', '0.ply'], folder);
  assert.equal(thinned.status, 0, thinned.stderr);
  assert.match(
    thinned.stderr,
    /a cloud of 310000 points: both are thinned to one point in 0\.\d+ m\. --set voxel_size=0/,
  );
  assert.ok(pairs(thinned.stdout) > 10_000 && pairs(thinned.stdout) <= 100_000, `${pairs(thinned.stdout)} pairs`);
  const whole = await scanstitch(
    ['icp', '1.ply', '0.ply', '--set', 'voxel_size=0', '--set', 'max_iterations=2'],
    folder,
  );
  assert.equal(whole.stderr, '');
  assert.ok(pairs(whole.stdout) > 300_000, `${pairs(whole.stdout)} pairs`);
});
