// @ts-check
/** The run on several threads, with threads made up: threads that die, and a registrar in a thread of its own. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';
import { SpatialRun, WorkerDied } from '../../npm/run/spatial_run.js';
import { Recorder, fakes, jobs, runOf, upTo } from './spatial_fakes.mjs';

/** @typedef {import('../../npm/run/frame_queue.js').Job} Job */
/** @typedef {import('../../npm/run/spatial_run.js').RunEvent} RunEvent */

test('a worker that dies is replaced and its frame tried again', async () => {
  const died = (/** @type {number} */ index, /** @type {number} */ attempt) =>
    index === 4 && attempt === 1 ? new WorkerDied('gone') : null;
  const { preparers, seen } = fakes(2, { fails: died });
  const { registrar, run, events } = runOf(preparers, 8);
  assert.deepEqual(await run.run(), { state: 'done', numRegistered: 8, problems: [] });
  assert.deepEqual(registrar.registered, upTo(8));
  assert.equal(seen.replaced, 1);
  assert.deepEqual(
    events.filter(({ type }) => type === 'replaced'),
    [{ type: 'replaced', index: 4, name: '4.png' }],
  );
});

test('a frame on which two workers die is told and left out', async () => {
  const { preparers, seen } = fakes(2, { fails: (index) => (index === 4 ? new WorkerDied('gone') : null) });
  const { run } = runOf(preparers, 8);
  const { problems, numRegistered } = await run.run();
  assert.equal(numRegistered, 7);
  assert.deepEqual(
    problems.map(({ index, error }) => [index, error.name]),
    [[4, 'WorkerDied']],
  );
  assert.equal(seen.replaced, 2);
});

test('workers that cannot be replaced: the others do it; none left is an error, and what is done is kept', async () => {
  const replaced = async () => {
    throw new Error('no memory');
  };
  const once = fakes(3, {
    fails: (index, attempt) => (index === 2 && attempt === 1 ? new WorkerDied('x') : null),
    replaced,
  });
  const { run } = runOf(once.preparers, 9);
  assert.equal((await run.run()).numRegistered, 9);

  const always = fakes(2, { fails: (index) => (index >= 5 ? new WorkerDied('x') : null), replaced });
  const { registrar: kept, run: doomed } = runOf(always.preparers, 9);
  await assert.rejects(doomed.run(), /No worker can be started/);
  assert.deepEqual(kept.registered, upTo(5));
});

test('a registrar in a thread of its own has the next frame at hand, and places them in order', async () => {
  const { preparers } = fakes(2, { milliseconds: () => 0 });
  /** @type {(() => void)[]} */
  const waiting = [];
  const registrar = new (class extends Recorder {
    ahead = 2;
    mostWaiting = 0;
    /** @override @param {Uint8Array} bytes */
    async place(bytes) {
      /** @type {Promise<void>} */
      const turn = new Promise((resolve) => waiting.push(resolve));
      this.mostWaiting = Math.max(this.mostWaiting, waiting.length);
      await turn;
      return super.place(bytes);
    }
  })();
  const refused = Object.assign(new Error('5.png: no'), { name: 'ScanstitchError' });
  registrar.refused.set(5, refused);
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(12));
  const running = run.run();
  // It answers once it has two frames, or the last one.
  for (let turns = 0; registrar.registered.length < 11; turns += 1) {
    assert.ok(turns < 60_000, `it hangs after ${registrar.registered.length} frames`);
    await sleep(1);
    if (waiting.length === 2 || registrar.registered.length === 10) waiting.shift()?.();
  }
  const { problems, numRegistered } = await running;
  assert.equal(registrar.mostWaiting, 2);
  assert.deepEqual([numRegistered, problems.map(({ index }) => index)], [11, [5]]);
  assert.deepEqual(
    registrar.registered,
    upTo(12).filter((index) => index !== 5),
  );
});

test('a registrar that breaks with the next frame at hand ends the run', async () => {
  const { preparers } = fakes(2);
  const registrar = Object.assign(new Recorder(), {
    ahead: 2,
    place: async () => {
      await sleep(20);
      throw new WorkerDied('gone');
    },
  });
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(5));
  await assert.rejects(run.run(), /gone/);
});

test('a frame that waited in a thread that died is not to blame', async () => {
  const [sick] = fakes(1).preparers;
  assert.ok(sick);
  let [numReplaced, mostAtHand] = [0, 0];
  /** @type {{ index: number, resolve: (prepared: import('../../npm/run/frame_queue.js').Prepared) => void, reject: (error: Error) => void }[]} */
  let atHand = [];
  const work = async () => {
    await sleep(2);
    mostAtHand = Math.max(mostAtHand, atHand.length);
    const [first, ...others] = atHand;
    atHand = others;
    if (first?.index !== 4) first?.resolve({ bytes: Uint8Array.of(first.index), milliseconds: {} });
    else {
      first.reject(new WorkerDied('gone'));
      for (const { reject } of others) reject(new WorkerDied('gone', true));
      atHand = [];
    }
  };
  const preparer = {
    ...sick,
    ahead: 2,
    prepare: (/** @type {Job} */ { index }) =>
      new Promise((resolve, reject) => {
        atHand.push({ index, resolve, reject });
        void work();
      }),
    replace: () => {
      numReplaced += 1;
    },
  };
  const { registrar, run, events } = runOf([preparer], 9);
  const { problems } = await run.run();
  assert.equal(mostAtHand, 2);
  assert.deepEqual(
    problems.map(({ index }) => index),
    [4],
  );
  assert.deepEqual(
    registrar.registered,
    upTo(9).filter((index) => index !== 4),
  );
  assert.ok(numReplaced >= 2);
  const told = events.flatMap((event) => (event.type === 'replaced' ? [event.index] : []));
  assert.deepEqual(told, [4]);
});
