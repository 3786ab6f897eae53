// @ts-check
/** `scanstitch edit`: steps taken, taken back and refused; files of steps that are wrong. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { BUILDING, driveLog } from './drive_log.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

const NUM_SCANS = 66;
const HERE = { x: 0, y: 0, theta: 0 };
/** As if the first and the last scan had been taken at one place. */
const WRONG = { action: 'add_loop', target: 0, source: 65, T_target_source: HERE };
const TAKEN_OUT = { action: 'remove_loop', target: 65, source: 0 };

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

test('wrong steps are told with their place', async (t) => {
  const folder = temporaryFolder(t);
  const few = 6;
  const [log = ''] = writeFiles(folder, { 'drive.log': driveLog(BUILDING, 0, few) });
  for (const [contents, message] of /** @type {const} */ ([
    ['{', /s\.json: This is no JSON, and so no file of steps\./],
    ['{}', /s\.json: This is no file of steps: it has no "scanstitch_steps"\./],
    ['{"scanstitch_steps": 7}', /s\.json: These steps are of version 7; this program reads 1\./],
    [fileOf([{ ...TAKEN_OUT, scan: 3 }]), /s\.json: Step 1 has "scan", which no step has\./],
    [fileOf([WRONG, { action: 'bend' }]), /s\.json: Step 2: "target" is a whole number from 0, not missing\./],
    [fileOf([{ ...WRONG, action: 'bend' }]), /s\.json: Step 1: "action" is remove_loop or add_loop, not "bend"\./],
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
