// @ts-check
/** `scanstitch reconstruct` on scans of a made-up room, of the samples and of a real corridor. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { describe_settings, load } from '../../npm/index.js';
import {
  DATA,
  plyFiles,
  ROOM_FILES,
  ROOM_POSES,
  readReport,
  SAMPLES,
  scanstitch,
  spawnScanstitch,
  skipWithoutData,
  temporaryFolder,
  writeFiles,
} from './support.mjs';

const OUTPUTS = ['trajectory.tum', 'map.ply', 'report.json', 'report.html'];

/** Positions that MATLAB's pcregistericp gives for zju10 (m), as published. */
const MATLAB_POSITIONS = `0 0 0
0.0459 1.1082 0
0.1924 2.2068 0
0.3375 3.3133 0
0.3970 4.0100 0
0.3145 5.0264 0
0.2742 5.9423 0
0.1316 6.8498 0
0.1663 8.1005 0
0.1687 9.0731 0
`;

/**
 * The numbers of each line of a TUM trajectory.
 * @param {string} path
 */
function readTum(path) {
  const lines = readFileSync(path, 'utf8').split('\n');
  return lines.filter((line) => line && !line.startsWith('#')).map((line) => line.split(' ').map(Number));
}

test('a room: every output is written, well formed, and right', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  const out = join(folder, 'made', 'by it');
  const { status, stdout, stderr } = await scanstitch(['reconstruct', folder, '--out', out]);
  assert.equal(stderr, '');
  assert.equal(status, 0);

  const report = readReport(out);
  assert.deepEqual(
    report.frames.map((/** @type {{ name: string }} */ { name }) => name),
    ['0.ply', '1.ply', '2.ply'],
  );
  const lines = readTum(join(out, 'trajectory.tum'));
  assert.equal(lines.length, 3);
  ROOM_POSES.forEach(([x, y, theta], index) => {
    const { T_world_sensor, status } = report.frames[index];
    assert.equal(status, 'good');
    const error = Math.hypot(T_world_sensor.x - x, T_world_sensor.y - y);
    assert.ok(error < 0.005, `scan ${index} is ${error} m off`);
    assert.ok(Math.abs(T_world_sensor.theta - theta) < 0.003, `scan ${index}: heading ${T_world_sensor.theta}`);
    const [stamp, tumX, tumY, , , , qz = 0, qw = 0, ...rest] = lines[index] ?? [];
    assert.deepEqual(rest, []);
    assert.deepEqual([stamp, tumX, tumY], [index, T_world_sensor.x, T_world_sensor.y]);
    assert.ok(Math.abs(2 * Math.atan2(qz, qw) - T_world_sensor.theta) < 1e-9);
  });

  const map = readFileSync(join(out, 'map.ply'));
  const header = map.subarray(0, map.indexOf('end_header\n') + 'end_header\n'.length).toString();
  const kept = report.frames
    .map(
      (/** @type {import('../../npm/index.js').ReconstructionResult['frames'][number]} */ { cleaning }) =>
        cleaning.num_kept,
    )
    .reduce((/** @type {number} */ sum, /** @type {number} */ count) => sum + count);
  assert.match(header, new RegExp(`^element vertex ${kept}$`, 'm'));
  assert.ok(map.length > header.length + 8 * kept, 'the map holds its points');

  assert.match(stdout, /^scan +x \(m\) +y \(m\) +heading \(deg\) +inliers +rmse \(mm\) +iterations +ms +status$/m);
  assert.match(stdout, /^1\.ply +0\.\d{3} +0\.\d{3} +2\.\d\d +\d+ +\d+\.\d +\d+ +\d+\.\d +good$/m);
  assert.match(stdout, /^Sharpness \d+\.\d mm/m);
  assert.doesNotMatch(stdout, /Distance to/);
});

test('the same files give the same bytes, in a new process and in one that has run before', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  for (const [name, run] of Object.entries({ first: spawnScanstitch, second: scanstitch }))
    assert.equal((await run(['reconstruct', folder, '--out', join(folder, name)])).status, 0);
  for (const output of OUTPUTS) {
    const [first, second] = ['first', 'second'].map((name) => readFileSync(join(folder, name, output)));
    assert.deepEqual(first, second, output);
  }
});

test('scans are taken in natural order, however they are given', async (t) => {
  const folder = temporaryFolder(t);
  const [first = '', second = '', third = ''] = Object.values(ROOM_FILES);
  const paths = writeFiles(folder, { '10.ply': third, '9.ply': second, '1.ply': first });
  const out = join(folder, 'out');
  assert.equal((await scanstitch(['reconstruct', ...paths, '--out', out])).status, 0);
  const names = readReport(out).frames.map((/** @type {{ name: string }} */ { name }) => name);
  assert.deepEqual(names, ['1.ply', '9.ply', '10.ply']);
});

test('files of one name in two folders keep their folder in the results', async (t) => {
  const [a, b] = [temporaryFolder(t), temporaryFolder(t)];
  writeFiles(a, { '0.ply': ROOM_FILES['0.ply'] ?? '' });
  writeFiles(b, { '0.ply': ROOM_FILES['1.ply'] ?? '' });
  const out = join(a, 'out');
  assert.equal((await scanstitch(['reconstruct', a, b, '--out', out])).status, 0);
  const names = readReport(out).frames.map((/** @type {{ name: string }} */ { name }) => name);
  assert.deepEqual(names.toSorted(), [join(a, '0.ply'), join(b, '0.ply')].toSorted());
});

test('a reference is compared with and used for nothing else', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  const shifted = ROOM_POSES.map(([x, y], index) => `${index === 2 ? x + 0.3 : x} ${y} 0\n`).join('');
  writeFiles(folder, { 'truth.xyz': shifted });
  const [alone, compared] = [join(folder, 'alone'), join(folder, 'compared')];
  await scanstitch(['reconstruct', folder, '--out', alone]);
  const args = ['reconstruct', folder, '--reference', join(folder, 'truth.xyz'), '--out', compared];
  const { status, stdout } = await scanstitch(args);
  assert.equal(status, 0);
  assert.match(
    stdout,
    /^Distance to truth\.xyz: mean 10\d\.\d mm, rmse 17\d\.\d mm, max (29|30)\d\.\d mm over 3 of 3 scans$/m,
  );
  assert.deepEqual(readReport(compared).frames, readReport(alone).frames);
  const { comparison } = readReport(compared);
  assert.ok(Math.abs(comparison.max - 0.3) < 0.01);
});

test('a report to be read is whole, runs no script and takes names as text', async (t) => {
  const folder = temporaryFolder(t);
  const [first = '', second = '', third = ''] = Object.values(ROOM_FILES);
  const evil = '<img src=x onerror=alert(1)>&.ply';
  const files = { '0.ply': first, [`1${evil}`]: second, '2.ply': third, 'broken.ply': 'ply\nformat ascii 1.0\n' };
  writeFiles(folder, { ...files, 'truth.xyz': ROOM_POSES.map(([x, y]) => `${x} ${y} 0\n`).join('') });
  const out = join(folder, 'out');
  assert.equal(
    (await scanstitch(['reconstruct', folder, '--reference', join(folder, 'truth.xyz'), '--out', out])).status,
    2,
  );
  const html = readFileSync(join(out, 'report.html'), 'utf8');
  assert.match(html, /^<!doctype html>[^]*<\/html>\n$/);
  assert.doesNotMatch(html, /<script|<img|\son\w+=(?!alert)|https?:/);
  assert.match(html, /1&lt;img src=x onerror=alert\(1\)&gt;&amp;\.ply/);
  assert.match(html, /With all poses aligned/);
  const { mean, rmse, max } = readReport(out).comparison;
  const [, ...figures] =
    /([\d.]+) mm<\/strong> mean; rmse ([\d.]+) mm, max ([\d.]+) mm, first poses aligned/.exec(html) ?? [];
  assert.deepEqual(
    figures,
    [mean, rmse, max].map((metres) => (1000 * metres).toFixed(1)),
  );
  assert.match(html, /<li>broken\.ply, line 3: /);
  assert.equal([...html.matchAll(/class="good"/g)].length, 3);
  assert.match(html, /<th scope="row">strategy<\/th><td>joint<\/td>/);
  // Angles in degrees, and no number with more digits than count.
  await load();
  const angles = describe_settings().flatMap(({ name, unit }) => (unit === 'rad' ? [name] : []));
  assert.ok(angles.length > 2);
  for (const name of angles) assert.match(html, new RegExp(`<th scope="row">${name}</th><td>[\\d.]{1,14}°</td>`));
  assert.doesNotMatch(html, /<td>\d*\.0*[1-9]\d{6,}/);
  // The path: three places, and the points of the map.
  const paths = [...html.matchAll(/<path d="([^"]*)"/g)].map(([, d = '']) => d.match(/[ML]/g)?.length ?? 0);
  assert.ok((paths[0] ?? 0) > 300 && paths[1] === 3 && paths[2] === 3, String(paths));
  // It is no input of the next run.
  const again = await scanstitch(['reconstruct', out, '--out', join(folder, 'again')]);
  assert.doesNotMatch(again.stderr, /report\.html/);
});

test('settings and presets reach the engine', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, ROOM_FILES);
  const out = join(folder, 'out');
  const set = ['--set', 'max_normal_angle=30deg', '--set', 'max_iterations=7', '--set', 'metric=point_to_line'];
  assert.equal((await scanstitch(['reconstruct', folder, '--out', out, '--preset', 'homework', ...set])).status, 0);
  const { settings } = readReport(out);
  assert.equal(settings.strategy, 'scan_to_scan', 'from the preset');
  assert.equal(settings.metric, 'point_to_line', 'set over the preset');
  assert.equal(settings.max_iterations, 7);
  assert.ok(Math.abs(settings.max_normal_angle - Math.PI / 6) < 1e-12);
});

test('the samples: within 15 mm of the truth, no heading off by more than 0.2 deg', async (t) => {
  assert.ok(existsSync(SAMPLES), 'www/samples holds the generated scans');
  const truth = join(SAMPLES, 'truth.tum');
  const out = temporaryFolder(t);
  const { status, stderr } = await scanstitch(['reconstruct', SAMPLES, '--reference', truth, '--out', out]);
  assert.equal(status, 0, stderr);
  const { frames, comparison } = readReport(out);
  assert.equal(frames.length, plyFiles(SAMPLES).length);
  assert.equal(comparison.num_matched, frames.length);
  assert.ok(comparison.mean <= 0.015, `mean distance to the truth ${comparison.mean} m`);
  const headings = readTum(truth).map(([, , , , , , qz = 0, qw = 1]) => 2 * Math.atan2(qz, qw));
  frames.forEach((/** @type {{ T_world_sensor: { theta: number } }} */ { T_world_sensor }, /** @type {number} */ i) => {
    const error = Math.abs(T_world_sensor.theta - ((headings[i] ?? Number.NaN) - (headings[0] ?? Number.NaN)));
    assert.ok((error * 180) / Math.PI <= 0.2, `scan ${i}: heading off by ${error} rad`);
  });
});

test('ten recorded scans: sharper than MATLAB, and near it', { skip: skipWithoutData }, async (t) => {
  const folder = temporaryFolder(t);
  const [reference = ''] = writeFiles(folder, { 'matlab.xyz': MATLAB_POSITIONS });
  const args = ['reconstruct', join(DATA, 'laser', 'zju10'), '--reference', reference, '--out', folder];
  const { status, stderr } = await scanstitch(args);
  assert.equal(status, 0, stderr);
  const { sharpness, comparison } = readReport(folder);
  assert.ok(sharpness.mean_residual <= 0.017, `sharpness ${sharpness.mean_residual} m`);
  assert.ok(comparison.mean <= 0.121, `mean distance to MATLAB's positions ${comparison.mean} m`);
  assert.ok(comparison.max <= 0.3, `largest distance to MATLAB's positions ${comparison.max} m`);
});
