/** The plots that make the argument: what each strategy costs and gains from frame to frame. */
import { type Colors, drawAxes, linearAxis, type Range, rangeOf, WHOLE } from '../views/axes.js';
import type { Painter } from '../components/figure-view.js';
import { drawSeries, plotArea, type Series } from '../views/figures.js';
import type { StrategyResult } from './protocol.js';

/** One strategy, as the figures see it. */
export interface Drawn {
  result: StrategyResult;
  milliseconds: readonly number[];
  color: string;
  isSelected: boolean;
}

export type FigureId = 'points' | 'time' | 'error' | 'paths';

export const FIGURES: readonly { id: FigureId; title: string; about: string }[] = [
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
  { id: 'paths', title: 'Paths from above', about: 'Dashed: ground truth.' },
];

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
    { points: poses, color: colors.reference, width: 1.5, dash: [5, 4] },
    ...drawn.map(({ result, color, isSelected }) => ({
      points: result.frames.map((frame) => frame.T_world_sensor),
      color,
      width: isSelected ? 2.5 : 1.5,
      dash: undefined,
    })),
  ];
  const across = rangeOf(paths.map(({ points }) => points.map(({ x }) => x)));
  const up = rangeOf(paths.map(({ points }) => points.map((pose) => pose[ahead])));
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
      for (const { points, color, width, dash } of paths) {
        const line = points.flatMap((pose) => [
          area.x + (pose.x - x.low) * scale,
          area.y + area.height - (pose[ahead] - y.low) * scale,
        ]);
        pen.line(line, { color, width, ...(dash && { dash }) });
      }
    });
  };
}
