// @ts-check
/** `scanstitch evaluate`, `convert` and `map-quality`: figures of evo, tables, bad input, every form of a trajectory. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { asciiPly, DATA, ROOT, scanstitch, skipWithoutData, temporaryFolder, writeFiles } from './support.mjs';

const OWN = join(ROOT, 'tests', 'data', 'evaluation');
const REFERENCE = join(OWN, 'reference.tum');
const ESTIMATE = join(OWN, 'estimate.tum');
const MATCH = ['--max-diff', '0.05', '--offset', '-0.25'];

/** What evo 1.38.1 computes of the two files, see tests/data/README.md. */
const evo = JSON.parse(readFileSync(join(OWN, 'evo.json'), 'utf8'));

await engine.load();

/** @param {string[]} args */
async function evaluateJson(args) {
  const { status, stdout, stderr } = await scanstitch(['evaluate', ...args, '--json']);
  assert.equal(status, 0, stderr);
  return JSON.parse(stdout);
}

/**
 * @param {number} found
 * @param {number} expected
 */
function same(found, expected) {
  assert.ok(Math.abs(found - expected) <= 1e-9 * Math.abs(expected), `${found} in place of ${expected}`);
}

test('the figures of evo, by way of the command line', async () => {
  const cases = /** @type {const} */ ([
    ['-as 20', ['--align', 'sim3', '--align-first', '20'], 'APE translation_part'],
    ['origin', ['--align', 'origin', '--relation', 'rotation_angle_deg'], 'APE rotation_angle_deg'],
    [
      'none',
      '--metric rpe --relation full_transformation --delta 0.5 --delta-unit meters --all-pairs --delta-tolerance 0.02 --pairs-from-reference'.split(
        ' ',
      ),
      'RPE full_transformation delta 0.5 meters rel_tol 0.02 all_pairs True pairs_from_reference True',
    ],
  ]);
  for (const [align, args, key] of cases) {
    const { results } = evo.cases.find(
      (/** @type {{ align: string, max_diff: number }} */ one) => one.align === align && one.max_diff === 0.05,
    );
    const { estimates, options, reference } = await evaluateJson([REFERENCE, ESTIMATE, ...MATCH, ...args]);
    assert.equal(reference, 'reference.tum');
    assert.equal(options.max_diff, 0.05);
    const [{ name, rank, statistics, num_errors }] = estimates;
    assert.deepEqual([name, rank, num_errors], ['estimate.tum', 1, results[key].n]);
    for (const figure of ['rmse', 'median', 'min']) {
      if (results[key][figure] > 1e-14) same(statistics[figure], results[key][figure]);
    }
  }
});

test('hand-in mode: many estimates are ranked, in every form of a table', async (t) => {
  const folder = temporaryFolder(t);
  const shifted = (/** @type {number} */ by) =>
    readFileSync(REFERENCE, 'utf8').replace(/^(\S+) (\S+)/gm, (_, stamp, x) => `${stamp} ${Number(x) + by}`);
  const paths = writeFiles(folder, {
    'late.tum': shifted(0.2),
    'best.tum': shifted(0.1),
    'a|b, worst.tum': shifted(3),
  });
  const text = await scanstitch(['evaluate', REFERENCE, ...paths, '--drift']);
  assert.equal(text.stderr, '');
  assert.equal(text.status, 0);
  assert.match(text.stdout, /^APE of translation_part, alignment none\n/);
  assert.match(text.stdout, /^rank +estimate +poses +rmse \(m\) .*drift \(%\) +drift \(deg\/m\)$/m);
  assert.match(text.stdout, /^ +1 +best\.tum +90\/90 +0\.1 .*\n +2 +late\.tum .*\n +3 +a\|b, worst\.tum .* 3 /m);

  const markdown = (await scanstitch(['evaluate', REFERENCE, ...paths, '--table', 'markdown'])).stdout;
  assert.match(markdown, /^\| rank \| estimate \| .*\n\| ---: \| --- \| .*\n\| 1 \| best\.tum \| 90\/90 \| 0\.1 \| /);
  assert.match(markdown, /\| 3 \| a\\\|b, worst\.tum \|/);
  const csv = (await scanstitch(['evaluate', REFERENCE, ...paths, '--table', 'csv', '--sort', 'max'])).stdout;
  assert.match(csv, /^rank,estimate,poses,rmse \(m\),.*\n1,best\.tum,90\/90,0\.1,.*\n.*\n3,"a\|b, worst\.tum",/);
});

test('one estimate that cannot be used does not spoil the others', async (t) => {
  const folder = temporaryFolder(t);
  const good = readFileSync(REFERENCE, 'utf8');
  const files = {
    'broken.tum': good.replace(/^(\S+ \S+) \S+/m, '$1 nan'),
    'elsewhere.tum': good.replace(/^17/gm, '18'),
    'milliseconds.tum': good.replace(/^(\S+)/gm, (stamp) => String(Number(stamp) * 1000)),
    'elapsed.tum': good.replace(/^(\S+)/gm, (stamp) => String((Number(stamp) - 1.7e9) * 1000)),
    'in_mm.tum': good.replace(/^(\S+) (\S+) (\S+) (\S+)/gm, (_, stamp, ...position) =>
      [stamp, ...position.slice(0, 3).map((value) => 1000 * Number(value))].join(' '),
    ),
    'one_pose.tum': good.split('\n')[0] ?? '',
    'long_quaternions.tum': good.replace(/ (\S+) (\S+) (\S+) (\S+)$/gm, ' $1 $2 $3 $4').replace(/(\S+)$/m, '3'),
  };
  const paths = writeFiles(folder, files);
  const { status, stdout, stderr } = await scanstitch([
    'evaluate',
    REFERENCE,
    ESTIMATE,
    ...paths,
    ...MATCH.slice(0, 2),
    '--align',
    'se3',
  ]);
  assert.equal(status, 2);
  assert.match(stderr, /^broken\.tum, line 1: Column 3 is "nan", not a finite number\./m);
  assert.match(
    stderr,
    /^elsewhere\.tum: No time .* the reference spans 1700000000\..* the estimate 1800000000\..*offset of -100000000\.000 s/m,
  );
  assert.match(stderr, /^elapsed\.tum: .*look like milliseconds/m);
  assert.match(stderr, /^note: milliseconds\.tum: The times were read as milliseconds/m);
  assert.match(stdout, /milliseconds\.tum +90\/90 +\d\S*e-/);
  assert.match(stderr, /^note: in_mm\.tum: The estimate moves 1000\S* times as far .* is in millimetres/m);
  assert.match(stderr, /^note: in_mm\.tum: --align sim3 fits the scale\.$/m);
  assert.match(stderr, /^one_pose\.tum: 1 pairs of positions do not fix the alignment/m);
  assert.match(
    stderr,
    /^note: long_quaternions\.tum: line 1: Columns 5 to 8 are not a rotation: .*It was made of length 1/m,
  );
  assert.match(stdout, /^ +2 +long_quaternions\.tum +90\/90 /m);
  assert.match(stdout, / +estimate\.tum /);
  assert.match(
    (await scanstitch(['evaluate', ESTIMATE, join(folder, 'broken.tum')])).stderr,
    /No estimate could be compared/,
  );
});

test('convert: every form and back, without loss', async (t) => {
  const folder = temporaryFolder(t);
  const times = join(folder, 'times.txt');
  const lines = readFileSync(REFERENCE, 'utf8').trim().split('\n');
  writeFileSync(times, lines.map((line) => `${line.split(' ')[0]}\n`).join(''));
  for (const [file, form] of /** @type {const} */ ([
    ['a.tum', 'tum'],
    ['a.kitti', 'kitti'],
    ['a.npy', 'npy'],
    ['a.csv', 'pose_table'],
    ['a.log', 'matrices'],
    ['euroc.csv', 'euroc'],
  ])) {
    const path = join(folder, file);
    const made = await scanstitch(['convert', REFERENCE, path, '--to', form]);
    assert.equal(made.status, 0, made.stderr);
    assert.match(made.stdout, new RegExp(`^90 poses, tum to ${form}: written to `));
    for (const relation of ['translation_part', 'rotation_angle_rad']) {
      const args = [REFERENCE, path, '--times', times, '--max-diff', '1e-6', '--relation', relation];
      const [{ statistics, num_matched }] = (await evaluateJson(args)).estimates;
      assert.equal(num_matched, 90, form);
      assert.ok(statistics.max < 1e-15, `${form} ${relation} ${statistics.max}`);
    }
  }
  const { stderr, status } = await scanstitch(['convert', REFERENCE, join(folder, 'x.unknown')]);
  assert.deepEqual([stderr, status], ['scanstitch: Name the form of x.unknown with --to.\n', 1]);
  const lost = join(folder, 'lost.tum');
  writeFileSync(lost, '0 1 0 0 0 0 0 1\n1 nan nan nan nan nan nan nan\n2 3 0 0 0 0 0 1\n');
  const told = await scanstitch(['convert', lost, join(folder, 'found.tum')]);
  assert.match(told.stderr, /^note: lost\.tum: 1 of its 3 poses have nan or inf/);
});

test('a folder of one matrix a frame is one estimate', async (t) => {
  const folder = temporaryFolder(t);
  const frames = join(folder, 'frames');
  mkdirSync(frames);
  const all = join(folder, 'all.log');
  await scanstitch(['convert', REFERENCE, all]);
  const rows = readFileSync(all, 'utf8').trim().split('\n');
  for (let index = 0; index < 90; index += 1) {
    writeFileSync(join(frames, `frame-${index}.pose.txt`), rows.slice(4 * index, 4 * index + 4).join('\n'));
  }
  writeFileSync(join(frames, 'camera-intrinsics.txt'), '585 0 320\n0 585 240\n0 0 1\n');
  const [{ statistics, num_matched }] = (await evaluateJson([REFERENCE, frames])).estimates;
  assert.deepEqual([num_matched, statistics.max], [90, 0]);
  writeFileSync(join(frames, 'frame-7.pose.txt'), rows.slice(0, 3).join('\n'));
  assert.match((await scanstitch(['evaluate', REFERENCE, frames])).stderr, /^frame-7\.pose\.txt, line \d/);
});

test('relations that are known to be right', async (t) => {
  const folder = temporaryFolder(t);
  const [poses, relations] = writeFiles(folder, {
    'poses.txt': '0 0 0 0\n1 1 0 1.5707963267948966\n2 1 1 3.141592653589793\n3 0 1 -1.5707963267948966\n',
    'loops.g2o':
      'VERTEX2 0 0 0 0\nEDGE2 0 1 1 0 1.5707963267948966 1 0 1 1 0 0\nEDGE2 0 3 0 1.2 -1.5707963267948966 1 0 1 1 0 0\n',
  });
  const args = [poses ?? '', poses ?? '', '--relations', relations ?? ''];
  const [{ relations: all }] = (await evaluateJson(args)).estimates;
  assert.deepEqual([all.num_relations, all.num_compared], [2, 2]);
  same(all.translation.mean, 0.1);
  const [{ relations: loops }] = (await evaluateJson([...args, '--loops-only'])).estimates;
  assert.equal(loops.num_relations, 1);
  same(loops.translation.max, 0.2);
  assert.match((await scanstitch(['evaluate', ...args])).stdout, /relations +trans \(m\) +rot \(deg\)\n.* 2 +0\.1 /);
});

/** A drive of 40 poses, one each 0.12 s, a quarter of a metre a step, and relations between every pose and the tenth after. */
const DRIVE = Array.from({ length: 40 }, (_, i) => `${(70.25 + 0.12 * i).toFixed(6)} ${0.25 * i} 0 0 0 0 0 1\n`).join(
  '',
);
/** @param {number} shift s, of their times @param {number} far how many of the thirty are a metre off */
function timedRelations(shift, far = 0) {
  const line = (/** @type {unknown} */ _, /** @type {number} */ i) => {
    const times = [i, i + 10].map((pose) => (70.25 + 0.12 * pose + shift).toFixed(6));
    return `${times.join(' ')} ${2.54 + (i < far ? 1 : 0)} 0.03 0 0 0 ${(2 * Math.PI) / 180}\n`;
  };
  return Array.from({ length: 30 }, line).join('');
}

test('relations by time and a trajectory alone: counts, figures, the share that is wrong', async (t) => {
  const folder = temporaryFolder(t);
  const extra = '900.000000 901.000000 1 0 0 0 0 0\n';
  const [drive = '', known = ''] = writeFiles(folder, {
    'drive.tum': DRIVE,
    'known.relations': timedRelations(0, 3) + extra,
  });
  const { status, stdout, stderr } = await scanstitch(['evaluate', drive, '--relations', known]);
  assert.deepEqual([status, stderr], [0, '']);
  assert.match(
    stdout,
    /^drive\.tum against known\.relations: 30 relations used, 1 left out, matched within 0\.060 s$/m,
  );
  assert.match(stdout, /^ +mean +deviation +median +largest$/m);
  assert.match(stdout, /^translation \(m\) +0\.1490 +0\.2971 +0\.0500 +1\.0404$/m);
  assert.match(stdout, /^rotation \(deg\) +2\.0000 +0\.0000 +2\.0000 +2\.0000$/m);
  assert.match(stdout, /^Off by more than 0\.5 m or 5 deg: 3 of 30 \(10\.00 %\)$/m);

  const { relations, estimates } = await evaluateJson([drive, '--relations', known]);
  assert.equal(relations, 'known.relations');
  const [{ name, relations: found }] = estimates;
  assert.deepEqual([name, found.num_relations, found.num_compared, found.num_left_out], ['drive.tum', 31, 30, 1]);
  assert.deepEqual([found.num_wrong, found.share_wrong, found.translation_errors], [3, 0.1, undefined]);
  same(found.translation.median, 0.05);
  same(found.rotation_deg.mean, 2);
  const [{ relations: full }] = (await evaluateJson([drive, '--relations', known, '--errors'])).estimates;
  assert.equal(full.translation_errors.length, 30);
  const csv = (await scanstitch(['evaluate', drive, '--relations', known, '--table', 'csv'])).stdout;
  assert.match(csv, /^estimate,relations,left out,trans \(m\),.*\ndrive\.tum,30,1,0\.1490,.*,10\.00\n$/);
});

test('relations whose times fit no pose are told with the remedy, and the rest is computed', async (t) => {
  const folder = temporaryFolder(t);
  const counted = DRIVE.split('\n').slice(0, -1).map((line, i) => line.replace(/^\S+/, String(i))).join('\n'); // prettier-ignore
  const files = {
    'drive.tum': DRIVE,
    'counted.tum': counted,
    'late.relations': timedRelations(1234.5),
    'edges.g2o': 'EDGE2 0 10 2.5 0 0 1 0 1 1 0 0\nEDGE2 300 310 1 0 0 1 0 1 1 0 0\nEDGE2 310 320 1 0 0 1 0 1 1 0 0\n',
  };
  const [drive = '', counts = '', late = '', edges = ''] = writeFiles(folder, files);
  const alone = await scanstitch(['evaluate', drive, '--relations', late]);
  assert.deepEqual([alone.status, alone.stdout], [1, '']);
  assert.match(
    alone.stderr,
    /^drive\.tum: late\.relations: The estimate has the poses of none of the 30 relations within/,
  );
  assert.match(
    alone.stderr,
    /an offset of 1234\.500 s would make them meet\.\nscanstitch: No relation could be compared/,
  );
  const shifted = await scanstitch(['evaluate', drive, '--relations', late, '--offset', '1234.5']);
  assert.equal(shifted.status, 0, shifted.stderr);
  assert.match(shifted.stdout, /30 relations used, 0 left out/);

  const counting = await scanstitch(['evaluate', counts, '--relations', late]);
  assert.equal(counting.status, 1);
  assert.match(counting.stderr, /the estimate counts its poses: 0, 1, 2\. Reconstruct the log anew/);

  // With a reference the rest is computed; some relations that fit are compared, and the others told.
  const ranked = await scanstitch(['evaluate', drive, drive, '--relations', late]);
  assert.equal(ranked.status, 2);
  assert.match(ranked.stdout, /^ +1 +drive\.tum +40\/40 +0 /m);
  const partly = await scanstitch(['evaluate', drive, '--relations', edges]);
  assert.equal(partly.status, 2);
  assert.match(
    partly.stderr,
    /both poses of 1 of the 3 relations: they count poses up to 320, and the estimate has 40/,
  );
  assert.match(partly.stdout, /1 relations used, 2 left out\n/);
});

test('wrong commands: one line each, exit code 1', async () => {
  const cases = /** @type {[string[], RegExp][]} */ ([
    [['evaluate'], /Name the reference and one estimate at least/],
    [['evaluate', REFERENCE], /Name the reference and one estimate at least, or one trajectory and --relations FILE/],
    [
      ['evaluate', REFERENCE, ESTIMATE, '--align', 'best'],
      /--align is one of none, origin, se3, sim3, scale, not "best"/,
    ],
    [['evaluate', REFERENCE, ESTIMATE, '--max-diff', 'wide'], /--max-diff is a number, not "wide"/],
    [['evaluate', REFERENCE, ESTIMATE, '--align-first', '1.5'], /--align-first is a whole number from 1/],
    [['evaluate', REFERENCE, ESTIMATE, '--format', 'bag'], /"bag" is not a trajectory format/],
    [['map-quality'], /Nothing to judge was given/],
    [['map-quality', 'a.ply', '--radius', 'Infinity'], /--radius is a number from 0, not "Infinity"/],
    [['convert', REFERENCE], /Name one input and one output/],
  ]);
  for (const [args, message] of cases) {
    const { status, stdout, stderr } = await scanstitch(args);
    assert.match(stderr, /^scanstitch: .+\n$/);
    assert.match(stderr, message);
    assert.deepEqual([stdout, status], ['', 1]);
  }
  const { stderr } = await scanstitch(['evaluate', 'absent.tum', ESTIMATE]);
  assert.match(stderr, /^absent\.tum: There is no such file or folder\.\nscanstitch: The reference could not be used/);
});

test('map-quality: a blurred map scores worse', async (t) => {
  const folder = temporaryFolder(t);
  const wall = (/** @type {number} */ blur) =>
    asciiPly(Array.from({ length: 900 }, (_, i) => [(i % 300) / 100, blur * Math.sin(i * i), 0]));
  const paths = writeFiles(folder, { 'crisp.ply': wall(0.005), 'blurred.ply': wall(0.02) });
  const { status, stdout } = await scanstitch(['map-quality', ...paths, '--json']);
  assert.equal(status, 0);
  const [crisp, blurred] = JSON.parse(stdout);
  assert.ok(crisp.mean_map_entropy < blurred.mean_map_entropy);
  assert.ok(crisp.mean_plane_variance < blurred.mean_plane_variance / 10);
  assert.match((await scanstitch(['map-quality', ...paths])).stdout, /^map +mean map entropy \(nats\)/);
});

test('map-quality: the points evaluated of a large map are spread over all of it', () => {
  // The product of a point's number and the number of points exceeds 32 bits before the rough end begins.
  const [count, rough] = [100_000, 90_000];
  const positions = Float32Array.from({ length: 3 * count }, (_, k) => {
    const i = Math.floor(k / 3);
    return [(i % 1000) / 50, Math.floor(i / 1000) / 50, i < rough ? 1 : 1 + 0.01 * Math.sin(i * i)][k % 3] ?? 0;
  });
  const map = engine.PointCloud.from_positions(positions);
  const { mean_plane_variance, num_points } = engine.map_quality(map, { radius: 0.05 });
  map.free();
  assert.equal(num_points, 50_000);
  assert.ok(mean_plane_variance > 1e-6, `${mean_plane_variance}`);
});

test('map-quality: frames are placed by trajectories, and what does not fit them is told', async (t) => {
  const folder = temporaryFolder(t);
  // A corner of three walls, seen from places along a line; each frame has points of its own.
  const shift = 0.1;
  const frame = (/** @type {number} */ number) =>
    asciiPly(
      Array.from({ length: 1200 }, (_, i) => {
        const random = (/** @type {number} */ k) =>
          Math.abs(Math.sin(12.9898 * i + 78.233 * number + k) * 43758.5453) % 1;
        const [u, v] = [2 * random(1), 2 * random(2)];
        const [x = 0, y = 0, z = 0] = [[u, v, 0], [u, 0, v], [0, u, v]][i % 3] ?? []; // prettier-ignore
        return [x - 1, y - 1 - shift * number, z - 1];
      }),
    );
  const poses = (/** @type {number} */ off) =>
    [0, 1, 2, 3].map((i) => `${i} 1 ${1 + shift * i + (i % 2) * off} 1 0 0 0 1\n`).join('');
  mkdirSync(join(folder, 'scans'));
  writeFiles(join(folder, 'scans'), { '0.ply': frame(0), '1.ply': frame(1), '2.ply': frame(2), '10.ply': frame(3) });
  const [truth = '', mine = '', short = ''] = writeFiles(folder, {
    'truth.tum': poses(0),
    'mine.tum': poses(0.04),
    'short.tum': '0 0 0 0 0 0 0 1\n',
  });
  const args = ['map-quality', '--frames', join(folder, 'scans'), truth, mine];
  const [exact, off] = JSON.parse((await scanstitch([...args, '--json'])).stdout);
  assert.equal(exact.residual.num_overlaps, 6);
  assert.ok(exact.residual.mean_residual < 0.005 && off.residual.mean_residual > exact.residual.mean_residual + 0.003);
  assert.ok(exact.mean_plane_variance < off.mean_plane_variance);
  assert.match((await scanstitch(args)).stdout, /^frames placed by +residual \(mm\) +mean map entropy/);
  const { status, stderr } = await scanstitch([...args, short]);
  assert.equal(status, 2);
  assert.match(stderr, /^short\.tum: There are 4 frames and 1 poses/);
  assert.match(
    (await scanstitch(['map-quality', '--frames', folder, truth])).stderr,
    /There is no PLY or PCD file in this folder/,
  );
});

test('in JavaScript: arrays of an evaluation', () => {
  const reference = engine.Trajectory.read(readFileSync(REFERENCE), 'reference.tum');
  const estimate = engine.Trajectory.read(readFileSync(ESTIMATE), 'estimate.tum', 'tum');
  assert.deepEqual([reference.length, reference.format, reference.has_orientations], [90, 'tum', true]);
  const evaluation = engine.evaluate(reference, estimate, { max_diff: 0.05, offset: -0.25, alignment: 'sim3' });
  const { num_matched, statistics, notes } = evaluation.summary();
  assert.ok(notes.every((note) => note.endsWith('.')));
  const errors = evaluation.errors();
  assert.equal(errors.length, num_matched);
  same(Math.sqrt(errors.reduce((sum, error) => sum + error ** 2, 0) / num_matched), statistics.rmse);
  for (const flat of [
    evaluation.reference_positions(),
    evaluation.estimate_positions(),
    evaluation.reference_roll_pitch_yaw(),
    evaluation.estimate_roll_pitch_yaw(),
  ]) {
    assert.equal(flat?.length, 3 * num_matched);
  }
  const [first = 0] = evaluation.matched_reference();
  assert.equal(evaluation.stamps()?.[0], reference.stamps()?.[first]);
  assert.equal(evaluation.distances()[0], 0);
  const wrong = /** @type {Partial<import('../../npm/index.js').EvaluationOptions>} */ ({ align: 'se3' });
  assert.throws(() => engine.evaluate(reference, estimate, wrong), /align/);
  for (const thing of [evaluation, reference, estimate]) thing.free();
});

test('the ground truth of another recording is named as such, and drift is not', async (t) => {
  const folder = temporaryFolder(t);
  /** Poses of a drive in the plane, as TUM. @param {number} phase @param {number} drift rad a pose */
  const drive = (phase, drift) => {
    let [x, y, heading] = [0, 0, 0];
    const lines = Array.from({ length: 150 }, (_, at) => {
      heading += 0.25 * Math.sin(0.3 * at + phase) ** 3 + drift;
      x += 0.3 * Math.cos(heading);
      y += 0.3 * Math.sin(heading);
      return `${at} ${x} ${y} 0 0 0 ${Math.sin(heading / 2)} ${Math.cos(heading / 2)}`;
    });
    return `${lines.join('\n')}\n`;
  };
  const files = { 'own.tum': drive(0, 0), 'other.tum': drive(1.4, 0), 'drifting.tum': drive(0, 0.004) };
  const [own, other, drifting] = writeFiles(folder, files);
  const notes = async (/** @type {string} */ estimate) => (await scanstitch(['evaluate', own ?? '', estimate])).stderr;
  assert.match(await notes(other ?? ''), /only \d+ % of its motions .* it is of another recording/);
  assert.doesNotMatch(await notes(drifting ?? ''), /another recording/);
});

test('100,000 poses are read and compared', () => {
  /** @param {number} index @param {number[]} shift */
  const line = (index, [east = 0, north = 0]) => {
    const [x, y] = [Math.cos(index / 5000) * 50, Math.sin(index / 5000) * 50];
    const noise = Math.sin(index * 12.9898) * 0.01;
    return `${index / 100} ${x + noise + east} ${y + north} ${noise} 0 0 ${Math.sin(index / 10000)} ${Math.cos(index / 10000)}\n`;
  };
  const read = (/** @type {string} */ name, /** @type {number[]} */ shift) => {
    const text = Array.from({ length: 100_000 }, (_, index) => line(index, shift)).join('');
    return engine.Trajectory.read(new TextEncoder().encode(text), name);
  };
  const [reference, estimate] = [read('a.tum', [0, 0]), read('b.tum', [3, 4])];
  const evaluate = (/** @type {'none' | 'sim3'} */ alignment) =>
    engine.evaluate(reference, estimate, { alignment, relation: 'full_transformation' });
  const [asItIs, aligned] = [evaluate('none'), evaluate('sim3')];
  assert.equal(asItIs.errors().length, 100_000);
  const { min, max } = asItIs.summary().statistics;
  assert.ok(Math.abs(min - 5) < 1e-12 && Math.abs(max - 5) < 1e-12, `${min} to ${max} m`);
  assert.ok(aligned.summary().statistics.max < 1e-12, 'the alignment takes the shift out');
  for (const thing of [asItIs, aligned, reference, estimate]) thing.free();
});

test('the stored result of evo: KITTI 00 against ORB-SLAM', { skip: skipWithoutData }, async () => {
  const args = ['KITTI_00_gt.txt', 'KITTI_00_ORB.txt'].map((name) => join(DATA, 'trajectories', name));
  const [{ statistics, drift }] = (await evaluateJson([...args, '--align', 'se3'])).estimates;
  same(statistics.rmse, 1.3034497145650266);
  assert.equal(drift.is_kitti, true);
});
