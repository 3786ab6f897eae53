// @ts-check
/** `scanstitch consistency`: right and wrong poses of a made-up room, and bad input. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { asciiPly, scanstitch, temporaryFolder } from './support.mjs';
import { greyPng, see, truthOf, WALK, walkFiles } from './depth_room.mjs';

const FILES = walkFiles();
const NUM_STEPS = WALK.length - 1;

/** @param {string} folder @param {Record<string, Uint8Array | string>} files */
function writeTree(folder, files) {
  for (const [path, contents] of Object.entries(files)) {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), contents);
  }
  return folder;
}

/** The walk, and a trajectory beside it. @param {import('node:test').TestContext} t @param {string} trajectory @param {string} [name] */
function recorded(t, trajectory, name = 'mine.tum') {
  const folder = temporaryFolder(t);
  const walk = writeTree(join(folder, 'walk'), FILES);
  const path = join(folder, name);
  writeFileSync(path, trajectory);
  return { walk, path };
}

/** @param {string[]} args @returns {Promise<import('../../npm/index.js').ConsistencyReport>} */
async function reportOf(args) {
  const { status, stdout, stderr } = await scanstitch(['consistency', ...args, '--json']);
  assert.equal(status, 0, stderr);
  return JSON.parse(stdout);
}

test('true poses agree in every step, and the table says so', async (t) => {
  const { walk, path } = recorded(t, truthOf(WALK));
  const { status, stdout } = await scanstitch(['consistency', walk, path]);
  assert.equal(status, 0);
  const lines = stdout.split('\n');
  assert.match(lines[0] ?? '', /^from +to +pixels +agree \(%\) +moved \(m\) +turned \(deg\) +step$/);
  assert.equal(lines.filter((line) => line.endsWith('agrees')).length, NUM_STEPS);
  assert.match(stdout, new RegExp(`^${NUM_STEPS} of ${NUM_STEPS} steps agree \\(100.0 %\\): 85 %`, 'm'));
  const { steps } = await reportOf([walk, path]);
  const second = steps[1];
  assert.ok(second?.share && second.share > 0.95 && second.num_visible > 20_000, JSON.stringify(second));
  const [from, to] = [WALK[1] ?? [0, 0, 0, 0], WALK[2] ?? [0, 0, 0, 0]];
  const moved = Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  assert.ok(Math.abs((second.translation ?? 0) - moved) < 1e-9);
  assert.ok(Math.abs((second.rotation ?? 0) - 0.04) < 1e-9);
});

test('one wrong pose spoils the two steps at it, and no other', async (t) => {
  const wrong = WALK.map(([x, y, z, yaw], index) => /** @type {const} */ ([x, y, index === 3 ? z + 0.3 : z, yaw]));
  const { walk, path } = recorded(t, truthOf(wrong));
  const { steps, num_agreeing } = await reportOf([walk, path]);
  assert.deepEqual(
    steps.map(({ agrees }) => agrees),
    [true, true, false, false, true],
  );
  assert.equal(num_agreeing, NUM_STEPS - 2);
  const standing = recorded(t, truthOf(WALK.map(() => WALK[0] ?? [0, 0, 0, 0])));
  assert.ok((await reportOf([standing.walk, standing.path])).num_agreeing < NUM_STEPS);
});

test('poses are found by number, by order, and under other axes', async (t) => {
  const lines = truthOf(WALK).split('\n');
  const numbered = recorded(t, lines.filter((_, index) => index !== 2).join('\n'));
  const { steps } = await reportOf([numbered.walk, numbered.path]);
  assert.deepEqual(
    steps.map(({ translation }) => translation === null),
    [false, true, true, false, false],
  );
  assert.match((await scanstitch(['consistency', numbered.walk, numbered.path])).stdout, /no pose$/m);

  // x right, y up, looking along -z; qw first.
  const opengl = WALK.map(([x, y, z, yaw]) => `${x},${y},${z},0,${Math.cos(yaw / 2)},0,${-Math.sin(yaw / 2)}`);
  const table = recorded(t, `x,y,z,qw,qx,qy,qz\n${opengl.join('\n')}\n`, 'poses.csv');
  const found = await reportOf([table.walk, table.path]);
  assert.equal(found.num_agreeing, NUM_STEPS, found.convention);
  assert.match(found.convention, /looking along -z/);
  const forced = await reportOf([table.walk, table.path, '--set', 'reference_axes=opencv']);
  assert.ok(forced.num_agreeing < NUM_STEPS);
});

test('the depth scale and the camera that are set count', async (t) => {
  const { walk, path } = recorded(t, truthOf(WALK));
  const wrong = await reportOf([walk, path, '--set', 'depth_scale=300']);
  assert.ok(wrong.num_agreeing < NUM_STEPS, 'metres that are three times too long');
  const near = await reportOf([walk, path, '--set', 'max_range=2']);
  const all = await reportOf([walk, path]);
  assert.ok((near.steps[0]?.num_visible ?? 0) < (all.steps[0]?.num_visible ?? 0));
});

test('a damaged image or one of another size is named, and its steps do not agree', async (t) => {
  const { walk, path } = recorded(t, truthOf(WALK));
  writeFileSync(join(walk, 'depth', '2.png'), readFileSync(join(walk, 'depth', '2.png')).subarray(0, 300));
  const [x, y, z, yaw] = WALK[4] ?? [0, 0, 0, 0];
  writeFileSync(join(walk, 'depth', '5.png'), greyPng(see([x, y, z, yaw], 96, 96).depth, 96));
  const { status, stdout, stderr } = await scanstitch(['consistency', walk, path]);
  assert.equal(status, 2);
  assert.match(stderr, /^depth\/2\.png: /m);
  assert.match(stderr, /^depth\/5\.png: The depth image has 96 x 96 pixels, the first one has 192 x 192/m);
  assert.match(stdout, new RegExp(`^1 of ${NUM_STEPS} steps agree`, 'm'));
});

test('bad input is refused in one line', async (t) => {
  const { walk, path } = recorded(t, truthOf(WALK));
  const folder = temporaryFolder(t);
  const [short, positions, text] = ['short.tum', 'positions.txt', 'text.tum'].map((name) => join(folder, name));
  writeFileSync(short ?? '', '10.5 0 0 0 0 0 0 1\n11.5 1 0 0 0 0 0 1\n');
  writeFileSync(positions ?? '', WALK.map(([x, y, z]) => `${x} ${y} ${z}\n`).join(''));
  writeFileSync(text ?? '', 'no trajectory\n');
  const clouds = writeTree(join(folder, 'clouds'), {
    '1.ply': asciiPly([
      [0, 0, 1],
      [1, 0, 1],
      [0, 1, 2],
    ]),
    '2.ply': asciiPly([
      [0, 0, 1],
      [1, 0, 1],
      [0, 1, 2],
    ]),
  });
  for (const [args, expected] of /** @type {[string[], RegExp][]} */ ([
    [[], /Name a recording and a trajectory/],
    [[walk], /Name a recording and a trajectory/],
    [[walk, short ?? ''], /short\.tum: The trajectory has 2 poses, but the recording has 6 frames/m],
    [[walk, positions ?? ''], /positions\.txt: The trajectory has positions alone/m],
    [[walk, text ?? ''], /text\.tum: /m],
    [[walk, join(folder, 'none.tum')], /none\.tum: There is no such file/],
    [[clouds, path], /There are no depth images/],
    [[walk, path, '--set', 'depth_scale=-1'], /depth_scale/],
    [[walk, path, '--set', 'max_range=-1'], /^scanstitch: (?!.*mine\.tum).*max_range/],
    [[walk, path, '--set', 'nothing=1'], /nothing/],
    [[walk, path, '--metric', 'x'], /consistency --help/],
  ])) {
    const { status, stdout, stderr } = await scanstitch(['consistency', ...args]);
    assert.equal(status, 1, `${args.join(' ')}: ${stderr}`);
    assert.match(stderr, expected);
    assert.equal(stdout, '');
    assert.doesNotMatch(stderr, /at .*\.js:\d+/);
  }
  for (const name of ['1', '2', '3', '4', '5']) rmSync(join(walk, 'depth', `${name}.png`));
  assert.equal((await scanstitch(['consistency', walk, path])).status, 1);
});
