// @ts-check
/** The run on several threads of the engine. */
import assert from 'node:assert/strict';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { startPreparers } from '../../npm/cli/preparers.js';
import { registrarOf } from '../../npm/cli/reconstruct_spatial.js';
import { fileError } from '../../npm/base/errors.js';
import * as engine from '../../npm/index.js';
import { SpatialRun } from '../../npm/run/spatial_run.js';
import { SIZE, VIEWS, walkFiles } from './depth_room.mjs';

/** @typedef {import('../../npm/run/spatial_run.js').RunEvent} RunEvent */
/** @typedef {Awaited<ReturnType<typeof startPreparers>>[number]} Thread */

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
 * @param {Pick<Thread, 'prepare' | 'replace' | 'close'>[]} preparers
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

/**
 * A thread that is killed while it prepares a frame.
 * @param {Thread} thread
 * @param {(index: number) => boolean} dies at this frame
 */
function mortal(thread, dies) {
  return {
    ahead: thread.ahead,
    prepare: (/** @type {Parameters<typeof thread.prepare>} */ ...args) => {
      const prepared = thread.prepare(...args);
      if (dies(args[0].index)) void thread.close();
      return prepared;
    },
    replace: () => thread.replace(),
    close: () => thread.close(),
  };
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
  const dies = (/** @type {number} */ index) => index % 2 === 1 && !killed.has(index) && Boolean(killed.add(index));
  const survived = await reconstructWalk(threads.map((thread) => mortal(thread, dies)));
  assert.equal(survived.events.filter(({ type }) => type === 'replaced').length, 3);
  assert.deepEqual(survived.outcome.problems, []);
  assert.deepEqual([survived.trajectory, survived.map], [alone.trajectory, alone.map]);

  const [thread] = await startPreparers(engine, 1);
  assert.ok(thread && (thread.ahead ?? 1) > 1);
  let isKilled = false;
  const diesOnce = (/** @type {number} */ index) => index === 3 && !isKilled && (isKilled = true);
  const recovered = await reconstructWalk([mortal(thread, diesOnce)]);
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
  // Image 10 and the last one are the same as the first, which is looked at more closely.
  assert.ok((untold.sizes.at(-1) ?? 0) >= (untold.sizes[10] ?? Infinity), `${untold.sizes}`);
  assert.equal(told.sizes[0], untold.sizes[0]);
  assert.ok((told.sizes.at(-1) ?? 0) < 0.8 * (told.sizes[0] ?? 0), `${told.sizes}`);
  assert.deepEqual([told.trajectory, told.map], [untold.trajectory, untold.map]);
});
