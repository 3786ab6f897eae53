// @ts-check
/** Made-up threads that prepare frames, and one that registers them. */
import assert from 'node:assert/strict';
import { setTimeout as sleep } from 'node:timers/promises';
import { SpatialRun } from '../../npm/run/spatial_run.js';

/** @typedef {import('../../npm/run/frame_queue.js').Job} Job */

/** @param {number} count */
export function jobs(count, from = 0) {
  return Array.from({ length: count }, (_, i) => ({ index: from + i, name: `${from + i}.png` }));
}

/** Notes the frames it is given. */
export class Recorder {
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
export function fakes(count = 3, behaviour = {}) {
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
export function upTo(count) {
  return Array.from({ length: count }, (_, i) => i);
}

/** A run of so many frames, with what is registered of them and what happens. @param {import('../../npm/run/spatial_run.js').Preparer<Job>[]} preparers @param {number} count */
export function runOf(preparers, count) {
  const registrar = new Recorder();
  /** @type {import('../../npm/run/spatial_run.js').RunEvent[]} */
  const events = [];
  const run = new SpatialRun({ registrar, preparers, onEvent: (event) => events.push(event) });
  run.add(jobs(count));
  return { registrar, run, events };
}
