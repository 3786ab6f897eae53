// @ts-check
/** `reconstruct --mesh`: the surface of depth images as PLY, OBJ, STL and GLB; that of clouds; what has none; bad arguments. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { addFrames, placedFrames } from '../../npm/mesh/frames.js';
import { roomCloud } from './room_clouds.mjs';
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

/**
 * A vector turned by a quaternion: q v q*, by Hamilton's product.
 * @param {number[]} q x y z w
 * @param {number[]} v
 */
function turned([x = 0, y = 0, z = 0, w = 0], v) {
  const product = (/** @type {number[]} */ [ax = 0, ay = 0, az = 0, aw = 0], /** @type {number[]} */ b) => {
    const [bx = 0, by = 0, bz = 0, bw = 0] = b;
    return [
      aw * bx + ax * bw + ay * bz - az * by,
      aw * by - ax * bz + ay * bw + az * bx,
      aw * bz + ax * by - ay * bx + az * bw,
      aw * bw - ax * bx - ay * by - az * bz,
    ];
  };
  return product(product([x, y, z, w], [...v, 0]), [-x, -y, -z, w]).slice(0, 3);
}

test('the folder for trainers of splats has the trajectory in both conventions, and the pictures as they were', async (t) => {
  const folder = temporaryFolder(t);
  const [out, splats] = [join(folder, 'out'), join(folder, 'splats')];
  const frames = [1, 2, 3].flatMap((n) => [join(APARTMENT, 'depth', `${n}.png`), join(APARTMENT, 'rgb', `${n}.jpg`)]);
  const { status, stdout, stderr } = await scanstitch(['reconstruct', ...frames, '--out', out, '--splats', splats]);
  assert.equal(status, 0, stderr);
  assert.match(stdout, /3 images with their poses for nerfstudio and COLMAP/);
  const numbers = (/** @type {string} */ line) => line.split(' ').map(Number);
  const lines = (/** @type {string[]} */ ...path) =>
    readFileSync(join(...path), 'utf8')
      .split('\n')
      .filter((line) => line !== '' && !line.startsWith('#'));
  const poses = lines(out, 'trajectory.tum').map((line) => numbers(line).slice(1));
  const { camera } = JSON.parse(readFileSync(join(out, 'report.json'), 'utf8'));
  const nerf = JSON.parse(readFileSync(join(splats, 'transforms.json'), 'utf8'));
  const colmap = lines(splats, 'sparse', '0', 'images.txt').map((line) => line.split(' '));
  const [, model, ...lens] = (lines(splats, 'sparse', '0', 'cameras.txt')[0] ?? '').split(' ');
  assert.equal(model, 'PINHOLE');
  // The middle of the first pixel is at 0.5.
  const expected = [512, 512, camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5];
  assert.deepEqual(lens.map(Number), expected);
  assert.deepEqual([nerf.w, nerf.h, nerf.fl_x, nerf.fl_y, nerf.cx, nerf.cy], expected);
  const points = lines(splats, 'sparse', '0', 'points3D.txt').map((line) => numbers(line).slice(1, 4));
  assert.ok(points.length > 10_000);
  assert.match(readFileSync(join(splats, 'sparse_pc.ply'), 'utf8'), new RegExp(`element vertex ${points.length}\n`));
  for (const [i, [x = 0, y = 0, z = 0, ...q]] of poses.entries()) {
    const { file_path, transform_matrix: M } = nerf.frames[i];
    assert.deepEqual(readFileSync(join(splats, file_path)), readFileSync(frames[2 * i + 1] ?? ''));
    assert.equal(`images/${colmap[i]?.[9]}`, file_path);
    let num_inside = 0;
    for (const point of points.filter((_, at) => at % 97 === 0)) {
      // Where the trajectory says that the camera sees it: x right, y down, z ahead.
      const away = point.map((value, k) => value - ([x, y, z][k] ?? 0));
      const [sx = 0, sy = 0, sz = 0] = turned(
        q.map((value, k) => (k < 3 ? -value : value)),
        away,
      );
      // OpenGL's camera: y up, looking along -z.
      const [gx = 0, gy = 0, gz = 0] = [0, 1, 2].map((column) =>
        point.reduce((sum, value, row) => sum + M[row][column] * (value - M[row][3]), 0),
      );
      // COLMAP's pose leads from the world to the camera, w first.
      const [, qw = 0, qx = 0, qy = 0, qz = 0, tx = 0, ty = 0, tz = 0] = (colmap[i] ?? []).map(Number);
      const [cx = 0, cy = 0, cz = 0] = turned([qx, qy, qz, qw], point).map(
        (value, k) => value + ([tx, ty, tz][k] ?? 0),
      );
      const apart = Math.max(Math.hypot(gx - sx, -gy - sy, -gz - sz), Math.hypot(cx - sx, cy - sy, cz - sz));
      assert.ok(apart < 1e-5, `${file_path}: ${apart} m`);
      const [u, v] = [(nerf.fl_x * sx) / sz + nerf.cx, (nerf.fl_y * sy) / sz + nerf.cy];
      if (sz > 0 && u > 0 && u < nerf.w && v > 0 && v < nerf.h) num_inside++;
    }
    assert.ok(num_inside > 100, `${file_path} sees ${num_inside} points`);
  }
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

test('holes are filled up to a size, counted, and marked in the PLY file', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'room.ply');
  const mesh = ['--mesh', path, '--mesh-voxel', '0.05', '--fill-holes'];
  const frames = [1, 2, 3].map((n) => join(APARTMENT, 'depth', `${n}.png`));
  const run = (/** @type {string} */ size) =>
    scanstitch(['reconstruct', ...frames, '--out', join(folder, 'out'), ...mesh, size]);
  const counts = [];
  for (const [size, extent] of /** @type {const} */ ([
    ['auto', 0.5],
    ['1', 1],
  ])) {
    const { status, stdout, stderr } = await run(size);
    assert.equal(status, 0, stderr);
    const told = /: (\d+) triangles in .* s, (\d+) of them over holes of up to (.*) m, written/.exec(stdout) ?? [];
    const [triangles = 0, filled = 0, up_to] = told.slice(1).map(Number);
    assert.equal(up_to, extent);
    counts.push(filled);
    const ply = readFileSync(path);
    const header = ply.toString('latin1', 0, ply.indexOf('end_header\n') + 11);
    assert.match(header, /property float deviation\nproperty uchar filled\nelement face/);
    const num_vertices = Number(/element vertex (\d+)/.exec(header)?.[1]);
    // x y z nx ny nz, deviation, filled.
    const isFilled = (/** @type {number} */ vertex) => ply[header.length + vertex * 29 + 28] === 1;
    const faces = header.length + 29 * num_vertices;
    const corners = (/** @type {number} */ face) => [1, 5, 9].map((at) => ply.readInt32LE(faces + 13 * face + at));
    const found = Array.from({ length: triangles }, (_, face) => corners(face)).filter((face) => face.some(isFilled));
    assert.equal(found.length, filled);
  }
  const [few = 0, many = 0] = counts;
  assert.ok(few > 0 && many > few, `${few} ${many}`);
});

test('the surface of clouds is that of the room, stands upright, and has no holes filled', async (t) => {
  const folder = temporaryFolder(t);
  const path = join(folder, 'room.glb');
  const clouds = [0, 1].map((number) => join(folder, `${number}.ply`));
  for (const [number, cloud] of clouds.entries()) writeFileSync(cloud, roomCloud(number));
  const args = ['reconstruct', ...clouds, '--out', join(folder, 'out'), '--mesh', path];
  const { status, stdout, stderr } = await scanstitch([...args, '--fill-holes', 'auto']);
  assert.equal(status, 2, 'something was not used');
  assert.match(stderr, /--fill-holes: not used, for holes of clouds stay open/);
  assert.match(stderr, /The surface has voxels of 0\.\d+ m: the points lie too far apart for smaller ones/);
  assert.ok(Number(/Surface of 2 frames: (\d+) triangles in/.exec(stdout)?.[1]) > 5000, stdout);
  const glb = readFileSync(path);
  const json = JSON.parse(glb.toString('utf8', 20, 20 + glb.readUInt32LE(12)));
  const { min, max } = json.accessors[json.meshes[0].primitives[0].attributes.POSITION];
  const corners = [min, max].map((corner) => turned(json.nodes[0].rotation, corner));
  const extents = [0, 1, 2].map((axis) => Math.abs((corners[1]?.[axis] ?? 0) - (corners[0]?.[axis] ?? 0)));
  for (const [axis, side] of [8, 3, 6].entries()) assert.ok(Math.abs((extents[axis] ?? 0) - side) < 0.1, `${extents}`);
  assert.ok(Math.abs(Math.min(...corners.map(([, y = 0]) => y)) + 1.2) < 0.05, 'the floor is below');
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
    [['--mesh', 'a.ply', '--fill-holes', '0'], /--fill-holes 0: give a number of metres up to 10, or auto/],
    [['--fill-holes', 'auto'], /--fill-holes is how large holes of --mesh FILE are filled/],
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
