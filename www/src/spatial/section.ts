/** An upright plane that cuts the map: what lies beyond it is not drawn. */
import { axes, type Orbit } from '../views/orbit.js';
import { added, dot, scaled, type Vec3 } from '../views/vectors.js';
import type { Survey } from './survey.js';

/** The points for which `normal` . point = `offset`, in the map's world. */
export interface Plane {
  normal: Vec3;
  offset: number;
}

/** A plane as the graphics card takes it, normal and offset; with none, nothing lies beyond it. */
export const planeUniform = (plane: Plane | null): readonly [number, number, number, number] =>
  plane ? [...plane.normal, plane.offset] : [0, 0, 0, 1];

/**
 * Seen from above this elevation (rad), walls are drawn from behind as well, so that a plan has no gaps: a wall hides there of the
 * floor behind it little more than half of its own height.
 */
const PLAN_ELEVATION = (60 * Math.PI) / 180;

/** Whether surfaces are drawn from behind as well; otherwise a room is looked into through its walls. */
export const seesBacks = ({ elevation }: Orbit, isInside: boolean): boolean => isInside || elevation >= PLAN_ELEVATION;

/** Which walls the plane is parallel to, which side is cut away, and how much of the map is left (0..1). */
export interface Cut {
  along: 'none' | 'across' | 'deep';
  isTurned: boolean;
  share: number;
}

export const NO_CUT: Cut = { along: 'none', isTurned: false, share: 0.5 };

/** Null: nothing is cut. `kept`: how much is left, from the first point on (m). */
export function planeOf({ along, isTurned, share }: Cut, survey: Survey): { plane: Plane; kept: number } | null {
  if (along === 'none' || survey.sampled.length === 0) return null;
  const { right, back } = axes({ azimuth: survey.straight, elevation: 0 });
  const direction = scaled(along === 'across' ? right : back, isTurned ? -1 : 1);
  const places = survey.sampled.map((point) => dot(point, direction));
  const [low, high] = [Math.min(...places), Math.max(...places)];
  const kept = share * (high - low);
  const [r, u, b] = survey.R_view_map;
  const normal = added(added(scaled(r, direction[0]), u, direction[1]), b, direction[2]);
  return { plane: { normal, offset: low + kept }, kept };
}
