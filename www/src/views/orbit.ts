/**
 * The orbit camera of all views in space: the eye looks at a target from a direction and a distance. Plain values; every
 * change is a new one.
 */
import { added, dot, normalized, scaled, type Vec3 } from './vectors.js';
import type { Size } from './viewport.js';

export type { Size };

/** From where the eye looks. */
export interface Direction {
  /** Turn about the vertical, rad; 0: from where the world's `back` points. */
  azimuth: number;
  /** Above the horizon, rad; a right angle: straight down. */
  elevation: number;
  /** Turn of the picture about the line of sight, rad: what is up leans to the right. None without. */
  roll?: number;
}

export interface Orbit extends Direction {
  /** In the picture's world: y up, and at azimuth 0 the eye is behind the first camera, looking where it looked. */
  target: Vec3;
  /** m */
  distance: number;
  projection: 'perspective' | 'orthographic';
  /** Half the height that is seen, a metre away; `TAN_HALF_VIEW` without. */
  tanHalfView?: number;
}

/** Half the height that is seen, a metre away. */
export const TAN_HALF_VIEW = Math.tan((22 * Math.PI) / 180);

export const STRAIGHT_DOWN = Math.PI / 2;
const LOWEST = (-80 * Math.PI) / 180;
const NEAREST = 0.05;
const FARTHEST = 2000;

export interface Axes {
  right: Vec3;
  up: Vec3;
  /** From the target to the eye. */
  back: Vec3;
}

/** Worlds, by what is right, up and back at azimuth 0 and elevation 0. */
export const Y_UP: Axes = { right: [1, 0, 0], up: [0, 1, 0], back: [0, 0, 1] };
export const Z_UP: Axes = { right: [0, 1, 0], up: [0, 0, 1], back: [1, 0, 0] };

/** What is right, up and back on the screen. */
export function axes({ azimuth, elevation, roll = 0 }: Direction, world: Axes = Y_UP): Axes {
  const [ca, sa] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [ce, se] = [Math.cos(elevation), Math.sin(elevation)];
  const levelBack = added(scaled(world.back, ca), world.right, sa);
  const right = added(scaled(world.right, ca), world.back, -sa);
  const up = added(scaled(world.up, ce), levelBack, -se);
  const [cr, sr] = [Math.cos(roll), Math.sin(roll)];
  return {
    right: added(scaled(right, cr), up, -sr),
    up: added(scaled(up, cr), right, sr),
    back: added(scaled(levelBack, ce), world.up, se),
  };
}

export function eye(orbit: Orbit): Vec3 {
  return added(orbit.target, axes(orbit).back, orbit.distance);
}

/** Metres that one pixel of the screen covers, at the target. */
export function metresPerPixel(orbit: Orbit, { height }: Size): number {
  return (2 * orbit.distance * tanHalfView(orbit)) / Math.max(height, 1);
}

export const tanHalfView = (orbit: Orbit): number => orbit.tanHalfView ?? TAN_HALF_VIEW;

/** The orbit of an eye at this place that looks ahead (a unit vector), with `up` as upright as it can be. */
export function looking(eye: Vec3, ahead: Vec3, up: Vec3, tanHalfView: number): Orbit {
  const level = {
    azimuth: Math.atan2(-ahead[0], -ahead[2]),
    elevation: Math.asin(Math.min(Math.max(-ahead[1], -1), 1)),
  };
  const { right, up: above } = axes(level);
  const roll = Math.atan2(dot(up, right), dot(up, above));
  return { ...level, roll, target: added(eye, ahead), distance: 1, projection: 'perspective', tanHalfView };
}

/** What lies under a position on the screen: a line in the picture's world that begins before all there is in reach (m). */
export function ray(orbit: Orbit, size: Size, x: number, y: number, reach: number): { origin: Vec3; direction: Vec3 } {
  const axis = axes(orbit);
  const scale = metresPerPixel(orbit, size);
  const [right, up] = [(x - size.width / 2) * scale, (size.height / 2 - y) * scale];
  const place = added(added(orbit.target, axis.right, right), axis.up, up);
  if (orbit.projection === 'orthographic') {
    return { origin: added(place, axis.back, reach), direction: scaled(axis.back, -1) };
  }
  const origin = eye(orbit);
  return { origin, direction: normalized(added(place, origin, -1)) };
}

/** Rotates the camera around the target (rad), with an elevation of at least `lowest` (rad). */
export function orbited<T extends Direction>(orbit: T, right: number, up: number, lowest = LOWEST): T {
  const elevation = Math.min(Math.max(orbit.elevation - up, lowest), STRAIGHT_DOWN);
  return { ...orbit, azimuth: orbit.azimuth - right, elevation };
}

/** Translates the scene with the pointer (pixels). */
export function panned(orbit: Orbit, size: Size, right: number, down: number): Orbit {
  const scale = metresPerPixel(orbit, size);
  const axis = axes(orbit);
  return { ...orbit, target: added(added(orbit.target, axis.right, -right * scale), axis.up, down * scale) };
}

/** Zooms such that the point under a position on the screen, at the target's distance, stays there. */
export function zoomedAt(orbit: Orbit, size: Size, x: number, y: number, factor: number): Orbit {
  const distance = Math.min(Math.max(orbit.distance / factor, NEAREST), FARTHEST);
  const share = 1 - distance / orbit.distance;
  const right = (x - size.width / 2) * share;
  const down = (y - size.height / 2) * share;
  return { ...panned(orbit, size, -right, -down), distance };
}

/** Pixels left free at either side, above and below. */
export interface Margin {
  across: number;
  along: number;
}

/** All of the points but the outermost few are seen, from the same direction. */
export function fitted(orbit: Orbit, points: readonly Vec3[], size: Size, margin: Margin): Orbit {
  if (points.length === 0 || size.width === 0 || size.height === 0) return orbit;
  const axis = axes(orbit);
  const across = range(points.map((point) => dot(point, axis.right)));
  const along = range(points.map((point) => dot(point, axis.up)));
  const deep = range(points.map((point) => dot(point, axis.back)));
  const middle = (deep.low + deep.high) / 2;
  const free = {
    width: Math.max(size.width - 2 * margin.across, 40),
    height: Math.max(size.height - 2 * margin.along, 40),
  };
  const tanHeight = TAN_HALF_VIEW * (free.height / size.height);
  const tanWidth = TAN_HALF_VIEW * (free.width / size.height);
  const flat = Math.max((across.high - across.low) / 2 / tanWidth, (along.high - along.low) / 2 / tanHeight, 0.5);
  // What is nearer than the target looks larger.
  const distance = orbit.projection === 'perspective' ? flat + (deep.high - deep.low) / 2 : flat;
  const target = added(
    added(added([0, 0, 0], axis.right, (across.low + across.high) / 2), axis.up, (along.low + along.high) / 2),
    axis.back,
    middle,
  );
  return { ...orbit, target, distance };
}

/** Whether a move from one to the other would hardly be noticed. */
export function isAlike(a: Orbit, b: Orbit): boolean {
  const apart = Math.hypot(...added(a.target, b.target, -1)) / b.distance;
  const turned = Math.hypot(a.azimuth - b.azimuth, a.elevation - b.elevation);
  return apart < 0.08 && Math.abs(Math.log(a.distance / b.distance)) < 0.12 && turned < 0.15;
}

function range(values: readonly number[]): { low: number; high: number } {
  const sorted = Float64Array.from(values).sort();
  const cut = Math.floor(sorted.length * 0.004);
  return { low: sorted[cut] ?? 0, high: sorted[sorted.length - 1 - cut] ?? 0 };
}

/** Where a point of the picture's world is on the screen, CSS pixels; null behind the eye. */
export function toScreen(orbit: Orbit, size: Size, point: Vec3): { x: number; y: number } | null {
  const axis = axes(orbit);
  const fromTarget = added(point, orbit.target, -1);
  const depth = orbit.distance - dot(fromTarget, axis.back);
  if (orbit.projection === 'perspective' && depth < 0.01) return null;
  const scale = size.height / 2 / tanHalfView(orbit) / (orbit.projection === 'perspective' ? depth : orbit.distance);
  return {
    x: size.width / 2 + dot(fromTarget, axis.right) * scale,
    y: size.height / 2 - dot(fromTarget, axis.up) * scale,
  };
}

/** Index of the point nearest to a position on the screen, within `reach` CSS pixels; null: none. */
export function nearest(
  points: readonly Vec3[],
  orbit: Orbit,
  size: Size,
  x: number,
  y: number,
  reach: number,
): number | null {
  let best: { index: number; distance: number } | null = null;
  for (const [index, point] of points.entries()) {
    const place = toScreen(orbit, size, point);
    if (!place) continue;
    const distance = Math.hypot(place.x - x, place.y - y);
    if (distance <= (best?.distance ?? reach)) best = { index, distance };
  }
  return best?.index ?? null;
}

/** On the way from one view to another, `t` from 0 to 1; turns go the short way round. */
export function between(from: Orbit, to: Orbit, t: number): Orbit {
  if (t >= 1) return to;
  const ease = t * t * (3 - 2 * t);
  const mix = (a: number, b: number): number => a + (b - a) * ease;
  const turn = Math.atan2(Math.sin(to.azimuth - from.azimuth), Math.cos(to.azimuth - from.azimuth));
  return {
    ...to,
    target: [mix(from.target[0], to.target[0]), mix(from.target[1], to.target[1]), mix(from.target[2], to.target[2])],
    azimuth: from.azimuth + turn * ease,
    elevation: mix(from.elevation, to.elevation),
    distance: Math.exp(mix(Math.log(from.distance), Math.log(to.distance))),
  };
}
