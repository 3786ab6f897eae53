/** Layers over the two pictures. Coordinates are pixels of the picture; the middle of the first one is (0, 0). */
import type { BevDocument } from './document.js';
import { gridLines, markedPixels, regionCorners } from './document.js';
import type { Projection, BevPoint, Pixel } from './protocol.js';

/** Draws over a picture that is shown at `scale` canvas pixels per image pixel. */
export type Overlay = (context: CanvasRenderingContext2D, stage: Stage) => void;

export interface Stage {
  /** Canvas pixels for each pixel of the picture. */
  scale: number;
  /** Canvas pixels for each CSS pixel: lines and words are as thick on every screen. */
  density: number;
  /** Of the picture. */
  width: number;
  height: number;
}

// The same on every picture, in light and dark: a colour with a rim that stands off from it.
const MARK = '#ff3d8b';
const MARK_SOFT = 'rgb(255 61 139 / 0.28)';
const CUT = '#ffb020';
const PAIR = '#27c7ff';
const RIM = 'rgb(10 14 20 / 0.85)';
const SEEN = 'rgb(255 255 255 / 0.75)';

/** The marks in the top view; `ghost` is where the pointer in the front view points to. */
export function topOverlay(
  document: BevDocument,
  answer: Projection | null,
  selected: number | null,
  ghost: Pixel | null,
): Overlay {
  const points = markedPixels(document);
  const corners = regionCorners(document);
  const lines = gridLines(document);
  return (context, stage) => {
    const pen = penOf(context, stage);
    if (answer?.common.is_clipped && answer.common.marked.length > 0) {
      pen.path(answer.common.marked, true);
      pen.stroke(SEEN, 1, [1.5, 3]);
    }
    if (corners.length > 0 && answer?.region) {
      const { marked, cuts, is_clipped } = answer.region;
      if (is_clipped) {
        pen.hatchOutside(corners, marked);
        pen.path(corners, true);
        pen.stroke(CUT, 1.5, [5, 4]);
      }
      pen.path(marked, true);
      pen.fill(MARK_SOFT);
      pen.edges(marked, cuts);
    } else if (document.tool === 'polygon') {
      pen.path(points, false);
      pen.stroke(MARK, 2);
    }
    for (const [from, to] of lines) pen.line(from, to, CUT, 1, [4, 4]);
    for (const { marked } of answer?.lines ?? []) pen.line(marked[0], marked[1], MARK, 1.5);
    if (document.tool === 'pairs') {
      document.pairs.forEach(({ top }, index) => pen.dot(top, letter(index), PAIR, index === selected));
    } else {
      const isGrid = lines.length > 0;
      if (isGrid) for (const point of points) pen.dot(point, '', MARK, false);
      const numbered = isGrid ? document.corners : points;
      numbered.forEach((point, index) => pen.dot(point, String(index + 1), MARK, index === selected));
    }
    if (ghost) pen.cross(ghost, SEEN);
  };
}

/** The projections in the front view; `ghost` is where the pointer in the top view points to. */
export function frontOverlay(
  document: BevDocument,
  answer: Projection | null,
  selected: number | null,
  ghost: Pixel | null,
): Overlay {
  return (context, stage) => {
    if (!answer) return;
    const pen = penOf(context, stage);
    if (answer.region) {
      const { projected, cuts } = answer.region;
      pen.path(projected, true);
      pen.fill(MARK_SOFT);
      pen.edges(projected, cuts);
    } else if (document.tool === 'polygon') {
      for (let i = 1; i < answer.points.length; i++) {
        const [from, to] = [answer.points[i - 1], answer.points[i]];
        if (from?.status === 'visible' && to?.status === 'visible' && from.projected && to.projected) {
          pen.line(from.projected, to.projected, MARK, 2);
        }
      }
    }
    for (const { projected } of answer.lines) pen.line(projected[0], projected[1], MARK, 1.5);
    if (document.tool === 'pairs') {
      document.pairs.forEach(({ front }, index) => {
        const projected = answer.pairPoints[index]?.projected;
        if (front && projected) pen.line(projected, front, PAIR, 1.5);
        if (projected) pen.cross(projected, CUT);
        if (front) pen.dot(front, letter(index), PAIR, index === selected);
      });
    } else {
      const isGrid = document.tool === 'grid' && document.corners.length === 2;
      answer.points.forEach((point, index) => {
        const label = isGrid ? '' : String(index + 1);
        const isSelected = index === selected && !isGrid;
        if (point.status === 'visible' && point.projected) pen.dot(point.projected, label, MARK, isSelected);
        else if (point.status === 'outside_image' && point.projected && !isGrid) pen.arrow(point, label);
      });
    }
    if (ghost) pen.cross(ghost, SEEN);
  };
}

/** A, B, C, ..., Z, AA, ... */
export function letter(index: number): string {
  const rest = Math.floor(index / 26);
  return (rest > 0 ? letter(rest - 1) : '') + String.fromCharCode(65 + (index % 26));
}

function penOf(context: CanvasRenderingContext2D, { scale, density, width, height }: Stage) {
  const x = (u: number) => (u + 0.5) * scale;
  const [right, bottom] = [width * scale, height * scale];
  context.lineJoin = 'round';
  context.lineCap = 'butt';

  function path(points: readonly Pixel[], isClosed: boolean): void {
    context.beginPath();
    add(points, isClosed);
  }

  function add(points: readonly Pixel[], isClosed: boolean): void {
    points.forEach(([u, v], index) => (index === 0 ? context.moveTo(x(u), x(v)) : context.lineTo(x(u), x(v))));
    if (isClosed && points.length > 0) context.closePath();
  }

  function fill(color: string): void {
    context.fillStyle = color;
    context.fill();
  }

  /** Strokes the path over a dark rim. */
  function stroke(color: string, thickness: number, dash: readonly number[] = []): void {
    context.setLineDash(dash.map((length) => length * density));
    context.strokeStyle = RIM;
    context.lineWidth = (thickness + 1.5) * density;
    if (dash.length === 0) context.stroke();
    context.strokeStyle = color;
    context.lineWidth = thickness * density;
    context.stroke();
    context.setLineDash([]);
  }

  function line(from: Pixel, to: Pixel, color: string, thickness: number, dash: readonly number[] = []): void {
    path([from, to], false);
    stroke(color, thickness, dash);
  }

  /** Edges of a region as lines, cuts through it dashed. */
  function edges(points: readonly Pixel[], cuts: readonly boolean[]): void {
    for (const isCut of [true, false]) {
      context.beginPath();
      points.forEach((point, index) => {
        if (cuts[index] === isCut) add([point, points[(index + 1) % points.length] ?? point], false);
      });
      stroke(isCut ? CUT : MARK, isCut ? 3 : 2, isCut ? [6, 4] : []);
    }
  }

  /** Hatches what of a region lies outside the part that is kept. */
  function hatchOutside(region: readonly Pixel[], kept: readonly Pixel[]): void {
    context.save();
    context.beginPath();
    context.rect(0, 0, right, bottom);
    add(kept, true);
    context.clip('evenodd');
    path(region, true);
    context.clip();
    context.beginPath();
    const step = 9 * density;
    for (let at = -bottom; at < right; at += step) {
      context.moveTo(at, bottom);
      context.lineTo(at + bottom, 0);
    }
    context.strokeStyle = CUT;
    context.globalAlpha = 0.7;
    context.lineWidth = 1.5 * density;
    context.stroke();
    context.restore();
  }

  function dot(at: Pixel, label: string, color: string, isSelected: boolean): void {
    const radius = (label === '' ? 2.5 : 4) * density;
    context.beginPath();
    context.arc(x(at[0]), x(at[1]), radius, 0, 2 * Math.PI);
    context.fillStyle = isSelected ? '#fff' : color;
    context.fill();
    context.strokeStyle = isSelected ? color : RIM;
    context.lineWidth = (isSelected ? 3 : 1.5) * density;
    context.stroke();
    if (label !== '') words(label, x(at[0]) + 7 * density, x(at[1]) - 7 * density);
  }

  /** A number that stays within the picture. */
  function words(text: string, left: number, base: number): void {
    context.font = `600 ${13 * density}px system-ui, sans-serif`;
    const wide = context.measureText(text).width;
    const place = Math.min(left, right - wide - 3 * density);
    const line = Math.max(base, 13 * density);
    context.lineWidth = 3.5 * density;
    context.strokeStyle = RIM;
    context.strokeText(text, place, line);
    context.fillStyle = '#fff';
    context.fillText(text, place, line);
  }

  function cross(at: Pixel, color: string): void {
    const arm = 5 / scale;
    for (const sign of [-1, 1]) {
      const end: Pixel = [at[0] + arm * density, at[1] + sign * arm * density];
      line([2 * at[0] - end[0], 2 * at[1] - end[1]], end, color, 2);
    }
  }

  /** At the edge of the picture, an arrow towards a point beyond it. */
  function arrow({ projected }: BevPoint, label: string): void {
    if (!projected) return;
    const inset = 12 * density;
    const [mx, my] = [right / 2, bottom / 2];
    const [dx, dy] = [x(projected[0]) - mx, x(projected[1]) - my];
    const share = Math.min((mx - inset) / Math.max(Math.abs(dx), 1e-9), (my - inset) / Math.max(Math.abs(dy), 1e-9));
    context.save();
    context.translate(mx + dx * share, my + dy * share);
    context.rotate(Math.atan2(dy, dx));
    context.beginPath();
    for (const [along, across] of [
      [9, 0],
      [-4, 6],
      [-4, -6],
    ] as const) {
      context.lineTo(along * density, across * density);
    }
    context.closePath();
    stroke(CUT, 1.5);
    fill(CUT);
    context.restore();
    words(label, mx + dx * share - 22 * density, my + dy * share + 4 * density);
  }

  return { path, fill, stroke, line, edges, hatchOutside, dot, cross, arrow };
}
