// @ts-check
/** The two files of the engine: what the page begins with finds, to the last bit, what the full one finds. */
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import * as full from '../../pkg/scanstitch.js';
import * as first from '../../pkg/scanstitch_planar.js';
import { compareNaturally } from '../../npm/base/natural_order.js';
import { ROOM_FILES, ROOT } from './support.mjs';

const pkg = (/** @type {string} */ name) => readFileSync(join(ROOT, 'pkg', name));
full.initSync({ module: pkg('scanstitch_bg.wasm') });
first.initSync({ module: pkg('scanstitch_planar_bg.wasm') });

const CORRIDOR = join(ROOT, 'www', 'samples', 'corridor');
const SAMPLE = readdirSync(CORRIDOR)
  .toSorted(compareNaturally)
  .map((name) => ({ name, content: new Uint8Array(readFileSync(join(CORRIDOR, name))) }));
const bytes = (/** @type {string} */ text) => new TextEncoder().encode(text);
const ROOM = Object.entries(ROOM_FILES).map(([name, text]) => ({ name, content: bytes(text) }));

/**
 * All that can be asked of a reconstruction.
 * @param {Pick<typeof first, 'Reconstruction'> | Pick<typeof full, 'Reconstruction'>} engine
 * @param {typeof SAMPLE} files
 * @param {Partial<full.Settings>} settings
 */
function everything({ Reconstruction }, files, settings) {
  const reconstruction = new Reconstruction();
  try {
    reconstruction.set_settings(settings);
    const cleaned = [];
    for (const { name, content } of files) {
      if (name.endsWith('.tum')) reconstruction.set_reference(name, content);
      else cleaned.push(reconstruction.add_scan(name, content));
    }
    const progress = [];
    do progress.push(reconstruction.step());
    while (progress.at(-1)?.stage !== 'done');
    const grid = reconstruction.occupancy_grid();
    const picture = { pgm: grid.pgm(), yaml: grid.yaml('map.pgm'), grey_values: grid.grey_values() };
    grid.free();
    return {
      cleaned,
      progress,
      picture,
      result: reconstruction.result(),
      report: reconstruction.report_json(),
      trajectory: reconstruction.trajectory_tum(),
      matrices: reconstruction.trajectory_matrices(),
      map: reconstruction.map_ply(),
      pairs: reconstruction.correspondences(1),
      history: reconstruction.history(1),
    };
  } finally {
    reconstruction.free();
  }
}

for (const { settings } of /** @type {{ settings: Partial<full.Settings> }[]} */ ([
  ...full.presets(),
  { settings: { strategy: 'scan_to_scan' } },
])) {
  test(`the same results with ${JSON.stringify(settings).slice(0, 60)}`, () => {
    for (const files of [SAMPLE, ROOM]) {
      assert.deepEqual(everything(first, files, settings), everything(full, files, settings));
    }
  });
}

test('the same settings and presets, and the same words about a broken file', () => {
  assert.deepEqual(first.describe_settings(), full.describe_settings());
  assert.deepEqual(first.presets(), full.presets());
  assert.equal(first.version(), full.version());
  const problemOf = (/** @type {{ Reconstruction: new () => Pick<full.Reconstruction, 'add_scan'> }} */ engine) => {
    try {
      new engine.Reconstruction().add_scan('cut.ply', SAMPLE[0]?.content.subarray(0, 2000) ?? new Uint8Array());
    } catch (error) {
      return { .../** @type {object} */ (error) };
    }
    return null;
  };
  assert.notEqual(problemOf(full), null);
  assert.deepEqual(problemOf(first), problemOf(full));
});

test('the first file is a part of the full one, and a small one', () => {
  assert.deepEqual(
    Object.keys(first).filter((name) => !(name in full)),
    [],
  );
  const [small, large] = [pkg('scanstitch_planar_bg.wasm'), pkg('scanstitch_bg.wasm')];
  // As published it is a quarter; compiled quickly, it keeps code that optimisation across crates removes.
  assert.ok(3 * small.length < large.length, `${small.length} of ${large.length} bytes`);
});
