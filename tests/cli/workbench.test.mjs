// @ts-check
/** Workbench files: what they keep, and those with which something is wrong. That a map comes out as it was: edit.test.mjs. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { strToU8, zipSync } from 'fflate';
import { openRecording } from '../../npm/recording_reader.js';
import { workbenchFiles } from '../../npm/report/workbench.js';
import { ROOM_FILES } from './support.mjs';

const STEP = /** @type {const} */ ({ action: 'remove_loop', target: 2, source: 0 });
const KEPT = { num_scans: 2, settings: { max_range: 9 }, steps: [STEP] };

/** A log between two scans, in an order that no names tell, with a trajectory whose name says nothing. */
function files() {
  const scan = (/** @type {string} */ path, /** @type {string} */ text, isLog = false) => ({
    path,
    bytes: strToU8(text),
    isLog,
  });
  return workbenchFiles({
    ...KEPT,
    table: 'ranges=1:3',
    scans: [
      scan('b/9.ply', ROOM_FILES['1.ply'] ?? ''),
      scan('drive.txt', '1 2 3\n', true),
      scan('a/1.ply', ROOM_FILES['0.ply'] ?? ''),
    ],
    reference: null,
    odometry: scan('way.txt', '0 0 0 0\n1 1 0 0\n'),
  });
}

const opened = (/** @type {Record<string, Uint8Array>} */ content) =>
  openRecording([{ path: 'my.zip', blob: new Blob([zipSync(content)]) }]);

test('scans in their order, what lies beside them, settings and steps', async () => {
  const recording = await opened(files());
  const { kind, scans, logs, odometry, reference, mended, notes } = recording;
  assert.deepEqual(
    { kind, scans, logs, odometry, reference, notes },
    {
      kind: 'planar_scans',
      scans: ['recording/b/9.ply', 'recording/drive.txt', 'recording/a/1.ply'],
      logs: ['recording/drive.txt'],
      odometry: 'recording/way.txt',
      reference: [],
      notes: [],
    },
  );
  assert.deepEqual(mended, { ...KEPT, table: 'ranges=1:3' });
  assert.equal(String(await recording.read('recording/drive.txt')), String(strToU8('1 2 3\n')));
});

test('a workbench that is wrong is told, and not taken for something else', async () => {
  const parts = JSON.parse(Buffer.from(files()['workbench.json'] ?? []).toString());
  const changed = (/** @type {object} */ changes) => ({
    ...files(),
    'workbench.json': strToU8(JSON.stringify({ ...parts, ...changes })),
  });
  const { 'map.steps.json': _, ...withoutSteps } = files();
  for (const [content, said] of /** @type {const} */ ([
    [changed({ scanstitch_workbench: 7 }), /it is a workbench of version 7, and this program reads 1/],
    [
      changed({ scans: ['recording/none.ply'] }),
      /it has no file "recording\/none\.ply", which it names\. Save the workbench once more/,
    ],
    [changed({ scans: 'all' }), /lists no scans/],
    [{ ...files(), 'workbench.json': strToU8('{"scanstitch_workbench": ') }, /it is no JSON/],
    [withoutSteps, /has no file "map\.steps\.json"/],
    [{ ...files(), 'map.steps.json': strToU8('{}') }, /it has no "scanstitch_steps"/],
  ])) {
    const { kind, notes } = await opened(content);
    assert.equal(kind, 'nothing');
    assert.match(notes.map(({ file, reason }) => `${file}: ${reason}`).join('\n'), said);
    assert.match(notes[0]?.file ?? '', /my\.zip/);
  }
  // A file of that name that is something else does not make one.
  const { kind } = await opened({ ...ROOM, 'workbench.json': strToU8('{"tools": []}') });
  assert.equal(kind, 'planar_scans');
});

const ROOM = Object.fromEntries(Object.entries(ROOM_FILES).map(([name, text]) => [name, strToU8(text)]));
