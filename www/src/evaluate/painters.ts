/** How each figure is drawn, from the scene alone: the same on the screen, in PNG and in SVG. */
import { type Axis, linearAxis, type Range, rangeOf, WHOLE } from '../views/axes.js';
import { RAMP_STEPS } from '../views/figure-colors.js';
import type { Painter } from '../drawing/figure-view.js';
import { drawHistogram, drawSeries, type Series, type Size } from '../views/figures.js';
import { type Camera, drawKey, drawPaths, type Projection, type ShownPath } from './paths.js';
import type { Pen } from '../views/pen.js';
import type { Comparison } from './protocol.js';
import { ABSCISSA_NAMES, type Scene } from './scene.js';

export type FigureName = 'paths' | 'errors' | 'histogram' | 'positions' | 'angles';

export function makePainter(
  name: FigureName,
  scene: Scene,
  camera: Camera,
  project: (size: Size) => Projection,
): Painter {
  switch (name) {
    case 'paths':
      return pathPainter(scene, camera, project);
    case 'errors':
      return errorPainter(scene);
    case 'histogram':
      return histogramPainter(scene);
    default:
      return panelPainter(scene, name);
  }
}

function errorName(unit: string): string {
  return unit === '' ? 'error' : `error (${unit})`;
}

function pathPainter(scene: Scene, camera: Camera, project: (size: Size) => Projection): Painter {
  const { selected, comparisons, colors } = scene;
  return (pen, size) => {
    if (!selected) return;
    const view = project(size);
    const others = comparisons.filter((comparison) => comparison !== selected);
    const errors = rangeOf([selected.errors]);
    const shown: ShownPath[] = [
      { positions: longest(comparisons), color: colors.reference, width: 1.5, isDashed: true },
      ...others.map((comparison) => ({
        positions: comparison.estimate_positions,
        color: scene.colorOf(comparison),
        width: 1.25,
        isDashed: false,
      })),
      { positions: selected.estimate_positions, color: shades(selected, errors), width: 2.5, isDashed: false },
    ];
    drawPaths(pen, view, shown, camera.look, colors);
    drawKey(pen, view, errors, selected.summary.unit, colors);
  };
}

function errorPainter(scene: Scene): Painter {
  const { selected, colors } = scene;
  const series = scene.comparisons.map((comparison): Series => {
    const xs = scene.xOf(comparison);
    return {
      x: Float64Array.from(comparison.error_poses, (pose) => xs[pose] as number),
      values: comparison.errors,
      stride: 1,
      offset: 0,
      color: scene.colorOf(comparison),
      width: comparison === selected ? 2 : 1,
      isDashed: false,
    };
  });
  series.sort((a, b) => a.width - b.width);
  const names = { x: ABSCISSA_NAMES[scene.abscissa], y: errorName(selected?.summary.unit ?? '') };
  return (pen, size) => {
    drawSeries(pen, size, series, xAxis(scene), names, colors, 'from_zero');
  };
}

function xAxis({ xRange, abscissa }: Scene): Axis {
  return linearAxis(xRange, abscissa === 'number' ? WHOLE : undefined);
}

function histogramPainter({ selected, colors }: Scene): Painter {
  return (pen, size) => {
    if (!selected) return;
    const { unit, statistics } = selected.summary;
    const marks = (['median', 'mean', 'rmse'] as const).map((name) => ({ name, value: statistics[name] }));
    drawHistogram(pen, size, selected.errors, errorName(unit), marks, colors);
  };
}

/** Three plots below each other: x, y and z, or roll, pitch and yaw. */
function panelPainter(scene: Scene, kind: 'positions' | 'angles'): Painter {
  const { selected, colors } = scene;
  const [ofReference, ofEstimate] = panelData(selected, kind);
  const names = kind === 'positions' ? ['x (m)', 'y (m)', 'z (m)'] : ['roll (deg)', 'pitch (deg)', 'yaw (deg)'];
  return (pen, size) => {
    if (!selected || !ofReference || !ofEstimate) return;
    const x = scene.xOf(selected);
    names.forEach((name, offset) => {
      const line = { x, stride: 3, offset };
      const series: Series[] = [
        { ...line, values: ofReference, color: colors.reference, width: 1.5, isDashed: true },
        { ...line, values: ofEstimate, color: scene.colorOf(selected), width: 1.5, isDashed: false },
      ];
      const words = { x: offset === 2 ? ABSCISSA_NAMES[scene.abscissa] : '', y: name };
      const row = { width: size.width, height: size.height / 3 };
      drawSeries(shiftedPen(pen, offset * row.height), row, series, xAxis(scene), words, colors, 'fitted');
    });
  };
}

/** The same pen, further down. */
function shiftedPen(pen: Pen, down: number): Pen {
  const shifted = (points: ArrayLike<number>): number[] =>
    Array.from(points, (value, i) => (i % 2 === 1 ? value + down : value));
  return {
    line: (points, stroke) => pen.line(shifted(points), stroke),
    segments: (ends, stroke) => pen.segments(shifted(ends), stroke),
    dots: (centers, radius, color) => pen.dots(shifted(centers), radius, color),
    picture: (x, y, width, height, pixels) => pen.picture(x, y + down, width, height, pixels),
    rect: (x, y, width, height, color) => pen.rect(x, y + down, width, height, color),
    circle: (x, y, radius, color, rim) => pen.circle(x, y + down, radius, color, rim),
    text: (x, y, words, style) => pen.text(x, y + down, words, style),
    inside: (x, y, width, height, draw) => pen.inside(x, y + down, width, height, draw),
  };
}

/** x y z (m), or roll pitch yaw (deg), of reference and estimate. */
function panelData(
  comparison: Comparison | null,
  kind: 'positions' | 'angles',
): [Float64Array | null, Float64Array | null] {
  if (!comparison) return [null, null];
  if (kind === 'positions') return [comparison.reference_positions, comparison.estimate_positions];
  const ofReference = inDegrees(comparison.referenceAngles, null);
  return [ofReference, inDegrees(comparison.estimateAngles, ofReference)];
}

/** Angles (deg) without jumps by a whole turn: near the angles before them, or, where given, near those beside them. */
function inDegrees(angles: Float64Array | null, beside: Float64Array | null): Float64Array | null {
  const shown = angles?.map((angle) => (angle * 180) / Math.PI) ?? null;
  shown?.forEach((degrees, i) => {
    const to = beside ? beside[i] : shown[i - 3];
    if (to !== undefined) shown[i] = degrees - 360 * Math.round((degrees - to) / 360);
  });
  return shown;
}

/** For each pose the colour of its error, by the index into the ramp; poses between errors have that of the next. */
function shades({ errors, error_poses, distances }: Comparison, { low, high }: Range): Uint8Array {
  const result = new Uint8Array(distances.length);
  let pose = 0;
  errors.forEach((error, index) => {
    const shade = Math.min(Math.floor(((error - low) / (high - low)) * RAMP_STEPS), RAMP_STEPS - 1);
    for (const end = error_poses[index] ?? 0; pose <= end; pose++) result[pose] = shade;
  });
  return result.fill(result[Math.max(pose - 1, 0)] ?? 0, pose);
}

/** The reference's positions where most of them are matched. */
function longest(comparisons: readonly Comparison[]): Float64Array {
  let best = new Float64Array() as Float64Array;
  for (const { reference_positions } of comparisons) {
    if (reference_positions.length > best.length) best = reference_positions;
  }
  return best;
}
