// @ts-check
/** Recordings in other units, coordinates, columns and orders than usual, made here: what comes out, with nothing set. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { scanLine } from '../../npm/bag/laser_scans.js';
import { readJson } from '../../npm/formats/json_scans.js';
import { moved, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** Numbers from 0 to 1, the same in every run. @param {number} seed */
function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1_103_515_245) + 12_345) & 0x7fff_ffff;
    return state / 0x8000_0000;
  };
}

/** @typedef {[number, number, number]} Point */

/** A room of 5 x 4 x 2.5 m with two cupboards, by their lowest and highest corners. @type {[Point, Point][]} */
const BOXES = [
  [
    [0, 0, 0],
    [5, 4, 2.5],
  ],
  [
    [0.5, 0.4, 0],
    [1.4, 0.9, 0.75],
  ],
  [
    [3.2, 2.9, 0],
    [4.7, 3.8, 1.5],
  ],
];
/** Of the second cloud in the first one's frame. */
const [TURN, SHIFT] = [(6 * Math.PI) / 180, /** @type {Point} */ ([0.25, 0.12, 0])];

/** Points on the walls of the room, its floor's middle at the origin. @param {number} seed @returns {Point[]} */
function room(seed) {
  const next = random(seed);
  return Array.from({ length: 4000 }, (_, index) => {
    const [low, high] = BOXES[index % 4 < 2 ? 0 : (index % 4) - 1] ?? [SHIFT, SHIFT];
    const axis = Math.floor(3 * next());
    const isFar = next() < 0.5;
    const point = low.map((value, i) =>
      i === axis && isFar ? high[i] : i === axis ? value : value + next() * ((high[i] ?? 0) - value),
    );
    const [x = 0, y = 0, z = 0] = point;
    return /** @type {Point} */ ([x - 2.5, y - 2, z + 0.004 * (next() - 0.5)]);
  });
}

/** The same room from the pose of the second cloud. @param {Point[]} points @returns {Point[]} */
function seenFromSecond(points) {
  const [cos, sin] = [Math.cos(TURN), Math.sin(TURN)];
  return points.map(([x, y, z]) => {
    const [dx, dy] = [x - SHIFT[0], y - SHIFT[1]];
    return [cos * dx + sin * dy, cos * dy - sin * dx, z - SHIFT[2]];
  });
}

/** @param {Point[]} points @param {'short' | 'double'} type @param {(point: Point) => Point} as */
function ply(points, type, as) {
  const size = type === 'short' ? 2 : 8;
  const properties = ['x', 'y', 'z'].map((name) => `property ${type} ${name}\n`).join('');
  const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${points.length}\n${properties}end_header\n`;
  const body = Buffer.alloc(3 * size * points.length);
  points
    .map(as)
    .flat()
    .forEach((value, at) => {
      if (type === 'short') body.writeInt16LE(Math.round(value), size * at);
      else body.writeDoubleLE(value, size * at);
    });
  return Buffer.concat([Buffer.from(header), body]);
}

/** @param {import('node:test').TestContext} t @param {Record<string, string | Uint8Array>} files @param {string[]} options */
async function reconstruct(t, files, ...options) {
  const folder = temporaryFolder(t);
  for (const name of Object.keys(files)) mkdirSync(join(folder, 'in', dirname(name)), { recursive: true });
  writeFiles(join(folder, 'in'), files);
  const out = join(folder, 'out');
  const { stdout, stderr } = await scanstitch(['reconstruct', join(folder, 'in'), '--out', out, ...options]);
  return { said: `${stderr}\n${stdout}`, report: JSON.parse(readFileSync(join(out, 'report.json'), 'utf8')) };
}

const FIRST = room(1);
const SECOND = seenFromSecond(room(2));

for (const origin of /** @type {Point[]} */ ([
  [0, 0, 0],
  [-20, 7, 1],
  [1000, 0, 0],
  [539_720, 4_065_742, 100],
])) {
  test(`clouds whose coordinates begin ${origin.join(', ')} m away are registered alike`, async (t) => {
    const placed = (/** @type {Point} */ point) =>
      /** @type {Point} */ (point.map((value, i) => value + (origin[i] ?? 0)));
    const files = { '0.ply': ply(FIRST, 'double', placed), '1.ply': ply(SECOND, 'double', placed) };
    const { report, said } = await reconstruct(t, files);
    const [, { status, T_world_sensor: pose }] = report.frames;
    assert.equal(status, 'good');
    // Where the second cloud's own origin lies, in the first one's coordinates.
    const place = moved(pose, origin).map((value, i) => value - (origin[i] ?? 0) - (SHIFT[i] ?? 0));
    assert.ok(Math.hypot(...place) < 2e-3, `off by ${place.join(', ')} m`);
    assert.ok(Math.abs(2 * Math.acos(pose.qw) - TURN) < 1e-3, JSON.stringify(pose));
    assert.match(said, /coordinates of the clouds do not begin at the sensor/);
  });
}

test('a second cloud that lies on the first as it is, is no motion', async (t) => {
  const placed = (/** @type {Point} */ [x, y, z]) => /** @type {Point} */ ([x + 300, y, z]);
  const files = { '0.ply': ply(FIRST, 'double', placed), '1.ply': ply(room(3), 'double', placed) };
  assert.match((await reconstruct(t, files)).said, /No motion: the clouds share one frame/);
});

test('the unit of clouds is told from whole numbers, from names, or is asked for', async (t) => {
  const centred = (/** @type {Point} */ [x, y, z]) => /** @type {Point} */ ([1e3 * x, 1e3 * y, 1e3 * (z - 1.2)]);
  const whole = { '0.ply': ply(FIRST, 'short', centred), '1.ply': ply(SECOND, 'short', centred) };
  const { report, said } = await reconstruct(t, whole);
  assert.equal(report.cloud_unit, 0.001);
  assert.match(said, /a unit is 0\.001 m \(assumed; supported by the size of the scene\)/);
  const text = (/** @type {Point[]} */ points) =>
    `x_cm,y_cm,z_cm\n${points.map(([x, y, z]) => [x, y, z - 1.2].map((value) => (100 * value).toFixed(2)).join(',')).join('\n')}\n`;
  const named = await reconstruct(t, { 'a.csv': text(FIRST), 'b.csv': text(SECOND) });
  assert.deepEqual([named.report.cloud_unit, named.report.assumptions], [0.01, []]);
  const inFeet = (/** @type {Point[]} */ points) => {
    const rows = points.map(([x, y, z]) => [x, y, z - 1.2].map((value) => (value / 0.3048).toFixed(4)).join(','));
    return `X (ft),Y (ft),Z (ft)\n${rows.join('\n')}\n`;
  };
  const feet = await reconstruct(t, { 'a.csv': inFeet(FIRST), 'b.csv': inFeet(SECOND) });
  assert.equal(feet.report.cloud_unit, 0.3048);
  assert.ok(Math.abs(feet.report.frames[1].T_world_sensor.x - SHIFT[0]) < 5e-3);
  const bare = (/** @type {Point[]} */ points) => text(points).replace('x_cm,y_cm,z_cm', 'x,y,z');
  const open = await reconstruct(t, { 'a.csv': bare(FIRST), 'b.csv': bare(SECOND) });
  assert.match(open.said, /possible as well: 0\.01 m/);
  const set = await reconstruct(t, { 'a.csv': bare(FIRST), 'b.csv': bare(SECOND) }, '--set', 'cloud_unit=0.01');
  assert.ok(Math.abs(set.report.frames[1].T_world_sensor.x - SHIFT[0]) < 5e-3);
});

/** Corners of a room that is no mirror image of itself. @type {[number, number][]} */
const CORNERS = [
  [-4, -3],
  [4, -3],
  [4, 3],
  [1, 3],
  [1, 1],
  [-4, 1],
];

/** The distance to the walls. @param {number} x @param {number} y @param {number} angle */
function range(x, y, angle) {
  const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
  const hits = CORNERS.flatMap(([px, py], at) => {
    const [qx, qy] = CORNERS[(at + 1) % CORNERS.length] ?? [0, 0];
    const [ex, ey] = [qx - px, qy - py];
    const det = dx * ey - dy * ex;
    const along = ((px - x) * ey - (py - y) * ex) / det;
    const across = ((px - x) * dy - (py - y) * dx) / det;
    return along > 0 && across >= 0 && across <= 1 ? [along] : [];
  });
  return Math.min(...hits);
}

/** Twenty scans of a drive to the east. @param {number[]} angles */
function drive(angles) {
  const next = random(5);
  return Array.from({ length: 20 }, (_, i) =>
    angles.map((angle) => range(-3 + 0.15 * i, -1 + 0.02 * i, angle) + 0.004 * (next() - 0.5)),
  );
}

/** @param {any} report */
function endOf(report) {
  const { x, y } = report.frames.at(-1).T_world_sensor;
  return [x, y];
}

/** @param {any} report */
function hasDriven(report) {
  const [x = 0, y = 0] = endOf(report);
  assert.ok(report.frames.length === 20 && Math.hypot(x - 2.85, y - 0.38) < 0.05, `${x}, ${y}`);
}

test('readings of an RPLIDAR are known by their units and turns, in any order of columns, with names or without', async (t) => {
  const degrees = Array.from({ length: 360 }, (_, i) => i);
  const scans = drive(degrees.map((angle) => (-angle * Math.PI) / 180));
  const lines = (/** @type {(scan: number, angle: number, range: number) => (number | string)[]} */ line) =>
    scans.flatMap((ranges, scan) => ranges.map((r, at) => line(scan, at, r).join(','))).join('\n');
  const mm = '-1deg,unit=mm';
  for (const [text, format] of /** @type {const} */ ([
    [
      `timestamp,quality,angle,distance\n${lines((scan, angle, r) => [scan / 10, 15, angle + 0.25, Math.round(4e3 * r) / 4])}\n`,
      mm,
    ],
    [`distance,angle,quality\n${lines((_, angle, r) => [Math.round(4e3 * r) / 4, angle + 0.015_625, 12])}\n`, mm],
    [`${lines((scan, angle, r) => [1.7e9 + scan / 10, 15, angle + 0.25, Math.round(4e3 * r) / 4])}\n`, mm],
    // In the units of its SDK: parts of a quarter turn, and 64ths of a degree.
    [
      `angle_z_q14,dist_mm_q2\n${lines((_, angle, r) => [Math.round((angle * 16_384) / 90), Math.round(4e3 * r)])}\n`,
      '-0.005493164063deg,unit=0.00025',
    ],
    [
      `angle_q6,distance_q2\n${lines((_, angle, r) => [64 * angle, Math.round(4e3 * r)])}\n`,
      '-0.015625deg,unit=0.00025',
    ],
  ])) {
    const { report, said } = await reconstruct(t, { 's.txt': text });
    assert.ok(said.includes(`:${format}`), said.split('\n')[0]);
    hasDriven(report);
  }
});

test('a first row of bearings names the ranges, with a corner, without one, behind an empty cell', async (t) => {
  const degrees = Array.from({ length: 181 }, (_, i) => i - 90);
  const bearings = degrees.map((angle) => ((angle * Math.PI) / 180).toFixed(6)).join(',');
  const rows = drive(degrees.map((angle) => (angle * Math.PI) / 180)).map((ranges, scan) => {
    return [scan / 2, ...ranges.map((r) => r.toFixed(4))].join(',');
  });
  for (const [head, end] of [
    [`NaN,${bearings}`, ''],
    [bearings, ''],
    [`,${bearings},`, ','],
  ]) {
    const { report, said } = await reconstruct(t, { 's.csv': `${head}\n${rows.map((row) => row + end).join('\n')}\n` });
    assert.match(said, /ranges=2:182,unit=m,start=-90deg,step=1deg,time=1/);
    hasDriven(report);
  }
});

test('a clock stays one where the first reading beside it is missing', async (t) => {
  const rows = drive(Array.from({ length: 181 }, (_, i) => ((i - 90) * Math.PI) / 180)).map((ranges, scan) => {
    const readings = ranges.map((range) => Math.round(100 * range));
    return [1_700_000_000_000 + 100 * scan, ...(scan % 7 === 3 ? ['nan', ...readings.slice(1)] : readings)].join(' ');
  });
  const { report, said } = await reconstruct(t, { 'scans.txt': `${rows.join('\n')}\n` });
  assert.match(said, /read as --table ranges=2:182,unit=cm,start=-90deg,step=1deg,time=1:ms/);
  hasDriven(report);
});

test('depth images as text may have decimal commas', async () => {
  const { depthOfTable, isDepthTable } = await import('../../npm/formats/depth_table.js');
  const rows = Array.from({ length: 30 }, (_, row) =>
    Array.from({ length: 80 }, (_, column) => (2 + row / 100 + column / 1000).toFixed(3)),
  );
  const text = (/** @type {string} */ separator, /** @type {string} */ comma) =>
    rows.map((row) => `${row.join(separator).replaceAll('.', comma)}\n`).join('');
  const german = text(';', ',');
  assert.ok(isDepthTable(german.slice(0, 4000)));
  const image = (/** @type {string} */ of) => depthOfTable('a.csv', new TextEncoder().encode(of));
  assert.deepEqual(image(german), image(text(',', '.')));
});

test('planar scans in millimetres are read as such, and scan_unit says otherwise', async (t) => {
  const angles = Array.from({ length: 180 }, (_, i) => ((i - 90) * Math.PI) / 180);
  const files = Object.fromEntries(
    drive(angles).map((ranges, scan) => {
      const points = ranges.map(
        (r, at) => /** @type {Point} */ ([r * Math.cos(angles[at] ?? 0), r * Math.sin(angles[at] ?? 0), 0]),
      );
      return [
        `${scan}.ply`,
        ply(points, 'short', (point) => /** @type {Point} */ (point.map((value) => 1000 * value))),
      ];
    }),
  );
  const { report, said } = await reconstruct(t, files);
  assert.match(said, /taken for millimetres.*scan_unit/);
  hasDriven(report);
  const set = await reconstruct(t, files, '--set', 'scan_unit=0.001');
  assert.doesNotMatch(set.said, /scan_unit/);
  hasDriven(set.report);
});

test('planar scans may have the height of their laser, not another plane and not the place of a map', async (t) => {
  const angles = Array.from({ length: 180 }, (_, i) => ((i - 90) * Math.PI) / 180);
  const scans = drive(angles);
  const files = (/** @type {(point: Point) => Point} */ as) =>
    Object.fromEntries(
      scans.map((ranges, scan) => {
        const points = ranges.map(
          (r, at) => /** @type {Point} */ ([r * Math.cos(angles[at] ?? 0), r * Math.sin(angles[at] ?? 0), 0]),
        );
        return [`${scan}.ply`, ply(points, 'double', as)];
      }),
    );
  hasDriven(
    (
      await reconstruct(
        t,
        files(([x, y]) => [x, y, 0.35]),
      )
    ).report,
  );
  const refused = async (/** @type {(point: Point) => Point} */ as) => {
    const folder = temporaryFolder(t);
    writeFiles(folder, files(as));
    const { status, stderr } = await scanstitch(['reconstruct', folder, '--out', join(folder, 'out')]);
    assert.equal(status, 1);
    return stderr;
  };
  assert.match(await refused(([x, y]) => [0.35, x, y]), /All points have x = 0\.35.*in the plane of y and z/);
  assert.match(
    await refused(([x, y]) => [x + 300, y, 0]),
    /as far from the origin of their coordinates as they reach across, as on a map/,
  );
});

test('text clouds behind a count of their points, each behind its number; KITTI clouds in millimetres, with rings and times', async (t) => {
  const rows = (/** @type {Point[]} */ points, /** @type {(row: number) => string} */ before) =>
    points.map((point, at) => `${before(at)}${point.map((value) => value.toFixed(4)).join(' ')}\n`).join('');
  const bin = (/** @type {Point[]} */ points) =>
    new Uint8Array(
      Float32Array.from(points.flatMap((point) => [...point.map((value) => 1000 * value), 0.5, 7, 0.01])).buffer,
    );
  for (const make of [
    (/** @type {Point[]} */ points) => ({ xyz: `${points.length}\n${rows(points, () => '')}` }),
    (/** @type {Point[]} */ points) => ({ xyz: rows(points, (row) => `${row} `) }),
    (/** @type {Point[]} */ points) => ({ bin: bin(points) }),
  ]) {
    const named = (/** @type {string} */ name, /** @type {Point[]} */ points) =>
      Object.entries(make(points)).map(([ending, contents]) => [`${name}.${ending}`, contents]);
    const { report } = await reconstruct(t, Object.fromEntries([...named('0', FIRST), ...named('1', SECOND)]));
    const [, { status, T_world_sensor: pose }] = report.frames;
    assert.equal(status, 'good');
    assert.ok(Math.hypot(pose.x - SHIFT[0], pose.y - SHIFT[1], pose.z) < 2e-3, JSON.stringify(pose));
  }
});

test('labels of readings are no scans', async (t) => {
  const degrees = Array.from({ length: 181 }, (_, i) => i - 90);
  const rows = drive(degrees.map((angle) => (angle * Math.PI) / 180));
  const table = (/** @type {(range: number) => string} */ cell) =>
    `NaN,${degrees.map((angle) => ((angle * Math.PI) / 180).toFixed(6)).join(',')}\n${rows.map((ranges, scan) => [scan / 2, ...ranges.map(cell)].join(',')).join('\n')}\n`;
  const files = { 'a.csv': table((r) => r.toFixed(4)), 'b.csv': table((r) => `${1 + Math.floor(r / 2)}`) };
  const { report, said } = await reconstruct(t, files);
  assert.match(said, /b\.csv: not used: labels/);
  hasDriven(report);
});

test('paths of two wheels are odometry once their distance is set', async (t) => {
  const degrees = Array.from({ length: 181 }, (_, i) => i - 90);
  const rows = drive(degrees.map((angle) => (angle * Math.PI) / 180)).map((ranges, scan) => {
    return [scan / 2, ...ranges.map((r) => r.toFixed(4))].join(',');
  });
  const bearings = degrees.map((angle) => ((angle * Math.PI) / 180).toFixed(6)).join(',');
  const wheels = Array.from({ length: 200 }, (_, i) => `${i / 20},${(0.15 * i) / 10},${(0.15 * i) / 10}`).join('\n');
  const files = { 's.csv': `NaN,${bearings}\n${rows.join('\n')}\n`, 'odom.csv': `time,s_right,s_left\n${wheels}\n` };
  assert.match((await reconstruct(t, files)).said, /Set wheel_track to it \(m\)/);
  const { said } = await reconstruct(t, files, '--set', 'wheel_track=0.3');
  assert.doesNotMatch(said, /wheel_track/);
});

test('poses belong to the frames of their numbers', async (t) => {
  const step =
    (/** @type {number} */ k) =>
    (/** @type {Point} */ [x, y, z]) =>
      /** @type {Point} */ ([x - 0.15 * k, y, z - 1.2]);
  const numbers = [0, 1, 3, 4];
  const clouds = numbers.map((k) => [`clouds/cloud_000${k}.ply`, ply(room(10 + k), 'double', step(k))]);
  const poses = [0, 1, 2, 3, 4].map((k) => [`gt/pose_000${k}.txt`, `1 0 0 ${0.15 * k}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n`]);
  const { report, said } = await reconstruct(t, Object.fromEntries([...clouds, ...poses]));
  assert.match(said, /pose_0002\.txt: not used: there is no frame of its number/);
  assert.ok(report.comparison.num_matched === 4 && report.comparison.max < 0.01, JSON.stringify(report.comparison));
});

test('a file that is there twice is told', async (t) => {
  const cloud = ply(FIRST, 'double', ([x, y, z]) => [x, y, z - 1.2]);
  const { said } = await reconstruct(t, { '0.ply': cloud, '1.ply': cloud });
  assert.match(said, /1\.ply: the same as .*0\.ply, and used as a frame of its own/);
});

test('a range_max of 0 is none, and a laser that hangs upside down turns the other way', () => {
  const scan = {
    angleMin: -1,
    angleMax: 1,
    angleIncrement: 0.5,
    rangeMin: 0.1,
    rangeMax: 0,
    ranges: Float32Array.of(1, 2, 3, 4, 5),
  };
  const message = { ...scan, stamp: { sec: 1, nsec: 0 }, frame: 'laser' };
  const upright = JSON.parse(scanLine(message));
  assert.deepEqual([upright.readings, upright.min_theta, upright.max_theta], [[1, 2, 3, 4, 5], -1, 1]);
  const hanging = JSON.parse(scanLine({ ...message, angleMin: 0 }, true));
  assert.deepEqual([hanging.readings, hanging.min_theta, hanging.max_theta], [[5, 4, 3, 2, 1], -2, 0]);
});

test('JSON without its end is read as far as it goes, and keys that are numbers are times', () => {
  const ranges = Array.from({ length: 30 }, (_, i) => 1 + i / 10);
  const scan = { angle_min: -1, angle_increment: 0.1, ranges };
  /** @type {string[]} */
  const told = [];
  const read = (/** @type {string} */ text) => readJson(text, 'a.json', (reason) => told.push(reason));
  const whole = JSON.stringify({ scans: [scan, scan, scan] });
  assert.equal(read(whole.slice(0, -2)).length, 3);
  assert.equal(read(whole.slice(0, -40)).length, 2);
  assert.match(told.join(), /it has no end/);
  const times = read(JSON.stringify({ 12.5: scan, 13: scan, 1_700_000_000_500: scan })).map(({ time }) => time);
  assert.deepEqual(times, [12.5, 13, 1_700_000_000.5]);
});
