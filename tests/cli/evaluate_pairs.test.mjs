// @ts-check
/** `scanstitch evaluate` on pairs whose files differ in conventions, times or numbers, or leave something open. */
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { DATA, scanstitch, skipWithoutData, temporaryFolder, writeFiles } from './support.mjs';

await engine.load();

/** @param {string[]} args */
async function evaluated(args) {
  const { status, stdout, stderr } = await scanstitch(['evaluate', ...args, '--json']);
  assert.equal(status, 0, stderr);
  return { ...JSON.parse(stdout), stderr };
}

/** A walk in space of 200 poses, 0.1 s apart. @param {number} noise m */
function walk(noise) {
  return Array.from({ length: 200 }, (_, i) => {
    const off = (/** @type {number} */ k) => noise * Math.sin(12.9898 * i + k);
    const [roll, yaw] = [0.3 * Math.sin(0.11 * i), 0.05 * i];
    const [cr, sr, cy, sy] = [Math.cos(roll / 2), Math.sin(roll / 2), Math.cos(yaw / 2), Math.sin(yaw / 2)];
    const position = [
      3 * Math.cos(0.05 * i) + off(0),
      2 * Math.sin(0.07 * i) + off(1),
      0.5 * Math.sin(0.2 * i) + off(2),
    ];
    return { t: 100 + 0.1 * i, position, quaternion: [cy * sr, sy * sr, sy * cr, cy * cr] };
  });
}

/** @param {ReturnType<typeof walk>} poses */
function tum(poses) {
  return poses.map(({ t, position, quaternion }) => `${[t, ...position, ...quaternion].join(' ')}\n`).join('');
}

/** Their poses with quaternions multiplied by i from the right: half a turn about x. @param {ReturnType<typeof walk>} poses */
function otherAxes(poses) {
  return poses.map(({ quaternion: [x = 0, y = 0, z = 0, w = 1], ...pose }) => ({
    ...pose,
    quaternion: [w, z, -y, -x],
  }));
}

test('a reference in reverse order is told, and is not explained by other axes', async (t) => {
  const truth = walk(0);
  // A walk whose speed varies, which tells its direction; half a circle turned back is half a circle.
  const bent = truth.map((pose, i) => ({ ...pose, position: pose.position.map((x) => x * (1 + 0.004 * i)) }));
  const reversed = bent.map(({ t: at }, i) => ({ ...(bent[bent.length - 1 - i] ?? bent[0]), t: at }));
  const [forward = '', backward = '', mine = ''] = writeFiles(temporaryFolder(t), {
    'truth.tum': tum(bent),
    'reversed.tum': tum(/** @type {typeof bent} */ (reversed)),
    'mine.tum': tum(bent),
  });
  const right = await evaluated([forward, mine, '--align', 'se3']);
  assert.equal(right.stderr, '');
  const { estimates, stderr } = await evaluated([backward, mine, '--align', 'se3']);
  assert.match(
    stderr,
    /Ground truth: its poses are in reverse order, or the estimate's are: .* Reverse the order in the file/,
  );
  assert.doesNotMatch(stderr, /axes|another recording/);
  assert.ok(estimates[0].statistics.rmse > 1);
});

test('times that are all the same are refused, and without them the poses are compared', async (t) => {
  const same = walk(0).map((pose) => ({ ...pose, t: 1604644894 }));
  const rows = tum(same).replaceAll(/^\S+ /gm, '');
  const [truth = '', mine = '', without = ''] = writeFiles(temporaryFolder(t), {
    'truth.tum': tum(walk(0)),
    'mine.tum': tum(same),
    'without.txt': rows,
  });
  const { status, stderr } = await scanstitch(['evaluate', truth, mine]);
  assert.equal(status, 1);
  assert.match(stderr, /All times of one of them are the same, 1604644894 s in the estimate.* leave them out/);
  const { estimates } = await evaluated([truth, without]);
  assert.ok(estimates[0].statistics.max < 1e-9);
});

test('conventions of either side are found and told, and the figures are those of equal conventions', async (t) => {
  const folder = temporaryFolder(t);
  const mine = walk(0.002);
  const mirrored = mine.map(
    ({ t: at, position: [x = 0, y = 0, z = 0], quaternion: [qx = 0, qy = 0, qz = 0, qw = 1] }) => ({
      t: at,
      position: [x, -y, z],
      quaternion: [-qx, qy, -qz, qw],
    }),
  );
  const wFirst = mine.map(({ quaternion: [x = 0, y = 0, z = 0, w = 1], ...pose }) => ({
    ...pose,
    quaternion: [w, x, y, z],
  }));
  const [truth = '', same = '', ...others] = writeFiles(folder, {
    'truth.tum': tum(walk(0)),
    'same.tum': tum(mine),
    'axes.tum': tum(otherAxes(mine)),
    'w_first.tum': tum(wFirst),
    'mirrored.tum': tum(mirrored),
  });
  const words = [/x, y, z of the estimate are x, -y, -z of the reference/, /read as qw qx qy qz/, /left-handed/];
  for (const align of ['none', 'origin', 'se3', 'sim3']) {
    for (const relation of ['translation_part', 'rotation_angle_deg', 'full_transformation']) {
      const args = ['--align', align, '--relation', relation];
      const { estimates, stderr } = await evaluated([truth, same, ...args]);
      assert.equal(stderr, '');
      for (const [index, other] of others.entries()) {
        const found = await evaluated([truth, other, ...args]);
        const [{ statistics }] = found.estimates;
        const expected = estimates[0].statistics.rmse;
        const what = `${other} ${align} ${relation}`;
        assert.ok(
          Math.abs(statistics.rmse - expected) <= 1e-9 * expected + 1e-12,
          `${what}: ${statistics.rmse}, ${expected}`,
        );
        assert.match(found.stderr, words[index] ?? /none/, what);
      }
    }
  }
  // The remedy that the note names.
  const asRead = await evaluated([
    truth,
    others[0] ?? '',
    '--relation',
    'rotation_angle_deg',
    '--conventions',
    'as_read',
  ]);
  assert.deepEqual([Math.round(asRead.estimates[0].statistics.min), asRead.stderr], [180, '']);
});

test('the reference is named in every form of the table, and Sim(3) has its scale', async (t) => {
  const larger = walk(0).map(({ position, ...pose }) => ({ ...pose, position: position.map((x) => 2.5 * x) }));
  const [truth = '', mine = ''] = writeFiles(temporaryFolder(t), {
    'truth.tum': tum(walk(0)),
    'mine.tum': tum(larger),
  });
  const run = async (/** @type {string[]} */ ...args) => (await scanstitch(['evaluate', truth, mine, ...args])).stdout;
  assert.match(await run(), /^APE of .*\nReference: truth\.tum, 200 poses\nrank/);
  assert.match(await run('--align', 'sim3'), /aligned \(m\) +scale\n +1 +mine\.tum .* 0\.4\n/);
  assert.match(await run('--align', 'sim3', '--table', 'csv'), /,scale,reference\n1,mine\.tum,.*,0\.4,truth\.tum\n/);
  assert.match(
    await run('--table', 'markdown'),
    /\| reference \|\n\| ---: \| --- \|.*\| --- \|\n.* \| truth\.tum \|\n/,
  );
});

test('interpolation is offered where times differ, and removes what they cost', async (t) => {
  const slower = walk(0).filter((_, i) => i % 2 === 0);
  const between = slower.slice(0, -1).map((pose) => {
    const i = 10 * (pose.t - 100) + 0.3;
    const position = [3 * Math.cos(0.05 * i), 2 * Math.sin(0.07 * i), 0.5 * Math.sin(0.2 * i)];
    return { ...pose, t: pose.t + 0.03, position };
  });
  const files = { 'truth.tum': tum(walk(0)), 'between.tum': tum(between) };
  const [truth = '', estimate = ''] = writeFiles(temporaryFolder(t), files);
  const near = await evaluated([truth, estimate, '--max-diff', '0.05']);
  assert.match(
    near.stderr,
    /every 0\.100 s and the estimate every 0\.200 s; .* differ by 0\.0300 s[^]*--interpolate compares/,
  );
  const interpolated = await evaluated([truth, estimate, '--interpolate']);
  assert.match(interpolated.stderr, /The reference was interpolated at 99 of the 99 times of the other/);
  const [before, after] = [near, interpolated].map(({ estimates }) => estimates[0].statistics.rmse);
  assert.ok(before > 0.03 && after < 0.003, `${before} m, ${after} m interpolated`);
  const none = await scanstitch(['evaluate', truth, estimate, '--by', 'time', '--max-diff', '0.01']);
  assert.match(none.stderr, /The spans overlap: allow a larger time difference, or interpolate/);
});

test('nanoseconds are read as such, with and without a unit in the header', async (t) => {
  const poses = walk(0);
  const rows = poses.map(({ t: at, position, quaternion: [x, y, z, w] }) => {
    const stamp = `${BigInt(Math.round(at * 10)) * 100_000_000n + 1_403_636_579_000_000_000n}`;
    return { stamp, last: [...position, x, y, z, w], first: [...position, w, x, y, z] };
  });
  const columns = 'p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []';
  const euroc = (/** @type {string} */ head) =>
    `${head}, ${columns}\n${rows.map(({ stamp, first }) => [stamp, ...first].join(',')).join('\n')}\n`;
  const files = {
    'truth.tum': tum(poses.map((pose) => ({ ...pose, t: 1_403_636_579 + pose.t }))),
    'euroc.csv': euroc('#timestamp'),
    'euroc_ns.csv': euroc('#timestamp [ns]'),
    'orb.txt': rows.map(({ stamp, last }) => `${stamp}.000000 ${last.join(' ')}\n`).join(''),
    'uptime.txt': rows.map(({ last }, i) => `${5_000_000_000 + 100_000_000 * i} ${last.join(' ')}\n`).join(''),
  };
  const [truth = '', ...others] = writeFiles(temporaryFolder(t), files);
  for (const other of others.slice(0, 3)) {
    const [{ num_matched, statistics }] = (await evaluated([truth, other])).estimates;
    assert.deepEqual([num_matched, statistics.max < 1e-6], [200, true], other);
  }
  const { estimates, stderr } = await evaluated([truth, others[3] ?? '', '--offset', String(1_403_636_579 + 95)]);
  assert.deepEqual([estimates[0].num_matched, estimates[0].statistics.max < 1e-6], [200, true]);
  assert.match(stderr, /The times were read as nanoseconds/);
});

test('numbers of poses before matrices tell which row of the reference is meant', async (t) => {
  const matrix = (/** @type {number} */ i) => `1 0 0 ${0.1 * i} 0 1 0 ${Math.sin(i)} 0 0 1 0`;
  const lines = (/** @type {(i: number) => string} */ line, /** @type {number[]} */ of) =>
    of.map((i) => `${line(i)}\n`).join('');
  const all = Array.from({ length: 50 }, (_, i) => i);
  const some = all.filter((i) => i > 1 && i !== 7);
  const [truth = '', fromZero = '', fromOne = ''] = writeFiles(temporaryFolder(t), {
    'truth.txt': lines(matrix, all),
    'from_0.txt': lines((i) => `${i} ${matrix(i)}`, some),
    'from_1.txt': lines((i) => `${i + 1} ${matrix(i)}`, some),
  });
  for (const [estimate, first] of [
    [fromZero, 0],
    [fromOne, 1],
  ]) {
    const { estimates, stderr } = await evaluated([truth, String(estimate)]);
    assert.deepEqual([estimates[0].num_matched, estimates[0].statistics.max], [47, 0]);
    assert.match(stderr, new RegExp(`numbers count the poses of the other from ${first}`));
  }
});

test(
  'straight and static paths: aligned as far as they can be, and the rest is told',
  { skip: skipWithoutData },
  async () => {
    const files = (/** @type {string} */ kind) =>
      ['gt', 'est'].map((which) => join(DATA, 'reports', 'straight_and_static', `${kind}_${which}.txt`));
    const rows = readFileSync(files('static')[1] ?? '', 'utf8')
      .trim()
      .split('\n')
      .map((row) => row.split(' ').map(Number));
    const variances = [1, 2, 3].map((axis) => {
      const values = rows.map((row) => row[axis] ?? 0);
      const mean = values.reduce((a, b) => a + b, 0) / values.length;
      return values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / values.length;
    });
    const spread = Math.sqrt(variances.reduce((a, b) => a + b, 0));
    for (const align of ['se3', 'sim3']) {
      const line = await evaluated([...files('line'), '--align', align]);
      assert.ok(line.estimates[0].statistics.max < 1e-5, `${line.estimates[0].statistics.max}`);
      assert.match(line.stderr, /turned about it at will/);
      const still = await evaluated([...files('static'), '--align', align]);
      const [{ statistics, alignment }] = still.estimates;
      assert.ok(Math.abs(statistics.rmse - spread) < 1e-12, `${statistics.rmse} in place of ${spread}`);
      assert.equal(alignment.scale, 1);
      assert.match(
        still.stderr,
        align === 'se3' ? /rotation is not determined/ : /rotation and scale are not determined/,
      );
    }
  },
);

test('ten flights and a monocular result with numbers, as published', { skip: skipWithoutData }, async () => {
  const flights = join(DATA, 'reports', 'ten_runs');
  const [reference = '', ...estimates] = readdirSync(flights)
    .sort()
    .map((name) => join(flights, name));
  const ranked = (await evaluated([reference, ...estimates, '--align', 'se3'])).estimates;
  const rmse = [0.0365, 0.0186, 0.0186, 0.0165, 0.0273, 0.1454, 0.029, 0.0183, 0.0255];
  for (const [index, expected] of rmse.entries()) {
    const found = ranked.find((/** @type {{ name: string }} */ { name }) => name.endsWith(`${index + 1}.txt`));
    assert.ok(Math.abs(found.statistics.rmse - expected) <= 5.1e-5, `${found.name}: ${found.statistics.rmse}`);
  }
  const kitti = join(DATA, 'reports', 'kitti_13_columns');
  const args = [join(kitti, 'gt', '09.txt'), join(kitti, '09.txt'), '--align', 'sim3'];
  const [{ statistics, alignment, drift, num_matched }] = (await evaluated(args)).estimates;
  assert.equal(num_matched, 1589);
  assert.ok(Math.abs(statistics.rmse - 8.38662) < 5e-6 && Math.abs(alignment.scale - 20.985) < 5e-4);
  assert.ok(Math.abs(drift.translation - 2.884) < 5e-4 && Math.abs(100 * drift.rotation - 0.249) < 5e-4);
});
