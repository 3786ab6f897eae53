// @ts-check
/** `scanstitch localize`: a drive found in the map of another one, a map of another building, bad arguments. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { BUILDING, driveAt, driveLog, driveOdometry, HALL } from './drive_log.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

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
    const [x = 0, y = 0] = driveAt(8 + index);
    const off = Math.hypot(place.T_world_sensor.x - (x - 1), place.T_world_sensor.y - (y - 1));
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

test('where the odometry has a gap, the robot is searched for again', async (t) => {
  const folder = temporaryFolder(t);
  const rows = driveOdometry(8, 66);
  const [drive = '', later = '', whole = '', broken = ''] = writeFiles(folder, {
    'drive.log': driveLog(BUILDING, 0, 66),
    'later.log': driveLog(BUILDING, 8, 66),
    'whole.txt': rows.join(''),
    'broken.txt': rows.filter((_, index) => index < 40 || index > 43).join(''),
  });
  const maps = join(folder, 'maps');
  assert.equal((await scanstitch(['reconstruct', drive, '--out', maps])).status, 0);
  const located = async (/** @type {string} */ odometry) => {
    const args = ['localize', join(maps, 'map.yaml'), later, '--odometry', odometry, '--out', folder, '--json'];
    return JSON.parse((await scanstitch(args)).stdout).scans[41];
  };
  const [followed, afterGap] = [await located(whole), await located(broken)];
  assert.deepEqual([followed.status, followed.is_known_at_once], ['good', true]);
  assert.notDeepEqual([afterGap.status, afterGap.is_known_at_once], ['good', true]);
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
