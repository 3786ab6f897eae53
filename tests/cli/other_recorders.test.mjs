// @ts-check
/** What other programs, phones and data sets leave behind: logs of scans, cameras and paths beside depth images, messages in bags. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { scanLine } from '../../npm/bag/laser_scans.js';
import { decodeLivoxCloud, decodeScan } from '../../npm/bag/messages.js';
import { convertFiles } from '../../npm/formats/convert.js';
import { fileInMemory } from '../../npm/files/content.js';
import { scanReader } from '../../npm/formats/scan_messages.js';
import { isSickBinary, readSickBinary } from '../../npm/formats/sick.js';
import { cameraFor } from '../../npm/recording/camera_file.js';
import { understand } from '../../npm/recording/understand.js';
import { joinPoses, trajectoryBytes } from '../../npm/recording/pose_file.js';
import { recordingsOf } from '../../npm/bag/bag_recordings.js';
import { listOne, mcapBytes } from './bag_files.mjs';
import { CdrWriter, stampAt } from './bag_messages.mjs';
import { count, DEPTH16, encode, JPEG, many, pairsOf, understandAll } from './recording_files.mjs';

/** The scans of a text, as the engine is given them. @param {string} text */
function scansOf(text) {
  const lines = scanReader(text)?.(text, 'log', () => undefined) ?? '';
  return lines
    .trim()
    .split('\n')
    .map((line) => JSON.parse(line));
}

test("Player's log: angles, limit and odometry", () => {
  const at = (/** @type {string} */ time) => `${time} 16777343 6665`;
  const text = [
    '## Player version 3.0.2',
    `${at('0.000')} laser 00 004 001 +0.1 0 0 0 0 0 0.15 0.15`,
    `${at('1.000')} position2d 00 001 001 +1.500 +0.250 -0.300 0 0 0 0`,
    `${at('1.100')} laser 00 001 001 7 -1.5708 1.5708 1.5708 8.0 3 2.000 0 9.000 1 4.000 0`,
    `${at('1.200')} laser 00 001 002 8 1 2 3 -1.5708 1.5708 1.5708 8.0 3 2.500 0 3.500 0 4.500 0`,
    `${at('1.300')} laser 00 001 001 9 -1.5708 1.5708 1.5708 8.0 3 2.000 0 9.0`,
  ].join('\n');
  assert.deepEqual(scansOf(text), [
    { readings: [2, null, 4], min_theta: -1.5708, max_theta: 1.5708, timestamp: 1.1, odometry: [1.5, 0.25, -0.3] },
    { readings: [2.5, 3.5, 4.5], min_theta: -1.5708, max_theta: 1.5708, timestamp: 1.2, odometry: [1.5, 0.25, -0.3] },
  ]);
});

test("DP-SLAM's log and what the sample program of RPLIDARs prints", () => {
  const [scan] = scansOf('Odometry 1 2 0.5\nLaser 3 1.5 2.5 3.5\n');
  assert.deepEqual(
    [scan.readings, scan.odometry, scan.max_theta - scan.min_theta],
    [[1.5, 2.5, 3.5], [1, 2, 0.5], Math.PI],
  );
  const printed =
    'Version: 2.0.0\nFirmware Ver: 1.29\nS  theta: 00.50 Dist: 01200.00 Q: 47\n   theta: 90.00 Dist: 00000.00 Q: 0\n';
  const scans = scansOf(
    `${printed}   theta: 180.00 Dist: 02000.00 Q: 47\nS  theta: 00.60 Dist: 01300.00 Q: 47\n   theta: 90.10 Dist: 01.00 Q: 3\n`,
  );
  assert.deepEqual(scans.map(({ readings }) => readings), [[1.2, null, 2], [1.3, 0.001]]); // prettier-ignore
  assert.equal(scans[0].theta[1], -Math.PI / 2); // they turn clockwise
});

test('a message as Python prints it, and lists without names', () => {
  const message = `[INFO] [listener]: sensor_msgs.msg.LaserScan(header=Header(stamp=Time(sec=17, nanosec=5)), angle_min=-1.0, angle_max=1.0,
    angle_increment=1.0, time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=30.0, ranges=[1.5, inf, 2.5], intensities=[])`;
  const [scan] = scansOf(message.replaceAll(/\s+/g, ' '));
  assert.deepEqual([scan.readings, scan.min_theta, scan.max_theta], [[1.5, null, 2.5], -1, 1]);
  assert.ok(Math.abs(scan.timestamp - 17.000000005) < 1e-9);
  const beams = Array.from({ length: 30 }, (_, beam) => 2 + beam / 100);
  const tableOf = (/** @type {string} */ text) => (scanReader(text)?.(text, 'x', () => undefined) ?? '').split('\n');
  const python = `[inf, ${beams.slice(1).join(', ')}]\n[${beams.join(', ')}]\n`;
  assert.match(tableOf(python)[1] ?? '', /^nan,2\.01,/);
  assert.match(tableOf(JSON.stringify({ scans: [{ t: 0.5, data: beams }] }))[1] ?? '', /^0\.5,2,2\.01,/);
  assert.equal(scanReader(JSON.stringify([beams]), true), null); // called a path
});

test("SICK's binary telegrams, with an encoder, between others and with a damaged one", () => {
  const telegram = (/** @type {string} */ name, /** @type {number[]} */ body) => {
    const payload = Uint8Array.of(...encode(name), ...body);
    const length = [0, 0, payload.length >> 8, payload.length & 255];
    return [2, 2, 2, 2, ...length, ...payload, payload.reduce((sum, byte) => sum ^ byte, 0)];
  };
  const number = (/** @type {'Uint16' | 'Uint32' | 'Int32' | 'Float32'} */ kind, /** @type {number} */ value) => {
    const view = new DataView(new ArrayBuffer(kind === 'Uint16' ? 2 : 4));
    view[`set${kind}`](0, value);
    return [...new Uint8Array(view.buffer)];
  };
  const scan = (/** @type {number} */ start) => [
    ...Array(14).fill(0), // version, device, serial, status, counters
    ...number('Uint32', 2_500_000), // time since power on
    ...Array(18).fill(0), // time of transmission, inputs, outputs, reserved, frequencies
    ...[...number('Uint16', 1), ...Array(6).fill(9)], // an encoder
    ...[...number('Uint16', 1), ...encode('DIST1'), ...number('Float32', 2), ...number('Float32', 0)],
    ...[...number('Int32', start), ...number('Uint16', 5000), ...number('Uint16', 3)],
    ...[1000, 0, 2500].flatMap((range) => number('Uint16', range)),
  ];
  const good = telegram('sSN LMDscandata ', scan(-50_000));
  const damaged = good.with(60, 77);
  const bytes = Uint8Array.from([
    ...good,
    ...telegram('sEA LMDscandata ', [1]),
    ...damaged,
    ...good,
    ...good.slice(0, 50),
  ]);
  assert.ok(isSickBinary(bytes) && !isSickBinary(encode('sSN LMDscandata 1 1')));
  const { scans, numBroken } = readSickBinary(bytes);
  assert.deepEqual([scans.length, numBroken, scans[0]?.ranges, scans[0]?.time], [2, 2, [2, null, 5], 2.5]);
  const degrees = [scans[0]?.start, scans[0]?.step].map((angle) => ((angle ?? 0) * 180) / Math.PI);
  assert.deepEqual(degrees.map((angle) => angle.toFixed(6)), ['-95.000000', '0.500000']); // prettier-ignore
  for (let cut = 0; cut < bytes.length; cut += 7) readSickBinary(bytes.subarray(0, cut));
});

test('a phone: the camera of its large colours is scaled to the depth, which its principal point tells', () => {
  const matrix = encode('1755.0, 0.0, 960.0\n0.0, 1755.0, 720.0\n0.0, 0.0, 1.0\n');
  const { camera, notes } = cameraFor('camera_matrix.csv', matrix, { width: 256, height: 192 });
  assert.deepEqual([camera.fx, camera.cx, camera.cy].map((value) => value.toFixed(2)), ['234.00', '128.00', '96.00']); // prettier-ignore
  assert.match(notes[0] ?? '', /by its principal point, the camera of 1920 x 1440 pixels is scaled/);
  // Another aspect is another camera.
  const other = encode('1755 0 960\n0 1755 540\n0 0 1\n');
  assert.throws(() => cameraFor('k.txt', other, { width: 256, height: 192 }), /cannot have taken/);
});

test("ARKitScenes: a camera a frame, and the world's motion in the camera as axis and angle", async () => {
  const numbers = count(0, 3);
  const recording = await understandAll({
    ...many(numbers, (i) => `scene/lowres_depth/47_${98.7 + i / 10}.png`, DEPTH16),
    ...many(numbers, (i) => `scene/lowres_wide_intrinsics/47_${98.7 + i / 10}.pincam`, '640 480 500 500 320 240\n'),
  });
  assert.equal(recording.intrinsics, 'scene/lowres_wide_intrinsics/47_98.7.pincam');
  const traj = trajectoryBytes('lowres_wide.traj', encode(`98.7 0 0 ${Math.PI / 2} 1 2 3\n98.8 0 0 0 1 2 3\n`));
  const rows = new TextDecoder().decode(traj).trim().split('\n');
  const values = (rows[0] ?? '').split(' ').map(Number);
  // The camera lies at -R^T t = (-2, 1, -3), turned by -90 degrees about z.
  for (const [at, value] of [98.7, -2, 1, -3, 0, 0, -Math.SQRT1_2, Math.SQRT1_2].entries()) {
    assert.ok(Math.abs((values[at] ?? 0) - value) < 1e-12, rows[0]);
  }
  assert.deepEqual((rows[1] ?? '').split(' ').slice(1).map(Number), [-1, -2, -3, 0, 0, 0, 1]);
  const quaternions = encode('98.7 1 2 0 0 0 1\n');
  assert.equal(trajectoryBytes('lowres_wide.traj', quaternions), quaternions);
});

test('Polycam: the pose of each frame stands beside its camera, in fields of its own', async () => {
  const pose = (/** @type {number} */ x) => ({ t_00: 0, t_01: -1, t_02: 0, t_03: x, t_10: 1, t_11: 0, t_12: 0, t_13: 2, t_20: 0, t_21: 0, t_22: 1, t_23: 3 }); // prettier-ignore
  const camera = (/** @type {number} */ i) =>
    JSON.stringify({ fx: 750, fy: 750, cx: 512, cy: 384, width: 1024, height: 768, timestamp: i, ...pose(i) });
  const numbers = count(5, 7);
  const recording = await understandAll({
    ...many(numbers, (i) => `keyframes/depth/${i}0317.png`, DEPTH16),
    ...many(numbers, (i) => `keyframes/images/${i}0317.jpg`, JPEG),
    ...Object.fromEntries(numbers.map((i) => [`keyframes/cameras/${i}0317.json`, camera(i)])),
    'mesh_info.json': '{"bbox": [1, 2, 3]}',
  });
  const paths = numbers.map((i) => `keyframes/cameras/${i}0317.json`);
  assert.deepEqual([recording.reference, recording.intrinsics], [paths, paths[0]]);
  const text = new TextDecoder().decode(joinPoses(numbers.map((i) => encode(camera(i)))));
  assert.equal(text, numbers.map((i) => `0 -1 0 ${i} 1 0 0 2 0 0 1 3 0 0 0 1\n`).join(''));
  // The motion between two lenses is the same for every frame, and no path.
  const fixed = await understandAll({
    ...many(numbers, (i) => `depth/${i}.png`, DEPTH16),
    ...many(numbers, (i) => `cameras/${i}.json`, JSON.stringify({ depth_to_color: [[1, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] })), // prettier-ignore
  });
  assert.deepEqual(fixed.reference, []);
});

test('BOP: the motion of the world in the camera, in millimetres', async () => {
  const camera = { cam_K: [500, 0, 320, 0, 500, 240, 0, 0, 1], depth_scale: 0.1 };
  const motion = { cam_R_w2c: [0, -1, 0, 1, 0, 0, 0, 0, 1], cam_t_w2c: [1000, 2000, 3000] };
  const cameras = encode(
    JSON.stringify({ 10: { ...camera, ...motion }, 9: { ...camera, ...motion, cam_t_w2c: [0, 0, 0] } }),
  );
  const recording = await understandAll({
    ...many([9, 10], (i) => `000001/depth/0000${i}.png`, DEPTH16),
    '000001/scene_camera.json': cameras,
  });
  assert.deepEqual(recording.reference, ['000001/scene_camera.json']);
  const lines = new TextDecoder().decode(trajectoryBytes('scene_camera.json', cameras)).trim().split('\n');
  const rows = lines.map((line) => line.split(' ').map((number) => Number(number) + 0));
  // The camera lies at -R^T t = (-2, 1, -3).
  assert.deepEqual(rows, [
    [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    [0, 1, 0, -2, -1, 0, 0, 1, 0, 0, 1, -3, 0, 0, 0, 1],
  ]);
});

test('SUN3D: numbers tell which belong together, and the times beside them differ', async () => {
  const numbers = count(1, 4);
  const name = (/** @type {number} */ i, /** @type {number} */ time) =>
    `${String(i).padStart(7, '0')}-${String(time).padStart(12, '0')}`;
  const recording = await understandAll({
    ...many(numbers, (i) => `depth/${name(i, 33367 * (i - 1))}.png`, DEPTH16),
    ...many(numbers, (i) => `image/${name(i, 33400 * (i - 1))}.jpg`, JPEG),
  });
  assert.deepEqual(pairsOf(recording)[2], [`depth/${name(3, 66734)}.png`, `image/${name(3, 66800)}.jpg`]);
  assert.deepEqual(recording.notes, []);
});

test('bags: of several echoes the first, and the points of a Livox', async () => {
  const echoes = new CdrWriter()
    .header(stampAt(1), 'laser')
    .f32(-1)
    .f32(1)
    .f32(1)
    .f32(0)
    .f32(0.1)
    .f32(0.1)
    .f32(30)
    .u32(3);
  echoes.u32(2).f32(1.5).f32(2.5).u32(0).u32(1).f32(4.5).u32(0);
  const line = JSON.parse(scanLine(decodeScan(echoes.done(), true)));
  assert.deepEqual([line.readings, line.min_theta, line.max_theta], [[1.5, null, 4.5], -1, 1]);
  const livox = new CdrWriter().header(stampAt(2), 'livox').f64(0).u32(2).u8(1).u8(0).u8(0).u8(0).u32(2);
  for (const x of [1, 2])
    livox
      .u32(100 * x)
      .f32(x)
      .f32(-x)
      .f32(0.5)
      .u8(10)
      .u8(0)
      .u8(x);
  const cloud = decodeLivoxCloud(livox.done());
  const [points, times] = [new Float32Array(cloud.data.buffer), new Uint32Array(cloud.data.buffer)];
  assert.deepEqual(
    [cloud.width, ...[0, 4].map((at) => [...points.slice(at, at + 3), times[at + 3]])],
    [2, [1, -1, 0.5, 100], [2, -2, 0.5, 200]],
  );
  const topics = [
    { name: '/scan', type: 'sensor_msgs/msg/MultiEchoLaserScan' },
    { name: '/livox/lidar', type: 'livox_ros_driver2/msg/CustomMsg' },
  ];
  const messages = [
    { topic: '/scan', time: 1_000_000_000n, data: echoes.done() },
    { topic: '/livox/lidar', time: 2_000_000_000n, data: livox.done() },
  ];
  const open = async (/** @type {Partial<Record<string, string | null>>} */ wishes) => {
    const [made] = await recordingsOf([await listOne('walk.mcap', mcapBytes(topics, messages))], wishes);
    return made;
  };
  const [scans, clouds] = [await open({ scans: '/scan', clouds: null }), await open({ clouds: '/livox/lidar' })];
  assert.deepEqual([scans?.recording.scans.length, clouds?.recording.clouds.length], [1, 1]);
  const log = new TextDecoder().decode(await scans?.files[0]?.read());
  assert.deepEqual(JSON.parse(log).readings, [1.5, null, 4.5]);
  const pcd = new TextDecoder('latin1').decode(await clouds?.files[0]?.read());
  assert.match(pcd, /FIELDS x y z offset_time\n[^]*POINTS 2\n/);
});

test('of hostile files, each byte is looked at a few times at most', () => {
  const before = process.cpuUsage();
  const many = 2_000_000;
  const telegrams = new Uint8Array(many).fill(2);
  // Lengths that reach to the middle of the file.
  for (let at = 4; at < many; at += 8) new DataView(telegrams.buffer).setUint32(at, many / 2 - at);
  assert.deepEqual(readSickBinary(telegrams).scans, []);
  const head = 'LaserScan(header=Header(), angle_min=-1.0, ';
  const list = Array(30).fill('1.5').join(', ');
  for (const text of [
    `${head}${'ranges=['.repeat(many / 8)}`,
    `[${list},${' '.repeat(many)}nan`,
    `1.5 1 1 laser 00 1 1 0\n1.5 1 1 laser 00 ${'0'.repeat(many)}`,
  ]) {
    try {
      const made = scanReader(text.slice(0, 32_768))?.(text, 'log', () => undefined);
      assert.ok(made !== undefined && made.trim() === '');
    } catch (error) {
      assert.match(String(error), /log/);
    }
  }
  assert.ok(process.cpuUsage(before).user < 20e6, 'in 20 s of the processor');
});

test('logs that begin with numbers alone are no tables where words say who wrote them', async () => {
  const readings = Array.from({ length: 30 }, (_, at) => 2 + at / 10);
  const player = `1.1 16777343 6665 laser 00 001 001 7 -1.5 1.4 0.1 8.0 30 ${readings.map((range) => `${range} 0`).join(' ')}\n`;
  const printed = readings.map((range, at) => `   theta: ${at}.50 Dist: ${1000 * range} Q: 47\n`).join('');
  for (const text of [player, `S  theta: 0.10 Dist: 1200.00 Q: 47\n${printed}`]) {
    const file = fileInMemory('scans.txt', encode(text.repeat(3)));
    const { files } = await convertFiles([file], (made) => made);
    const lines = new TextDecoder()
      .decode(await files[0]?.read())
      .trim()
      .split('\n');
    assert.deepEqual(lines.length, 3);
    assert.deepEqual(JSON.parse(lines[0] ?? '').readings.slice(-3), readings.slice(-3));
  }
});

test('depth images as text, and raw values of a Kinect', async () => {
  const [width, height] = [80, 60];
  const row = (/** @type {number} */ v, /** @type {number} */ unit) =>
    Array.from({ length: width }, (_, u) => (u === 3 ? 'nan' : String(unit * (1 + u / 100 + v / 50)))).join(',');
  const image = (/** @type {number} */ unit) => Array.from({ length: height }, (_, v) => `${row(v, unit)}\n`).join('');
  const file = (/** @type {string} */ name, /** @type {string} */ text) =>
    fileInMemory(name, new TextEncoder().encode(text));
  const { files, notes } = await convertFiles(
    [file('depth_0.csv', image(1)), file('depth_1.csv', image(1000)), file('depth_2.csv', `${image(1)}1,2\n`)],
    (made) => made,
  );
  assert.deepEqual(files.map(({ path }) => path), ['depth_0.pfm', 'depth_1.pfm']); // prettier-ignore
  assert.match(notes[0]?.reason ?? '', /line 61 has 2 numbers where the image has 80 columns/i);
  const [metres, millimetres] = await Promise.all(files.map(({ read }) => read()));
  const pixels = new Float32Array(metres?.slice(-4 * width * height).buffer ?? new ArrayBuffer(0));
  // The last row comes first in a PFM.
  assert.ok(Math.abs((pixels[(height - 1) * width + 10] ?? 0) - 1.1) < 1e-6 && Number.isNaN(pixels[3] ?? 0));
  // As they are: the engine takes what cannot be metres for millimetres.
  const larger = new Float32Array(millimetres?.slice(-4 * width * height).buffer ?? new ArrayBuffer(0));
  assert.ok(Math.abs((larger[(height - 1) * width + 10] ?? 0) - 1100) < 1e-3);
  const raw = { path: 'basement/d-1316653580.471513-1316138413.pgm', size: 10 };
  const { kind, notes: told } = await understand([raw], async () => new Uint8Array());
  assert.equal(kind, 'nothing');
  assert.match(told.map(({ reason }) => reason).join(), /a Kinect's raw values \(NYU\).*351\.3/);
});

test('the cameras of published data sets are told by the names of their folders and paths', async () => {
  const text = (/** @type {string} */ path) => fileInMemory(path, encode('# time x y z qx qy qz qw\n'));
  for (const [paths, fx] of /** @type {const} */ ([
    [['a/rgbd_dataset_freiburg1_xyz/groundtruth.txt', 'a/rgbd_dataset_freiburg1_xyz/rgb.txt'], 517.3],
    [['rgbd_dataset_freiburg3_long_office_household/depth.txt'], 535.4],
    [['rgbd_bonn_balloon/groundtruth.txt'], 542.8],
    [['living_room/livingRoom2n.gt.freiburg', 'living_room/associations.txt'], 481.2],
    [['traj0.gt.freiburg'], 481.2],
  ])) {
    const { files, notes } = await convertFiles(paths.map(text), (made) => made);
    const made = files.find(({ path }) => path.endsWith('camera.yaml'));
    const { camera } = cameraFor('camera.yaml', (await made?.read()) ?? new Uint8Array(), { width: 640, height: 480 });
    assert.deepEqual([camera.fx, camera.depth_scale, notes.length], [fx, 5000, 1], paths[0]);
  }
  for (const paths of [['freiburg/groundtruth.txt'], ['rgbd_bonn_balloon/depth.txt', 'rgbd_bonn_balloon/camera.txt']]) {
    const { files, notes } = await convertFiles(paths.map(text), (made) => made);
    assert.deepEqual([files.length, notes], [paths.length, []]);
  }
});
