// @ts-check
/** Formats that are converted before the engine reads them: MATLAB, NumPy, KITTI, LAS, text; and what is said of the others. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { crc32 } from '../../npm/base/crc32.js';
import { tableOf } from '../../npm/formats/array_table.js';
import { convertFiles } from '../../npm/formats/convert.js';
import { cameraFromVelodyne, posesOf, velodynePoses } from '../../npm/formats/kitti.js';
import { lasCloud, lasHeader } from '../../npm/formats/las.js';
import { readMat } from '../../npm/formats/mat.js';
import { cloudsOfJson, isCloudJson } from '../../npm/formats/json_clouds.js';
import { isLaserTable, looksLikePoints, pointColumns, textClouds } from '../../npm/formats/text_cloud.js';
import { fileInMemory } from '../../npm/files/content.js';
import { adviceFor } from '../../npm/recording/other_formats.js';
import { roomCloud } from './room_clouds.mjs';
import { ROOT, readReport, scanstitch, temporaryFolder } from './support.mjs';

const MATS = join(ROOT, 'tests', 'data', 'mat');
const EXPECTED = JSON.parse(readFileSync(join(import.meta.dirname, 'mat_expectations.json'), 'utf8'));

/** @param {string} name */
const matFile = (name) => new Uint8Array(readFileSync(join(MATS, name)));
const encode = (/** @type {string} */ text) => new TextEncoder().encode(text);

/** A value as the expectations have it. @param {import('../../npm/formats/mat.js').Value} value @returns {unknown} */
function described(value) {
  if (value.kind === 'numbers') {
    return { dims: value.dims, crc: crc32(new Uint8Array(value.values.buffer)) };
  }
  if (value.kind === 'cell') return value.items.map(described);
  if (value.kind === 'struct') {
    return Object.fromEntries([...value.fields].map(([name, values]) => [name, values.map(described)]));
  }
  return value.what;
}

for (const name of Object.keys(EXPECTED)) {
  test(`${name} is read as SciPy reads it`, async () => {
    const variables = await readMat(name, matFile(name));
    const entries = [...variables].map(([variable, value]) => [variable, described(value)]);
    assert.deepEqual(Object.fromEntries(entries), EXPECTED[name]);
  });
}

test('of the arrays of a file, scans, angles, times and poses are told by their names and lengths', async () => {
  const firstLine = async (/** @type {string} */ name) => {
    const table = tableOf(await readMat(name, matFile(name)));
    return new TextDecoder().decode(table ?? undefined).split('\n')[0] ?? '';
  };
  assert.equal(await firstLine('rows.mat'), '# table: ranges=1:36,start=-90deg,step=5deg');
  assert.equal(await firstLine('columns.mat'), '# table: ranges=5:40,start=-90deg,step=5deg,time=1,odometry=2:3:4');
  assert.equal(await firstLine('struct.mat'), '# table: ranges=2:37,start=-90deg,step=5deg,time=1');
  assert.equal(await firstLine('cells.mat'), '# table: ranges=5:40,start=-87.5deg,step=5deg,time=1,poses=2:3:4');
  assert.equal(await firstLine('poses.mat'), '0 0 0');
  const scan = JSON.parse(await firstLine('uneven.mat'));
  assert.deepEqual([scan.theta.length, scan.readings[1], scan.true_pose], [36, 2.199, [0, 0, 0]]);
});

test('a file of MATLAB is reconstructed, and --table changes how', async (t) => {
  const out = join(temporaryFolder(t), 'out');
  const run = (/** @type {string[]} */ ...args) => scanstitch(['reconstruct', ...args, '--out', out]);
  const { stderr } = await run(join(MATS, 'columns.mat'));
  assert.match(stderr, /read as --table ranges=5:40,unit=mm,start=-90deg,step=5deg,time=1:s,odometry=2:3:4/);
  assert.equal(readReport(out).frames.length, 4);
  const changed = await run(join(MATS, 'columns.mat'), '--table', 'unit=cm,odometry=none');
  assert.ok(!changed.stderr.includes('read as'), changed.stderr);
});

test('MATLAB 7.3, damage and files without scans are told with what to do', async () => {
  const notes = async (/** @type {string} */ path, /** @type {Uint8Array} */ bytes) =>
    (await convertFiles([fileInMemory(path, bytes)], (made) => made)).notes.map(({ reason }) => reason).join();
  const hdf = encode('MATLAB 7.3 MAT-file, Platform: GLNXA64'.padEnd(600));
  assert.match(await notes('drive.mat', hdf), /MATLAB 7\.3 .*save\('drive_v7\.mat', '-struct', 's', '-v7'\)/);
  const rows = matFile('rows.mat');
  assert.match(await notes('cut.mat', rows.subarray(0, 500)), /cannot be read: it is cut off/);
  assert.match(await notes('text.mat', encode('1 2 3\n4 5 6\n'.repeat(20))), /no matrix of level 4/);
  assert.match(await notes('other.mat', withoutScans()), /neither scans nor poses.*it holds M \(2 x 3\)/);
  for (let place = 0; place < rows.length; place += 5) {
    const copy = rows.slice();
    copy[place] = (copy[place] ?? 0) ^ 0xff;
    for (const bytes of [copy, rows.subarray(0, place)]) await notes('flipped.mat', bytes);
  }
});

/** A list of structs of the level 5, without fields, that claims these dimensions. @param {number} rows @param {number} columns */
function structWithoutFields(rows, columns) {
  const element = (/** @type {number} */ type, /** @type {number[]} */ words) => [type, 4 * words.length, ...words];
  const body = [
    ...element(6, [2, 0]), // flags: a struct
    ...element(5, [rows, columns]),
    ...element(1, []), // no name
    ...[5, 4, 32, 0], // names of 32 bytes,
    ...element(1, []), // and none of them
  ];
  const named = [...body];
  named.splice(8, 2, 1, 1, 0x61, 0); // called a
  const bytes = new Uint8Array(128 + 8 + 4 * named.length);
  bytes.set(encode('MATLAB 5.0 MAT-file'.padEnd(124)));
  bytes.set(encode('\0\u0001IM'), 124);
  new Uint32Array(bytes.buffer, 128).set([14, 4 * named.length, ...named]);
  return bytes;
}

test('MATLAB: what a list of structs claims, and what it would take to make its rows equally long, is bounded', async () => {
  const read = (/** @type {Uint8Array} */ bytes) => readMat('claims.mat', bytes);
  await assert.rejects(read(structWithoutFields(2 ** 16, 2 ** 15)), /a struct of 65536 x 32768 has no fields/);
  const none = await read(structWithoutFields(1, 1));
  assert.deepEqual([...none.keys()], ['a']);
  assert.equal(tableOf(none), null);
  // 200,000 scans of which one has 4,000 beams: 6 GB, and too many for the stack.
  const scan = (/** @type {number} */ length) => ({
    ...{ kind: /** @type {const} */ ('numbers'), dims: [1, length] },
    values: new Float64Array(length).fill(2),
  });
  const ranges = Array.from({ length: 200_000 }, (_, at) => scan(at === 0 ? 4000 : 1));
  const list = { kind: /** @type {const} */ ('struct'), dims: [1, 200_000], fields: new Map([['ranges', ranges]]) };
  assert.equal(tableOf(new Map([['laser', list]])), null);
  const angles = scan(200_000);
  angles.values.forEach((_, at) => (angles.values[at] = at / 1e5));
  const many = tableOf(
    new Map([
      ['ranges', scan(200_000)],
      ['angles', angles],
    ]),
  );
  assert.ok(many && many.length > 0);
});

/** A file of level 4 with a matrix of 2 x 3. */
function withoutScans() {
  const bytes = new Uint8Array(20 + 2 + 48);
  const view = new DataView(bytes.buffer);
  [0, 2, 3, 0, 2].forEach((value, at) => view.setUint32(4 * at, value, true));
  bytes.set(encode('M\0'), 20);
  return bytes;
}

/** Points of a PLY file as the converters write it. @param {Uint8Array} ply @param {number} columns */
function pointsOf(ply, columns) {
  const header = new TextDecoder('latin1').decode(ply).indexOf('end_header\n') + 11;
  const text = new TextDecoder('latin1').decode(ply.subarray(0, header));
  const stride = 4 * columns + (text.match(/ uchar /g)?.length ?? 0);
  const view = new DataView(ply.buffer, ply.byteOffset + header, ply.length - header);
  return Array.from({ length: view.byteLength / stride }, (_, i) =>
    Array.from({ length: columns }, (_, column) => view.getFloat32(stride * i + 4 * column, true)),
  );
}

/** A room as a laser with many rings sees it from x (m). @param {number} x */
function cloudFrom(x) {
  const points = [];
  for (let ring = -4; ring < 4; ring += 1) {
    for (let beam = 0; beam < 360; beam += 2) {
      const [angle, tilt] = [(beam * Math.PI) / 180, ring * 0.03];
      const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
      const toX = dx > 0 ? (8 - x) / dx : (-6 - x) / dx;
      const range = Math.min(Math.abs(toX), Math.abs((dy > 0 ? 5 : -4 + Math.sin(beam / 20)) / dy));
      points.push([range * dx, range * dy, range * Math.tan(tilt), 0.25]);
    }
  }
  return new Uint8Array(Float32Array.from(points.flat()).buffer);
}

test("KITTI's clouds are reconstructed, with the camera's poses as the laser's", async (t) => {
  const folder = temporaryFolder(t);
  const sequence = join(folder, 'sequences', '07');
  mkdirSync(join(sequence, 'velodyne'), { recursive: true });
  const places = [0, 0.3, 0.6, 0.9];
  places.forEach((x, frame) => writeFileSync(join(sequence, 'velodyne', `00000${frame + 1}.bin`), cloudFrom(x)));
  // The camera looks along the laser's x, 0.3 m ahead of it; its poses count from its own first one, frame 0.
  writeFileSync(join(sequence, 'calib.txt'), 'P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 -0.3\n');
  const poses = [-0.3, ...places].map((x) => `1 0 0 0 0 1 0 0 0 0 1 ${x}\n`);
  writeFileSync(join(sequence, 'poses.txt'), poses.join(''));
  const times = [0, 0.104, 0.207, 0.311, 0.414];
  writeFileSync(join(sequence, 'times.txt'), times.map((time) => `${time.toExponential(6)}\n`).join(''));
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['reconstruct', sequence, '--out', out]);
  assert.equal(status, 0, stderr);
  assert.doesNotMatch(stderr, /times\.txt/);
  const rows = readFileSync(join(out, 'trajectory.tum'), 'utf8')
    .trim()
    .split('\n')
    .filter((row) => !row.startsWith('#'));
  // The clouds are called 000001 to 000004: the first time is that of a frame that is not here.
  assert.deepEqual(
    rows.map((row) => Number(row.split(' ')[0])),
    times.slice(1),
  );
  assert.match(stderr, /poses\.txt: .*carried over to the laser by Tr of calib\.txt/);
  const { frames, comparison } = readReport(out);
  assert.equal(frames.length, 4);
  assert.ok(comparison.mean < 0.05, JSON.stringify(comparison));
});

test('poses of a camera become those of the laser as by matrices', () => {
  const Tr = cameraFromVelodyne('P0: 1\nTr_velo_to_cam: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 -0.3\n');
  assert.ok(Tr);
  const [camera] = posesOf('0 0 1 5 0 1 0 6 -1 0 0 7\n') ?? [];
  assert.ok(camera);
  // NumPy: inv(Tr) @ T @ Tr with these matrices as 4 x 4.
  const expected = [0, 1, 0, 7.2, -1, 0, 0, -4.6, 0, 0, 1, -6];
  const numbers = velodynePoses([camera], Tr).trim().split(' ').map(Number);
  numbers.forEach((value, at) => assert.ok(Math.abs(value - (expected[at] ?? 0)) < 1e-12, `${numbers}`));
});

test('files of 32-bit floats that are no clouds stay what they are', async () => {
  const noise = Uint8Array.from({ length: 16_000 }, (_, i) => (i * 2654435761) >>> 13);
  for (const bytes of [noise, new Uint8Array(16_000), cloudFrom(0).subarray(0, 16_001)]) {
    const { files } = await convertFiles([fileInMemory('a.bin', bytes)], (made) => made);
    assert.equal(files[0]?.isCloud, undefined);
  }
});

/** A LAS file of three points. @param {{ minor?: number, format?: number, record?: number, east?: number }} [changes] */
function las({ minor = 2, format = 1, record = 28, east = 0 } = {}) {
  const start = minor >= 4 ? 375 : 227;
  const bytes = new Uint8Array(start + 3 * record);
  const view = new DataView(bytes.buffer);
  bytes.set(encode('LASF'));
  bytes.set([1, minor], 24);
  view.setUint32(96, start, true);
  bytes[104] = format;
  view.setUint16(105, record, true);
  if (minor >= 4) view.setBigUint64(247, 3n, true);
  else view.setUint32(107, 3, true);
  [0, 1, 2].forEach((axis) => view.setFloat64(131 + 8 * axis, 0.01, true));
  view.setFloat64(155, east, true);
  [east + 3, east, 6, 4, 9, 7].forEach((limit, at) => view.setFloat64(179 + 8 * at, limit, true));
  [0, 1, 2].forEach((point) =>
    [100 * (point + 1), 400 + 100 * point, 700].forEach((raw, axis) => {
      view.setInt32(start + point * record + 4 * axis, raw, true);
    }),
  );
  return bytes;
}

test('LAS is read in its versions, map coordinates in double precision', async () => {
  const near = [
    [1, 4, 7],
    [2, 5, 7],
    [3, 6, 7],
  ];
  for (const changes of [{}, { minor: 4, format: 6, record: 30 }, { format: 3, record: 34 }]) {
    assert.deepEqual(pointsOf(lasCloud('a.las', las(changes)), 3), near);
  }
  const far = lasCloud('a.las', las({ east: 691_000 }));
  const doubles = new DataView(far.buffer, far.length - 3 * 24);
  assert.deepEqual([doubles.getFloat64(0, true), doubles.getFloat64(8, true)], [691_001, 4]);
  const cut = las().subarray(0, 227 + 60);
  assert.deepEqual(pointsOf(lasCloud('a.las', cut), 3), near.slice(0, 2));
  assert.equal(lasHeader('a.las', cut, cut.length).loss, 'cut off: 2 of 3 points are there');
  assert.throws(() => lasCloud('a.las', encode('LASF')), /not a LAS cloud, or it is cut off/);
  // To be listed, its header is enough.
  const bytes = las({ east: 691_000 });
  /** @type {import('../../npm/files/content.js').Content} */
  const file = {
    ...{ path: 'a.las', size: bytes.length, readHead: async (length) => bytes.slice(0, length) },
    read: () => Promise.reject(new Error('read as a whole')),
  };
  const { files } = await convertFiles([file], (made) => made);
  assert.equal(files[0]?.isCloud, true);
});

test('points as text: columns behind x y z, counts, headers, the grid of PTX', () => {
  const points = (/** @type {string} */ text, dimensions = 3) =>
    pointsOf(textClouds(encode(text), [0, 1, 2].slice(0, dimensions))[0]?.ply ?? new Uint8Array(), 3);
  assert.deepEqual(points('2\n1 2 3 0.5 255 0 0\n4 5 6 0.5 255 0 0\n'), [
    [1, 2, 3],
    [4, 5, 6],
  ]);
  assert.deepEqual(points('\ufeff# made\r\nx,y,z\r\n1,2,3\r\n\r\n4 , 5 , 6\r\n'), [
    [1, 2, 3],
    [4, 5, 6],
  ]);
  assert.deepEqual(points('1 2\n3 4\n', 2), [
    [1, 2, 0],
    [3, 4, 0],
  ]);
  const grid = '2\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n';
  assert.deepEqual(points(`${grid}1 2 3 0.5\n0 0 0 0.5\n`), [[1, 2, 3]]);
  // Two scans of a PTX; x y z among other columns; decimal commas.
  const two = textClouds(encode(`${grid}1 2 3 0.5\n0 0 0 0.5\n${grid}4 5 6 0.5\n7 8 9 0.5\n`));
  assert.deepEqual(
    two.map(({ ply, count }) => [count, pointsOf(ply, 3)]),
    [
      [1, [[1, 2, 3]]],
      [
        2,
        [
          [4, 5, 6],
          [7, 8, 9],
        ],
      ],
    ],
  );
  const table = encode(`Version,Slot ID,Timestamp,X,Y,Z,Reflectivity\n${'5,7,0x10,1.5,2.5,3.5,9\n'.repeat(30)}`);
  assert.deepEqual(looksLikePoints(table), [3, 4, 5]);
  assert.ok(isLaserTable(table));
  assert.deepEqual(pointsOf(textClouds(table, [3, 4, 5])[0]?.ply ?? new Uint8Array(), 3)[29], [1.5, 2.5, 3.5]);
  // Ouster's program has the first return's coordinates in X1, Y1 and Z1.
  const ouster = encode(
    `TIMESTAMP (ns), RING, X1 (mm), Y1 (mm), Z1 (mm), RANGE1 (mm)\n${'9, 1, 1500, 2500, 3500, 7\n'.repeat(30)}`,
  );
  assert.deepEqual(looksLikePoints(ouster), [2, 3, 4]);
  assert.match(new TextDecoder().decode(textClouds(ouster, [2, 3, 4])[0]?.ply.slice(0, 80)), /comment unit mm/);
  assert.deepEqual(points('X;Y;Z\n1,5;2,5;3,5\n4;5;6\n'), [
    [1.5, 2.5, 3.5],
    [4, 5, 6],
  ]);
  assert.deepEqual(pointColumns(encode('//X Y Z Intensity\n1 2 3 4\n')), [0, 1, 2]);
  const notes = textClouds(encode('1 2 3\nend of it\n4 5 6\n'))[0]?.notes;
  assert.deepEqual(notes, ['1 of its lines are not points and are left out']);
  // What is announced and not there is a loss; scans may follow each other, each behind its count.
  const lossOf = (/** @type {string} */ text) => textClouds(encode(text))[0]?.loss;
  assert.equal(lossOf('3\n1 2 3\n4 5 6\n'), 'cut off: 2 of 3 points are there');
  assert.equal(lossOf('1\n1 2 3\n2\n4 5 6\n'), 'cut off: 2 of 3 points are there');
  assert.equal(lossOf('1\n1 2 3\n1\n4 5 6\n'), null);
  assert.equal(lossOf(`${grid}1 2 3 0.5\n`), 'cut off: 1 of 2 points are there');
  assert.equal(lossOf(`${grid}1 2 3 0.5\n0 0 0 0.5\n`), null);
});

test('clouds in JSON, as lists and as objects; flat ones are planar scans', () => {
  const at = (/** @type {number} */ i, height = 0.1) => [i, 2 * i, height * i];
  const list = Array.from({ length: 40 }, (_, i) => at(i));
  const objects = { clouds: [{ points: list.map(([x, y, z]) => ({ x, y, z, i: 3 })) }, { points: list.slice(0, 30) }] };
  for (const text of [JSON.stringify({ timestamp: 1.5, points: list }), JSON.stringify(objects)]) {
    assert.ok(isCloudJson(text.slice(0, 2000)), text.slice(0, 60));
  }
  const clouds = cloudsOfJson(JSON.stringify(objects)).map((ply) => pointsOf(ply, 3));
  assert.deepEqual(
    clouds.map(({ length }) => length),
    [40, 30],
  );
  assert.deepEqual(clouds[0]?.[10], [10, 20, 1]);
  assert.ok(!isCloudJson(JSON.stringify({ points: list.map((_, i) => at(i, 0)) })));
  assert.ok(!isCloudJson(JSON.stringify({ ranges: list.map(([x]) => x) })));
  // Fewer lists than a cloud has points, tried in all ways of taking their digits apart, would take hours.
  assert.ok(!isCloudJson(JSON.stringify(Array.from({ length: 22 }, () => list.map(([x = 0]) => x + 1.0625)))));
});

test('every format that is not read has the line that helps', () => {
  for (const [name, words] of /** @type {const} */ ([
    ['a.7z', /7z x/],
    ['a.rar', /unrar x/],
    ['a.tar.xz', /tar xf/],
    ['a.csv.xz', /unxz/],
    ['a.db3-wal', /together with its \.db3/],
    ['a.rawlog', /rawlog-edit/],
    ['a.h5', /savetxt/],
    ['a.bag.active', /rosbag reindex/],
    ['a.mp4', /depth is needed/],
    ['a.stl', /PLY/],
    ['a.exr', /numpy\.save/],
    ['a.r3d', /PLY/],
    ['a.gfs', /gfs2log/],
    ['a.3d', /awk/],
    ['a.xlsx', /convert-to csv/],
    ['a.pbstream', /give the bag/],
    ['a.g2o', /log or bag of the laser/],
    ['a.pcap', /VeloView/],
    ['a.lvx', /CSV, LAS or PCD/],
    ['a.parquet', /to_csv/],
    ['seq/times.txt', /not those of the frames/],
    ['map.posegraph', /ros2 bag record/],
    ['map.stcm', /ros2 bag record/],
    ['a.osf', /ouster-cli/],
    ['a.mkv', /azure_kinect_mkv_reader\.py --input/],
    ['depth_maps/1.png.geometric.bin', /numpy\.save/],
    ['lms_front/1418381798086398.bin', /numpy\.save/],
  ])) {
    assert.match(adviceFor(name) ?? '', words, name);
  }
});

test('an OBJ, and a PLY that begins with points that were not seen or lie on a floor, are placed as the PLY without them', async (t) => {
  const [folder, out] = [temporaryFolder(t), temporaryFolder(t)];
  const NUM_UNSEEN = 5000;
  /** @type {Record<string, (ply: string) => string>} */
  const writers = {
    'plain.ply': (ply) => ply,
    'unseen.ply': (ply) =>
      ply
        .replace('vertex 12000', `vertex ${12_000 + NUM_UNSEEN}`)
        .replace('end_header\n', `end_header\n${'nan nan nan\n'.repeat(NUM_UNSEEN)}`),
    'floor.ply': (ply) => {
      const [header, rows = ''] = ply.split('end_header\n');
      const raised = rows
        .trim()
        .split('\n')
        .map((row) => row.replace(/\S+$/, (z) => (Number(z) + 1.2).toFixed(4)));
      return `${header}end_header\n${raised.toSorted((a, b) => Number(b.endsWith(' 0.0000')) - Number(a.endsWith(' 0.0000'))).join('\n')}\n`;
    },
    'mesh.obj': (ply) => `# vertices\n${ply.split('end_header\n')[1]?.replaceAll(/^(?=.)/gm, 'v ')}vt 0 0\nf 1 2 3\n`,
  };
  const places = [];
  for (const [name, write] of Object.entries(writers)) {
    const paths = [0, 1].map((number) => join(folder, `${number}_${name}`));
    for (const [number, path] of paths.entries()) writeFileSync(path, write(roomCloud(number)));
    const { status } = await scanstitch(['reconstruct', ...paths, '--out', out]);
    assert.equal(status, 0, name);
    places.push(readReport(out).frames[1].T_world_sensor.x);
  }
  assert.ok(Math.abs(places[0] - 0.3) < 0.02, `${places[0]}`);
  for (const place of places) assert.ok(Math.abs(place - places[0]) < 0.005, `${places}`);
  const bad = join(folder, 'bad.obj');
  writeFileSync(bad, 'v 1 2\n');
  const { stderr } = await scanstitch(['reconstruct', bad, bad, '--out', out]);
  assert.match(stderr, /Its vertex "v 1 2" is no row of numbers\. Export it again\.(?!\.)/);
});
