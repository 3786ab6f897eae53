// @ts-check
/** Messages of bags as files of standard formats. */
import assert from 'node:assert/strict';
import { deflateSync } from 'node:zlib';
import { test } from 'node:test';
import { listBags, recordingsOf } from '../../npm/bag/bag_recordings.js';
import { cloudFile } from '../../npm/bag/clouds.js';
import { colorFile, depthFile } from '../../npm/bag/images.js';
import { ofOneLaser, scanLine } from '../../npm/bag/laser_scans.js';
import { decodeCloud, decodeCompressed, decodeImage, decodeScan } from '../../npm/bag/messages.js';
import { packedFile } from '../../npm/bag/packed_images.js';
import { pathText } from '../../npm/bag/path.js';
import { chooseTopics } from '../../npm/bag/topics.js';
import { crc32 } from '../../npm/base/crc32.js';
import { listOne, mcapBytes } from './bag_files.mjs';
import {
  cameraInfo,
  compressedImage,
  image,
  laserScan,
  odometry,
  pointCloud,
  poseStamped,
  stampAt,
  transforms,
} from './bag_messages.mjs';

const STAMP = stampAt(12.5);
const text = (/** @type {Uint8Array} */ bytes) => new TextDecoder('latin1').decode(bytes);

/** Header and values of a file. @param {Uint8Array} file @param {number} lines of the header */
function split(file, lines) {
  let place = 0;
  for (let line = 0; line < lines; line += 1) place = file.indexOf(10, place) + 1;
  return { header: text(file.subarray(0, place)), body: file.slice(place) };
}

/** @param {string} encoding @param {number[]} bytes @param {{ step?: number, bigEndian?: boolean, isLittle?: boolean, width?: number }} [changes] */
function imageOf(encoding, bytes, { width = 2, ...changes } = {}) {
  return decodeImage(image({ stamp: STAMP, width, height: 2, encoding, data: Uint8Array.from(bytes), ...changes }));
}

test('depth of 16 bits: byte orders and padded rows come out the same', () => {
  const expected = { header: 'P5\n2 2\n65535\n', body: Uint8Array.of(1, 2, 3, 4, 5, 6, 7, 8) };
  for (const isLittle of [true, false]) {
    const low = imageOf('16UC1', [2, 1, 4, 3, 6, 5, 8, 7], { isLittle });
    assert.deepEqual(split(depthFile(low), 3), expected);
    const high = imageOf('mono16', [1, 2, 3, 4, 9, 9, 5, 6, 7, 8], { step: 6, bigEndian: true, isLittle });
    assert.deepEqual(split(depthFile(high), 3), expected);
  }
  assert.deepEqual(
    [...split(depthFile(imageOf('16SC1', [1, 0, 255, 255, 0, 128, 2, 0])), 3).body],
    [0, 1, 0, 0, 0, 0, 0, 2],
  );
  assert.deepEqual(split(depthFile(imageOf('mono8', [1, 2, 0, 3, 4], { step: 3 })), 3), {
    header: 'P5\n2 2\n255\n',
    body: Uint8Array.of(1, 2, 3, 4),
  });
});

test('depth in metres: the last row first, whatever the byte order', () => {
  const values = [1.5, Number.NaN, 0, 2.25];
  const bytes = (/** @type {boolean} */ isLittle) => {
    const view = new DataView(new ArrayBuffer(16));
    values.forEach((value, index) => view.setFloat32(4 * index, value, isLittle));
    return [...new Uint8Array(view.buffer)];
  };
  for (const bigEndian of [false, true]) {
    const { header, body } = split(depthFile(imageOf('32FC1', bytes(!bigEndian), { bigEndian })), 3);
    assert.equal(header, 'Pf\n2 2\n-1.0\n');
    assert.deepEqual([...new Float32Array(body.buffer)], [0, 2.25, 1.5, Number.NaN]);
  }
  const doubles = [...new Uint8Array(Float64Array.from(values).buffer)];
  assert.deepEqual(
    [...new Float32Array(split(depthFile(imageOf('64FC1', doubles)), 3).body.buffer)],
    [0, 2.25, 1.5, Number.NaN],
  );
});

test('colours of every encoding', () => {
  const red = (/** @type {import('../../npm/bag/messages.js').ImageMessage} */ message) => [
    ...split(colorFile(message), 3).body.subarray(0, 3),
  ];
  const fill = (/** @type {number[]} */ pixel) => [pixel, pixel, pixel, pixel].flat();
  for (const [encoding, pixel] of /** @type {const} */ ([
    ['rgb8', [200, 10, 20]],
    ['bgr8', [20, 10, 200]],
    ['8UC3', [20, 10, 200]],
    ['rgba8', [200, 10, 20, 255]],
    ['bgra8', [20, 10, 200, 255]],
    ['rgb16', [1, 200, 1, 10, 1, 20]],
  ])) {
    const message = imageOf(encoding, fill([...pixel]));
    assert.deepEqual(red(message), [200, 10, 20], encoding);
    assert.equal(split(colorFile(message), 3).header, 'P6\n2 2\n255\n');
  }
  assert.deepEqual(split(colorFile(imageOf('mono8', [1, 2, 3, 4])), 3).body, Uint8Array.of(1, 2, 3, 4));
  assert.deepEqual(split(colorFile(imageOf('mono16', [9, 1, 9, 2, 9, 3, 9, 4])), 3).body, Uint8Array.of(1, 2, 3, 4));
  // Pure red in BT.601 is Y = 81, U = 90, V = 240.
  for (const [encoding, pixels] of /** @type {const} */ ([
    ['yuv422', [90, 81, 240, 81]],
    ['yuv422_yuy2', [81, 90, 81, 240]],
  ])) {
    const { body } = split(colorFile(imageOf(encoding, [...pixels, ...pixels])), 3);
    for (let pixel = 0; pixel < 12; pixel += 3) {
      const [r = 0, g = 0, b = 0] = body.subarray(pixel);
      assert.ok(r >= 253 && g <= 2 && b <= 2, `${encoding}: ${r} ${g} ${b}`);
    }
  }
  assert.throws(() => colorFile(imageOf('bayer_rggb8', [1, 2, 3, 4])), /bayer_rggb8 are not read.*rgb8 or bgr8/);
});

/** A grey PNG of 16 bits, each row with the filter it is given. @param {number} width @param {number[][]} rows @param {number[]} filters */
function png16(width, rows, filters) {
  const plain = rows.map((row) => row.flatMap((value) => [value >> 8, value & 255]));
  const lines = plain.map((row, v) => {
    const at = (/** @type {number[] | undefined} */ line, /** @type {number} */ i) => line?.[i] ?? 0;
    const filtered = row.map((value, i) => {
      const [left, up, corner] = [at(row, i - 2), at(plain[v - 1], i), at(plain[v - 1], i - 2)];
      const p = left + up - corner;
      const near = [left, up, corner].reduce((best, c) => (Math.abs(p - c) < Math.abs(p - best) ? c : best), left);
      return (value - ([0, left, up, (left + up) >> 1, near][filters[v] ?? 0] ?? 0)) & 255;
    });
    return [filters[v] ?? 0, ...filtered];
  });
  const chunk = (/** @type {string} */ name, /** @type {Uint8Array} */ data) => {
    const body = Buffer.concat([Buffer.from(name, 'latin1'), data]);
    const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
    length.writeUInt32BE(data.length);
    sum.writeUInt32BE(crc32(body));
    return Buffer.concat([length, body, sum]);
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(rows.length, 4);
  head.set([16, 0, 0, 0, 0], 8);
  const parts = [
    chunk('IHDR', head),
    chunk('IDAT', deflateSync(Uint8Array.from(lines.flat()))),
    chunk('IEND', Buffer.alloc(0)),
  ];
  return Buffer.concat([Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10), ...parts]);
}

test('packed depth: millimetres pass, metres are had back from their inverse', () => {
  const rows = [
    [0, 300, 2000],
    [40000, 517, 3],
    [1, 2, 65535],
    [256, 255, 0],
    [7, 7, 7],
  ];
  const png = png16(3, rows, [0, 1, 2, 3, 4]);
  const config = Buffer.alloc(12);
  const [a, b] = [10_000, 99.5];
  config.writeFloatLE(a, 4);
  config.writeFloatLE(b, 8);
  const packed = (/** @type {string} */ format, /** @type {Uint8Array} */ body) =>
    packedFile(decodeCompressed(compressedImage(STAMP, format, Buffer.concat([config, body]))));
  assert.deepEqual(Buffer.from(packed('16UC1; compressedDepth png', png)), png);
  const { header, body } = split(packed('32FC1; compressedDepth png', png), 3);
  assert.equal(header, 'Pf\n3 5\n-1.0\n');
  const expected = rows
    .toReversed()
    .flat()
    .map((value) => (value === 0 ? Number.NaN : Math.fround(a / (value - b))));
  assert.deepEqual([...new Float32Array(body.buffer)], expected);
  const { body: broken } = split(png, 0);
  assert.throws(() => packed('32FC1; compressedDepth png', broken.subarray(0, 60)), /not a grey PNG|damaged|cut off/);
  assert.throws(() => packed('16UC1; compressedDepth png', Uint8Array.of(1, 2)), /no PNG/);
});

test('packed depth in RVL', () => {
  // By hand from the paper: two zeros, then a run of 1000, 1001, 999; three zeros.
  const nibbles = /** @type {number[]} */ ([]);
  const put = (/** @type {number} */ value) => {
    do {
      nibbles.push((value & 7) | (value > 7 ? 8 : 0));
      value >>= 3;
    } while (value > 0);
  };
  const zigzag = (/** @type {number} */ value) => (value << 1) ^ (value >> 31);
  [2, 3, zigzag(1000), zigzag(1), zigzag(-2), 3, 0].forEach(put);
  while (nibbles.length % 8 !== 0) nibbles.push(0);
  const body = Buffer.alloc(8 + nibbles.length / 2);
  body.writeUInt32LE(4, 0);
  body.writeUInt32LE(2, 4);
  for (let i = 0; i < nibbles.length; i += 8) {
    const word = nibbles.slice(i, i + 8).reduce((sum, nibble) => sum * 16 + nibble, 0);
    body.writeUInt32LE(word, 8 + i / 2);
  }
  const file = packedFile(
    decodeCompressed(compressedImage(STAMP, '16UC1; compressedDepth rvl', Buffer.concat([Buffer.alloc(12), body]))),
  );
  const { header, body: pixels } = split(file, 3);
  assert.equal(header, 'P5\n4 2\n65535\n');
  const values = [0, 0, 1000, 1001, 999, 0, 0, 0];
  assert.deepEqual(
    [...pixels],
    values.flatMap((value) => [value >> 8, value & 255]),
  );
});

test('packed depth that claims more than its bytes hold is refused before the memory for it is taken', () => {
  const packed = (/** @type {string} */ format, /** @type {Uint8Array} */ body) => {
    const before = process.memoryUsage().arrayBuffers;
    try {
      return packedFile(decodeCompressed(compressedImage(STAMP, format, Buffer.concat([Buffer.alloc(12), body]))));
    } finally {
      assert.ok(process.memoryUsage().arrayBuffers - before < 2 ** 24);
    }
  };
  const rvl = (/** @type {number} */ width, /** @type {number} */ height, /** @type {number[]} */ ...words) => {
    const body = Buffer.alloc(8 + 4 * words.length);
    [width, height, ...words].forEach((word, at) => body.writeUInt32LE(word, 4 * at));
    return body;
  };
  const format = '16UC1; compressedDepth rvl';
  assert.throws(() => packed(format, rvl(8192, 8192, 0)), /claims 8192 x 8192 pixels, in 12 bytes/);
  // A run of 2^30 zeros in an image of 2 x 2: no encoder writes it.
  assert.throws(() => packed(format, rvl(2, 2, 0xffffffff, 0xff000000)), /a run leads beyond its 4 pixels/);
  assert.throws(() => packed(format, rvl(2048, 2048, 0x11212121)), /cut off/);
  // 100 pixels from three bytes: eight zeros at a time are few bytes, and are grown into.
  assert.equal(split(packed(format, rvl(10, 10, 0xcc100000)), 3).body.length, 200);
  const claims = Buffer.from(png16(3, [[1, 2, 3]], [0]));
  claims.writeUInt32BE(2000, 16);
  claims.writeUInt32BE(2000, 20);
  assert.throws(() => packed('32FC1; compressedDepth png', claims), /cut off/);
});

test('PNG and JPEG pass as they are', () => {
  const jpeg = Uint8Array.of(0xff, 0xd8, 1, 2, 3);
  assert.deepEqual(packedFile(decodeCompressed(compressedImage(STAMP, 'rgb8; jpeg compressed bgr8', jpeg))), jpeg);
  assert.throws(
    () => packedFile(decodeCompressed(compressedImage(STAMP, 'webp', Uint8Array.of(1, 2)))),
    /"webp", which is not read/,
  );
});

test('clouds keep their fields, whatever their layout', () => {
  const points = [
    [1, 2, 3, 4000],
    [-1, 0.5, Number.NaN, 7],
    [9, 8, 7, 6],
    [5, 4, 3, 2],
  ];
  // x y z as floats in an odd order, a gap, a whole number of 16 bits; rows padded.
  for (const bigEndian of [false, true]) {
    const [pointStep, rowStep] = [18, 40];
    const view = new DataView(new ArrayBuffer(2 * rowStep));
    points.forEach(([x = 0, y = 0, z = 0, ring = 0], i) => {
      const start = Math.floor(i / 2) * rowStep + (i % 2) * pointStep;
      view.setFloat32(start + 4, x, !bigEndian);
      view.setFloat32(start, y, !bigEndian);
      view.setFloat32(start + 8, z, !bigEndian);
      view.setUint16(start + 14, ring, !bigEndian);
    });
    const message = pointCloud({
      ...{ stamp: STAMP, width: 2, height: 2, pointStep, rowStep, bigEndian, data: new Uint8Array(view.buffer) },
      fields: [
        ['x', 4, 7],
        ['y', 0, 7],
        ['z', 8, 7],
        ['ring', 14, 4],
      ],
    });
    const { header, body } = split(cloudFile(decodeCloud(message)), 10);
    assert.match(
      header,
      /^VERSION 0\.7\nFIELDS y x z ring\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 2\n/,
    );
    assert.match(header, /POINTS 4\nDATA binary\n$/);
    const values = new DataView(body.buffer);
    points.forEach(([x, y, z, ring], i) => {
      const read = [4, 0, 8].map((offset) => values.getFloat32(14 * i + offset, true));
      assert.deepEqual([...read, values.getUint16(14 * i + 12, true)], [x, y, z, ring]);
    });
  }
  for (const name of ['x', 'xyz', 'position']) {
    const view = new DataView(new ArrayBuffer(2 * 16));
    [1, -2, 3, 7, 4, 5, -6, 8].forEach((value, at) => view.setFloat32(4 * at, value, true));
    const fields = /** @type {[string, number, number, number?][]} */ ([
      [name, 0, 7, 3],
      ['intensity', 12, 7],
    ]);
    const whole = { stamp: STAMP, width: 2, pointStep: 16, data: new Uint8Array(view.buffer), fields };
    const { header, body } = split(cloudFile(decodeCloud(pointCloud(whole))), 10);
    assert.match(
      header,
      /FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n/,
      `a position in one field: ${name}`,
    );
    assert.equal(new DataView(body.buffer).getFloat32(4, true), -2);
  }
  const flat = pointCloud({
    stamp: STAMP,
    width: 1,
    pointStep: 8,
    data: new Uint8Array(8),
    fields: [
      ['x', 0, 7],
      ['y', 4, 7],
    ],
  });
  assert.throws(() => cloudFile(decodeCloud(flat)), /have no z/);
  const outside = pointCloud({ stamp: STAMP, width: 1, pointStep: 8, data: new Uint8Array(8), fields: [['x', 6, 7]] });
  assert.throws(() => cloudFile(decodeCloud(outside)), /x lies outside its points of 8 bytes/);
  const short = pointCloud({
    stamp: STAMP,
    width: 9,
    pointStep: 12,
    data: new Uint8Array(20),
    fields: [
      ['x', 0, 7],
      ['y', 4, 7],
      ['z', 8, 7],
    ],
  });
  assert.throws(() => cloudFile(decodeCloud(short)), /shorter than its header says: 9 x 1 points/);
});

test('laser scans: what the message calls invalid is null', () => {
  const ranges = [1.25, Number.NaN, Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY, 0.05, 31, 30, 0.1];
  const line = JSON.parse(scanLine(decodeScan(laserScan(STAMP, -1, 0.25, [0.1, 30], ranges))));
  assert.deepEqual(line.readings, [1.25, null, null, null, null, null, 30, 0.1]);
  assert.equal(line.nrays, 8);
  assert.deepEqual([line.min_theta, line.max_theta], [-1, 0.75]);
  assert.deepEqual(line.timestamp, [12, 500_000]);
  assert.deepEqual([line.odometry, line.estimate, line.true_pose], [null, null, null]);
  const turned = JSON.parse(scanLine(decodeScan(laserScan(STAMP, 1, -0.5, [0, 9], [1, 2, 3]))));
  assert.deepEqual([turned.min_theta, turned.max_theta, turned.readings], [0, 1, [3, 2, 1]]);
  assert.throws(() => scanLine(decodeScan(laserScan(STAMP, 0, 0, [0, 9], [1, 2]))), /lie 0 rad apart/);
  const spread = scanLine({ ...decodeScan(laserScan(STAMP, 0, 0, [0, 9], [1, 2, 3])), angleMin: -0.5, angleMax: 1 });
  assert.deepEqual([JSON.parse(spread).min_theta, JSON.parse(spread).max_theta], [-0.5, 1]);
  const degrees = (/** @type {number} */ step) =>
    scanLine(decodeScan(laserScan(STAMP, -90, step, [0, 9], Array(181).fill(2))));
  assert.deepEqual([JSON.parse(degrees(1)).min_theta, JSON.parse(degrees(1)).max_theta], [-90, 90], 'the engine tells');
  assert.throws(() => degrees(10), /cover 103132 degrees: its angles are not in radians/);
  assert.throws(
    () => scanLine(decodeScan(laserScan(STAMP, -1, 1, [9, 5], [1, 2]))),
    /between .* 9, and its range_max, 5/,
  );
});

const DEPTH = { name: '/cam/depth/image_raw', type: 'sensor_msgs/msg/Image' };
const COLOR = { name: '/cam/color/image_raw', type: 'sensor_msgs/msg/Image' };
const INFRA = { name: '/cam/infra1/image_raw', type: 'sensor_msgs/msg/Image' };
const CAMERA = { name: '/cam/depth/camera_info', type: 'sensor_msgs/msg/CameraInfo' };
const OTHER_CAMERA = { name: '/cam/color/camera_info', type: 'sensor_msgs/msg/CameraInfo' };
const SCAN = { name: '/scan', type: 'sensor_msgs/msg/LaserScan' };
const TF = { name: '/tf', type: 'tf2_msgs/msg/TFMessage' };
const TF_STATIC = { name: '/tf_static', type: 'tf2_msgs/msg/TFMessage' };
const ODOMETRY = { name: '/odom', type: 'nav_msgs/msg/Odometry' };
const TRUTH = { name: '/ground_truth/pose', type: 'geometry_msgs/msg/PoseStamped' };
const S = Math.SQRT1_2;

/** A robot that drives along x with a camera 0.5 m above and 0.1 m ahead of it, which looks ahead. */
function drive() {
  /** @type {import('./bag_writer.mjs').MessageToWrite[]} */
  const messages = [];
  const add = (/** @type {string} */ topic, /** @type {number} */ time, /** @type {Uint8Array} */ data) => {
    messages.push({ topic, time: BigInt(Math.round(time * 1e9)), data });
  };
  const picture = { width: 4, height: 4 };
  add(TF_STATIC.name, 5, transforms([[stampAt(5), 'base', 'camera', [0.1, 0, 0.5, -0.5, 0.5, -0.5, 0.5]]]));
  for (let i = 0; i < 10; i += 1) {
    const time = 5 + i / 10;
    const stamp = stampAt(time);
    add(DEPTH.name, time, image({ stamp, ...picture, encoding: '16UC1', data: new Uint8Array(32).fill(4) }));
    if (i !== 3) {
      const late = stampAt(time + 0.008);
      add(COLOR.name, time, image({ stamp: late, ...picture, encoding: 'bgr8', data: new Uint8Array(48) }));
    }
    add(INFRA.name, time, image({ stamp, ...picture, encoding: 'mono8', data: new Uint8Array(16) }));
    add(CAMERA.name, time, cameraInfo(stamp, 4, 4, [3, 3, 1.5, 1.5]));
    add(OTHER_CAMERA.name, time, cameraInfo(stamp, 4, 4, [9, 9, 1.5, 1.5]));
    add(SCAN.name, time, laserScan(stamp, 0, 0.1, [0, 9], [1, 2, 3]));
    // The odometry drifts; localisation mends that: map to odom to base, a quarter turn at the second half.
    add(
      TF.name,
      time,
      transforms([
        [stamp, 'map', 'odom', [0, 0, 0, 0, 0, i < 5 ? 0 : S, i < 5 ? 1 : S]],
        [stamp, 'odom', 'base', [i, 0, 0, 0, 0, 0, 1]],
      ]),
    );
    add(ODOMETRY.name, time, odometry(stamp, 'odom', 'base', [i, 0, 0, 0, 0, 0, 1]));
    add(TRUTH.name, time, poseStamped(stamp, 'world', [i, 0, 0, 0, 0, 0, 1]));
  }
  return messages;
}

/** @param {import('./bag_writer.mjs').TopicToWrite[]} topics */
function bagOf(topics) {
  const names = new Set(topics.map(({ name }) => name));
  return listOne(
    'drive.mcap',
    mcapBytes(
      topics,
      drive().filter(({ topic }) => names.has(topic)),
    ),
  );
}

/** @param {import('./bag_writer.mjs').TopicToWrite[]} topics @param {import('../../npm/bag/topics.js').Wishes} [wishes] */
async function made(topics, wishes = {}) {
  const [recording] = await recordingsOf([await bagOf(topics)], wishes);
  if (!recording) throw new Error('no recording');
  return recording;
}

/** @param {Awaited<ReturnType<typeof made>>} bag @param {string | null | undefined} path */
async function contentOf({ files }, path) {
  const file = files.find((candidate) => candidate.path === path);
  if (!file) throw new Error(`no ${path}`);
  return text(await file.read());
}

test('of two lasers in turn on one topic the first is taken, and a frame that was only renamed is one laser', () => {
  const scans = (/** @type {string} */ frames) => [...frames].map((frame, at) => ({ frame, line: `${at}` }));
  assert.deepEqual(ofOneLaser(scans('lrlrlr')).lines, ['0', '2', '4']);
  assert.deepEqual(ofOneLaser(scans('aaabbb')).lines, ['0', '1', '2', '3', '4', '5']);
  assert.match(ofOneLaser(scans('lrlrlr')).loss ?? '', /^3 scans of other frames than l left out/);
  assert.deepEqual(ofOneLaser([]), { lines: [], loss: null });
});

test('sensible topics are chosen: depth with its colours and its camera, and who calls itself the truth', async () => {
  const { topics } = await bagOf([INFRA, COLOR, DEPTH, OTHER_CAMERA, CAMERA, SCAN, TF, TF_STATIC, ODOMETRY, TRUTH]);
  assert.deepEqual(chooseTopics(topics), {
    depth: DEPTH.name,
    color: COLOR.name,
    camera: CAMERA.name,
    reference: TRUTH.name,
  });
  const without = (/** @type {string} */ name) => topics.filter(({ topic }) => topic.name !== name);
  assert.equal(chooseTopics(without(TRUTH.name)).reference, TF.name);
  assert.equal(chooseTopics(without(COLOR.name)).color, undefined, 'infrared is no colour');
  assert.deepEqual(chooseTopics(without(DEPTH.name)), { scans: SCAN.name, odometry: '/odom', reference: TRUTH.name });
});

test('depth and colours are paired by their times', async () => {
  const bag = await made([DEPTH, COLOR, CAMERA]);
  assert.equal(bag.recording.kind, 'depth_images');
  assert.deepEqual(
    bag.recording.depth_frames.map(({ color }) => color !== null),
    [true, true, true, false, true, true, true, true, true, true],
  );
  assert.equal(bag.recording.depth_frames[1]?.depth, 'drive.mcap/depth/5.100000000.pgm');
  assert.equal(bag.recording.depth_frames[1]?.color, 'drive.mcap/color/5.108000000.ppm');
  assert.match(bag.recording.notes.map(({ reason }) => reason).join(), /1 depth image without a colour image/);
  assert.deepEqual(JSON.parse(await contentOf(bag, bag.recording.intrinsics)), {
    width: 4,
    height: 4,
    fx: 3,
    fy: 3,
    cx: 1.5,
    cy: 1.5,
  });
});

test('the camera of images that are binned and cut to a region has the size of the region', async () => {
  const stamp = stampAt(5);
  const pixels = image({ stamp, width: 4, height: 3, encoding: '16UC1', data: new Uint8Array(24).fill(4) });
  const camera = cameraInfo(stamp, 20, 16, [6, 6, 10, 8], [4, 2, 6, 8], [2, 2]);
  const messages = [
    { topic: DEPTH.name, time: 5n, data: pixels },
    { topic: CAMERA.name, time: 5n, data: camera },
  ];
  const [bag] = await recordingsOf([await listOne('cut.mcap', mcapBytes([DEPTH, CAMERA], messages))], {});
  assert.ok(bag);
  const expected = { width: 4, height: 3, fx: 3, fy: 3, cx: 3, cy: 3 };
  assert.deepEqual(JSON.parse(await contentOf(bag, bag.recording.intrinsics)), expected);
});

test("RealSense's viewer records the unit of depth, and a camera of larger images is scaled", async () => {
  const sensor = '/device_0/sensor_0';
  const depth = { name: `${sensor}/Depth_0/image/data`, type: 'sensor_msgs/msg/Image' };
  const info = { name: `${sensor}/Depth_0/info/camera_info`, type: 'sensor_msgs/msg/CameraInfo' };
  const unit = { name: `${sensor}/option/Depth_Units/value`, type: 'std_msgs/msg/Float32' };
  const pixels = { stamp: stampAt(5), width: 4, height: 3, encoding: 'mono16', data: new Uint8Array(24).fill(4) };
  const messages = [
    { topic: unit.name, time: 4n, data: Uint8Array.of(0, 1, 0, 0, ...new Uint8Array(Float32Array.of(0.00025).buffer)) },
    { topic: info.name, time: 4n, data: cameraInfo(stampAt(0), 8, 6, [6, 6, 3.5, 2.5]) },
    { topic: depth.name, time: 5n, data: image(pixels) },
  ];
  const [bag] = await recordingsOf([await listOne('l515.mcap', mcapBytes([depth, info, unit], messages))], {});
  assert.ok(bag);
  const expected = { width: 4, height: 3, fx: 3, fy: 3, cx: 1.5, cy: 1, depth_scale: 4000 };
  assert.deepEqual(JSON.parse(await contentOf(bag, bag.recording.intrinsics)), expected);
  assert.deepEqual(
    bag.recording.notes.map(({ file }) => file),
    [info.name],
  );
});

/** @param {string} tum */
function rows(tum) {
  return tum
    .trim()
    .split('\n')
    .map((line) => line.split(' ').map(Number));
}

test('a path that is only compared with is read without the images between its poses; one to begin from with its chunks', async () => {
  const stamps = Array.from({ length: 40 }, (_, i) => ({ sec: 5 + i, nsec: 0 }));
  const time = (/** @type {{ sec: number }} */ { sec }) => BigInt(sec) * 1_000_000_000n;
  const [width, height] = [64, 64];
  const pixels = new Uint8Array(2 * width * height).fill(3);
  const messages = stamps.flatMap((stamp, i) => [
    { topic: '/depth', time: time(stamp), data: image({ stamp, width, height, encoding: '16UC1', data: pixels }) },
    { topic: '/ground_truth', time: time(stamp), data: poseStamped(stamp, 'world', [i, 0, 0, 0, 0, 0, 1]) },
  ]);
  const topics = [
    { name: '/depth', type: 'sensor_msgs/msg/Image' },
    { name: '/ground_truth', type: 'geometry_msgs/msg/PoseStamped' },
  ];
  const bytes = mcapBytes(topics, messages, { chunkBytes: 2 ** 13 });
  let numRead = 0;
  const read = async (/** @type {number} */ start, /** @type {number} */ end) => {
    numRead += end - start;
    return bytes.subarray(start, end);
  };
  const { bags } = await listBags([{ path: 'walk.mcap', source: async () => ({ size: bytes.length, read }) }]);
  numRead = 0;
  const [made] = await recordingsOf(bags, {});
  const [path = ''] = made?.recording.reference ?? [];
  const poses = rows(text((await made?.files.find((file) => file.path === path)?.read()) ?? new Uint8Array()));
  assert.deepEqual(
    poses.map((pose) => pose.slice(0, 2)),
    stamps.map(({ sec }, i) => [sec, i]),
  );
  assert.ok(numRead < bytes.length / 2, `${numRead} of ${bytes.length} bytes`);
  const reads = numRead;
  const { bag, topics: facts } = /** @type {import('../../npm/bag/bag_recordings.js').ListedBag} */ (bags[0]);
  await pathText(bag, facts, /** @type {import('../../npm/bag/open.js').Topic} */ (bag.topic('/ground_truth')), '');
  assert.ok(numRead - reads > 0.9 * bytes.length, `${numRead - reads} of ${bytes.length} bytes`);
});

test('the truth of /tf is that of the sensor: chained over all frames', async () => {
  const bag = await made([DEPTH, CAMERA, TF, TF_STATIC]);
  const poses = rows(await contentOf(bag, bag.recording.reference[0]));
  assert.equal(poses.length, 10);
  // The camera looks along x, its x to the right: -y of the robot.
  const close = (/** @type {number[] | undefined} */ row, /** @type {number[]} */ expected) => {
    assert.equal(row?.length, expected.length);
    row?.forEach((value, i) => assert.ok(Math.abs(value - (expected[i] ?? 0)) < 1e-9, `${row} against ${expected}`));
  };
  close(poses[2], [5.2, 2.1, 0, 0.5, -0.5, 0.5, -0.5, 0.5]);
  // After the quarter turn of the odometry's frame: x becomes y.
  close(poses[7], [5.7, 0, 7.1, 0.5, -S, 0, 0, S]);
  const odometry = await made([DEPTH, CAMERA, TF_STATIC, ODOMETRY]);
  close(rows(await contentOf(odometry, odometry.recording.reference[0]))[4], [5.4, 4.1, 0, 0.5, -0.5, 0.5, -0.5, 0.5]);
  const unmounted = await made([DEPTH, CAMERA, ODOMETRY]);
  close(rows(await contentOf(unmounted, unmounted.recording.reference[0]))[4], [5.4, 4, 0, 0, 0, 0, 0, 1]);
  assert.match(
    unmounted.recording.notes.map(({ reason }) => reason).join(),
    /there is no static transform from base to the sensor's frame, camera/,
  );
});

test('other topics are used where they are wished for', async () => {
  const all = [INFRA, COLOR, DEPTH, OTHER_CAMERA, CAMERA, SCAN, TF, TF_STATIC, ODOMETRY, TRUTH];
  const scans = await made(all, { scans: SCAN.name });
  assert.equal(scans.recording.kind, 'planar_scans');
  const log = await contentOf(scans, scans.recording.scans[0]);
  assert.equal(log.trim().split('\n').length, 10);
  assert.deepEqual(JSON.parse(log.split('\n')[1] ?? '').timestamp, [5, 100_000]);
  const bare = await made(all, { color: null, reference: null });
  assert.deepEqual(bare.choice, { depth: DEPTH.name, camera: CAMERA.name });
  const other = await made(all, { color: INFRA.name, camera: OTHER_CAMERA.name });
  assert.equal(other.recording.depth_frames[3]?.color, 'drive.mcap/color/5.300000000.pgm');
  assert.match(await contentOf(other, other.recording.intrinsics), /"fx":9/);
});
