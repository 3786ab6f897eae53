// @ts-check
/** The run on several threads, with threads made up: order, bounds, errors, stops. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';
import { Frame } from '../../npm/run/frame_queue.js';
import { SpatialRun, WorkerDied } from '../../npm/run/spatial_run.js';
import { Recorder, fakes, jobs, runOf, upTo } from './spatial_fakes.mjs';

/** @typedef {import('../../npm/run/frame_queue.js').Job} Job */
/** @typedef {import('../../npm/run/spatial_run.js').RunEvent} RunEvent */

test('frames are placed in order, whatever order they are prepared in', async () => {
  const { preparers, seen } = fakes(4, { milliseconds: (index) => ((index * 7) % 5) * 3 });
  const { registrar, run, events } = runOf(preparers, 20);
  assert.deepEqual(await run.run(), { state: 'done', numRegistered: 20, problems: [] });
  assert.deepEqual(registrar.registered, upTo(20));
  assert.deepEqual([...seen.decodeConfigs], ['as 0.png']);
  const registered = events.flatMap((event) => (event.type === 'registered' ? [event] : []));
  assert.deepEqual(
    registered.map(({ index }) => index),
    upTo(20),
  );
  assert.equal(events.filter(({ type }) => type === 'prepared').length, 20);
  const [first] = registered;
  assert.deepEqual(Object.keys(first?.milliseconds ?? {}), ['prepare', 'register']);
});

test('preparing runs ahead, but no further than the bound', async () => {
  const { preparers, seen } = fakes(3);
  const registrar = new Recorder();
  registrar.milliseconds = 10;
  let ahead = 0;
  const run = new SpatialRun({
    registrar,
    preparers,
    onEvent: () => {
      ahead = Math.max(ahead, seen.started.length - registrar.registered.length);
    },
  });
  run.add(jobs(30));
  await run.run();
  assert.deepEqual(registrar.registered, upTo(30));
  // One more is being registered.
  assert.ok(ahead > 3 && ahead <= 3 + 4 + 1, `${ahead} frames ahead`);
});

test('frames to come are prepared with what the registrar says last', async () => {
  const { preparers } = fakes(1);
  /** @type {[number, string][]} */
  const used = [];
  const noting = preparers.map((preparer) => ({
    ...preparer,
    prepare: (/** @type {Parameters<typeof preparer.prepare>} */ ...args) => {
      used.push([args[0].index, args[1]]);
      return preparer.prepare(...args);
    },
  }));
  const registrar = new (class extends Recorder {
    /** @override @param {Uint8Array} bytes */
    async place(bytes) {
      const progress = await super.place(bytes);
      return progress.done === 2 ? { ...progress, decodeConfig: 'as decided' } : progress;
    }
  })();
  const run = new SpatialRun({ registrar, preparers: noting, maxInFlight: 1 });
  run.add(jobs(5));
  await run.run();
  assert.deepEqual(
    used.map(([, decodeConfig]) => decodeConfig),
    ['as 0.png', 'as 0.png', 'as decided', 'as decided', 'as decided'],
  );
});

test('several preparers work at the same time', async () => {
  let [working, most] = [0, 0];
  const preparers = fakes(4, { milliseconds: () => 20 }).preparers.map((preparer) => ({
    ...preparer,
    prepare: async (/** @type {Parameters<typeof preparer.prepare>} */ ...given) => {
      most = Math.max(most, ++working);
      return preparer.prepare(...given).finally(() => working--);
    },
  }));
  const { registrar, run } = runOf(preparers, 16);
  await run.run();
  assert.equal(most, 4);
  assert.deepEqual(registrar.registered, upTo(16));
});

test('an error of one frame is told, the others go on', async () => {
  const { preparers, seen } = fakes(2, { fails: (index) => (index === 3 ? new Error('3.png is cut off') : null) });
  const { registrar, run } = runOf(preparers, 8);
  const refused = Object.assign(new Error('5.png: no'), { name: 'ScanstitchError' });
  registrar.refused.set(5, refused);
  const { state, problems } = await run.run();
  assert.equal(state, 'done');
  assert.deepEqual(registrar.registered, [0, 1, 2, 4, 6, 7]);
  assert.deepEqual(
    problems.map(({ index, name, error }) => [index, name, error.message]),
    [
      [3, '3.png', '3.png is cut off'],
      [5, '5.png', '5.png: no'],
    ],
  );
  assert.equal(seen.replaced, 0);
});

test('the first frame that can be looked at begins', async () => {
  const { preparers, seen } = fakes(2);
  const { registrar, run } = runOf(preparers, 5);
  registrar.unreadable.set(0, new Error('0.png is cut off'));
  registrar.unreadable.set(1, new Error('1.png holds no depth'));
  const { problems } = await run.run();
  assert.equal(registrar.begun, '2.png');
  assert.deepEqual(registrar.registered, [2, 3, 4]);
  assert.deepEqual(
    problems.map(({ index }) => index),
    [0, 1],
  );
  assert.ok(!seen.started.includes(0) && !seen.started.includes(1));
});

test('no frame can be looked at: all are told', async () => {
  const { preparers } = fakes(2);
  const { registrar, run } = runOf(preparers, 4);
  for (const index of upTo(4)) registrar.unreadable.set(index, new Error('no'));
  const outcome = await run.run();
  assert.equal(outcome.numRegistered, 0);
  assert.equal(outcome.problems.length, 4);
});

test('a stop answers at once and keeps what is done; the run goes on later', async () => {
  const { preparers } = fakes(2, { milliseconds: (index) => (index < 3 ? 1 : index === 3 ? 5000 : 2) });
  const registrar = new Recorder();
  const controller = new AbortController();
  const onEvent = (/** @type {RunEvent} */ event) => {
    if (event.type === 'registered' && event.index === 2) controller.abort();
  };
  const run = new SpatialRun({ registrar, preparers, onEvent });
  run.add(jobs(8));
  const outcome = await run.run(controller.signal);
  assert.equal(outcome.state, 'stopped');
  assert.equal(outcome.numRegistered, 3);
  assert.deepEqual(outcome.problems, []);

  const quick = fakes(2);
  preparers.forEach((preparer, i) => Object.assign(preparer, quick.preparers[i]));
  assert.deepEqual(await run.run(), { state: 'done', numRegistered: 8, problems: [] });
  assert.deepEqual(registrar.registered, upTo(8));
});

test('a stop while nobody obeys it answers before anybody does, and nothing is placed twice', async () => {
  let obey = () => {};
  const obeyed = /** @type {Promise<void>} */ (new Promise((resolve) => (obey = resolve)));
  const preparers = fakes(2).preparers.map((preparer) => ({
    ...preparer,
    prepare: async (/** @type {Job} */ { index }) => {
      if (index >= 2) await obeyed; // deaf
      return { bytes: Uint8Array.of(index), milliseconds: {} };
    },
  }));
  const registrar = new Recorder();
  registrar.milliseconds = 150;
  const controller = new AbortController();
  const onEvent = (/** @type {RunEvent} */ event) => {
    if (event.type === 'prepared' && event.index === 1) controller.abort();
  };
  const run = new SpatialRun({ registrar, preparers, onEvent });
  run.add(jobs(6));
  assert.equal((await run.run(controller.signal)).state, 'stopped');
  obey();
  const { state } = await run.run();
  assert.equal(state, 'done');
  assert.deepEqual(registrar.registered, upTo(6));
});

test('stopped before it began', async () => {
  const { preparers, seen } = fakes(2);
  const { run } = runOf(preparers, 3);
  assert.equal((await run.run(AbortSignal.abort())).state, 'stopped');
  assert.deepEqual(seen.started, []);
});

test('more frames can be added to a finished run, and while it runs', async () => {
  const { preparers, seen } = fakes(2, { milliseconds: () => 15 });
  const { registrar, run } = runOf(preparers, 3);
  assert.equal((await run.run()).numRegistered, 3);
  run.add(jobs(3, 10));
  const running = run.run();
  await sleep(5);
  run.add(jobs(2, 20));
  assert.equal((await running).numRegistered, 8);
  assert.deepEqual(registrar.registered, [0, 1, 2, 10, 11, 12, 20, 21]);
  assert.deepEqual([...seen.decodeConfigs], ['as 0.png'], 'looked at once');
  assert.throws(() => run.add(jobs(1, 21)), /Frame 21 .* cannot come after frame 21/);
});

test('a registrar that breaks ends the run', async () => {
  const { preparers } = fakes(2);
  const { registrar, run } = runOf(preparers, 5);
  registrar.refused.set(2, new WebAssembly.RuntimeError('unreachable'));
  await assert.rejects(run.run(), /unreachable/);
  assert.deepEqual(registrar.registered, [0, 1]);
});

test('what is left after the last frame is done piece by piece', async () => {
  const { preparers } = fakes(2);
  const { registrar, run, events } = runOf(preparers, 3);
  registrar.numLeft = 2;
  const stages = () => events.flatMap((event) => (event.type === 'step' ? [event.progress.stage] : []));
  await run.run();
  assert.deepEqual(stages(), ['loops', 'loops', 'done']);
  run.add(jobs(1, 3));
  await run.run();
  assert.deepEqual(stages().slice(3), ['done']);
});

/** How often the states of frames are looked at while it works. @param {() => Promise<void>} work */
async function countLooks(work) {
  const state = Object.getOwnPropertyDescriptor(Frame.prototype, 'state');
  assert.ok(state?.get && state.set);
  let numLooks = 0;
  const get = state.get;
  const counted = /** @this {unknown} */ function () {
    numLooks += 1;
    return get.call(this);
  };
  Object.defineProperty(Frame.prototype, 'state', { ...state, get: counted });
  try {
    await work();
  } finally {
    Object.defineProperty(Frame.prototype, 'state', state);
  }
  return numLooks;
}

test('a long run looks at each frame as often as a short one', async () => {
  const numLooks = (/** @type {number} */ count) =>
    countLooks(async () => {
      const preparers = fakes(3).preparers.map((preparer) => ({
        ...preparer,
        // Without a timer: thousands of frames in a moment.
        prepare: async (/** @type {Job} */ { index }) => {
          if (index % 7 === 3) throw new Error('cut off');
          if (index % 50 === 9) throw new WorkerDied('gone');
          return { bytes: Uint8Array.of(index), milliseconds: {} };
        },
      }));
      const registrar = new Recorder();
      const run = new SpatialRun({ registrar, preparers });
      const controller = new AbortController();
      run.add(jobs(count));
      const stopped = run.run(controller.signal);
      await sleep(1);
      controller.abort();
      await stopped;
      const { state, numRegistered, problems } = await run.run();
      assert.equal(state, 'done');
      assert.equal(numRegistered + problems.length, count);
      assert.ok(problems.length > count / 8);
    });
  const [short, long] = [await numLooks(200), await numLooks(4000)];
  assert.ok(short / 200 < 30, `${short} looks at 200 frames`);
  assert.ok(long / 4000 < 30, `${long} looks at 4000 frames`);
});

test('nothing to do is done', async () => {
  const { run } = runOf(fakes(1).preparers, 0);
  assert.deepEqual(await run.run(), { state: 'done', numRegistered: 0, problems: [] });
});

test('two runs at a time are refused', async () => {
  const { run } = runOf(fakes(1).preparers, 2);
  const first = run.run();
  await assert.rejects(run.run(), /running already/);
  await first;
});
