// @ts-check
/** `scanstitch localize`: a drive found in the map of another one, a map of another building, bad arguments. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** Corners of a building: a corridor with two different recesses that bends into a room. */
const BUILDING = '0,0 6,0 6,-1 7.5,-1 7.5,0 12,0 12,6 9,6 9,4 10,4 10,2 4,2 4,3.2 2.2,3.2 2.2,2 0,2';
/** A round hall of another one. */
const HALL = '3,-4 8,-3 10,1 8,6 3,7 -1,5 -3,1 -1,-3';

/**
 * A robot that drives 20 cm a scan ahead and then to the left, as CARMEN logs it, with its odometry.
 * @param {string} building @param {number} first @param {number} last
 */
function driveLog(building, first, last) {
  const corners = building.split(' ').map((corner) => corner.split(',').map(Number));
  const walls = corners.map((corner, index) => [corner, corners[(index + 1) % corners.length] ?? corner]);
  /** @param {number[]} at @param {number} angle */
  const rangeFrom = ([x = 0, y = 0], angle) => {
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    const hits = walls.map(([[ax = 0, ay = 0] = [], [bx = 0, by = 0] = []]) => {
      const determinant = dx * (by - ay) - dy * (bx - ax);
      const range = ((ax - x) * (by - ay) - (ay - y) * (bx - ax)) / determinant;
      const share = ((ax - x) * dy - (ay - y) * dx) / determinant;
      return range > 0 && share >= 0 && share <= 1 ? range : Infinity;
    });
    return Math.min(81, ...hits);
  };
  const lines = Array.from({ length: last - first }, (_, index) => {
    const way = 0.2 * (first + index);
    const [x, y, heading] = way < 9.5 ? [1 + way, 1, 0] : [10.9, 1 + way - 9.5, Math.PI / 2];
    const turn = way < 9.5 ? Math.max(0, way - 8.5) * (Math.PI / 2) : heading;
    const ranges = Array.from({ length: 180 }, (_, beam) => {
      return rangeFrom([x, y], turn + ((beam - 90) * Math.PI) / 180).toFixed(3);
    });
    const pose = `${x.toFixed(3)} ${y.toFixed(3)} ${turn.toFixed(4)}`;
    return `FLASER 180 ${ranges.join(' ')} ${pose} ${pose} ${index} robot ${index}`;
  });
  return `${lines.join('\n')}\n`;
}

test('a drive is found in the map of another one, and not in that of another building', async (t) => {
  const folder = temporaryFolder(t);
  const [drive = '', later = '', hall = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, 66),
    'later.log': driveLog(BUILDING, 8, 66),
    'hall.log': driveLog(HALL, 0, 30),
  });
  const maps = join(folder, 'maps');
  assert.equal((await scanstitch(['reconstruct', drive, '--out', maps])).status, 0);
  const out = join(folder, 'where');
  // So short a log does not show whose its poses are.
  const asked = ['localize', join(maps, 'map.yaml'), later, '--out', out, '--json'];
  const alone = JSON.parse((await scanstitch(asked)).stdout);
  assert.equal(alone.verdict, 'undecided', 'without odometry nothing is certain');
  const found = await scanstitch([...asked, '--set', 'odometry=log']);
  const report = JSON.parse(found.stdout);
  assert.equal(report.verdict, 'found', report.summary);
  assert.deepEqual(report, JSON.parse(readFileSync(join(out, 'report.json'), 'utf8')));
  // The map's world is the frame of the first robot, at (1, 1).
  const good = report.scans.filter((/** @type {any} */ scan) => scan.status === 'good');
  assert.ok(good.length > 30, `${good.length} good`);
  for (const { index, place } of good) {
    const way = 0.2 * (8 + index);
    const [x, y] = way < 9.5 ? [way, 0] : [9.9, way - 9.5];
    const off = Math.hypot(place.T_world_sensor.x - x, place.T_world_sensor.y - y);
    assert.ok(off < 0.15, `scan ${index} is off by ${off} m`);
  }
  const tum = readFileSync(join(out, 'trajectory.tum'), 'utf8').trim();
  const lines = tum.split('\n').filter((line) => !line.startsWith('#'));
  assert.equal(lines.length, good.length);
  assert.equal(readFileSync(join(out, 'localization.png')).subarray(1, 4).toString(), 'PNG');

  const other = await scanstitch(['localize', join(maps, 'map.yaml'), hall, '--out', out]);
  assert.equal(other.status, 2);
  assert.match(other.stderr, /30 of 30 scans have no certain place/);
  assert.match(other.stdout, /Not in this map|Undecided/);
});

test('arguments that cannot be used have their own message', async (t) => {
  const [log = '', picture = '', yaml = ''] = writeFiles(temporaryFolder(t), {
    'drive.log': driveLog(BUILDING, 0, 2),
    'floor.pgm': 'P2 2 2 255 254 254 254 254\n',
    'map.yaml':
      'image: nowhere.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n',
  });
  /** @type {[string[], RegExp][]} */
  const cases = [
    [[], /Name a map and a recording/],
    [[yaml], /Name a map and a recording/],
    [[yaml, log], /nowhere\.pgm/],
    [[picture, log], /needs --resolution/],
    [[picture, log, '--resolution=-1'], /-1/],
    [[picture, log, '--resolution', '0.05'], /no walls or no free space/],
  ];
  for (const [args, said] of cases) {
    const { status, stderr } = await scanstitch(['localize', ...args]);
    assert.equal(status, 1);
    assert.match(stderr, said, args.join(' '));
  }
});
