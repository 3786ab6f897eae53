// @ts-check
/** The answers of the gallery of the ICP lab are true. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { difference } from '../../npm/base/matrices.js';

await engine.load();

/**
 * A scene registered by each of its methods: the error of the end, the iterations, and what the pairs determine.
 * @param {string} name
 */
function registered(name) {
  const scene = engine.lab_scene(name);
  const source = engine.PointCloud.from_positions(scene.source);
  const target = engine.PointCloud.from_positions(scene.target);
  const results = scene.methods.map((options) => {
    const lab = new engine.IcpLab(source, target, options);
    const trace = lab.trace();
    const T = trace.poses.at(-1) ?? scene.T_reference;
    const { degeneracy } = lab.iteration(Float64Array.from(T));
    lab.free();
    return { T, ...difference(scene.T_reference, T), trace, degeneracy, options };
  });
  /** Labels of a basin over some unknowns, by the first method. @type {(axes: number[], half_widths: number[], size: number[]) => Int16Array} */
  const basin = (axes, half_widths, size) => {
    const grid = { T_center: scene.T_reference, axes, half_widths, size };
    return engine.basin_of_attraction(source, target, { ...scene.methods[0], grid, reference: scene.T_reference })
      .labels;
  };
  return { scene, results, basin };
}

const degrees = (/** @type {number} */ angle) => (angle * 180) / Math.PI;

test('scenes are the same each time, and an unknown one is refused', () => {
  assert.equal(engine.lab_scenes().length, 10);
  for (const name of engine.lab_scenes()) {
    const scene = engine.lab_scene(name);
    assert.deepEqual(scene, engine.lab_scene(name));
    assert.ok(scene.title && scene.look_at && scene.question.endsWith('?') && scene.answer.length > 50, name);
  }
  assert.throws(() => engine.lab_scene('nowhere'), /no scene "nowhere"/);
});

test('corridor: the position along it is undetermined', () => {
  const [line, point] = registered('corridor').results;
  const { shares = [], directions = [] } = line?.degeneracy ?? {};
  assert.ok((shares[0] ?? 1) < 0.01 && (shares[1] ?? 0) > 0.1);
  assert.ok(Math.abs(directions[1] ?? 0) > 0.99, 'along x');
  assert.ok((line?.translation ?? 0) > 0.45 && degrees(line?.rotation ?? 9) < 0.1);
  const [x = 9, y = 9] = [point?.T[3], point?.T[7]];
  assert.ok(Math.abs(x) < 0.05 && Math.abs(y - 0.05) < 0.005, 'point to point ends at no motion along the walls');
});

test('circle: a turn about the centre is undetermined', () => {
  const { results, scene } = registered('circle');
  const [line] = results;
  const { shares = [], directions = [] } = line?.degeneracy ?? {};
  assert.ok((shares[0] ?? 1) < 0.01 && (shares[1] ?? 0) > 0.1 && Math.abs(directions[0] ?? 0) > 0.99);
  assert.ok(degrees(line?.rotation ?? 0) > 8);
  const radius = (/** @type {number[]} */ T) => Math.hypot(T[3] ?? 0, T[7] ?? 0);
  assert.ok(Math.abs(radius(line?.T ?? []) - radius(scene.T_reference)) < 0.01);
});

test('repeated_doors: the basin repeats every two metres', () => {
  const { results, basin } = registered('repeated_doors');
  assert.ok((results[0]?.translation ?? 9) < 0.01);
  const labels = [...basin([1], [3], [25])]; // every 0.25 m
  const home = labels.flatMap((label, index) => (label === 0 ? [(index - 12) * 0.25] : []));
  assert.ok(home.every((x) => Math.abs(x) <= 1.25) && home.length >= 5, `${home}`);
  assert.ok(new Set(labels).size >= 3);
});

test('large_motion: the identity ends elsewhere, a search finds the motion', () => {
  const { results, basin } = registered('large_motion');
  assert.ok(degrees(results[0]?.rotation ?? 0) > 30);
  assert.ok((results[1]?.translation ?? 9) < 0.01 && degrees(results[1]?.rotation ?? 9) < 0.2);
  const labels = [...basin([0], [Math.PI / 2], [19])]; // every 10 degrees
  assert.ok(
    labels.slice(6, 13).every((label) => label === 0),
    `home within 30 degrees: ${labels}`,
  );
  assert.ok(
    [labels[2], labels[16]].every((label) => label !== 0),
    `not at 70 degrees: ${labels}`,
  );
});

test('partial_overlap: a wide limit pulls several times as far', () => {
  const [near, wide] = registered('partial_overlap').results;
  assert.ok((near?.translation ?? 0) > 0.02, 'neither is right');
  assert.ok((wide?.translation ?? 0) > 4 * (near?.translation ?? 9));
});

test('outliers: a robust kernel makes the error ten times smaller', () => {
  const [squares, robust] = registered('outliers').results;
  assert.ok((robust?.translation ?? 9) < 0.005);
  assert.ok((squares?.translation ?? 0) > 10 * (robust?.translation ?? 9));
});

test('trimming: neither nothing nor nearly all', () => {
  const [none, some, most] = registered('trimming').results.map(({ translation }) => translation);
  assert.ok(
    (some ?? 9) < 0.01 && (none ?? 0) > 10 * (some ?? 9) && (most ?? 0) > 10 * (some ?? 9),
    `${none} ${some} ${most}`,
  );
});

test('point_to_point_crawl: the same end, many times the iterations', () => {
  const [line, point] = registered('point_to_point_crawl').results;
  assert.ok(
    (line?.translation ?? 9) < 0.02 && (point?.translation ?? 9) < 0.05,
    `${line?.translation} ${point?.translation}`,
  );
  assert.ok((point?.trace.records.length ?? 0) > 5 * (line?.trace.records.length ?? 99));
});

test('free_plane: three of six unknowns are measured', () => {
  const [plane] = registered('free_plane').results;
  const { shares = [] } = plane?.degeneracy ?? {};
  assert.equal(shares.filter((share) => share < 0.01).length, 3);
  const [, , , , , , , , tilt = 0] = plane?.T ?? [];
  assert.ok(shares.filter((share) => share > 0.1).length === 3 && Math.abs(tilt) < 1);
});

test('sparse_rings: GICP finds the motion, point to point the rings', () => {
  const [gicp, point] = registered('sparse_rings').results;
  assert.ok((gicp?.translation ?? 9) < 0.005);
  assert.ok((point?.translation ?? 0) > 0.8 * Math.hypot(0.3, 0.1));
});
