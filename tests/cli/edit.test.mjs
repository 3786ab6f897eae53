// @ts-check
/** `scanstitch edit`: steps taken, taken back and refused; files of steps that are wrong. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { BUILDING, driveLog } from './drive_log.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const NUM_SCANS = 66;
const HERE = { x: 0, y: 0, theta: 0 };
/** As if the first and the last scan had been taken at one place. */
const WRONG = { action: 'add_loop', target: 0, source: 65, T_target_source: HERE };
const TAKEN_OUT = { action: 'remove_loop', target: 65, source: 0 };

const LINE = {
  action: 'paint_line',
  cells: 'occupied',
  ends: [
    [1, -0.5],
    [1, 0.5],
  ],
  width: 0.2,
};
const CROP = {
  action: 'crop',
  corners: [
    [-0.5, -0.5],
    [4, 0.5],
  ],
};

/** @param {unknown[]} steps @param {number} [num_scans] */
function fileOf(steps, num_scans = NUM_SCANS) {
  return JSON.stringify({ scanstitch_steps: 1, num_scans, settings: { max_range: 20 }, steps });
}

const RESULTS = ['trajectory.tum', 'map.ply', 'report.json', 'map.pgm'];

/** @param {string} folder */
function resultsIn(folder, names = RESULTS) {
  return names.map((name) => readFileSync(join(folder, name)));
}

test('a loop that is put in unchecked makes all doubtful, is refused with checks, and taken out leaves nothing', async (t) => {
  const folder = temporaryFolder(t);
  const [log = '', unchecked = '', checked = '', undone = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, NUM_SCANS),
    'unchecked.json': fileOf([{ ...WRONG, unchecked: true }]),
    'checked.json': fileOf([WRONG]),
    'undone.json': fileOf([{ ...WRONG, unchecked: true }, TAKEN_OUT]),
  });
  const out = (/** @type {string} */ name) => join(folder, name);
  const edited = (/** @type {string} */ steps, /** @type {string} */ name, /** @type {string[]} */ ...also) =>
    scanstitch(['edit', log, steps, '--out', out(name), ...also]);
  await scanstitch(['reconstruct', log, '--set', 'max_range=20', '--out', out('plain')]);
  const plain = resultsIn(out('plain'));

  assert.equal((await edited(unchecked, 'wrong', '--workbench', '--mcap', '--g2o')).status, 0);
  const { frames } = JSON.parse(readFileSync(join(out('wrong'), 'report.json'), 'utf8'));
  const [first, last] = [frames[0].T_world_sensor, frames.at(-1).T_world_sensor];
  assert.ok(Math.hypot(first.x - last.x, first.y - last.y) < 2, 'the ends of the way are drawn together');
  for (const { status, reason } of frames) {
    assert.deepEqual(
      [status, reason],
      ['doubtful', 'a loop of the map was put in by hand, without a match of the scans'],
    );
  }

  // The workbench opens as the map was, and keeps itself.
  const bench = join(out('wrong'), 'workbench.zip');
  const again = await scanstitch(['reconstruct', bench, '--workbench', '--mcap', '--g2o', '--out', out('again')]);
  assert.equal(again.status, 0, again.stderr);
  const all = [...RESULTS, 'map.mcap', 'graph.g2o', 'workbench.zip'];
  assert.deepEqual(resultsIn(out('again'), all), resultsIn(out('wrong'), all));

  assert.match(readFileSync(join(out('again'), 'graph.g2o'), 'utf8'), /^VERTEX_SE2 0 .*\nEDGE_SE2 0 1 /s);

  const refused = await edited(checked, 'refused');
  assert.equal(refused.status, 2);
  assert.match(refused.stderr, /checked\.json: Step 1 was not taken: the scans do not match there: /);
  assert.deepEqual(resultsIn(out('refused')), plain);

  assert.equal((await edited(undone, 'undone')).status, 0);
  assert.deepEqual(resultsIn(out('undone')), plain);
});

test('the grid is painted, cropped and turned to the walls with all poses, and steps out of the map are told', async (t) => {
  const folder = temporaryFolder(t);
  const far = {
    action: 'paint_rectangle',
    cells: 'free',
    corners: [
      [90, 90],
      [91, 91],
    ],
  };
  const steps = [{ action: 'rotate', angle: 0.5 }, LINE, CROP];
  const [log = '', painted = '', turned = '', outside = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, NUM_SCANS),
    'painted.json': fileOf([LINE, CROP]),
    'turned.json': fileOf([...steps, { action: 'rotate' }, { action: 'leave_out', first: 60, last: 65 }]),
    'outside.json': fileOf([LINE, far]),
  });
  const out = (/** @type {string} */ name) => join(folder, name);
  const edited = async (/** @type {string} */ steps, /** @type {string} */ name) =>
    scanstitch(['edit', log, steps, '--workbench', '--mcap', '--out', out(name)]);

  // The first pose is the map's origin, and the corridor runs along x.
  assert.equal((await edited(painted, 'painted')).status, 0);
  const grid = gridIn(out('painted'));
  assert.deepEqual([grid.width, grid.height], [90, 20]);
  assert.deepEqual([grid.at(1, 0.3), grid.at(0.5, 0), grid.at(3.9, 0)], [0, 254, 254]);
  assert.equal(
    (await scanstitch(['reconstruct', join(out('painted'), 'workbench.zip'), '--out', out('again')])).status,
    0,
  );
  assert.deepEqual(resultsIn(out('again')), resultsIn(out('painted')));

  // Turned away and back by the walls, in front of which the robot starts.
  assert.equal((await edited(turned, 'turned')).status, 0);
  const yaml = readFileSync(join(out('turned'), 'map.yaml'), 'utf8');
  assert.match(yaml, /^origin: \[.*, 0\.0\]$/m);
  const heading = JSON.parse(readFileSync(join(out('turned'), 'report.json'), 'utf8')).frames[0].T_world_sensor.theta;
  assert.ok(Math.abs(heading) < 0.003, `${heading} rad from the corridor`);
  assert.match(
    readFileSync(join(out('turned'), 'report.json'), 'utf8'),
    /shapes painted 1; grid cropped 1; .*scans left out 6/,
  );

  const told = await edited(outside, 'outside');
  assert.equal(told.status, 2);
  assert.match(
    told.stderr,
    /outside\.json: Step 2 was not taken: no cell of the map lies in it: the map reaches from \(.*\) m\./,
  );
});

/** What map_server reads of a grid. @param {string} folder */
function gridIn(folder) {
  const yaml = readFileSync(join(folder, 'map.yaml'), 'utf8');
  const [, x0 = '', y0 = ''] = /origin: \[(.*?), (.*?),/.exec(yaml) ?? [];
  const pgm = readFileSync(join(folder, 'map.pgm'));
  const [width = 0, height = 0] = (pgm.toString('latin1').split('\n')[1] ?? '').split(' ').map(Number);
  const cells = pgm.subarray(pgm.length - width * height);
  const at = (/** @type {number} */ x, /** @type {number} */ y) => {
    const [column, row] = [x - Number(x0), y - Number(y0)].map((along) => Math.floor(along / 0.05));
    return cells[(height - 1 - (row ?? 0)) * width + (column ?? 0)];
  };
  return { width, height, at };
}

test('a grid without its scans is painted and cropped, and other steps are told', async (t) => {
  const folder = temporaryFolder(t);
  const [width, height] = [10, 8];
  const yaml =
    'image: map.pgm\nresolution: 0.5\norigin: [-1, -1, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n';
  const [map = '', , file = '', wrong = ''] = writeFiles(folder, {
    'map.yaml': yaml,
    'map.pgm': Buffer.concat([Buffer.from(`P5\n${width} ${height}\n255\n`), Buffer.alloc(width * height, 205)]),
    'a.json': fileOf(
      [
        // The cells with x from 0 to 1 and y from 0 to 0.5, then all up to x = 2, y = 1.
        {
          action: 'paint_rectangle',
          cells: 'occupied',
          corners: [
            [0, 0],
            [1, 0.5],
          ],
        },
        { action: 'rotate' },
        {
          action: 'crop',
          corners: [
            [-1, -1],
            [2, 1],
          ],
        },
        {
          action: 'paint_rectangle',
          cells: 'free',
          corners: [
            [50, 50],
            [51, 51],
          ],
        },
      ],
      0,
    ),
    'b.json': fileOf(
      [
        {
          action: 'paint_rectangle',
          cells: 'free',
          corners: [
            [0, 0],
            [0, 1],
          ],
        },
      ],
      0,
    ),
  });
  const out = join(folder, 'out');
  const { status, stderr } = await scanstitch(['edit', map, file, '--out', out, '--g2o']);
  assert.equal(status, 2, stderr);
  assert.match(stderr, /--g2o: not used, for a map is edited without its scans/);
  assert.match(stderr, /a\.json: Step 2 was not taken: it needs the scans that the map was made of/);
  assert.match(stderr, /a\.json: Step 4 was not taken: no cell of the map lies in it/);
  const picture = readFileSync(join(out, 'map.pgm'));
  const [header = '', columns, rows] = /^P5\n(?:#.*\n)*(\d+) (\d+)\n255\n/.exec(picture.toString('latin1')) ?? [];
  assert.deepEqual([columns, rows], ['6', '4']);
  const cells = [...picture.subarray(header.length)].map((grey) => (grey === 0 ? '#' : grey === 205 ? '?' : '.'));
  assert.equal(cells.join(''), '??????' + '??##??' + '??????' + '??????');
  assert.match(readFileSync(join(out, 'map.yaml'), 'utf8'), /origin: \[-1(\.0*)?, -1(\.0*)?, 0(\.0*)?\]/);

  const refused = await scanstitch(['edit', map, wrong, '--out', join(folder, 'none')]);
  assert.deepEqual(
    [refused.status, /Step 1: the rectangle has no size/.test(refused.stderr)],
    [1, true],
    refused.stderr,
  );
});

test('wrong steps are told with their place', async (t) => {
  const folder = temporaryFolder(t);
  const few = 6;
  const [log = ''] = writeFiles(folder, { 'drive.log': driveLog(BUILDING, 0, few) });
  for (const [contents, message] of /** @type {const} */ ([
    ['{', /s\.json: This is no JSON, and so no file of steps\./],
    ['{}', /s\.json: This is no file of steps: it has no "scanstitch_steps"\./],
    ['{"scanstitch_steps": 7}', /s\.json: These steps are of version 7; this program reads 1\./],
    [fileOf([{ ...TAKEN_OUT, scan: 3 }]), /s\.json: Step 1 has "scan", which no step remove_loop has\./],
    [fileOf([WRONG, { action: 'add_loop' }]), /s\.json: Step 2: "target" is a whole number from 0, not missing\./],
    [
      fileOf([WRONG, { action: 'bend' }]),
      /s\.json: Step 2: "action" is one of remove_loop, .*, leave_out, not "bend"\./,
    ],
    [fileOf([{ ...LINE, cells: 'grey' }]), /s\.json: Step 1: "cells" is occupied, free or unknown, not "grey"\./],
    [fileOf([{ ...LINE, width: null }]), /s\.json: Step 1: "width" is a number, not null\./],
    [fileOf([LINE]).replace('0.2', '1e999'), /s\.json: Step 1: "width" is a number, not Infinity\./],
    [fileOf([{ ...LINE, ends: [[0, 0]] }]), /s\.json: Step 1: "ends" has two points, not 1\./],
    [
      fileOf([{ ...CROP, corners: [[0, 0], [1]] }]),
      /s\.json: Step 1: Point 2 of "corners" is \[x, y\] in metres, not \[1\]\./,
    ],
    [
      fileOf([
        {
          ...CROP,
          corners: [
            [0, 0],
            [1, 'b'],
          ],
        },
      ]),
      /s\.json: Step 1: y of point 2 of "corners" is a number, not "b"\./,
    ],
    [
      fileOf(
        [
          {
            ...CROP,
            corners: [
              [3, 0],
              [3, 4],
            ],
          },
        ],
        few,
      ),
      /s\.json: Step 1: the rectangle has no size: both corners have x = 3\. Give two opposite corners\./,
    ],
    [
      fileOf([LINE, { action: 'leave_out', first: 3, last: 9 }], few),
      /s\.json: Step 2 names scan 9, and the recording has 6\./,
    ],
    [
      fileOf([{ ...WRONG, T_target_source: { ...HERE, y: '1' } }]),
      /s\.json: Step 1: "y" of "T_target_source" is a number, not "1"\./,
    ],
    [
      fileOf([{ ...TAKEN_OUT, target: 0, source: few }], few),
      /s\.json: Step 1 names scan 6, and the recording has 6\. Scans are counted/,
    ],
    [fileOf([], few + 1), /s\.json: The steps are for a recording of 7 scans, and this one has 6\./],
  ])) {
    const [steps = ''] = writeFiles(folder, { 's.json': contents });
    const { status, stderr } = await scanstitch(['edit', log, steps, '--out', join(folder, 'out')]);
    assert.equal(status, 1, stderr);
    assert.match(stderr, message);
  }
  const absent = await scanstitch(['edit', log]);
  assert.equal(absent.status, 1);
  assert.match(absent.stderr, /Name a recording and a file of steps/);
});

test('a map is anchored to known coordinates, with the residuals told, and pairs that contradict each other are named', async (t) => {
  const folder = temporaryFolder(t);
  // Turned by a right angle and shifted; the second place is 2 cm off.
  const pairs = [
    { map: [0, 0], world: [100, 200] },
    { map: [4, 0], world: [100, 204.02] },
  ];
  const scaled = pairs.map(({ map, world: [x = 0, y = 0] }) => ({ map, world: [x, 200 + 1.1 * (y - 200)] }));
  const [log = '', anchored = '', contradicting = '', wrong = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, NUM_SCANS),
    'anchored.json': fileOf([LINE, { action: 'anchor', pairs, accuracy: 0.02 }]),
    'contradicting.json': fileOf([{ action: 'anchor', pairs: scaled }]),
    'wrong.json': fileOf([{ action: 'anchor', pairs: [{ map: [0, 0], word: [1, 1] }] }]),
  });
  const out = join(folder, 'out');
  const edited = async (/** @type {string} */ steps) => scanstitch(['edit', log, steps, '--g2o', '--out', out]);

  const { status, stderr } = await edited(anchored);
  assert.equal(status, 0, stderr);
  const { frames, notes } = JSON.parse(readFileSync(join(out, 'report.json'), 'utf8'));
  const { x, y, theta } = frames[0].T_world_sensor;
  assert.ok(Math.hypot(x - 100, y - 200.01) < 1e-9 && Math.abs(theta - Math.PI / 2) < 1e-9, `${x} ${y} ${theta}`);
  assert.ok(notes.includes('The map was mended by hand: shapes painted 1; turned by 90.00°; anchored to known places, off by 0.010, 0.010 m (0.010 m rms).'), notes.join('\n')); // prettier-ignore
  // The grid, the graph and what was painted before lie there, too.
  assert.deepEqual([gridIn(out).at(99.8, 201.01), gridIn(out).at(100, 200.5)], [0, 254]);
  assert.match(
    readFileSync(join(out, 'graph.g2o'), 'utf8'),
    /^VERTEX_SE2 0 (99\.99999|100)\d*(\.0\d*)? 200\.0(1|09999)/,
  );

  const refused = await edited(contradicting);
  assert.equal(refused.status, 1);
  assert.match(
    refused.stderr,
    /the pairs do not fit each other to 0\.05 m: pair \d is off by 0\.21 m, and the places lie 10\.[56] % further apart/,
  );
  const read = await edited(wrong);
  assert.equal(read.status, 1);
  assert.match(read.stderr, /Step 1: Pair 1 has "word"; a pair is \{ "map": \[x, y\], "world": \[X, Y\] \}/);
});

test('a building plan is laid behind the map, with the residuals told, and written with its world file', async (t) => {
  const folder = temporaryFolder(t);
  const picture = Buffer.from('89504e470d0a1a0a0000000d4948445200000001000000010800000000', 'hex');
  // 5 cm a pixel, turned by a right angle; the third point is 3 cm off.
  const points = [
    { picture: [0, 0], map: [2, -4] },
    { picture: [400, 0], map: [2, 16] },
    { picture: [400, 200], map: [12.03, 16] },
  ];
  const plan = { action: 'lay_plan', picture: 'floor 1.png', points };
  const turn = { action: 'rotate', angle: Math.PI / 2 };
  const kept = (/** @type {unknown[]} */ steps, /** @type {unknown} */ base64) =>
    JSON.stringify({ ...JSON.parse(fileOf(steps)), pictures: { 'floor 1.png': base64 } });
  const [log = '', laid = '', off = '', few = '', damaged = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, NUM_SCANS),
    'laid.json': kept([plan, turn], picture.toString('base64')),
    'off.json': kept([plan, { action: 'remove_plan' }], picture.toString('base64')),
    'few.json': fileOf([{ ...plan, points: points.slice(1) }]),
    'damaged.json': kept([plan], '!'),
  });
  const edited = (/** @type {string} */ steps, /** @type {string} */ name) =>
    scanstitch(['edit', log, steps, '--workbench', '--out', join(folder, name)]);
  const { status, stderr } = await edited(laid, 'laid');
  assert.equal(status, 0, stderr);
  assert.match(stderr, /building plan floor 1\.png of 0\.0500 m a pixel laid, off by 0\.00\d, 0\.01\d, 0\.01\d m/);
  assert.deepEqual(readFileSync(join(folder, 'laid', 'plan.png')), picture);
  // The map was turned by a right angle after it: its rows run against the x axis, down is against y.
  const world = readFileSync(join(folder, 'laid', 'plan.pgw'), 'utf8')
    .trim()
    .split('\n')
    .map(Number);
  const near = (/** @type {number} */ at, /** @type {number} */ value, /** @type {number} */ by) =>
    assert.ok(Math.abs((world[at] ?? NaN) - value) < by, `${world}`);
  [-0.05, 0, 0, 0.05].forEach((value, at) => near(at, value, 2e-4));
  near(4, 4 - 0.025, 0.03);
  near(5, 2 + 0.025, 0.03);
  // What the workbench keeps is the same plan again.
  const again = await scanstitch([
    'reconstruct',
    join(folder, 'laid', 'workbench.zip'),
    '--out',
    join(folder, 'again'),
  ]);
  assert.equal(again.status, 0, again.stderr);
  const names = ['plan.png', 'plan.pgw', 'report.json', 'map.pgm'];
  assert.deepEqual(resultsIn(join(folder, 'again'), names), resultsIn(join(folder, 'laid'), names));

  assert.equal((await edited(off, 'off')).status, 0);
  assert.equal(existsSync(join(folder, 'off', 'plan.png')), false);
  for (const [steps, message] of /** @type {const} */ ([
    [few, /Step 1: the plan has 2 points/],
    [damaged, /The picture "floor 1\.png" is no base64/],
  ])) {
    const refused = await edited(steps, 'refused');
    assert.equal(refused.status, 1);
    assert.match(refused.stderr, message);
  }
});
