// @ts-check
/** What is new or gone between two recordings that make one map. */
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { BUILDING, driveLog, driveOdometry } from './drive_log.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

/** The building with a cupboard at the wall of its corridor, 0.8 m wide and 0.5 m deep. */
const WITH_CUPBOARD = BUILDING.replace('0,0 6,0', '0,0 3.6,0 3.6,0.5 4.4,0.5 4.4,0 6,0');
const NUM_SCANS = 90;

test('a cupboard that a second recording shows is new, one that it lacks is gone', async (t) => {
  const folder = temporaryFolder(t);
  const rows = driveOdometry(0, NUM_SCANS);
  const both = [...rows, ...rows.map((row, scan) => row.replace(/^\d+/, String(NUM_SCANS + scan)))].join('');
  const [bare, cupboard] = [BUILDING, WITH_CUPBOARD].map((building) => driveLog(building, 0, NUM_SCANS));
  for (const [first, second, kind] of [
    [bare, cupboard, 'new'],
    [cupboard, bare, 'gone'],
  ]) {
    const [monday = '', tuesday = '', odometry = ''] = writeFiles(folder, {
      'monday.log': first ?? '',
      'tuesday.log': second ?? '',
      'odometry.txt': both,
    });
    const out = join(folder, `${kind}`);
    const run = await scanstitch(['reconstruct', monday, tuesday, '--odometry', odometry, '--out', out]);
    assert.match(run.stderr, /joins the map of the recordings before it/, run.stderr);
    const [of] = JSON.parse(readFileSync(join(out, 'changes.json'), 'utf8'));
    assert.equal(of.recording, 1);
    assert.deepEqual(
      of.changes.map((/** @type {any} */ change) => change.kind),
      [kind],
    );
    // Its front, in the frame of the first robot at (1, 1).
    const [change] = of.changes;
    assert.ok(Math.hypot(change.middle[0] - 3, change.middle[1] + 0.5) < 0.2, `at ${change.middle}`);
    assert.ok(change.size > 0.5 && change.size < 1, `${change.size} m`);
    assert.match(
      run.stderr,
      kind === 'new' ? /1 thing is new, 0 things are gone/ : /0 things are new, 1 thing is gone/,
    );
  }
  const alone = join(folder, 'alone');
  await scanstitch(['reconstruct', join(folder, 'monday.log'), '--out', alone]);
  assert.ok(existsSync(join(alone, 'report.json')) && !existsSync(join(alone, 'changes.json')));
});
