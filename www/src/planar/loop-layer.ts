/** The graph over the map: nodes, loops by how far the rest of the graph contradicts them, and the scans of the one that is looked at. */
import type { GraphLoop, PlanarPose } from '../engine/protocol.js';
import type { MapLayer } from '../views/map-layer.js';
import { type Context, DARK_MAP, LIGHT_MAP, type MapTheme, type Status } from '../views/map-painter.js';
import { cssColor } from '../views/palette.js';
import { type Size, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';
import { composed, inverse, placed } from './loop-poses.js';
import type { Mending } from './mending.js';

/** Chi-squared of three degrees of freedom that one right loop in 100, and one in 100,000, exceeds. */
const [DOUBTFUL, WRONG] = [11.3, 25.9];
const LIGHT: Record<Status, string> = { good: '#19703e', doubtful: '#b86e00', lost: '#ad2219' };
const DARK: Record<Status, string> = { good: '#6fd7a0', doubtful: '#f2b862', lost: '#ff938a' };

/** How well a loop fits the rest of the graph; one that this tells nothing of is doubtful. */
export function fitOf({ chi_squared: chiSquared }: GraphLoop): Status {
  return chiSquared > WRONG ? 'lost' : chiSquared > DOUBTFUL || chiSquared === 0 ? 'doubtful' : 'good';
}

export function loopLayer(mending: Mending): MapLayer {
  const { poses } = mending;
  return {
    paint: (ctx, size, view, dark) => paint(mending, poses, new Pen(ctx, size, view, dark)),
    tap: (x, y, reach, size, view) => {
      const at = (scan: number): [number, number] => onScreen(view, size, poses[scan]);
      const isChoosing = mending.draft?.kind === 'new' && !mending.draft.pose;
      const scan = isChoosing ? nearest(poses.keys(), (scan) => distance([x, y], at(scan), at(scan)), reach) : null;
      if (scan !== null) mending.chooseScan(scan);
      if (mending.draft?.kind === 'new') return true;
      const toLoop = ({ target, source }: GraphLoop): number => distance([x, y], at(target), at(source));
      const loop = nearest(mending.loops?.loops ?? [], toLoop, reach);
      if (loop) mending.prepare({ kind: 'old', loop });
      return loop !== null;
    },
    drag: (x, y) => mending.move(x, y, 0, false),
    release: () => void mending.move(0, 0),
    keys: mending.keys,
  };
}

function paint(mending: Mending, poses: readonly PlanarPose[], pen: Pen): void {
  const { loops, draft } = mending;
  for (const node of loops?.nodes ?? []) pen.dot(poses[node], 1.5, pen.theme.path);
  for (const [target, source] of loops?.left_out ?? [])
    pen.line(poses[target], poses[source], pen.theme.text, 1, [3, 4]);
  // The least fitting on top.
  for (const loop of [...(loops?.loops ?? [])].reverse())
    pen.line(poses[loop.target], poses[loop.source], pen.colors[fitOf(loop)], 2.5);
  if (!draft) return;
  const [target = -1, source = -1] = draft.kind === 'old' ? [draft.loop.target, draft.loop.source] : draft.scans;
  const [from, to] = [poses[target], poses[source]];
  const pose = draft.kind === 'new' ? draft.pose : from && composed(from, draft.loop.T_target_source);
  pen.line(from, to, cssColor(pen.theme.selected), 4);
  pen.scan(mending, target, from, from, pen.colors.good);
  pen.scan(mending, source, to, pose, cssColor(pen.theme.selected));
  for (const end of [from, pose]) pen.dot(end, 6, cssColor(pen.theme.selected));
}

/** Paints in the world's coordinates. */
class Pen {
  readonly theme: MapTheme;
  readonly colors: Record<Status, string>;

  constructor(
    readonly ctx: Context,
    readonly size: Size,
    readonly view: Viewport,
    dark: boolean,
  ) {
    this.theme = dark ? DARK_MAP : LIGHT_MAP;
    this.colors = dark ? DARK : LIGHT;
  }

  line(
    from: PlanarPose | undefined,
    to: PlanarPose | undefined,
    color: string,
    width: number,
    dashes: number[] = [],
  ): void {
    if (!from || !to) return;
    const { ctx, size, view } = this;
    ctx.setLineDash(dashes);
    ctx.lineCap = 'round';
    ctx.beginPath();
    ctx.moveTo(...onScreen(view, size, from));
    ctx.lineTo(...onScreen(view, size, to));
    for (const [style, extra] of [
      [this.theme.halo, 2.5],
      [color, 0],
    ] as const) {
      ctx.strokeStyle = style;
      ctx.lineWidth = width + extra;
      ctx.stroke();
    }
    ctx.setLineDash([]);
  }

  dot(at: { x: number; y: number } | null | undefined, radius: number, color: string): void {
    if (!at) return;
    const { ctx } = this;
    ctx.fillStyle = color;
    ctx.beginPath();
    ctx.arc(...onScreen(this.view, this.size, at), radius, 0, 2 * Math.PI);
    ctx.fill();
  }

  /** The points of a scan as if it had been taken at another pose. */
  scan(
    { session: { points: set } }: Mending,
    scan: number,
    from: PlanarPose | undefined,
    to: PlanarPose | null | undefined,
    color: string,
  ): void {
    if (!from || !to) return;
    const { ctx, size, view } = this;
    const moved = composed(to, inverse(from));
    ctx.fillStyle = color;
    const end = 2 * (set.offsets[scan + 1] ?? 0);
    for (let i = 2 * (set.offsets[scan] ?? 0); i < end; i += 2) {
      const at = placed(moved, set.points[i] ?? 0, set.points[i + 1] ?? 0);
      const [x, y] = onScreen(view, size, at);
      ctx.fillRect(x - 1.5, y - 1.5, 3, 3);
    }
  }
}

function onScreen(view: Viewport, size: Size, at: { x: number; y: number } | undefined): [number, number] {
  return at ? [toScreenX(view, size, at.x, at.y), toScreenY(view, size, at.x, at.y)] : [Infinity, Infinity];
}

/** From a point to the line between two. */
function distance([x, y]: [number, number], [ax, ay]: [number, number], [bx, by]: [number, number]): number {
  const [dx, dy] = [bx - ax, by - ay];
  const share = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
  return Math.hypot(ax + share * dx - x, ay + share * dy - y);
}

/** The nearest one within reach. */
function nearest<T>(all: Iterable<T>, distanceTo: (one: T) => number, reach: number): T | null {
  let found: T | null = null;
  let best = reach;
  for (const one of all) {
    const away = distanceTo(one);
    if (away <= best) [found, best] = [one, away];
  }
  return found;
}
