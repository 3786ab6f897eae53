// @ts-check
/** How the engine's memory grows. */
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { initSync } from '../../pkg/scanstitch.js';

const { memory } = initSync({ module: readFileSync(new URL('../../pkg/scanstitch_bg.wasm', import.meta.url)) });

const SAMPLE = new URL('../../www/samples/apartment/', import.meta.url);

test('the memory grows in few steps, and not with every frame', () => {
  const there = Array.from({ length: 20 }, (_, index) => index + 1);
  const numbers = [there, there.toReversed(), there].flat();
  const reconstruction = new engine.SpatialReconstruction();
  const read = (/** @type {number} */ number) => readFileSync(new URL(`depth/${number}.png`, SAMPLE));
  const decodeConfig = reconstruction.begin('1.png', read(1));
  const frames = numbers.map((number, index) =>
    engine.prepare_frame(decodeConfig, `${index}.png`, index, null, read(number), null, null),
  );
  const sizes = frames.map((frame) => {
    reconstruction.add_prepared(frame);
    reconstruction.step();
    return memory.buffer.byteLength;
  });
  assert.ok(reconstruction.result().frames.every(({ status }) => status !== 'lost'));
  reconstruction.free();

  const numGrown = sizes.filter((size, place) => place > 0 && size > (sizes[place - 1] ?? 0)).length;
  const factor = (sizes.at(-1) ?? 0) / (sizes[0] ?? 1);
  assert.ok(factor > 3, `it became ${factor} times as large, which is too little to tell`);
  assert.ok(numGrown <= 12, `it grew ${numGrown} times in ${frames.length} frames`);
});
