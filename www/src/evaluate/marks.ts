/** What marks one instant in all figures: a line at it, and a dot for each estimate. */
import type { Mark, Marker } from '../drawing/figure-view.js';
import { plotArea, type Size } from '../views/figures.js';
import type { Projection } from './paths.js';
import { poseAtInstant, type Scene } from './scene.js';

export const NO_MARKS: Marker = () => [];

/** A line through plots that stand below each other; with dots, at the errors. */
export function instantMarker(scene: Scene, instant: number | null, num_rows: number, hasDots: boolean): Marker {
  if (instant === null) return NO_MARKS;
  const { comparisons, colors, xRange } = scene;
  const high = Math.max(...comparisons.map(({ summary }) => summary.statistics.max), 1e-12) * 1.05;
  return (size) => {
    const row = { width: size.width, height: size.height / num_rows };
    const area = plotArea(row);
    const x = area.x + (area.width * (instant - xRange.low)) / (xRange.high - xRange.low);
    const end = size.height - (row.height - area.y - area.height);
    const line: Mark = { line: [x, area.y, x, end], color: colors.selected, width: 1.25 };
    if (!hasDots) return [line];
    const dots = comparisons.flatMap((comparison): Mark[] => {
      const error = poseAtInstant(scene, comparison, instant)?.error ?? null;
      if (error === null) return [];
      const radius = comparison === scene.selected ? 4 : 3;
      return [{ dot: [x, area.y + area.height * (1 - error / high)], radius, color: scene.colorOf(comparison) }];
    });
    return [line, ...dots];
  };
}

/** Where each estimate was, and how far from the reference the selected one. */
export function poseMarker(scene: Scene, instant: number | null, project: (size: Size) => Projection): Marker {
  const { selected, colors } = scene;
  if (instant === null || !selected) return NO_MARKS;
  return (size) => {
    const view = project(size);
    return scene.comparisons.flatMap((comparison): Mark[] => {
      const found = poseAtInstant(scene, comparison, instant);
      if (!found) return [];
      const at = (positions: Float64Array): [number, number] => {
        const [x = 0, y = 0, z = 0] = positions.subarray(3 * found.pose, 3 * found.pose + 3);
        return view.project(x, y, z);
      };
      const estimate = at(comparison.estimate_positions);
      const color = scene.colorOf(comparison);
      if (comparison !== selected) return [{ dot: estimate, radius: 3.5, color }];
      const reference = at(comparison.reference_positions);
      return [
        { line: [...reference, ...estimate], color: colors.selected, width: 1.5 },
        { dot: reference, radius: 4, color: colors.reference },
        { dot: estimate, radius: 5, color },
      ];
    });
  };
}
