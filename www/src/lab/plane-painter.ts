/** Two clouds in the plane, the pairs between them, and what is known of the step: plain data in, strokes out. */
import type { Size } from '../views/figures.js';
import { cssColor } from '../views/palette.js';
import type { Pen } from '../views/pen.js';
import { roundLength, toScreenAngle, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';
import { formatLength } from '../views/format.js';
import { NUM_SHADES, type PairColor, REJECTION_COLORS, shades, shadesOf } from './pair-colors.js';
import { acted, centroid } from './poses.js';
import { type LabFacts, type LabIteration, NO_PARTNER, type Pose } from './protocol.js';

/** What is drawn of a step. */
export interface StageLook {
  colorBy: PairColor;
  pairs: boolean;
  rejected: boolean;
  normals: boolean;
  /** Factor by which pairs are drawn longer, so that residuals of millimetres are visible in a room of metres. */
  stretch: number;
}

export const FIRST_LOOK: StageLook = { colorBy: 'residual', pairs: true, rejected: true, normals: false, stretch: 1 };

/** A direction of motion at the middle of the pairs: a double arrow, or a round one where it turns. */
export interface Arrow {
  x: number;
  y: number;
  turns: boolean;
  dx: number;
  dy: number;
  color: string;
  label: string;
}

/** The shape of an ellipse about a point, by its half axes. */
export interface Ellipse {
  x: number;
  y: number;
  major: readonly [number, number];
  minor: readonly [number, number];
  color: string;
}

export interface PlaneScene {
  facts: LabFacts;
  pose: Pose;
  iteration: LabIteration | null;
  look: StageLook;
  /** Where the source was at the start, and other poses to compare with. */
  ghosts: readonly { pose: Pose; color: string }[];
  /** Of the source's centroid, x y x y ... */
  path: readonly number[];
  arrows: readonly Arrow[];
  ellipse: Ellipse | null;
  dark: boolean;
}

export interface StageTheme {
  background: string;
  grid: string;
  target: string;
  source: string;
  text: string;
  handle: string;
}

export const stageTheme = (dark: boolean): StageTheme =>
  dark
    ? {
        background: '#0b0f14',
        grid: '#171e27',
        target: '#c4ceda',
        source: '#8ab0ff',
        text: '#a3afbf',
        handle: '#8ab0ff',
      }
    : {
        background: '#fcfdfe',
        grid: '#e9edf2',
        target: '#3d4856',
        source: '#2356c7',
        text: '#4a5565',
        handle: '#2356c7',
      };

/** From metres to pixels. */
type Place = (x: number, y: number) => [number, number];

export function placer(view: Viewport, size: Size): Place {
  return (x, y) => [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
}

/** Grid and target: what stays while the source moves. */
export function paintGround(pen: Pen, size: Size, view: Viewport, { facts, dark }: PlaneScene): void {
  const theme = stageTheme(dark);
  const place = placer(view, size);
  pen.rect(0, 0, size.width, size.height, theme.background);
  paintLines(pen, size, view, theme);
  pen.dots(placed(facts.target_points, place), dotRadius(facts.target_points.length / 3), theme.target);
}

/** Everything above the ground. */
export function paintStep(pen: Pen, size: Size, view: Viewport, scene: PlaneScene): void {
  const { facts, pose, iteration, look, dark, ghosts, path } = scene;
  const theme = stageTheme(dark);
  const place = placer(view, size);
  const moved = movedPoints(facts.source_points, pose);
  const radius = dotRadius(facts.source_points.length / 3);
  for (const ghost of ghosts) {
    pen.dots(placed(movedPoints(facts.source_points, ghost.pose), place), radius * 0.8, ghost.color);
  }
  if (path.length > 2) pen.line(placedPath(path, place), { color: theme.source, width: 1.25, dash: [4, 4] });
  if (!iteration) pen.dots(placed(moved, place), radius, theme.source);
  else {
    if (look.normals) paintNormals(pen, place, scene, view);
    if (look.rejected) paintRejectedLines(pen, place, scene, moved);
    paintPairs(pen, place, scene, moved, radius);
    paintRejected(pen, place, scene, moved, radius);
  }
  if (scene.ellipse) paintEllipse(pen, place, scene.ellipse);
  for (const arrow of scene.arrows) paintArrow(pen, place, arrow, theme);
}

/** The handle by which the source is turned: where it is on the screen. */
export const HANDLE_REACH = 58;

export function handleOf(
  facts: LabFacts,
  pose: Pose,
  view: Viewport,
  size: Size,
): { pivot: [number, number]; grip: [number, number] } {
  const [x, y] = acted(pose, ...centroid(facts.source_points));
  const pivot = placer(view, size)(x, y);
  const heading = toScreenAngle(view, Math.atan2(pose[4] ?? 0, pose[0] ?? 1));
  return {
    pivot,
    grip: [pivot[0] + HANDLE_REACH * Math.cos(heading), pivot[1] - HANDLE_REACH * Math.sin(heading)],
  };
}

export function paintHandle(pen: Pen, facts: LabFacts, pose: Pose, view: Viewport, size: Size, dark: boolean): void {
  const theme = stageTheme(dark);
  const { pivot, grip } = handleOf(facts, pose, view, size);
  const ring = Array.from({ length: 65 }, (_, i) => {
    const angle = (i / 64) * 2 * Math.PI;
    return [pivot[0] + HANDLE_REACH * Math.cos(angle), pivot[1] + HANDLE_REACH * Math.sin(angle)];
  }).flat();
  pen.line(ring, { color: theme.handle, width: 1, dash: [2, 4] });
  pen.line([...pivot, ...grip], { color: theme.handle, width: 1.25 });
  pen.circle(...pivot, 4, theme.handle, theme.background);
  pen.circle(...grip, 7, theme.handle, theme.background);
}

/** Points moved by a pose, x y z x y z ... */
export function movedPoints(points: Float32Array, T: Pose): Float32Array {
  const [a = 1, b = 0, , x = 0, c = 0, d = 1, , y = 0] = Array.from(T);
  const moved = new Float32Array(points.length);
  for (let i = 0; i + 2 < points.length; i += 3) {
    const [px, py] = [points[i] as number, points[i + 1] as number];
    moved[i] = a * px + b * py + x;
    moved[i + 1] = c * px + d * py + y;
  }
  return moved;
}

const dotRadius = (count: number): number => (count > 20_000 ? 0.7 : count > 4000 ? 1.1 : 2);

function placed(points: Float32Array, place: Place): Float32Array {
  const result = new Float32Array((points.length / 3) * 2);
  for (let i = 0, k = 0; i + 2 < points.length; i += 3) {
    const [x, y] = place(points[i] as number, points[i + 1] as number);
    result[k++] = x;
    result[k++] = y;
  }
  return result;
}

function placedPath(path: readonly number[], place: Place): number[] {
  const result: number[] = [];
  for (let i = 0; i + 1 < path.length; i += 2) result.push(...place(path[i] ?? 0, path[i + 1] ?? 0));
  return result;
}

/** Lines one round length apart, with that length in the corner. */
function paintLines(pen: Pen, size: Size, view: Viewport, { grid, text }: StageTheme): void {
  const step = roundLength(view, 110);
  const pitch = step * view.scale;
  const [x0, y0] = placer(view, size)(0, 0);
  const ends: number[] = [];
  for (let x = x0 - Math.floor(x0 / pitch) * pitch; x <= size.width; x += pitch) ends.push(x, 0, x, size.height);
  for (let y = y0 - Math.floor(y0 / pitch) * pitch; y <= size.height; y += pitch) ends.push(0, y, size.width, y);
  pen.segments(ends, { color: grid, width: 1 });
  const [left, bottom] = [14, size.height - 14];
  pen.segments([left, bottom, left + pitch, bottom, left, bottom - 4, left, bottom + 4], { color: text, width: 1.5 });
  pen.segments([left + pitch, bottom - 4, left + pitch, bottom + 4], { color: text, width: 1.5 });
  pen.text(left + pitch / 2, bottom - 10, formatLength(step), { color: text, size: 11, align: 'middle' });
}

function paintPairs(
  pen: Pen,
  place: Place,
  { facts, iteration, look, dark }: PlaneScene,
  moved: Float32Array,
  radius: number,
): void {
  if (!iteration) return;
  const { source, target } = iteration;
  const shade = shadesOf(iteration, look.colorBy);
  const lines = Array.from({ length: NUM_SHADES }, (): number[] => []);
  const dots = Array.from({ length: NUM_SHADES }, (): number[] => []);
  for (let i = 0; i < source.length; i++) {
    const [s, t] = [3 * (source[i] as number), 3 * (target[i] as number)];
    const [px, py] = [moved[s] as number, moved[s + 1] as number];
    const [qx, qy] = [facts.target_points[t] as number, facts.target_points[t + 1] as number];
    const bin = shade[i] as number;
    dots[bin]?.push(...place(px, py));
    lines[bin]?.push(...place(qx + look.stretch * (px - qx), qy + look.stretch * (py - qy)), ...place(qx, qy));
  }
  for (const [bin, color] of shades(dark).entries()) {
    if (look.pairs) pen.segments(lines[bin] ?? [], { color: cssColor(color, 0.8), width: 1.5 });
  }
  for (const [bin, color] of shades(dark).entries()) pen.dots(dots[bin] ?? [], radius, cssColor(color));
}

function paintRejectedLines(pen: Pen, place: Place, { facts, iteration, dark }: PlaneScene, moved: Float32Array): void {
  if (!iteration) return;
  const lines = REJECTION_COLORS.map((): number[] => []);
  iteration.rejected_target.forEach((to, i) => {
    if (to === NO_PARTNER) return;
    const from = 3 * (iteration.rejected_source[i] ?? 0);
    const [px, py] = [moved[from] ?? 0, moved[from + 1] ?? 0];
    const [qx, qy] = [facts.target_points[3 * to] ?? 0, facts.target_points[3 * to + 1] ?? 0];
    lines[iteration.rejected_reason[i] ?? 0]?.push(...place(px, py), ...place(qx, qy));
  });
  REJECTION_COLORS.forEach(({ light, dark: onDark }, reason) => {
    pen.segments(lines[reason] ?? [], { color: dark ? onDark : light, width: 1, dash: [2, 3] });
  });
}

/**
 * A diamond without a partner, a cross where the normals disagree, an upright cross where trimmed or without a normal; a
 * diamond for all of them where their pairs are not drawn.
 */
function paintRejected(
  pen: Pen,
  place: Place,
  { iteration, look, dark }: PlaneScene,
  moved: Float32Array,
  radius: number,
): void {
  if (!iteration) return;
  const r = radius + 1;
  const signs = REJECTION_COLORS.map((): number[] => []);
  iteration.rejected_source.forEach((from, i) => {
    const [x, y] = place(moved[3 * from] ?? 0, moved[3 * from + 1] ?? 0);
    const reason = iteration.rejected_reason[i] ?? 0;
    const marks = signs[reason];
    if (reason === 0 || !look.rejected)
      marks?.push(x - r, y, x, y - r, x, y - r, x + r, y, x + r, y, x, y + r, x, y + r, x - r, y);
    else if (reason === 1) marks?.push(x - r, y - r, x + r, y + r, x - r, y + r, x + r, y - r);
    else marks?.push(x - r, y, x + r, y, x, y - r, x, y + r);
  });
  REJECTION_COLORS.forEach(({ light, dark: onDark }, reason) => {
    pen.segments(signs[reason] ?? [], { color: dark ? onDark : light, width: 1.25 });
  });
}

/** Length of a normal, CSS pixels. */
const NORMAL_PIXELS = 13;

function paintNormals(pen: Pen, place: Place, { facts, iteration, dark }: PlaneScene, view: Viewport): void {
  const { target_normals, target_points } = facts;
  if (!iteration || target_normals.length === 0) return;
  const length = NORMAL_PIXELS / view.scale;
  const ends: number[] = [];
  for (const to of iteration.target) {
    const [x, y] = [target_points[3 * to] ?? 0, target_points[3 * to + 1] ?? 0];
    const [nx, ny] = [target_normals[3 * to] ?? 0, target_normals[3 * to + 1] ?? 0];
    ends.push(...place(x, y), ...place(x + nx * length, y + ny * length));
  }
  pen.segments(ends, { color: stageTheme(dark).text, width: 1 });
}

/** Length of half an arrow, and of the ellipse's smaller half axis at least, CSS pixels. */
const ARROW_PIXELS = 74;
const MINOR_PIXELS = 16;

function paintEllipse(pen: Pen, place: Place, { x, y, major, minor, color }: Ellipse): void {
  const [cx, cy] = place(x, y);
  const [right, up] = axesOnScreen(place, x, y);
  const scale = MINOR_PIXELS / Math.max(Math.hypot(...minor), 1e-9);
  const points = Array.from({ length: 65 }, (_, i) => {
    const [c, s] = [Math.cos((i / 64) * 2 * Math.PI), Math.sin((i / 64) * 2 * Math.PI)];
    const [a, b] = [scale * (c * major[0] + s * minor[0]), scale * (c * major[1] + s * minor[1])];
    return [cx + a * right[0] + b * up[0], cy + a * right[1] + b * up[1]];
  }).flat();
  pen.line(points, { color, width: 2 });
}

/** Unit vectors of x and y on the screen. */
function axesOnScreen(place: Place, x: number, y: number): [[number, number], [number, number]] {
  const [from, alongX, alongY] = [place(x, y), place(x + 1, y), place(x, y + 1)];
  const unit = (to: [number, number]): [number, number] => {
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const length = Math.hypot(dx, dy) || 1;
    return [dx / length, dy / length];
  };
  return [unit(alongX), unit(alongY)];
}

function paintArrow(pen: Pen, place: Place, { x, y, turns, dx, dy, color, label }: Arrow, theme: StageTheme): void {
  const [cx, cy] = place(x, y);
  const [right, up] = axesOnScreen(place, x, y);
  const length = Math.hypot(dx, dy) || 1;
  const along = [(dx * right[0] + dy * up[0]) / length, (dx * right[1] + dy * up[1]) / length] as const;
  const reach = turns ? ARROW_PIXELS * 0.62 : ARROW_PIXELS;
  const tip: [number, number] = turns ? [cx, cy - reach] : [cx + reach * along[0], cy + reach * along[1]];
  const strokes = turns ? arcStrokes(cx, cy, reach) : straightStrokes(cx, cy, reach, Math.atan2(along[1], along[0]));
  for (const [width, shade] of [
    [5, theme.background],
    [2.5, color],
  ] as const) {
    pen.segments(strokes, { color: shade, width });
  }
  // Beyond the tip, clear of the other arrows and of the ring.
  const [lx, ly] = turns ? [cx - reach - 34, cy - reach] : [tip[0] + 14 * along[0] + 6, tip[1] + 14 * along[1]];
  pen.text(lx, ly, label, { color, size: 12, halo: theme.background });
}

const HEAD_PIXELS = 9;

function head(x: number, y: number, angle: number): number[] {
  return [-0.45, 0.45].flatMap((side) => [
    x,
    y,
    x - HEAD_PIXELS * Math.cos(angle + side),
    y - HEAD_PIXELS * Math.sin(angle + side),
  ]);
}

function straightStrokes(cx: number, cy: number, reach: number, angle: number): number[] {
  const [dx, dy] = [reach * Math.cos(angle), reach * Math.sin(angle)];
  return [
    cx - dx,
    cy - dy,
    cx + dx,
    cy + dy,
    ...head(cx + dx, cy + dy, angle),
    ...head(cx - dx, cy - dy, angle + Math.PI),
  ];
}

/** Three quarters of a circle, with a head at either end. */
function arcStrokes(cx: number, cy: number, radius: number): number[] {
  const [from, to] = [-0.75 * Math.PI - 0.5, 0.25 * Math.PI];
  const at = (i: number): number => from + (i / 32) * (to - from);
  const ends = Array.from({ length: 32 }, (_, i) =>
    [at(i), at(i + 1)].flatMap((a) => [cx + radius * Math.cos(a), cy + radius * Math.sin(a)]),
  );
  const tip = (angle: number, turn: number): number[] =>
    head(cx + radius * Math.cos(angle), cy + radius * Math.sin(angle), angle + (turn * Math.PI) / 2);
  return [...ends.flat(), ...tip(to, 1), ...tip(from, -1)];
}
