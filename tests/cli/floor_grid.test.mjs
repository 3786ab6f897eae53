// @ts-check
/** `reconstruct --grid`: a map in space flattened to a grid, in a room whose furniture is known; what has none; bad arguments. */
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { walkFiles } from './depth_room.mjs';
import { BUILDING, driveLog } from './drive_log.mjs';
import { scanstitch, temporaryFolder } from './support.mjs';

const [OCCUPIED, FREE, UNKNOWN] = [0, 254, 205];

/** @param {import('node:test').TestContext} t */
function walkIn(t) {
  const folder = temporaryFolder(t);
  for (const [path, contents] of Object.entries(walkFiles())) {
    mkdirSync(dirname(join(folder, 'walk', path)), { recursive: true });
    writeFileSync(join(folder, 'walk', path), contents);
  }
  return folder;
}

/** What map_server reads of a grid. @param {string} yaml its path */
function gridOf(yaml) {
  const text = readFileSync(yaml, 'utf8');
  const [, picture = ''] = /^image: (.*)$/m.exec(text) ?? [];
  const [, x0 = '', y0 = '', yaw = ''] = /^origin: \[(.*?), (.*?), (.*?)\]$/m.exec(text) ?? [];
  const pgm = readFileSync(join(dirname(yaml), picture));
  const [width = 0, height = 0] = (pgm.toString('latin1').split('\n')[1] ?? '').split(' ').map(Number);
  const cells = pgm.subarray(pgm.length - width * height);
  /** x ahead of the first camera, y to its left (m). @param {number} x @param {number} y */
  const at = (x, y) => {
    const [column = 0, row = 0] = [x - Number(x0), y - Number(y0)].map((along) => Math.floor(along / 0.05));
    return cells[(height - 1 - row) * width + column];
  };
  /** Whether one of the cells around a place is occupied. @param {number} x @param {number} y */
  const isNear = (x, y) =>
    [-0.05, 0, 0.05].some((dx) => [-0.05, 0, 0.05].some((dy) => at(x + dx, y + dy) === OCCUPIED));
  return { at, isNear, text, yaw: Number(yaw) };
}

test('walls and furniture in the band are occupied, what rays pass is free, and what hangs above is neither', async (t) => {
  const folder = walkIn(t);
  const gridIn = async (/** @type {string} */ name, /** @type {string[]} */ ...band) => {
    const path = join(folder, name);
    const args = ['reconstruct', join(folder, 'walk'), '--out', join(folder, 'out'), '--workers', '0', '--grid', path];
    const { status, stdout, stderr } = await scanstitch([...args, ...band]);
    assert.equal(status, 0, stderr);
    // The camera is 1.2 m over the floor.
    assert.match(
      stderr,
      /The floor is 1\.(19|2\d) m below the first frame; the grid shows what stands 0\.\d+ to [\d.]+ m/,
    );
    assert.match(stdout, /^Grid of \d+ x \d+ cells of 0\.05 m, written to /m);
    return gridOf(path);
  };
  const room = await gridIn('room.yaml', '--band', '0.2:1.6');
  assert.equal(room.yaw, 0);
  assert.match(room.text, /^# Flattened from 0\.2 to 1\.6 m over the floor\. .* of the trajectory\.$/m);
  // The wall ahead, a chest to the right and a shelf at 1.0 to 1.4 m; the floor between.
  assert.ok(room.isNear(3.2, 0.5) && room.isNear(1.3, -0.8) && room.isNear(2.6, -0.3), 'occupied');
  for (const [x, y] of /** @type {const} */ ([
    [1.5, 0.2],
    [2.3, 0.1],
    [1.6, -0.2],
    [2, 0.6],
  ])) {
    assert.equal(room.at(x, y), FREE, `(${x}, ${y})`);
  }
  // The chest is 0.9 m high: rays over it tell nothing of what stands in it or behind it.
  assert.notEqual(room.at(1.7, -0.8), FREE, 'within the chest');
  assert.equal(room.at(2.4, -0.95), UNKNOWN, 'behind the chest');
  // The cupboard at 1.8 m and more hangs over the band.
  assert.ok(!room.isNear(2.5, 0.2));

  // A band below the shelf, of the chest; and by default, with the picture beside it.
  const low = await gridIn('low.yaml', '--band', '0.1:0.8');
  assert.ok(!low.isNear(2.6, -0.3) && low.isNear(1.3, -0.8));
  const usual = await gridIn('usual.yml');
  assert.match(usual.text, /^image: usual\.pgm$/m);
  assert.match(usual.text, /Flattened from 0\.2 to 1\.8 m/);
});

test('bad bands, names and recordings without a floor are named', async (t) => {
  const folder = temporaryFolder(t);
  const log = join(folder, 'drive.log');
  writeFileSync(log, driveLog(BUILDING, 0, 12));
  const run = (/** @type {string[]} */ ...args) =>
    scanstitch(['reconstruct', log, '--out', join(folder, 'out'), ...args]);
  for (const band of ['1.8:0.2', '0:1', '1', 'a:b', '0.2:1:2', '0.2:']) {
    const { status, stderr } = await run('--grid', 'map.yaml', '--band', band);
    assert.equal(status, 1);
    assert.match(stderr, /--band .*: give two heights over the floor, the lower first, as 0\.2:1\.8 \(m\)\./);
  }
  assert.match((await run('--band', '0.2:1')).stderr, /--band is the heights over the floor that --grid FILE shows\./);
  assert.match((await run('--grid', 'map.png')).stderr, /--grid map\.png: the name ends in \.yaml; its picture is/);
  const planar = await run('--grid', join(folder, 'map.yaml'));
  assert.equal(planar.status, 2);
  assert.match(planar.stderr, /--grid .*map\.yaml: not used, for the grid of planar scans is map\.pgm and map\.yaml\./);
});
