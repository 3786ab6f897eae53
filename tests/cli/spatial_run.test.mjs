// @ts-check
/** The run on several threads, with threads made up: order, bounds, deaths, errors, stops. */
import assert from 'node:assert/strict';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';
import { startPreparers } from '../../npm/cli/preparers.js';
import { registrarOf } from '../../npm/cli/reconstruct_spatial.js';
import { fileError } from '../../npm/base/errors.js';
import { Frame } from '../../npm/run/frame_queue.js';
import * as engine from '../../npm/index.js';
import { SpatialRun, WorkerDied } from '../../npm/run/spatial_run.js';
import { SIZE, VIEWS, walkFiles } from './depth_room.mjs';

/** @typedef {import('../../npm/run/frame_queue.js').Job} Job */
/** @typedef {import('../../npm/run/spatial_run.js').RunEvent} RunEvent */

/** @param {number} count */
function jobs(count, from = 0) {
  return Array.from({ length: count }, (_, i) => ({ index: from + i, name: `${from + i}.png` }));
}

/** Notes the frames it is given. */
class Recorder {
  /** @type {number[]} */
  registered = [];
  begun = '';
  isBusy = false;
  milliseconds = 0;
  /** What a frame's begin or registration throws. @type {Map<number, Error>} */
  refused = new Map();
  /** @type {Map<number, Error>} */
  unreadable = new Map();

  /** @param {Job} job */
  begin({ index, name }) {
    const error = this.unreadable.get(index);
    if (error) throw error;
    this.begun = name;
    return `as ${name}`;
  }

  /** Pieces of work that are left after the last frame. */
  numLeft = 0;

  /** @param {Uint8Array} bytes @returns {Promise<import('../../npm/run/spatial_run.js').Progress>} */
  async place([index = -1]) {
    assert.ok(!this.isBusy, 'one frame at a time');
    this.isBusy = true;
    if (this.milliseconds > 0) await sleep(this.milliseconds);
    const error = this.refused.get(index);
    this.isBusy = false;
    if (error) throw error;
    this.registered.push(index);
    const done = this.registered.length;
    return { stage: 'register', done, total: done, frame: done - 1 };
  }

  finish() {
    assert.ok(!this.isBusy, 'when all frames are placed');
    const done = this.registered.length;
    const stage = this.numLeft-- > 0 ? 'loops' : 'done';
    return { stage, done, total: done, frame: null };
  }
}

/** @param {number} [count] @param {Partial<{ milliseconds: (index: number) => number, fails: (index: number, attempt: number) => Error | null, replaced: () => Promise<void> }>} [behaviour] */
function fakes(count = 3, behaviour = {}) {
  const { milliseconds = () => 1, fails = () => null, replaced = async () => {} } = behaviour;
  const seen = { inFlight: 0, started: /** @type {number[]} */ ([]), replaced: 0, decodeConfigs: new Set() };
  /** @type {Map<number, number>} */
  const attempts = new Map();
  const preparers = Array.from({ length: count }, () => {
    let isBusy = false;
    return {
      prepare: async (
        /** @type {Job} */ { index },
        /** @type {string} */ decodeConfig,
        /** @type {AbortSignal} */ signal,
      ) => {
        assert.ok(!isBusy, 'a preparer has one frame at a time');
        isBusy = true;
        seen.started.push(index);
        seen.decodeConfigs.add(decodeConfig);
        const attempt = (attempts.get(index) ?? 0) + 1;
        attempts.set(index, attempt);
        try {
          await sleep(milliseconds(index), undefined, { signal });
          const error = fails(index, attempt);
          if (error) throw error;
          return { bytes: Uint8Array.of(index), milliseconds: { prepare: milliseconds(index) } };
        } finally {
          isBusy = false;
        }
      },
      replace: async () => {
        seen.replaced += 1;
        await replaced();
      },
    };
  });
  return { preparers, seen };
}

/** @param {number} count */
function upTo(count) {
  return Array.from({ length: count }, (_, i) => i);
}

test('frames are placed in order, whatever order they are prepared in', async () => {
  const { preparers, seen } = fakes(4, { milliseconds: (index) => ((index * 7) % 5) * 3 });
  const registrar = new Recorder();
  /** @type {RunEvent[]} */
  const events = [];
  const run = new SpatialRun({ registrar, preparers, onEvent: (event) => events.push(event) });
  run.add(jobs(20));
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
  const registrar = new Recorder();
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(16));
  await run.run();
  assert.equal(most, 4);
  assert.deepEqual(registrar.registered, upTo(16));
});

test('an error of one frame is told, the others go on', async () => {
  const { preparers, seen } = fakes(2, { fails: (index) => (index === 3 ? new Error('3.png is cut off') : null) });
  const registrar = new Recorder();
  const refused = Object.assign(new Error('5.png: no'), { name: 'ScanstitchError' });
  registrar.refused.set(5, refused);
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(8));
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
  const registrar = new Recorder();
  registrar.unreadable.set(0, new Error('0.png is cut off'));
  registrar.unreadable.set(1, new Error('1.png holds no depth'));
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(5));
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
  const registrar = new Recorder();
  for (const index of upTo(4)) registrar.unreadable.set(index, new Error('no'));
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(4));
  const outcome = await run.run();
  assert.equal(outcome.numRegistered, 0);
  assert.equal(outcome.problems.length, 4);
});

test('a worker that dies is replaced and its frame tried again', async () => {
  const died = (/** @type {number} */ index, /** @type {number} */ attempt) =>
    index === 4 && attempt === 1 ? new WorkerDied('gone') : null;
  const { preparers, seen } = fakes(2, { fails: died });
  const registrar = new Recorder();
  /** @type {RunEvent[]} */
  const events = [];
  const run = new SpatialRun({ registrar, preparers, onEvent: (event) => events.push(event) });
  run.add(jobs(8));
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
  const registrar = new Recorder();
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(8));
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
  const registrar = new Recorder();
  const run = new SpatialRun({ registrar, preparers: once.preparers });
  run.add(jobs(9));
  assert.equal((await run.run()).numRegistered, 9);

  const always = fakes(2, { fails: (index) => (index >= 5 ? new WorkerDied('x') : null), replaced });
  const kept = new Recorder();
  const doomed = new SpatialRun({ registrar: kept, preparers: always.preparers });
  doomed.add(jobs(9));
  await assert.rejects(doomed.run(), /No worker can be started/);
  assert.deepEqual(kept.registered, upTo(5));
});

test('a stop answers at once and keeps what is done; the run goes on later', async () => {
  const { preparers } = fakes(2, { milliseconds: (index) => (index < 3 ? 1 : index === 3 ? 5000 : 2) });
  const registrar = new Recorder();
  const controller = new AbortController();
  const onEvent = (/** @type {import('../../npm/run/spatial_run.js').RunEvent} */ event) => {
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
  const onEvent = (/** @type {import('../../npm/run/spatial_run.js').RunEvent} */ event) => {
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
  const run = new SpatialRun({ registrar: new Recorder(), preparers });
  run.add(jobs(3));
  assert.equal((await run.run(AbortSignal.abort())).state, 'stopped');
  assert.deepEqual(seen.started, []);
});

test('more frames can be added to a finished run, and while it runs', async () => {
  const { preparers, seen } = fakes(2, { milliseconds: () => 15 });
  const registrar = new Recorder();
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(3));
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
  const registrar = new Recorder();
  registrar.refused.set(2, new WebAssembly.RuntimeError('unreachable'));
  const run = new SpatialRun({ registrar, preparers });
  run.add(jobs(5));
  await assert.rejects(run.run(), /unreachable/);
  assert.deepEqual(registrar.registered, [0, 1]);
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
  const registrar = new Recorder();
  /** @type {RunEvent[]} */
  const events = [];
  const run = new SpatialRun({ registrar, preparers: [preparer], onEvent: (event) => events.push(event) });
  run.add(jobs(9));
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

test('what is left after the last frame is done piece by piece', async () => {
  const { preparers } = fakes(2);
  const registrar = new Recorder();
  registrar.numLeft = 2;
  /** @type {string[]} */
  const stages = [];
  const onEvent = (/** @type {RunEvent} */ event) => {
    if (event.type === 'step') stages.push(event.progress.stage);
  };
  const run = new SpatialRun({ registrar, preparers, onEvent });
  run.add(jobs(3));
  await run.run();
  assert.deepEqual(stages, ['loops', 'loops', 'done']);
  run.add(jobs(1, 3));
  await run.run();
  assert.deepEqual(stages.slice(3), ['done']);
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
  const { preparers } = fakes(1);
  const run = new SpatialRun({ registrar: new Recorder(), preparers });
  assert.deepEqual(await run.run(), { state: 'done', numRegistered: 0, problems: [] });
});

test('two runs at a time are refused', async () => {
  const { preparers } = fakes(1);
  const run = new SpatialRun({ registrar: new Recorder(), preparers });
  run.add(jobs(2));
  const first = run.run();
  await assert.rejects(run.run(), /running already/);
  await first;
});

/**
 * Images of the made-up walk, in memory.
 * @param {readonly number[]} numbers
 * @param {Record<string, Uint8Array | string>} files
 * @returns {import('../../npm/cli/preparers.js').FrameJob[]}
 */
function walk(numbers, files) {
  const source = (/** @type {string} */ path) => {
    // A copy: what is given to a thread is gone here.
    const read = async () => Uint8Array.from(Buffer.from(files[path] ?? ''));
    return { path, size: 0, read, readHead: read };
  };
  return numbers.map((number, index) => ({
    index,
    name: `${number}.png`,
    time: null,
    kind: /** @type {const} */ ('depth_images'),
    file: source(`depth/${number}.png`),
    color: source(`rgb/${number}.png`),
  }));
}

/**
 * Reconstructs the walk with the real engine.
 * @param {Pick<Awaited<ReturnType<typeof startPreparers>>[number], 'prepare' | 'replace' | 'close'>[]} preparers
 */
async function reconstructWalk(preparers, jobs = walk([1, 2, 3, 4, 5, 6], walkFiles())) {
  const reconstruction = new engine.SpatialReconstruction();
  /** @type {RunEvent[]} */
  const events = [];
  const run = new SpatialRun({
    preparers,
    registrar: registrarOf(reconstruction),
    onEvent: (event) => events.push(event),
  });
  run.add(jobs);
  const outcome = await run.run();
  await Promise.all(preparers.map((preparer) => preparer.close()));
  const [trajectory, map] = [reconstruction.trajectory_tum(), reconstruction.map_ply()];
  const { notes } = reconstruction.result();
  assertSameArrays(reconstruction);
  reconstruction.free();
  return { outcome, events, trajectory, map, notes };
}

/** The map's points all at once are those that are asked for one by one. @param {engine.SpatialReconstruction} whole */
function assertSameArrays(whole) {
  const points = whole.map_points();
  assert.ok(points.frames.length > 1024);
  assert.deepEqual(points.positions, whole.map_positions());
  assert.deepEqual(points.colors, whole.map_colors());
  assert.deepEqual(points.frames, whole.map_frames());
  const normals = whole.map_normals();
  assert.equal(points.normals.length, normals.length);
  const off = normals.findIndex((normal, i) => !(Math.abs((points.normals[i] ?? 0) - 32_767 * normal) < 0.51));
  assert.equal(off, -1, `${points.normals[off]}, ${normals[off]}`);
  points.free();
}

test('the engine in real threads: the same bytes with one thread, with three, and when threads are killed', async () => {
  await engine.load();
  const alone = await reconstructWalk(await startPreparers(engine, 0));
  assert.deepEqual(alone.outcome, { state: 'done', numRegistered: 6, problems: [] });
  const stages = alone.events.flatMap((event) => (event.type === 'step' ? [event.progress.stage] : []));
  assert.deepEqual(stages, ['loops', 'done'], 'the last loop is closed here as on the page');
  const three = await reconstructWalk(await startPreparers(engine, 3));
  assert.deepEqual([three.trajectory, three.map], [alone.trajectory, alone.map]);

  const threads = await startPreparers(engine, 2);
  const killed = new Set();
  const mortal = threads.map((thread) => ({
    prepare: (/** @type {Parameters<typeof thread.prepare>} */ ...args) => {
      const prepared = thread.prepare(...args);
      const { index } = args[0];
      if (index % 2 === 1 && !killed.has(index)) {
        killed.add(index);
        void thread.close();
      }
      return prepared;
    },
    replace: () => thread.replace(),
    close: () => thread.close(),
  }));
  const survived = await reconstructWalk(mortal);
  assert.equal(survived.events.filter(({ type }) => type === 'replaced').length, 3);
  assert.deepEqual(survived.outcome.problems, []);
  assert.deepEqual([survived.trajectory, survived.map], [alone.trajectory, alone.map]);

  const [thread] = await startPreparers(engine, 1);
  assert.ok(thread && (thread.ahead ?? 1) > 1);
  let isKilled = false;
  const once = {
    ahead: thread.ahead,
    prepare: (/** @type {Parameters<typeof thread.prepare>} */ ...args) => {
      const prepared = thread.prepare(...args);
      if (args[0].index === 3 && !isKilled) {
        isKilled = true;
        void thread.close();
      }
      return prepared;
    },
    replace: () => thread.replace(),
    close: () => thread.close(),
  };
  const recovered = await reconstructWalk([once]);
  assert.equal(recovered.events.filter(({ type }) => type === 'replaced').length, 1);
  assert.deepEqual([recovered.trajectory, recovered.map], [alone.trajectory, alone.map]);
});

test('colours that cannot be read are told, with the reason, and the frame is used', async () => {
  await engine.load();
  for (const count of [0, 1]) {
    const jobs = walk([1, 2, 3, 4, 5, 6], walkFiles());
    const [, second, third] = jobs;
    assert.ok(second?.color && third?.color);
    second.color.read = async () => {
      throw fileError('walk.mcap', 'The chunk at byte 7 is damaged', 'Record it again');
    };
    const gone = { ...third, color: { ...third.color, disk: join(tmpdir(), 'scanstitch-no-such-folder', '3.png') } };
    const { outcome, notes } = await reconstructWalk(await startPreparers(engine, count), jobs.with(2, gone));
    assert.deepEqual(outcome, { state: 'done', numRegistered: 6, problems: [] });
    assert.deepEqual(notes.slice(0, 2), [
      '2.png: its colours are left out: walk.mcap: The chunk at byte 7 is damaged. Record it again.',
      '3.png: its colours are left out: rgb/3.png: There is no such file or folder. See whether it was moved or deleted.',
    ]);
  }
});

/** The walk as a camera sees it that cuts depths off to whole 255ths of 10 m. */
function coarseWalkFiles() {
  const images = VIEWS.map(({ depth }, index) => {
    const coarse = depth.map((millimetres) => Math.floor((millimetres * 255) / 10_000));
    return [
      `depth/${index + 1}.png`,
      Buffer.concat([Buffer.from(`P5 ${SIZE} ${SIZE} 255\n`), Uint8Array.from(coarse)]),
    ];
  });
  return { ...walkFiles(), ...Object.fromEntries(images) };
}

test('once it is decided how depth is read, frames are prepared in one way, and nothing else changes', async () => {
  await engine.load();
  const toAndFro = [1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1];
  const run = async (/** @type {boolean} */ isTold) => {
    /** @type {number[]} */
    const sizes = [];
    const [thread] = await startPreparers(engine, 0);
    assert.ok(thread);
    /** @type {string | null} */
    let first = null;
    const noting = {
      prepare: async (/** @type {Parameters<typeof thread.prepare>} */ ...[job, decodeConfig, signal]) => {
        first ??= decodeConfig;
        const prepared = await thread.prepare(job, isTold ? decodeConfig : first, signal);
        sizes.push(prepared.bytes.length);
        return prepared;
      },
      replace: () => thread.replace(),
      close: () => thread.close(),
    };
    return { ...(await reconstructWalk([noting], walk(toAndFro, coarseWalkFiles()))), sizes };
  };
  const [told, untold] = [await run(true), await run(false)];
  // The first image and the last one are the same.
  assert.ok((untold.sizes.at(-1) ?? 0) >= (untold.sizes[0] ?? 0), `${untold.sizes}`);
  assert.equal(told.sizes[0], untold.sizes[0]);
  assert.ok((told.sizes.at(-1) ?? 0) < 0.8 * (told.sizes[0] ?? 0), `${told.sizes}`);
  assert.deepEqual([told.trajectory, told.map], [untold.trajectory, untold.map]);
});
