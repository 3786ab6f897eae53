// @ts-check
/** `scanstitch reconstruct` on laser logs: outputs, odometry, bad lines. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { rangesAt } from './layout_room.mjs';
import { roomLog } from './laser_room.mjs';
import { readReport, scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const rows = (/** @type {number} */ count, scale = 1) =>
  Array.from({ length: count }, (_, i) => `${i} ${0.05 * i * scale} 0 0\n`).join('');

test('a log: a trajectory of all its scans, a grid for map_server, and the poses in it as a reference', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'drive.log': roomLog(9) });
  const { status, stdout, stderr } = await scanstitch([
    'reconstruct',
    join(folder, 'drive.log'),
    '--out',
    join(folder, 'out'),
  ]);
  assert.equal(status, 0, stderr);
  const { frames, comparison } = readReport(join(folder, 'out'));
  assert.equal(frames.length, 9);
  assert.equal(frames[8].name, 'drive.log #8');
  assert.equal(comparison.name, 'the poses in the log');
  assert.ok(comparison.max < 0.01, `${comparison.max} m`);
  assert.match(stdout, /9 scans in/);
  const pgm = readFileSync(join(folder, 'out', 'map.pgm'));
  const [, width, height] =
    pgm
      .subarray(0, 40)
      .toString('latin1')
      .match(/^P5\n(\d+) (\d+)\n255\n/) ?? [];
  assert.equal(pgm.length, `P5\n${width} ${height}\n255\n`.length + Number(width) * Number(height));
  const yaml = readFileSync(join(folder, 'out', 'map.yaml'), 'utf8');
  assert.match(yaml, /^image: map\.pgm\nmode: trinary\nresolution: 0\.05\norigin: \[-?[\d.]+, -?[\d.]+, 0\.0\]\n/);
});

test('odometry that is named gives the first guess; one without headings is told', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'drive.log': roomLog(9), 'wheels.txt': rows(9, 1.1), 'positions.txt': '0 0\n0.05 0\n' });
  const at = (/** @type {string} */ name) => join(folder, name);
  const used = await scanstitch(['reconstruct', at('drive.log'), '--odometry', at('wheels.txt'), '--out', at('out')]);
  assert.equal(used.status, 0, used.stderr);
  assert.match(used.stderr, /wheels\.txt gives the first guess/);
  assert.ok(readReport(at('out')).comparison.max < 0.01);
  const refused = await scanstitch([
    'reconstruct',
    at('drive.log'),
    '--odometry',
    at('positions.txt'),
    '--out',
    at('out'),
  ]);
  assert.equal(refused.status, 2);
  assert.match(refused.stderr, /positions\.txt: These positions have no headings/);
});

test('a log cut in two files, and in files of one scan each, is as one', async (t) => {
  const folder = temporaryFolder(t);
  // The wheels' own poses, which the scans' lines repeat.
  const scans = roomLog(24)
    .split('\n')
    .filter((line) => line.startsWith('FLASER'));
  const lines = scans.map((line, scan) => `ODOM ${0.05 * scan} 0 0 0 0 0 ${scan} robot ${scan}\n${line}\n`);
  const run = async (/** @type {string} */ name, /** @type {string[]} */ parts) => {
    const logs = writeFiles(folder, Object.fromEntries(parts.map((part, i) => [`${name}-${100 + i}.log`, part])));
    const out = join(folder, name);
    const { status, stderr } = await scanstitch(['reconstruct', ...logs, '--out', out]);
    assert.equal(status, 0, stderr);
    assert.match(stderr, /The poses in the log are the wheels' own .* and are used as odometry/);
    return readFileSync(join(out, 'trajectory.tum'), 'utf8');
  };
  const whole = await run('whole', [lines.join('')]);
  assert.equal(await run('cut', [lines.slice(0, 12).join(''), lines.slice(12).join('')]), whole);
  assert.equal(await run('alone', lines), whole);
});

/** A robot that turns on the spot in a room, 3 degrees a scan: x y theta are given as they are. @param {number} numScans */
function turningLog(numScans) {
  const line = (/** @type {unknown} */ _, /** @type {number} */ scan) => {
    const heading = (3 * scan * Math.PI) / 180;
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      const angle = heading + ((beam - 90) * Math.PI) / 180;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      return Math.min(c > 0 ? 5 / c : -3 / c, s > 0 ? 4 / s : -2.5 / s).toFixed(3);
    });
    const time = (1000 + 0.25 * scan).toFixed(6);
    return `FLASER 180 ${ranges.join(' ')} 0 0 ${heading} 0 0 ${heading} ${time} robot ${(0.25 * scan).toFixed(6)}`;
  };
  return `${Array.from({ length: numScans }, line).join('\n')}\n`;
}

test('a trajectory carries the times of the log, and report.json as well; without such, the number of the scan', async (t) => {
  const folder = temporaryFolder(t);
  const repeated = turningLog(12).replaceAll(/100\d\.\d+ robot/g, '1.01893e+09 robot');
  writeFiles(folder, { 'drive.log': turningLog(12), 'repeated.log': repeated });
  const stampsOf = async (/** @type {string} */ name) => {
    const out = join(folder, `${name}-out`);
    const run = await scanstitch(['reconstruct', join(folder, name), '--out', out]);
    assert.equal(run.status, 0, run.stderr);
    const lines = readFileSync(join(out, 'trajectory.tum'), 'utf8').trim().split('\n').slice(1);
    const { frames } = readReport(out);
    return { ...run, stamps: lines.map((line) => Number(line.split(' ')[0])), times: frames.map((/** @type {any} */ { time }) => time) }; // prettier-ignore
  };
  const times = Array.from({ length: 12 }, (_, scan) => 1000 + 0.25 * scan);
  const timed = await stampsOf('drive.log');
  assert.deepEqual([timed.stamps, timed.times], [times, times]);
  const counted = await stampsOf('repeated.log');
  assert.deepEqual(counted.stamps, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
  assert.match(counted.stderr, /^note: The log's times do not tell its scans apart: 11 of 12 scans are not later/m);

  // Against relations by time, a reference by time, one that counts, and one by index.
  const turn = (6 * Math.PI) / 180;
  const quaternion = (/** @type {number} */ scan) =>
    `${Math.sin((scan * Math.PI) / 120)} ${Math.cos((scan * Math.PI) / 120)}`;
  writeFiles(folder, {
    'known.relations': Array.from({ length: 10 }, (_, i) => `${times[i]} ${times[i + 2]} 0 0 0 0 0 ${turn}\n`).join(''),
    'timed.tum': times.map((time, scan) => `${time} 0 0 0 0 0 ${quaternion(scan)}\n`).join(''),
    'counted.tum': times.map((_, scan) => `${scan} 0 0 0 0 0 ${quaternion(scan)}\n`).join(''),
    'index.txt': times.map((_, scan) => `${scan} 0 0 ${(3 * scan * Math.PI) / 180}\n`).join(''),
  });
  const at = (/** @type {string} */ name) => join(folder, name);
  const trajectory = at('drive.log-out/trajectory.tum');
  const known = await scanstitch(['evaluate', trajectory, '--relations', at('known.relations'), '--json']);
  assert.equal(known.status, 0, known.stderr);
  const [{ relations }] = JSON.parse(known.stdout).estimates;
  assert.deepEqual([relations.num_compared, relations.num_left_out, relations.num_wrong], [10, 0, 0]);
  assert.ok(relations.rotation_deg.max < 0.5, known.stdout);
  for (const reference of ['timed.tum', 'counted.tum', 'index.txt']) {
    const { status, stdout, stderr } = await scanstitch(['evaluate', at(reference), trajectory, '--json']);
    assert.equal(status, 0, stderr);
    assert.equal(JSON.parse(stdout).estimates[0].num_matched, 12, reference);
  }
});

test('odometry in other units, by another clock or of another log is told with the remedy, and the scans are placed', async (t) => {
  const folder = temporaryFolder(t);
  const count = 40;
  const turning = (/** @type {number} */ scale) =>
    Array.from({ length: count }, (_, i) => `${i} 0 0 ${((3 * i * Math.PI) / 180) * scale}\n`).join('');
  writeFiles(folder, {
    'drive.log': turningLog(count),
    'good.txt': turning(1),
    'degrees.txt': turning(180 / Math.PI),
    'gaps.txt': turning(1).split('\n').filter((_, row) => row < 10 || row > 14).join('\n'), // prettier-ignore
    'others.txt': Array.from({ length: 400 }, (_, i) => `${i} ${0.5 * i} 0 0\n`).join(''),
  });
  const at = (/** @type {string} */ name) => join(folder, name);
  const run = (/** @type {string} */ name) =>
    scanstitch(['reconstruct', at('drive.log'), '--odometry', at(name), '--out', at('out')]);
  const good = await run('good.txt');
  assert.deepEqual([good.status, /^note: good\.txt gives the first guess/m.test(good.stderr)], [0, true], good.stderr);
  for (const [name, told] of /** @type {const} */ ([
    ['degrees.txt', /^degrees\.txt: Its headings are degrees: .* Give them in radians\. It was not used\.$/m],
    ['others.txt', /^others\.txt: .*Give the odometry of this log.* It was not used\.$/m],
  ])) {
    const { status, stderr } = await run(name);
    assert.equal(status, 2, stderr);
    assert.match(stderr, told);
    assert.doesNotMatch(stderr, /gives the first guess/);
    const { frames, comparison, odometry_refusal } = readReport(at('out'));
    assert.equal(frames.length, count);
    assert.match(odometry_refusal, told);
    assert.ok(comparison.max < 0.05, `${comparison.max} m`);
  }
  const gaps = await run('gaps.txt');
  assert.equal(gaps.status, 0, gaps.stderr);
  assert.match(gaps.stderr, /^note: gaps\.txt has gaps: 5 of 40 scans have no pose in it, scan 10 first/m);
});

test('a log that was cut in mid-scan, and scans of two lasers in one', async (t) => {
  const folder = temporaryFolder(t);
  const log = turningLog(30);
  const rear = log.replaceAll(/^(FLASER .*)$/gm, '$1\n$1').replaceAll(/^(FLASER .*)\nFLASER/gm, '$1\nRLASER');
  const mixed = log.replaceAll(/^(FLASER .*)$/gm, `$1\nFLASER 20${' 2'.repeat(20)} 0 0 0 0 0 0 0 h 0`);
  writeFiles(folder, { 'cut.log': log.slice(0, -500), 'two.log': rear, 'mixed.log': mixed });
  // A rear laser has lines of its own, which are none of the front one's: nothing is lost.
  for (const [name, scans, code, told] of /** @type {const} */ ([
    ['cut.log', 29, 2, /^cut\.log: Line 30, the last one, is cut off and was left out\./m],
    ['two.log', 30, 0, /^note: two\.log: 30 scans of another laser \(RLASER, ROBOTLASER2\) were left out/m],
    ['mixed.log', 30, 2, /^mixed\.log: The log mixes the scans of several lasers: 30 of 60 were left out/m],
  ])) {
    const { status, stderr } = await scanstitch(['reconstruct', join(folder, name), '--out', join(folder, 'out')]);
    assert.equal(status, code, stderr);
    assert.match(stderr, told);
    assert.equal(readReport(join(folder, 'out')).frames.length, scans);
  }
});

test('a bad line is told with its number', async (t) => {
  const folder = temporaryFolder(t);
  writeFiles(folder, { 'bad.log': 'FLASER 3 1 2 3 0 0 0 0 0 0\nFLASER 3 1 x 3 0 0 0 0 0 0\n# end\n' });
  const { status, stderr } = await scanstitch(['reconstruct', join(folder, 'bad.log'), '--out', join(folder, 'out')]);
  assert.notEqual(status, 0);
  assert.match(stderr, /bad\.log, line 2: "x" in the place of readings is not a number/);
});

test('a log whose odometry is the mirror image of its scans: told, doubtful, and exit code 2', async (t) => {
  const folder = temporaryFolder(t);
  const log = (/** @type {boolean} */ isClockwise) =>
    Array.from({ length: 120 }, (_, scan) => {
      // Stands still for a while now and then, which gives the clock away.
      const at = 0.09 * (14 * Math.floor(scan / 20) + Math.min(scan % 20, 14));
      const [x, y, heading] = [1.2 + 1.2 * Math.cos(at), 1.6 + 1.4 * Math.sin(at), at + 1.6 + 0.4 * Math.sin(5 * at)];
      const along = Array.from({ length: 180 }, (_, beam) => ((beam - 90) * Math.PI) / 180);
      const ranges = rangesAt([x, y, heading], along).map((range) => range.toFixed(3));
      const beams = (isClockwise ? ranges.toReversed() : ranges).join(' ');
      return `FLASER 180 ${beams} ${x} ${y} ${heading} ${x} ${y} ${heading} ${100 + scan / 2} h ${100 + scan / 2}\n`;
    }).join('');
  const run = async (/** @type {boolean} */ isClockwise) => {
    const [path = ''] = writeFiles(folder, { 'drive.log': log(isClockwise) });
    return scanstitch(['reconstruct', path, '--out', folder]);
  };
  const right = await run(false);
  assert.equal(right.status, 0, right.stderr);
  const { status, stderr } = await run(true);
  assert.equal(status, 2, stderr);
  assert.match(stderr, /mirror image/);
  // A complaint, not a note.
  assert.match(stderr, /^(?!note: ).*mirror image.*turns clockwise/m);
  assert.ok(readReport(folder).frames.every((/** @type {{ status: string }} */ frame) => frame.status !== 'good'));
});
