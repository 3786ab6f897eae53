// @ts-check
/** `reconstruct --mesh`: the surface of depth images as PLY, OBJ, STL and GLB; what has none; bad arguments. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { addFrames, placedFrames } from '../../npm/mesh/frames.js';
import { ROOT, SAMPLES, scanstitch, temporaryFolder } from './support.mjs';

const APARTMENT = join(ROOT, 'www', 'samples', 'apartment');

test('a surface in each format holds the same triangles', async (t) => {
  const folder = temporaryFolder(t);
  const path = (/** @type {string} */ format) => join(folder, `room.${format}`);
  const frames = [1, 2, 3].flatMap((n) => [join(APARTMENT, 'depth', `${n}.png`), join(APARTMENT, 'rgb', `${n}.jpg`)]);
  const counts = new Map();
  for (const format of ['ply', 'obj', 'stl', 'glb']) {
    const args = [
      'reconstruct',
      ...frames,
      '--out',
      join(folder, 'out'),
      '--mesh',
      path(format),
      '--mesh-voxel',
      '0.1',
    ];
    const { status, stdout, stderr } = await scanstitch(args);
    assert.equal(status, 0, stderr);
    counts.set(format, Number(/Surface of 3 frames: (\d+) triangles in/.exec(stdout)?.[1]));
  }
  const [triangles = 0] = new Set(counts.values());
  assert.ok(triangles > 1000 && new Set(counts.values()).size === 1, JSON.stringify([...counts]));
  assert.match(
    readFileSync(path('ply')).toString('latin1', 0, 500),
    new RegExp(`property uchar red[^]*property float deviation\nelement face ${triangles}\n`),
  );
  assert.equal(readFileSync(path('stl')).readUInt32LE(80), triangles);
  assert.equal(readFileSync(path('obj'), 'utf8').match(/^f /gm)?.length, triangles);
  const glb = readFileSync(path('glb'));
  assert.equal(glb.toString('latin1', 0, 4), 'glTF');
  const json = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  const { attributes, indices } = json.meshes[0].primitives[0];
  assert.deepEqual(Object.keys(attributes).sort(), ['COLOR_0', 'NORMAL', 'POSITION']);
  assert.equal(json.accessors[indices].count, 3 * triangles);
});

test('a surface with fewer triangles: at most as many as were asked for, and by how much that moves it', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'room.stl');
  const mesh = ['--mesh', path, '--mesh-voxel', '0.1', '--mesh-triangles', '500'];
  const frame = join(APARTMENT, 'depth', '1.png');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', frame, '--out', join(folder, 'out'), ...mesh]);
  assert.equal(status, 0, stderr);
  assert.match(stderr, /Fewer triangles: the surface moves by up to \d+\.\d mm/);
  const count = Number(/Surface of 1 frames: (\d+) triangles in/.exec(stdout)?.[1]);
  assert.ok(count > 100 && count <= 500, stdout);
  assert.equal(readFileSync(path).readUInt32LE(80), count);
});

test('what has no surface and what is no format is said', async (t) => {
  const out = temporaryFolder(t);
  const scans = [join(SAMPLES, '0.ply'), join(SAMPLES, '1.ply')];
  const planar = await scanstitch(['reconstruct', ...scans, '--out', out, '--mesh', join(out, 'a.ply')]);
  assert.equal(planar.status, 2);
  assert.match(planar.stderr, /--mesh .*: not used, for planar scans have no surface/);
  assert.ok(!existsSync(join(out, 'a.ply')));
  for (const [args, told] of /** @type {const} */ ([
    [['--mesh', 'a.fbx'], /--mesh a\.fbx: the name ends in one of \.ply, \.obj, \.stl, \.glb/],
    [['--mesh', 'a.ply', '--mesh-voxel', '0'], /--mesh-voxel 0: give a number of metres from 0\.001 to 1/],
    [['--mesh', 'a.ply', '--mesh-triangles', '1.5'], /--mesh-triangles 1\.5: give a whole number from 100 to/],
    [['--mesh-triangles', '500'], /--mesh-triangles is how many triangles --mesh FILE has/],
    [['--mesh-voxel', '0.1'], /--mesh-voxel is the size of the voxels of --mesh FILE/],
  ])) {
    const { status, stderr } = await scanstitch(['reconstruct', ...scans, '--out', out, ...args]);
    assert.equal(status, 1);
    assert.match(stderr, told);
  }
});

test('the frames of a surface: good poses of the main piece, each with the colours that can be read; one that cannot be read is left out', async () => {
  const T_world_sensor = { x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: 1 };
  const frame = (/** @type {number} */ index, status = 'good', piece = 0) => ({
    index,
    name: `${index}.png`,
    status,
    piece,
    T_world_sensor,
  });
  const frames = [frame(0), frame(1, 'doubtful'), frame(2), frame(3, 'lost'), frame(4, 'good', 1), frame(5), frame(6)];
  const placed = placedFrames(/** @type {any} */ ({ frames }));
  assert.deepEqual(
    placed.map(({ index, pose }) => [index, ...pose]),
    [0, 2, 5, 6].map((index) => [index, 1, 2, 3, 0, 0, 0, 1]),
  );
  /** @type {unknown[]} */
  const told = [];
  const bytes = (/** @type {number} */ value) => ({ read: async () => Uint8Array.of(value) });
  const gone = { read: () => Promise.reject(new Error('gone')) };
  await addFrames(placed, {
    filesOf: ({ index }) =>
      index === 6 ? null : { depth: index === 2 ? gone : bytes(index), color: index === 5 ? gone : bytes(9) },
    add: async ({ name }, depth, colors) => void told.push([name, ...depth, colors?.[0]]),
    refused: ({ name }, error) => void told.push([name, String(error)]),
    done: (count) => void told.push(count),
  });
  assert.deepEqual(told, [['0.png', 0, 9], 1, ['2.png', 'Error: gone'], 2, ['5.png', 5, undefined], 3, 4]);
  // What `refused` throws ends it.
  const add = () => Promise.reject(new Error('no'));
  const refused = (/** @type {unknown} */ _, /** @type {unknown} */ error) => {
    throw error;
  };
  const filesOf = () => ({ depth: bytes(1), color: null });
  await assert.rejects(addFrames(placed, { filesOf, add, refused, done: () => undefined }), /no/);
});
