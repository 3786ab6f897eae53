// @ts-check
/** The equations that the ICP lab shows, against numeric differences; where its landscape is lowest. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as engine from '../../npm/index.js';
import { moved } from '../../npm/lab/matrices.js';

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
