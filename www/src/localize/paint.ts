/** The map with the way through it, and the places of one scan. Plain data in, strokes out. */
import { DARK_MAP, LIGHT_MAP, type MapTheme, paintAxes, paintScaleBar, type Status } from '../views/map-painter.js';
import { cssColor, type Rgb } from '../views/palette.js';
import { paintArrow } from '../views/path-painter.js';
import { type Size, toScreenAngle, toScreenX, toScreenY, type Viewport } from '../views/viewport.js';
import { levelFor, type MapLevels } from './map-levels.js';
import { paintParticles } from './paint-particles.js';
import type { LocatedPose, ScanDetails } from './protocol.js';
import { poseOf, type Track, worldOf } from './track.js';

export interface LocatedScene {
  map: MapLevels | null;
  track: Track | null;
  selected: number;
  /** Of the selected scan; null before it has come. */
  details: ScanDetails | null;
  /** x, y, theta and weight of each particle. */
  particles: Float32Array | null;
  layers: SceneLayers;
  dark: boolean;
}

export interface SceneLayers {
  /** The likelihood field in the place of the map. */
  field: boolean;
  particles: boolean;
  trajectory: boolean;
  returns: boolean;
  places: boolean;
}

/** Of what is certain, of what may be wrong, of the returns of a scan and of particles: as told on the page. */
const COLORS = {
  light: {
    good: [10, 122, 63],
    doubtful: [192, 92, 0],
    lost: [173, 34, 25],
    returns: [29, 95, 209],
    particles: [147, 36, 165],
  },
  dark: {
    good: [83, 208, 138],
    doubtful: [255, 176, 77],
    lost: [255, 147, 138],
    returns: [127, 176, 255],
    particles: [226, 150, 240],
  },
} as const satisfies Record<string, Record<Status | 'returns' | 'particles', Rgb>>;

/** One for each scan. */
export function statusColors(statuses: readonly Status[], dark: boolean): Rgb[] {
  const colors = COLORS[dark ? 'dark' : 'light'];
  return statuses.map((status) => colors[status]);
}

/** Quantile of chi-squared with two degrees of freedom: 95 % of the positions lie within. */
const WITHIN_95 = 5.991;
/** Of the places, the most likely ones have a probability beside them. */
const MOST_LABELLED = 12;
const ELLIPSE_STEPS = 40;
/** Half the length of the signs of a place, CSS pixels. */
const PLACE_RADIUS = 12;
const RIVAL_RADIUS = 9;
/** Opacity of a place that is next to impossible. */
const FAINTEST = 0.3;
/** Room that a probability takes, CSS pixels. */
const [LABEL_WIDTH, LABEL_HEIGHT] = [46, 15];

type Context = CanvasRenderingContext2D;

/** `ratio`: device pixels per CSS pixel. */
export function paintScene(ctx: Context, size: Size, ratio: number, view: Viewport, scene: LocatedScene): void {
  const { map, track, details, particles, layers, dark } = scene;
  const theme = dark ? DARK_MAP : LIGHT_MAP;
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.fillStyle = theme.background;
  ctx.fillRect(0, 0, size.width, size.height);
  if (!map) return;
  paintMap(ctx, size, ratio, view, map);
  const { good, doubtful, lost, returns, particles: ofParticles } = COLORS[dark ? 'dark' : 'light'];
  const colors: Colors = {
    good: cssColor(good),
    doubtful: cssColor(doubtful),
    lost: cssColor(lost),
    returns: cssColor(returns),
  };
  if (track && layers.trajectory) paintTrack(ctx, size, view, track, colors, theme);
  if (particles && layers.particles) paintParticles(ctx, size, view, particles, cssColor(ofParticles));
  const shown = details?.index === scene.selected ? details : null;
  if (shown && layers.returns) paintReturns(ctx, size, view, shown.points, colors.returns);
  if (shown && layers.places) paintPlaces(ctx, size, view, shown, colors, theme);
  const pose = track && (!shown || !layers.places) ? poseOf(track.values, scene.selected) : null;
  if (pose) paintPose(ctx, size, view, pose, PLACE_RADIUS, colors[pose.status], theme.halo);
  paintScaleBar(ctx, size, view, theme);
  paintAxes(ctx, size, view, theme);
}

function paintMap(ctx: Context, size: Size, ratio: number, view: Viewport, map: MapLevels): void {
  const { grid } = map;
  const level = levelFor(map, view.scale * grid.resolution * ratio);
  if (!level) return;
  const at = (right: number, up: number): [number, number] => {
    const [x, y] = worldOf(grid, right, up);
    return [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
  };
  const [left, top] = at(0, grid.height);
  const [rightX, rightY] = at(level.cells, grid.height);
  const [belowX, belowY] = at(0, grid.height - level.cells);
  ctx.save();
  ctx.transform(rightX - left, rightY - top, belowX - left, belowY - top, left, top);
  ctx.imageSmoothingEnabled = view.scale * grid.resolution * level.cells * ratio < 1;
  ctx.drawImage(level.image, 0, 0);
  ctx.restore();
}

type Colors = Record<Status | 'returns', string>;

/** The paths are kept in the world: the canvas transforms them. */
function paintTrack(ctx: Context, size: Size, view: Viewport, track: Track, colors: Colors, theme: MapTheme): void {
  const [originX, originY] = [toScreenX(view, size, 0, 0), toScreenY(view, size, 0, 0)];
  ctx.save();
  ctx.transform(
    toScreenX(view, size, 1, 0) - originX,
    toScreenY(view, size, 1, 0) - originY,
    toScreenX(view, size, 0, 1) - originX,
    toScreenY(view, size, 0, 1) - originY,
    originX,
    originY,
  );
  [ctx.lineJoin, ctx.lineCap] = ['round', 'round'];
  for (const [path, color, width] of [
    [track.doubtful, colors.doubtful, 4],
    [track.certain, colors.good, 2.2],
  ] as const) {
    [ctx.strokeStyle, ctx.lineWidth] = [theme.halo, (width + 2) / view.scale];
    ctx.stroke(path);
    [ctx.strokeStyle, ctx.lineWidth] = [color, width / view.scale];
    ctx.stroke(path);
  }
  ctx.restore();
}

function paintReturns(ctx: Context, size: Size, view: Viewport, points: Float32Array, color: string): void {
  ctx.fillStyle = color;
  ctx.beginPath();
  for (let i = 0; i + 1 < points.length; i += 2) {
    const [x, y] = [points[i] ?? 0, points[i + 1] ?? 0];
    ctx.rect(toScreenX(view, size, x, y) - 1.5, toScreenY(view, size, x, y) - 1.5, 3, 3);
  }
  ctx.fill();
}

/** The most likely place over its rivals, which are the paler the less likely they are; each with its 95 % region. */
function paintPlaces(
  ctx: Context,
  size: Size,
  view: Viewport,
  { scan: { place, rivals, status } }: ScanDetails,
  colors: Colors,
  theme: MapTheme,
): void {
  if (!place) return;
  for (const rival of rivals.toReversed()) {
    ctx.save();
    ctx.globalAlpha = FAINTEST + (1 - FAINTEST) * Math.sqrt(rival.probability / place.probability);
    paintPlace(ctx, size, view, rival, RIVAL_RADIUS, colors.doubtful, theme.halo);
    ctx.restore();
  }
  paintPlace(ctx, size, view, place, PLACE_RADIUS, colors[status], rivals.length > 0 ? theme.path : theme.halo);
  if (rivals.length > 0) paintShares(ctx, size, view, [place, ...rivals], theme);
}

function paintPlace(
  ctx: Context,
  size: Size,
  view: Viewport,
  { T_world_sensor: pose, covariance }: LocatedPose,
  radius: number,
  color: string,
  outline: string,
): void {
  const alpha = ctx.globalAlpha;
  ctx.beginPath();
  for (let step = 0; step < ELLIPSE_STEPS; step++) {
    const [dx, dy] = ofEllipse(covariance, (2 * Math.PI * step) / ELLIPSE_STEPS);
    const [x, y] = [pose.x + dx, pose.y + dy];
    ctx.lineTo(toScreenX(view, size, x, y), toScreenY(view, size, x, y));
  }
  ctx.closePath();
  [ctx.fillStyle, ctx.globalAlpha] = [color, 0.25 * alpha];
  ctx.fill();
  ctx.globalAlpha = alpha;
  [ctx.strokeStyle, ctx.lineWidth] = [color, 1.5];
  ctx.stroke();
  paintPose(ctx, size, view, pose, radius, color, outline);
}

function paintPose(
  ctx: Context,
  size: Size,
  view: Viewport,
  { x, y, theta }: { x: number; y: number; theta: number },
  radius: number,
  color: string,
  outline: string,
): void {
  const [screenX, screenY] = [toScreenX(view, size, x, y), toScreenY(view, size, x, y)];
  paintArrow(ctx, screenX, screenY, toScreenAngle(view, theta), radius, color, outline);
}

/** The probabilities of the most likely places, where there is room for them. */
function paintShares(ctx: Context, size: Size, view: Viewport, places: readonly LocatedPose[], theme: MapTheme): void {
  [ctx.font, ctx.textAlign, ctx.textBaseline] = ['600 12px system-ui, sans-serif', 'left', 'middle'];
  [ctx.strokeStyle, ctx.lineWidth, ctx.lineJoin, ctx.fillStyle] = [theme.halo, 4, 'round', theme.path];
  const taken: [number, number][] = [];
  for (const { T_world_sensor, probability } of places.slice(0, MOST_LABELLED)) {
    const { x, y } = T_world_sensor;
    const [left, middle] = [toScreenX(view, size, x, y) + 14, toScreenY(view, size, x, y) - 12];
    if (taken.some(([x, y]) => Math.abs(x - left) < LABEL_WIDTH && Math.abs(y - middle) < LABEL_HEIGHT)) continue;
    taken.push([left, middle]);
    ctx.strokeText(percent(probability), left, middle);
    ctx.fillText(percent(probability), left, middle);
  }
}

/** Never a hundred or nothing where it is less or more than that. */
export function percent(share: number): string {
  if (share > 0 && share < 0.001) return '< 0.1 %';
  if (share < 1 && share >= 0.9995) return '> 99.9 %';
  return `${(100 * share).toFixed(share < 0.0995 || share > 0.9905 ? 1 : 0)} %`;
}

/** From the middle of the 95 % region to its border: a point of the unit circle by the covariance's lower triangular root. */
function ofEllipse([xx = 0, xy = 0, , , yy = 0]: readonly number[], angle: number): [number, number] {
  const a = Math.sqrt(Math.max(xx, 1e-12));
  const b = xy / a;
  const c = Math.sqrt(Math.max(yy - b * b, 0));
  const [s, t] = [Math.sqrt(WITHIN_95) * Math.cos(angle), Math.sqrt(WITHIN_95) * Math.sin(angle)];
  return [a * s, b * s + c * t];
}
