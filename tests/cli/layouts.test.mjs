// @ts-check
/**
 * Files as programs of others write them, of a laser that drives through one room: each is read at the first drop and gives the
 * drive, or is named with what to do. Nothing that is read otherwise than it was meant is good.
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load, Reconstruction } from '../../npm/index.js';
import { readRecording } from '../../npm/recording_reader.js';
import { bearings, DEGREE, LAST, PLACES, rangesAt } from './layout_room.mjs';
import { count, DEPTH16, encode, JPEG, many, npy, RGB, understandAll } from './recording_files.mjs';

await load();

/** @typedef {Record<string, string | Uint8Array>} Files */
/** @param {number} value @param {number} [digits] */
const f = (value, digits = 3) => value.toFixed(digits);
const FROM_ZERO = bearings(360, 0, 1);
const ROS = bearings(360, -180, 1);
const HALF = bearings(181, -90, 1);
const F1TENTH = bearings(1080, -135, 0.25);
/** @param {readonly number[]} along */
const scans = (along) => PLACES.map((place) => rangesAt(place, along));
/** @param {readonly number[]} along @param {(ranges: string[], scan: number) => string} line */
const lines = (along, line) =>
  scans(along)
    .map(
      (ranges, scan) =>
        `${line(
          ranges.map((range) => f(range)),
          scan,
        )}\n`,
    )
    .join('');
/** Returns as points x y. @param {readonly number[]} ranges @param {readonly number[]} along @returns {[number, number][]} */
const pointsOf = (ranges, along) =>
  ranges.map((range, beam) => [range * Math.cos(along[beam] ?? 0), range * Math.sin(along[beam] ?? 0)]);

/** What is placed, and what is told. @param {Files} files */
async function reconstructed(files) {
  const given = Object.entries(files).map(([path, content]) => ({
    path,
    blob: new Blob([/** @type {BlobPart} */ (content)]),
  }));
  const recording = await readRecording(given);
  const told = recording.notes.map(({ file, reason }) => `${file}: ${reason}`);
  if (recording.kind !== 'planar_scans') return { recording, told, statuses: [], last: null };
  const engine = new Reconstruction();
  try {
    for (const path of recording.scans) {
      const bytes = await recording.read(path);
      try {
        if (encode('ply').every((byte, at) => bytes[at] === byte)) engine.add_scan(path, bytes);
        else told.push(...Object.values(engine.add_log(path, bytes)).flat().map(String));
      } catch (error) {
        told.push(String(error));
      }
    }
    while (engine.step().stage !== 'done');
    const { frames } = engine.result();
    const { x = 0, y = 0, theta = 0 } = frames.at(-1)?.T_world_sensor ?? {};
    return { recording, told, statuses: frames.map(({ status }) => status), last: [x, y, theta] };
  } finally {
    engine.free();
  }
}

/** Every scan is of this status, and the last lies where it was made, or turned with its sensor by half a turn. @param {Files} files @param {'good' | 'doubtful'} status */
async function assertDriven(files, status) {
  const { told, statuses, last } = await reconstructed(files);
  assert.deepEqual(statuses, Array(PLACES.length).fill(status), told.join('\n'));
  const [x = 0, y = 0, heading = 0] = last ?? [];
  assert.ok(Math.hypot(x - LAST[0], y - LAST[1]) < 0.01, `${last}`);
  assert.ok(Math.abs(heading - LAST[2]) < 0.01, `${last}`);
  return told;
}

const STAMPS = (/** @type {number} */ scan) => f(1_227_796_083 + 0.1 * scan, 6);

/** @type {Record<string, () => Files>} */
const READ = {
  'polar coordinates in a unit that a comment names, with words for no return': () => ({
    'polar.csv': `# units: mm\ntheta_deg,r\n${lines(HALF, (ranges) => ranges.map((range, beam) => `${beam - 90},${beam === 7 ? 'None' : f(1000 * Number(range), 0)}`).join('\n'))}`,
  }),
  'points with decimal commas beside an intensity, a file a scan': () =>
    Object.fromEntries(
      scans(HALF).map((ranges, scan) => {
        const rows = pointsOf(ranges, HALF).map(([x, y]) => `${f(x, 4)};${f(y, 4)};47`.replaceAll('.', ','));
        return [`s${scan}.csv`, `x;y;intensity\n${rows.join('\n')}\n`];
      }),
    ),
  "F1TENTH's ranges behind a time": () => ({
    'scan.csv': lines(F1TENTH, (ranges, scan) => [STAMPS(scan), ...ranges].join(',')),
  }),
  'a message a line, as ros2 topic echo --csv prints it': () => ({
    'scan.csv': lines(ROS, (ranges, scan) =>
      [
        1700 + scan,
        500_000,
        'laser',
        -3.14159,
        3.1241,
        0.0174533,
        0,
        0.1,
        0.1,
        30,
        ...ranges,
        ...ranges.map(() => 47),
      ].join(','),
    ),
  }),
  'mcap cat --json': () => ({
    'scan.jsonl': lines(ROS, (ranges, scan) =>
      JSON.stringify({
        topic: '/scan',
        sequence: scan,
        log_time: 1e18,
        data: {
          header: { stamp: { sec: 17 + scan, nsec: 0 } },
          angle_min: -Math.PI,
          angle_max: Math.PI - DEGREE,
          angle_increment: DEGREE,
          range_min: 0.1,
          range_max: 30,
          ranges: ranges.map(Number),
          intensities: [],
        },
      }),
    ),
  }),
  "PlotJuggler's table": () => ({
    'plot.csv': `${['__time', '/scan/angle_increment', '/scan/angle_max', '/scan/angle_min', ...ROS.map((_, beam) => `/scan/ranges[${beam}]`)].join(',')}\n${lines(ROS, (ranges, scan) => [1700 + scan, 0.0174533, 3.1241, -3.14159, ...ranges].join(','))}`,
  }),
  "bagpy's table": () => ({
    'laser.csv': `${['Time', 'header.seq', 'header.stamp.secs', 'header.stamp.nsecs', 'header.frame_id', 'angle_min', 'angle_max', 'angle_increment', 'time_increment', 'scan_time', 'range_min', 'range_max', ...ROS.map((_, beam) => `ranges_${beam}`), ...ROS.map((_, beam) => `intensities_${beam}`)].join(',')}\n${lines(ROS, (ranges, scan) => [1700 + scan, scan, 1700 + scan, 0, 'laser', -3.14159, 3.1241, 0.0174533, 0, 0.1, 0.1, 30, ...ranges, ...ranges.map(() => 0)].join(','))}`,
  }),
  'Rawseeds: a time, the count, the first angle': () => ({
    'SICK_FRONT.csv': lines(HALF, (ranges, scan) => [STAMPS(scan), 181, '-1.570796', ...ranges].join(', ')),
  }),
  'a time, the count, the first and the last angle': () => ({
    'log.txt': lines(HALF, (ranges, scan) => [f(0.1 * scan), 181, -90, 90, ...ranges].join(' ')),
  }),
  "MRPT's scans as text, with their times": () => ({
    'LASER1.txt': lines(bearings(361, -90, 0.5), (ranges) => ranges.join(' ')),
    'LASER1_times.txt': PLACES.map((_, scan) => `${STAMPS(scan)}\n`).join(''),
  }),
  "CoppeliaSim's Hokuyo: x y z of every return on a line": () => ({
    'hokuyo.csv': PLACES.map((place) => {
      const along = bearings(684, -120, 240 / 683);
      return `${pointsOf(rangesAt(place, along), along)
        .map(([x, y]) => `${f(x)},${f(y)},0.000`)
        .join(',')}\n`;
    }).join(''),
  }),
  'x y of every return on a line': () => ({
    'laser.txt': PLACES.map(
      (place) =>
        `${pointsOf(rangesAt(place, FROM_ZERO), FROM_ZERO)
          .flat()
          .map((value) => f(value))
          .join(' ')}\n`,
    ).join(''),
  }),
  "the listener of YDLIDAR's package": () => ({
    'client.txt': lines(ROS, (ranges) =>
      [
        `[YDLIDAR INFO]: I heard a laser scan laser_frame[360]:`,
        `[YDLIDAR INFO]: angle_range : [-180.000000, 180.000000]`,
        ...ranges.map((range, beam) => `[YDLIDAR INFO]: angle-distance : [${f(beam - 180, 6)}, ${range}000, ${beam}]`),
      ].join('\n'),
    ),
  }),
  "the listener of RPLIDAR's package": () => ({
    'client.log': lines(ROS, (ranges) =>
      [
        `[INFO] [1700.1]: I heard a laser scan laser[360]:`,
        `[INFO] [1700.1]: angle_range, -180.000000, 180.000000`,
        ...ranges.map((range, beam) => `[INFO] [1700.1]: : [${f(beam - 180, 6)}, ${range}]`),
      ].join('\n'),
    ),
  }),
  "a Neato's answers, some readings with an error in place of a distance": () => ({
    'lds.txt': lines(FROM_ZERO, (ranges) =>
      [
        'GetLDSScan',
        'AngleInDegrees,DistInMM,Intensity,ErrorCodeHEX',
        ...ranges.map((range, beam) =>
          beam % 30 === 5 ? `${beam},8035,0,8035` : `${beam},${f(1000 * Number(range), 0)},90,0`,
        ),
        'ROTATION_SPEED,5.03',
      ].join('\n'),
    ),
  }),
  "ARIA's log of a Pioneer": () => ({
    'drive.2d': `LaserOdometryLog\n#Created by ARIA\nversion: 3\nsick1pose: 103 0 0.00\nsick1conf: -90 90 181\n${PLACES.map(
      ([x, y, heading], scan) =>
        `scan1Id: ${scan}\ntime: ${f(0.2 * scan)}\nrobot: ${f(1000 * x, 0)} ${f(1000 * y, 0)} ${f(heading / DEGREE, 2)}\nsick1: ${rangesAt(
          [x, y, heading],
          HALF,
        )
          .map((range) => f(1000 * range, 0))
          .join(' ')} \n`,
    ).join('')}`,
  }),
  'a table of the number of the scan, x and y': () => ({
    'points.csv': `scan_id,x,y\n${PLACES.flatMap((place, scan) => pointsOf(rangesAt(place, FROM_ZERO), FROM_ZERO).map(([x, y]) => `${scan},${f(x)},${f(y)}\n`)).join('')}`,
  }),
  'points in JSON, as lists and as objects': () => ({
    'scans.json': JSON.stringify({
      scans: PLACES.map((place, scan) => {
        const points = pointsOf(rangesAt(place, FROM_ZERO), FROM_ZERO);
        return { id: scan, points: scan % 2 === 0 ? points : points.map(([x, y]) => ({ x, y })) };
      }),
    }),
  }),
  'planar scans as PCD, as text': () => pcdFiles(false),
  'planar scans as PCD, binary': () => pcdFiles(true),
  "an LD06's packets, as bytes": () => ({ 'ld06.bin': packets() }),
  "an LD06's packets, in hexadecimal": () => ({
    'ld06.txt': [...packets()].map((byte) => byte.toString(16).padStart(2, '0')).join(' '),
  }),
};

/** A PCD of x y z and intensity for each place. @param {boolean} isBinary @returns {Files} */
function pcdFiles(isBinary) {
  const files = PLACES.map((place, scan) => {
    const points = pointsOf(rangesAt(place, FROM_ZERO), FROM_ZERO);
    const header = `# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 360\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 360\nDATA ${isBinary ? 'binary' : 'ascii'}\n`;
    const text = points.map(([x, y]) => `${f(x, 4)} ${f(y, 4)} 0 47\n`).join('');
    const numbers = Float32Array.from(points.flatMap(([x, y]) => [x, y, 0, 47]));
    const body = isBinary ? new Uint8Array(numbers.buffer) : encode(text);
    return [`scan_${scan}.pcd`, new Uint8Array(Buffer.concat([encode(header), body]))];
  });
  return Object.fromEntries(files);
}

/** What an LD06 sends: 30 packets of twelve readings a turn, clockwise. */
function packets() {
  const all = PLACES.flatMap((place, scan) =>
    Array.from({ length: 30 }, (_, part) => {
      const packet = Buffer.alloc(47);
      packet.set([0x54, 0x2c, 0x10, 0x0e]);
      packet.writeUInt16LE(1200 * part, 4);
      for (let reading = 0; reading < 12; reading += 1) {
        const [range = 0] = rangesAt(place, [-DEGREE * (12 * part + reading)]);
        packet.writeUInt16LE(Math.round(1000 * range), 6 + 3 * reading);
        packet[8 + 3 * reading] = 200;
      }
      packet.writeUInt16LE(1200 * part + 1100, 42);
      packet.writeUInt16LE((100 * scan + 3 * part) % 30_000, 44);
      let sum = 0;
      for (const byte of packet.subarray(0, 46)) {
        sum ^= byte;
        for (let bit = 0; bit < 8; bit += 1) sum = sum & 0x80 ? ((sum << 1) ^ 0x4d) & 0xff : (sum << 1) & 0xff;
      }
      packet[46] = sum;
      return packet;
    }),
  );
  return new Uint8Array(Buffer.concat(all));
}

for (const [name, make] of Object.entries(READ)) {
  test(`read: ${name}`, async () => {
    await assertDriven(make(), 'good');
  });
}

/** Read as meant, but nothing tells which way the laser turns. @type {Record<string, () => Files>} */
const OPEN = {
  'an angle and a range in turn on a line': () => ({
    'polar.txt': lines(FROM_ZERO, (ranges) => ranges.flatMap((range, beam) => [beam, range]).join(' ')),
  }),
  'angle, distance, quality': () => ({
    'lidar.csv': `angle,distance,quality\n${lines(FROM_ZERO, (ranges) => ranges.map((range, beam) => `${beam}.0,${f(1000 * Number(range), 0)},15`).join('\n'))}`,
  }),
  'half a turn whose angles go on from 359 to 0': () => ({
    'lidar.csv': `start,angle,distance,quality\n${lines(HALF, (ranges) => ranges.map((range, beam) => `${Number(beam === 0)},${(beam + 270) % 360},${f(1000 * Number(range), 0)},15`).join('\n'))}`,
  }),
  'two columns without names': () => ({
    'lidar.csv': lines(FROM_ZERO, (ranges) =>
      ranges.map((range, beam) => `${beam},${f(1000 * Number(range), 0)}`).join('\n'),
    ),
  }),
  'a full turn a line': () => ({ 'turns.csv': lines(FROM_ZERO, (ranges) => ranges.join(',')) }),
  'arrays of a full turn, as JSON': () => ({
    'turns.json': JSON.stringify(scans(FROM_ZERO).map((ranges) => ranges.map(Number))),
  }),
  'objects in JSON': () => ({
    'scans.json': JSON.stringify(
      scans(FROM_ZERO).map((ranges) => ranges.map((range, angle) => ({ angle, distance: 1000 * range }))),
    ),
  }),
};

for (const [name, make] of Object.entries(OPEN)) {
  test(`doubtful, as it may be a mirror image: ${name}`, async () => {
    const told = await assertDriven(make(), 'doubtful');
    if (name.includes('objects') || name.includes('in turn'))
      assert.match(told.join('\n'), /counter-clockwise.*the map is mirrored: then set laser_direction=mirrored/);
    else assert.match(told.join('\n'), /the map is mirrored: give (angle|step)=/);
  });
}

test('a pose and a speed before 1,080 ranges, which could be 1,081, are asked about', async () => {
  const text = PLACES.map(([x, y, heading], scan) =>
    [
      f(x),
      f(y),
      f(heading, 4),
      f(1.5 + 0.01 * scan, 2),
      ...rangesAt([x, y, heading], F1TENTH).map((range) => f(range)),
    ].join(','),
  ).join('\n');
  const { told, statuses } = await reconstructed({ 'lap.csv': `${text}\n` });
  assert.deepEqual(statuses, []);
  assert.match(told.join('\n'), /1080 ranges may begin at column 5.*--table ranges=5:1084/s);
});

test('a path with the numbers of its frames is none of points', async () => {
  const path = PLACES.map(([x, y], scan) => `${scan},${f(x)},${f(y)}\n`).join('');
  const scans = lines(HALF, (ranges) => ranges.join(' '));
  for (const head of ['frame,x,y', 'frame,x,y,yaw']) {
    const { recording } = await reconstructed({ 'scans.txt': scans, 'groundtruth.csv': `${head}\n${path}` });
    assert.deepEqual([recording.scans, recording.reference], [['scans.txt'], ['groundtruth.csv']]);
  }
});

test('what only looks like points is left alone', async () => {
  const outline = JSON.stringify({
    shapes: [{ points: pointsOf(rangesAt(PLACES[0] ?? [0, 0, 0], HALF), HALF) }],
    imagePath: '1.png',
  });
  const corners = JSON.stringify({ points: [[0, 0], [1, 0], [1, 1]], origin: { x: 1, y: 2 } }); // prettier-ignore
  const { recording, told } = await reconstructed({ 'outline.json': outline, 'corners.json': corners });
  assert.equal(recording.kind, 'nothing');
  assert.ok(
    recording.notes.every(({ is_loss }) => !is_loss),
    told.join(),
  );
  // Ranges with -1 for no return are no coordinates.
  const ranges = lines(HALF, (given) => given.map((range, beam) => (beam % 5 < 2 ? '-1' : range)).join(' '));
  const read = await reconstructed({ 'scans.txt': ranges });
  assert.match(read.told.join(), /--table ranges=1:181,unit=m,start=-90/);
});

/** @param {string} text */
const sqlite = (text) => {
  const bytes = Buffer.alloc(4096);
  bytes.write('SQLite format 3\0');
  bytes.write(text, 200);
  return new Uint8Array(bytes);
};

/** What helps, by the file's name. @type {[Files, RegExp][]} */
const TOLD = [
  [
    { 'map.yaml': 'image: map.pgm\nresolution: 0.05\norigin: [-1, -1, 0]\noccupied_thresh: 0.65\n' },
    /a map that is finished.*ros2 bag record \/scan/,
  ],
  [{ 'lcmlog-2016-05-03.00': new Uint8Array(60) }, /a log of LCM.*lcm-logplayer/],
  [{ 'old.bag': `#ROSRECORD V1.2\n${'x'.repeat(200)}` }, /rosbag fix/],
  [
    { 'rosbag2/metadata.yaml': 'rosbag2_bagfile_information:\n  version: 4\n' },
    /give the whole folder, with its \.db3 or \.mcap/,
  ],
  [{ 'imu.csv': 'timestamp,ax,ay,az\n0,0.1,0.2,9.8\n1,0.1,0.2,9.8\n2,0.1,0.2,9.8\n' }, /inertial sensor/],
  [
    { 'gps.log': '$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n'.repeat(9) },
    /satellite receiver/,
  ],
  [{ 'segment.tfrecord': new Uint8Array(60) }, /records of TensorFlow/],
  [{ 'rtabmap.db': sqlite('CREATE TABLE Node ( id INTEGER') }, /rtabmap-export/],
  [{ 'app.sqlite': sqlite('CREATE TABLE users') }, /no bag of ROS 2/],
];

test('what is no recording is named with what to do', async () => {
  for (const [files, expected] of TOLD) {
    const { recording, told } = await reconstructed(files);
    assert.equal(recording.kind, 'nothing');
    assert.match(told.join('\n'), expected);
  }
});

test('distances along the ray are not taken for depth', async () => {
  const radial = {
    ...many(count(0, 3), (i) => `out/distance_to_camera_${i}.npy`, npy('480, 640')),
    ...many(count(0, 3), (i) => `out/rgb_${i}.png`, RGB),
  };
  const airsim = many(count(0, 3), (i) => `images/img_0_2_16${i}.pfm`, encode('Pf\n256 144\n-1.0\n'));
  assert.equal((await understandAll(radial)).kind, 'nothing');
  const { kind, notes } = await understandAll(airsim);
  assert.equal(kind, 'nothing');
  assert.match(notes.map(({ reason }) => reason).join(), /along each pixel's ray.*DepthPlanar/);
});

test('OpenLORIS: the camera stands as fx cx fy cy', async () => {
  const files = {
    ...many(count(0, 3), (i) => `home/aligned_depth/156${i}.1.png`, DEPTH16),
    ...many(count(0, 3), (i) => `home/color/156${i}.1.jpg`, JPEG),
    'home/sensors.yaml':
      '%YAML:1.0\n---\nd400_color:\n   intrinsics: !!opencv-matrix\n      rows: 1\n      cols: 4\n      dt: d\n      data: [ 611.45, 318.2, 611.48, 249.47 ]\n',
  };
  const { intrinsics, notes } = await understandAll(files);
  assert.deepEqual([intrinsics, notes], ['home/sensors.yaml', []]);
});
