// @ts-check
/** What files claim or leave out, each in an input made here after a report of a bug: what is read, what is said, and that the remedy works. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { metresOfLas } from '../../npm/formats/las_units.js';
import { cameraFor } from '../../npm/recording/camera_file.js';
import { scaled } from '../../npm/recording/scaled_camera.js';
import { roomCloud } from './room_clouds.mjs';
import { roomLog } from './laser_room.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** @typedef {[number, number, number]} Point */

/** Points of the room from two places, 0.3 m apart along x. @param {number} number @returns {Point[]} */
function room(number) {
  const rows = roomCloud(number).split('end_header\n')[1]?.trim().split('\n') ?? [];
  return rows.map((row) => /** @type {Point} */ (row.split(' ').map(Number)));
}
const CLOUDS = [room(0), room(1)];
/** Distance of the second cloud from the first (m). */
const STEP = 0.3;

/** @param {import('node:test').TestContext} t @param {Record<string, string | Uint8Array>} files @param {string[]} options */
async function reconstruct(t, files, ...options) {
  const folder = temporaryFolder(t);
  for (const name of Object.keys(files)) mkdirSync(join(folder, 'in', dirname(name)), { recursive: true });
  writeFiles(join(folder, 'in'), files);
  const out = join(folder, 'out');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', join(folder, 'in'), '--out', out, ...options]);
  const report = status === 1 ? null : JSON.parse(readFileSync(join(out, 'report.json'), 'utf8'));
  return { status, said: `${stderr}\n${stdout}`, report };
}

/** @param {Point[]} points @param {(point: Point) => number[]} as */
function doublePly(points, as) {
  const properties = ['x', 'y', 'z'].map((name) => `property double ${name}\n`).join('');
  const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${points.length}\n${properties}end_header\n`;
  return Buffer.concat([Buffer.from(header), doubles(points.flatMap(as))]);
}

/** @param {number[]} values */
function doubles(values) {
  return Buffer.from(Float64Array.from(values).buffer);
}

/** @param {any} report @param {number} [unit] of the poses (m) */
function hasMoved(report, unit = 1) {
  const [, { status, T_world_sensor: pose }] = report.frames;
  assert.equal(status, 'good');
  assert.ok(Math.abs(Math.hypot(pose.x, pose.y, pose.z) * unit - STEP) < 5e-3, JSON.stringify(pose));
}

test('map coordinates in millimetres are told from metres: no map has so many', async (t) => {
  const as = (/** @type {Point} */ [x, y, z]) => [1e3 * (x + 539_720), 1e3 * (y + 4_065_742), 1e3 * (z + 100)];
  const { report, said } = await reconstruct(t, {
    '0.ply': doublePly(CLOUDS[0] ?? [], as),
    '1.ply': doublePly(CLOUDS[1] ?? [], as),
  });
  assert.equal(report.cloud_unit, 0.001);
  assert.match(said, /0\.001 m are assumed.*--set cloud_unit=NUMBER/);
  assert.equal(report.frames[1].status, 'good');
});

test('clouds in kilometres are refused with the unit to set, and longitudes and latitudes with what to do', async (t) => {
  const files = (/** @type {(point: Point) => number[]} */ as) =>
    Object.fromEntries(CLOUDS.map((points, at) => [`${at}.ply`, doublePly(points, as)]));
  const small = files((point) => point.map((value) => value / 1000));
  const refused = await reconstruct(t, small);
  assert.match(refused.said, /the farthest is 0\.00\d m away\. Set cloud_unit.*cloud_unit=1000 for kilometres/);
  hasMoved((await reconstruct(t, small, '--set', 'cloud_unit=1000')).report);
  const geographic = files(([x, y, z]) => [8.5 + x / 75_000, 47.3 + y / 111_320, 400 + z]);
  assert.match((await reconstruct(t, geographic)).said, /longitude and latitude.*Project the clouds into metres/);
});

test('clouds of NumPy with a point a column, and floats without a header, with and without a brightness', async (t) => {
  const npy = (/** @type {Point[]} */ points) => {
    const head = `{'descr': '<f8', 'fortran_order': False, 'shape': (3, ${points.length}), }`.padEnd(117) + '\n';
    const size = Buffer.alloc(2);
    size.writeUInt16LE(head.length);
    const columns = [0, 1, 2].flatMap((axis) => points.map((point) => point[axis] ?? 0));
    return Buffer.concat([Buffer.from('\x93NUMPY\x01\x00', 'latin1'), size, Buffer.from(head), doubles(columns)]);
  };
  const bin = (/** @type {Point[]} */ points) => doubles(points.flatMap((point) => [...point, 0.5]));
  const singles = (/** @type {Point[]} */ points) => Buffer.from(Float32Array.from(points.flat()).buffer);
  for (const [ending, make] of /** @type {const} */ ([
    ['npy', npy],
    ['bin', bin],
    ['bin', (/** @type {Point[]} */ points) => doubles(points.flat())],
    ['bin', singles],
  ])) {
    const files = Object.fromEntries(CLOUDS.map((points, at) => [`${at}.${ending}`, make(points)]));
    const { report, said } = await reconstruct(t, files);
    assert.equal(report?.frames.length, 2, said);
    hasMoved(report);
  }
});

/** A LAS header and one record of its coordinate system. @param {number} id @param {Uint8Array} body */
function lasRecord(id, body) {
  const bytes = new Uint8Array(227 + 54 + body.length);
  const view = new DataView(bytes.buffer);
  view.setUint16(94, 227, true);
  view.setUint32(100, 1, true);
  bytes.set(Buffer.from('LASF_Projection'), 227 + 2);
  view.setUint16(227 + 18, id, true);
  view.setUint16(227 + 20, body.length, true);
  bytes.set(body, 227 + 54);
  return bytes;
}

test('the header of a LAS says in which unit it is', () => {
  const keys = (/** @type {number[][]} */ ...list) =>
    new Uint8Array(Uint16Array.from([1, 1, 0, list.length, ...list.flat()]).buffer);
  const [foot, surveyFoot] = [0.3048, 1200 / 3937];
  const ofKeys = (/** @type {number[][]} */ ...list) => metresOfLas('a.las', lasRecord(34_735, keys(...list)));
  assert.deepEqual(ofKeys([1024, 0, 1, 1], [3076, 0, 1, 9003]), [surveyFoot, surveyFoot, surveyFoot]);
  assert.deepEqual(ofKeys([3076, 0, 1, 9002], [4099, 0, 1, 9001]), [foot, foot, 1]);
  assert.deepEqual(ofKeys([3072, 0, 1, 32_632]), [1, 1, 1]);
  assert.throws(() => ofKeys([1024, 0, 1, 2]), /longitude and latitude/);
  const ofText = (/** @type {string} */ text) => metresOfLas('a.las', lasRecord(2112, Buffer.from(text)));
  const geographic = 'GEOGCS["NAD83",DATUM["D",SPHEROID["S",6378137,298.2]],UNIT["degree",0.0174532925199433]]';
  const projected = `PROJCS["Oregon",${geographic},PROJECTION["Lambert"],UNIT["foot",0.3048]]`;
  assert.deepEqual(ofText(projected), [foot, foot, foot]);
  assert.deepEqual(ofText(`COMPD_CS["a",${projected},VERT_CS["NAVD88",UNIT["metre",1]]]`), [foot, foot, 1]);
  assert.throws(() => ofText(geographic), /longitude and latitude/);
  assert.deepEqual(metresOfLas('a.las', new Uint8Array(227)), [1, 1, 1]);
});

test('a camera in shares of the sides of its images, and a field of view whose name says degrees', () => {
  const of = (/** @type {string} */ text) => cameraFor('camera.txt', Buffer.from(text), { width: 640, height: 480 });
  const { camera, notes } = of('0.9140625 1.21875 0.5 0.5 0\n');
  assert.deepEqual([camera.fx, camera.fy, camera.cx, camera.cy], [585, 585, 319.5, 239.5]);
  assert.match(notes.join(), /shares of the sides of the images, 640 x 480 pixels/);
  const view = of('{"fov_x_deg": 57.36, "width": 640, "height": 480}').camera;
  assert.ok(Math.abs(view.fx - 585) < 0.5, `${view.fx}`);
});

test('the camera of images that were turned by a quarter is turned with them', () => {
  const camera = { label: '', fx: 580, fy: 585, cx: 322, cy: 238, size: null, distortion: [], depth_scale: null };
  const turned = scaled('k.txt', camera, { width: 480, height: 640 });
  assert.deepEqual([turned.camera.fx, turned.camera.fy, turned.camera.cx, turned.camera.cy], [585, 580, 238, 322]);
  assert.match(turned.notes.join(), /turned by a quarter.*in which direction is not known/);
  const sized = { ...camera, size: { width: 640, height: 480 } };
  assert.equal(scaled('k.json', sized, { width: 480, height: 640 }).camera.cx, 238);
  const upright = scaled('k.txt', camera, { width: 640, height: 480 });
  assert.deepEqual([upright.camera.cx, upright.notes], [322, []]);
});

/** Scans of a room, ten a second. */
const SCANS = roomLog(20)
  .split('\n')
  .filter((line) => line.startsWith('FLASER'))
  .map((line) => line.split(' ').slice(2, 182).map(Number));
/** Their way (m). */
const WAY = 0.95;

/** @param {any} report */
function hasDriven(report) {
  const { x, y } = report.frames.at(-1).T_world_sensor;
  assert.ok(report.frames.length === 20 && Math.abs(Math.hypot(x, y) - WAY) < 0.05, `${x}, ${y}`);
}

test('a small number that stands for no return is no wall', async (t) => {
  const none = SCANS.map((ranges) => ranges.map((range) => (range > 4.2 ? '0.120' : range.toFixed(3))).join(','));
  const { report, said } = await reconstruct(t, { 's.csv': none.join('\n') });
  assert.match(said, /readings are 0\.120 m and hardly any lies up to 2 times that: they were taken for no return/);
  hasDriven(report);
});

test('times in days, short names of columns in any order, angles whose names say degrees', async (t) => {
  const days = SCANS.map((ranges, scan) => [(2_460_000.5 + scan / 864_000).toFixed(9), ...ranges].join(','));
  const julian = await reconstruct(t, { 's.csv': days.join('\n') });
  assert.match(julian.said, /time=1:d/);
  assert.ok(Math.abs(julian.report.frames[19].time - julian.report.frames[0].time - 1.9) < 0.01);
  hasDriven(julian.report);
  const rows = SCANS.flatMap((ranges, scan) =>
    ranges.map((r, beam) => [(1000 * r).toFixed(1), beam - 90, scan].join(',')),
  );
  hasDriven((await reconstruct(t, { 's.csv': `dist,ang,scan\n${rows.join('\n')}` })).report);
  const objects = SCANS.map((ranges, scan) => ({
    timestamp: scan / 10,
    ...{ angle_min_deg: -90, angle_increment_deg: 1, ranges_mm: ranges.map((r) => Math.round(1000 * r)) },
  }));
  hasDriven((await reconstruct(t, { 's.json': JSON.stringify(objects) })).report);
});

/** A hand that moves irregularly, as TUM. @param {number} begin @param {number} end @param {number} step @param {number} offset (s) */
function handPath(begin, end, step, offset) {
  return Array.from({ length: Math.floor((end - begin) / step) }, (_, at) => {
    const time = begin + at * step;
    const [x, y, z] = [
      Math.sin(0.7 * time) + 0.3 * Math.sin(2.3 * time),
      Math.cos(0.05 * time * time),
      0.2 * Math.sin(time),
    ];
    const half = 0.2 * Math.sin(0.9 * time);
    return [(time + offset).toFixed(4), x, y, z, 0, 0, Math.sin(half), Math.cos(half)].join(' ');
  }).join('\n');
}

test('the offset between two clocks follows from the motions, and with it as an option the trajectories agree', async (t) => {
  for (const offset of [0.7, 3600, -1_700_000_000]) {
    const folder = temporaryFolder(t);
    writeFiles(folder, { 'gt.txt': handPath(0, 40, 0.01, 1.7e9), 'est.txt': handPath(6, 33, 1 / 30, 1.7e9 + offset) });
    const run = (/** @type {string[]} */ ...more) =>
      scanstitch(['evaluate', join(folder, 'gt.txt'), join(folder, 'est.txt'), '--align', 'se3', '--json', ...more]);
    const told = await run();
    const [, found = ''] = `${told.stderr}${told.stdout}`.match(/Both move alike with an offset of (-?[\d.]+) s/) ?? [];
    assert.ok(Math.abs(Number(found) + offset) < 0.01, `${found}, not ${-offset}`);
    const { stdout } = await run('--offset', found);
    const [{ statistics }] = JSON.parse(stdout).estimates;
    assert.ok(statistics.rmse < 0.02, `${statistics.rmse} m`);
  }
});
