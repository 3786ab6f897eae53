// @ts-check
/** The equations that the ICP lab shows, against numeric differences; where its landscape is lowest. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { IDENTITY, moved, multiplied, poseOf } from '../../npm/base/matrices.js';

await engine.load();

test('H and b are those of the weighted residuals, by numeric differences', () => {
  const { source, target } = engine.lab_scene('outliers');
  const [a, b] = [engine.PointCloud.from_positions(source), engine.PointCloud.from_positions(target)];
  for (const metric of /** @type {const} */ (['point_to_line', 'point_to_point'])) {
    const lab = new engine.IcpLab(a, b, { metric });
    lab.trace();
    const [points, targets, normals] = [lab.source_points(), lab.target_points(), lab.target_normals()];
    for (const index of [0, 1, 2]) {
      const { T_target_source: T, H, b: gradient, source: i, target: j, weight } = lab.traced_iteration(index);
      /** Residuals of the fixed pairs after a perturbation on the left. @type {(x: number[]) => number[]} */
      const residuals = ([theta = 0, x = 0, y = 0]) =>
        Array.from(i, (point, pair) => {
          const [px = 0, py = 0] = moved(T, [...points.subarray(3 * point, 3 * point + 3)]);
          const at = 3 * (j[pair] ?? 0);
          // To first order in the step exp(x) is a turn and a translation.
          const d = [Math.cos(theta) * px - Math.sin(theta) * py + x, Math.sin(theta) * px + Math.cos(theta) * py + y];
          const off = d.map((value, axis) => value - (targets[at + axis] ?? 0));
          if (metric === 'point_to_point') return off;
          return [off.reduce((sum, value, axis) => sum + value * (normals[at + axis] ?? 0), 0)];
        }).flat();
      const now = residuals([0, 0, 0]);
      const per_pair = now.length / i.length;
      const w = (/** @type {number} */ row) => weight[Math.floor(row / per_pair)] ?? 0;
      const h = 1e-5;
      const columns = [0, 1, 2].map((axis) => {
        const [plus, minus] = [h, -h].map((step) => residuals([0, 0, 0].with(axis, step)));
        return now.map((_, row) => ((plus?.[row] ?? 0) - (minus?.[row] ?? 0)) / (2 * h));
      });
      const near = (/** @type {number} */ found, /** @type {number} */ expected, /** @type {string} */ what) =>
        assert.ok(
          Math.abs(found - expected) < 1e-5 * (1 + Math.abs(expected)),
          `${metric} ${what}: ${found} ${expected}`,
        );
      columns.forEach((column, row) => {
        near(
          gradient[row] ?? 0,
          column.reduce((sum, J, k) => sum + w(k) * J * (now[k] ?? 0), 0),
          `b${row}`,
        );
        columns.forEach((other, col) =>
          near(
            H[3 * row + col] ?? 0,
            column.reduce((sum, J, k) => sum + w(k) * J * (other[k] ?? 0), 0),
            `H${row}${col}`,
          ),
        );
      });
    }
    lab.free();
  }
});

test('the landscape is lowest where the loop ends', () => {
  const { source, target } = engine.lab_scene('outliers');
  const [a, b] = [engine.PointCloud.from_positions(source), engine.PointCloud.from_positions(target)];
  for (const axes of [
    [1, 2],
    [1, 0],
  ]) {
    const grid = { axes, half_widths: [0.5, 0.5], size: [101, 101] };
    const { costs } = engine.cost_landscape(a, b, { metric: 'point_to_line', grid });
    const lowest = costs.reduce((best, cost, node) => (cost < (costs[best] ?? Infinity) ? node : best), 0);
    const [column, row] = [(lowest % 101) - 50, Math.floor(lowest / 101) - 50];
    assert.ok(Math.abs(column) <= 2 && Math.abs(row) <= 2, `${column} ${row} nodes of 1 cm off`);
  }
});

/** A turn about z and a translation in the plane. @param {number} theta @param {number} x @param {number} y */
function planarPose(theta, x, y) {
  const [cos, sin] = [Math.cos(theta), Math.sin(theta)];
  return poseOf([cos, -sin, 0, sin, cos, 0, 0, 0, 1], [x, y, 0]);
}

/** The motion of a twist in the plane. @param {number[]} twist theta, x, y */
function exponential([theta = 0, x = 0, y = 0]) {
  const [along, across] = theta === 0 ? [1, 0] : [Math.sin(theta) / theta, (2 * Math.sin(theta / 2) ** 2) / theta];
  return planarPose(theta, along * x - across * y, across * x + along * y);
}

test('sines, cosines and their inverses in WebAssembly: turns come back from poses, steps from their logarithm', () => {
  // Of three points far apart, the step turns them back by up to a sixth of a turn.
  const points = engine.PointCloud.from_positions(Float32Array.of(-9, -5, 0, 9, -5, 0, 0, 10, 0));
  const all_pairs = { max_normal_angle: Math.PI, max_correspondence_distance: 100 };
  const exact = /** @type {const} */ ({ metric: 'point_to_point', step: 'closed_form', robust_kernel: 'none' });
  const lab = new engine.IcpLab(points, points, { ...exact, ...all_pairs });
  assert.ok(lab.is_planar);
  const same = (/** @type {ArrayLike<number>} */ found, /** @type {ArrayLike<number>} */ expected) => {
    assert.equal(found.length, expected.length);
    const off = Array.from(found, (value, at) => Math.abs(value - (expected[at] ?? Number.NaN)));
    assert.ok(Math.max(...off) < 1e-10, `${Array.from(found)} in place of ${Array.from(expected)}`);
  };
  for (const theta of [-3.1, -1, -1e-9, 0, 1e-4, 0.5, 3.1]) {
    const [center, offsets] = [Float64Array.from(IDENTITY), Float64Array.of(theta, 0.15, -0.2)];
    const pose = lab.pose_at(center, offsets);
    same(pose, planarPose(theta, 0.15, -0.2));
    same(lab.offsets(center, pose), offsets);
    const { x, T_next } = lab.iteration(pose);
    same(T_next, multiplied(exponential(x ?? []), pose));
    if (Math.abs(theta) <= 1) same(x?.slice(0, 1) ?? [], [-theta]);
  }
  for (const thing of [points, lab]) thing.free();
});
