/** The correlative search as a figure: the blocks of poses that it looks at, in their order, coloured by their bounds. */
import type { Painter } from '../drawing/figure-view.js';
import { type Colors, drawAxes, linearAxis, rangeOf } from '../views/axes.js';
import { plotArea } from '../views/figures.js';
import { cssColor, frameColor } from '../views/palette.js';
import { planarParts, planarPose } from './poses.js';
import type { Pose, SearchedBlock } from './protocol.js';

export interface CorrelativeSearch {
  center: Pose;
  /** Half width of the window in x and y (m). */
  reach: number;
  /** In the order of their evaluation; those of level 0 are single poses. */
  blocks: readonly SearchedBlock[];
}

/** What the search has found out by its `count`-th block. */
export interface SearchState {
  block: SearchedBlock | null;
  /** The best single pose so far; the search does not enter blocks whose bound is lower than its score. */
  best: SearchedBlock | null;
  /** Number of evaluated blocks by level, the coarsest first. */
  levels: readonly { level: number; side: number; count: number }[];
}

export function stateAt({ blocks }: CorrelativeSearch, count: number): SearchState {
  const seen = blocks.slice(0, count);
  const levels = new Map<number, { level: number; side: number; count: number }>();
  for (const { level, side } of seen) {
    const known = levels.get(level);
    if (known) known.count++;
    else levels.set(level, { level, side, count: 1 });
  }
  // Every single pose that is evaluated is better than those before it.
  const best = seen.findLast(({ level }) => level === 0) ?? null;
  return { block: seen.at(-1) ?? null, best, levels: [...levels.values()].sort((a, b) => b.level - a.level) };
}

/** Middle of a block; of one of level 0, its pose. */
export function poseOfBlock(center: Pose, { level, turn, x, y, side }: SearchedBlock): Pose {
  const middle = level === 0 ? 0 : side / 2;
  const { x: cx, y: cy, theta } = planarParts(center);
  return planarPose(cx + x + middle, cy + y + middle, theta + turn);
}

/** Draws the blocks of the selected heading, the finest on top. */
export function searchPainter(search: CorrelativeSearch, count: number, colors: Colors, dark: boolean): Painter {
  const { blocks, reach } = search;
  const { block, best } = stateAt(search, count);
  const drawn = blocks.slice(0, count).filter(({ turn }) => turn === block?.turn);
  drawn.sort((a, b) => b.level - a.level);
  const { low, high } = rangeOf([blocks.map(({ bound }) => bound)]);
  const ramp = Array.from({ length: 64 }, (_, i): string => cssColor(frameColor(i / 63, dark)));
  const colorOf = ({ bound }: SearchedBlock): string => ramp[Math.round((63 * (bound - low)) / (high - low))] ?? '';
  return (pen, size) => {
    const area = plotArea(size);
    const axis = linearAxis({ low: -reach, high: reach });
    drawAxes(pen, area, axis, axis, { x: 'x (m)', y: 'y (m)' }, colors);
    const scale = area.width / (2 * reach);
    const left = (x: number): number => area.x + area.width * axis.share(x);
    const top = (y: number): number => area.y + area.height * (1 - axis.share(y));
    pen.inside(area.x, area.y, area.width, area.height, () => {
      for (const one of drawn) {
        const tall = (area.height / area.width) * one.side * scale;
        pen.rect(left(one.x), top(one.y) - tall, one.side * scale, tall, colorOf(one));
        pen.line(cornersOf(one), { color: colors.background, width: 0.5 });
      }
      if (block) pen.line(cornersOf(block), { color: colors.selected, width: 1.75 });
      if (best?.turn === block?.turn && best)
        pen.circle(left(best.x), top(best.y), 5, colors.selected, colors.background);
    });

    function cornersOf({ x, y, side }: SearchedBlock): number[] {
      const [x0, x1, y0, y1] = [left(x), left(x + side), top(y), top(y + side)];
      return [x0, y0, x1, y0, x1, y1, x0, y1, x0, y0];
    }
  };
}
