/** The plots that make the argument: what each strategy costs and gains from frame to frame. */
import { type Colors, drawAxes, linearAxis, type Range, rangeOf, WHOLE } from '../views/axes.js';
import type { Painter } from '../drawing/figure-view.js';
import { drawSeries, plotArea, type Series } from '../views/figures.js';
import type { Compared } from '../../../package/report/strategy_table.js';
import { mapBounds } from '../views/map-bounds.js';
import type { PointSet } from '../views/point-layer.js';

/** One strategy, as the figures see it. */
export interface Drawn {
  result: Compared;
  /** Null where it is not drawn. */
  map: PointSet | null;
  milliseconds: readonly number[];
  color: string;
  isSelected: boolean;
}

export type FigureId = 'points' | 'time' | 'error' | 'paths';

interface Figure {
  id: FigureId;
  title: string;
  about: string;
}

const FIGURES: readonly Figure[] = [
  {
    id: 'points',
    title: 'Points of the map',
    about: 'An unfiltered map grows with every frame, a voxel map only with new surface.',
  },
  { id: 'time', title: 'Time per frame', about: 'Should not grow with the map.' },
  {
    id: 'error',
    title: 'Distance to ground truth',
    about: 'After aligning the first poses. A jump is a wrongly registered frame.',
  },
  { id: 'paths', title: 'Paths from above', about: '' },
];
const MAPS: Figure = {
  id: 'paths',
  title: 'Maps on top of each other',
  about: 'With the paths; the selected strategy is on top.',
};

/** Planar scans keep all points of a map, whatever the strategy; their maps are drawn. */
export function figuresOf(drawn: readonly Drawn[]): readonly Figure[] {
  const hasMaps = drawn.some(({ map }) => map !== null);
  const hasReference = drawn.some(({ result }) => result.comparison !== null);
  const all = hasMaps ? [...FIGURES.filter(({ id }) => id === 'time' || id === 'error'), MAPS] : FIGURES;
  if (!hasReference) return all.filter(({ id }) => id !== 'error');
  return all.map((figure) =>
    figure.id === 'paths' ? { ...figure, about: `${figure.about} Dashed: ground truth.`.trim() } : figure,
  );
}

export function makePainter(id: FigureId, all: readonly Drawn[], colors: Colors, isLog: boolean): Painter {
  // The selected one comes last, on top.
  const drawn = [...all].sort((a, b) => Number(a.isSelected) - Number(b.isSelected));
  if (id === 'paths') return pathPainter(drawn, colors);
  const values: Record<Exclude<FigureId, 'paths'>, (one: Drawn) => readonly (number | null)[]> = {
    points: ({ result }) => result.frames.map(({ map_points }) => map_points),
    time: ({ milliseconds }) => milliseconds.map((value, place) => (place === 0 ? null : value)),
    error: ({ result }) => result.comparison?.errors ?? [],
  };
  const series = drawn.map((one): Series => {
    const known = values[id](one).flatMap((value, place) =>
      value === null ? [] : [[one.result.frames[place]?.index ?? place, value] as const],
    );
    return {
      x: known.map(([index]) => index),
      values: known.map(([, value]) => value),
      stride: 1,
      offset: 0,
      color: one.color,
      width: one.isSelected ? 2.5 : 1.5,
      isDashed: false,
    };
  });
  const x = linearAxis({ ...rangeOf(series.map(({ x }) => x)), low: 0 }, WHOLE);
  const unit = { points: 'points', time: 'ms', error: 'm' }[id];
  const names = { x: 'frame', y: unit };
  return (pen, size) => {
    drawSeries(pen, size, series, x, names, colors, isLog ? 'log' : 'from_zero', FORMATS[id]);
  };
}

/** Of the numbers at their axes, as d3-format has it: large counts with their thousands or millions. */
const FORMATS: Partial<Record<FigureId, string>> = { points: '~s' };

/** Dots of a map that are drawn: more of them cover each other on a figure of a thousand by four hundred pixels. */
const MAX_DOTS = 20_000;
const DOT_RADIUS = 0.6;

/** x y x y ..., evenly over the whole map. */
function thinned({ points }: PointSet): ArrayLike<number> {
  const step = Math.ceil(points.length / 2 / MAX_DOTS);
  return step <= 1 ? points : points.filter((_, i) => (i >> 1) % step === 0);
}

/** Right and ahead of the first frame: x and z of a camera, x and y where that spreads more, as in a robot's own frame. */
function pathPainter(drawn: readonly Drawn[], colors: Colors): Painter {
  const reference = drawn.find(({ result }) => result.comparison)?.result.comparison?.reference ?? [];
  const poses = reference.filter((pose) => pose !== null);
  const basis = poses.length > 0 ? poses : (drawn.at(-1)?.result.frames.map((frame) => frame.T_world_sensor) ?? []);
  const spread = (axis: 'y' | 'z'): number => {
    const { low, high } = rangeOf([basis.map((pose) => pose[axis])]);
    return high - low;
  };
  const ahead = spread('z') >= spread('y') ? 'z' : 'y';
  const paths = [
    { points: poses, map: [], color: colors.reference, width: 1.5, dash: [5, 4] },
    ...drawn.map(({ result, map, color, isSelected }) => ({
      map: map ? thinned(map) : [],
      points: result.frames.map((frame) => frame.T_world_sensor),
      color,
      width: isSelected ? 2.5 : 1.5,
      dash: undefined,
    })),
  ];
  const bounds = drawn.flatMap(({ result, map }) => {
    const path = result.frames.map((frame) => frame.T_world_sensor);
    return (map && mapBounds(map, path)) ?? [];
  });
  const across = rangeOf([
    ...paths.map(({ points }) => points.map(({ x }) => x)),
    ...bounds.map(({ minX, maxX }) => [minX, maxX]),
  ]);
  const up = rangeOf([
    ...paths.map(({ points }) => points.map((pose) => pose[ahead])),
    ...bounds.map(({ minY, maxY }) => [minY, maxY]),
  ]);
  return (pen, size) => {
    const area = plotArea(size);
    const scale = Math.min(area.width / (across.high - across.low), area.height / (up.high - up.low)) * 0.92;
    const around = ({ low, high }: Range, length: number): Range => {
      const half = length / scale / 2;
      return { low: (low + high) / 2 - half, high: (low + high) / 2 + half };
    };
    const [x, y] = [around(across, area.width), around(up, area.height)];
    drawAxes(pen, area, linearAxis(x), linearAxis(y), { x: 'x (m)', y: `${ahead} (m)` }, colors);
    pen.inside(area.x, area.y, area.width, area.height, () => {
      const atX = (value: number): number => area.x + (value - x.low) * scale;
      const atY = (value: number): number => area.y + area.height - (value - y.low) * scale;
      for (const { map, color } of paths) {
        pen.dots(
          Float32Array.from(map, (value, i) => (i % 2 === 0 ? atX(value) : atY(value))),
          DOT_RADIUS,
          color,
        );
      }
      for (const { points, color, width, dash } of paths) {
        pen.line(
          points.flatMap((pose) => [atX(pose.x), atY(pose[ahead])]),
          { color, width, ...(dash && { dash }) },
        );
      }
    });
  };
}
