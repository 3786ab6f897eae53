/** The distance between two points of the surface, and how sure it is. */
import { html, type TemplateResult } from 'lit';
import type { SurfaceMesh } from '../engine/surface-protocol.js';
import { BOUND_95 } from '../../../package/report/bounds.js';
import { formatFixed } from '../views/format.js';
import { ray, toScreen } from '../views/orbit.js';
import { added, cross, dot, normalized, scaled, transformed, type Vec3 } from '../views/vectors.js';
import type { MapTool, ToolHost } from './map-tool.js';
import { type Plane, seesBacks } from './section.js';

/** A point of the surface, in the map's world. */
export interface SurfacePoint {
  place: Vec3;
  normal: Vec3;
  /** Standard deviation along the normal, m. */
  deviation: number;
}

/** What is drawn of the surface. */
export interface Shown {
  /** What lies above, towards `up`, is cut away (m). */
  up: Vec3;
  height: number;
  plane: Plane | null;
  /** Whether triangles are seen from behind as well. */
  hasBacks: boolean;
}

/** Length of the arms of a point's mark, in sides of a voxel. */
const ARM = 3;

/** The first point of the surface on a line, among what is shown; null: none. */
export function pick(mesh: SurfaceMesh, origin: Vec3, direction: Vec3, shown: Shown): SurfacePoint | null {
  const { triangles, deviations } = mesh;
  let best: { met: Met; corners: Corners } | null = null;
  for (let at = 0; at < triangles.length; at += 3) {
    const corners: Corners = [triangles[at] ?? 0, triangles[at + 1] ?? 0, triangles[at + 2] ?? 0];
    if (isFarFrom(mesh, corners, origin, direction)) continue;
    const met = meeting(corners.map((vertex) => placeOf(mesh, vertex)) as never, origin, direction);
    if (!met || (met.isBehind && !shown.hasBacks) || met.distance >= (best?.met.distance ?? Number.POSITIVE_INFINITY)) {
      continue;
    }
    if (isShown(added(origin, direction, met.distance), shown)) best = { met, corners };
  }
  if (!best) return null;
  const { met, corners } = best;
  const deviation = corners.reduce((sum, vertex, i) => sum + (met.shares[i] ?? 0) * (deviations[vertex] ?? 0), 0);
  return { place: added(origin, direction, met.distance), normal: met.normal, deviation };
}

type Corners = [number, number, number];

/** Where a line meets a triangle. */
interface Met {
  distance: number;
  /** Of the three corners. */
  shares: Vec3;
  normal: Vec3;
  isBehind: boolean;
}

const placeOf = ({ positions }: SurfaceMesh, vertex: number): Vec3 => [
  positions[3 * vertex] ?? 0,
  positions[3 * vertex + 1] ?? 0,
  positions[3 * vertex + 2] ?? 0,
];

/** Whether a line passes a triangle at more than its longest edges; plain numbers, as most of a million triangles end here. */
function isFarFrom({ positions: p }: SurfaceMesh, [a, b, c]: Corners, origin: Vec3, direction: Vec3): boolean {
  const [ax, ay, az] = [p[3 * a] ?? 0, p[3 * a + 1] ?? 0, p[3 * a + 2] ?? 0];
  const [x, y, z] = [ax - origin[0], ay - origin[1], az - origin[2]];
  const along = x * direction[0] + y * direction[1] + z * direction[2];
  const [bx, by, bz] = [(p[3 * b] ?? 0) - ax, (p[3 * b + 1] ?? 0) - ay, (p[3 * b + 2] ?? 0) - az];
  const [cx, cy, cz] = [(p[3 * c] ?? 0) - ax, (p[3 * c + 1] ?? 0) - ay, (p[3 * c + 2] ?? 0) - az];
  const reach = Math.max(bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz);
  return x * x + y * y + z * z - along * along > reach;
}

/** Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997; null: it does not. */
function meeting([a, b, c]: [Vec3, Vec3, Vec3], origin: Vec3, direction: Vec3): Met | null {
  const [toB, toC, from] = [added(b, a, -1), added(c, a, -1), added(origin, a, -1)];
  const p = cross(direction, toC);
  const determinant = dot(toB, p);
  if (determinant === 0) return null;
  const q = cross(from, toB);
  const [u, v] = [dot(from, p) / determinant, dot(direction, q) / determinant];
  const distance = dot(toC, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1 || distance <= 0) return null;
  return { distance, shares: [1 - u - v, u, v], normal: normalized(cross(toB, toC)), isBehind: determinant < 0 };
}

const isShown = (point: Vec3, { up, height, plane }: Shown): boolean =>
  dot(point, up) <= height && (plane === null || dot(point, plane.normal) <= plane.offset);

/**
 * Distance (m) and its standard deviation (m). Along its normal a point is as sure as its vertices are; along the surface no better than
 * a voxel tells, which is uniform over its side.
 */
export function measured(a: SurfacePoint, b: SurfacePoint, voxelSize: number): { distance: number; deviation: number } {
  const apart = added(b.place, a.place, -1);
  const distance = Math.hypot(...apart);
  const direction = normalized(apart);
  const variance = ({ normal, deviation }: SurfacePoint): number => {
    const cosine = dot(normal, direction);
    return cosine ** 2 * deviation ** 2 + (1 - cosine ** 2) * (voxelSize ** 2 / 12);
  };
  return { distance, deviation: Math.sqrt(variance(a) + variance(b)) };
}

/** A distance and its 95 % bound, both to the last digit that is sure. */
export function measuredWords(distance: number, deviation: number): string {
  const bound = BOUND_95 * deviation;
  const isFine = bound < 0.1;
  return `${formatFixed(distance, isFine ? 3 : 2)} m ± ${isFine ? `${formatFixed(Math.max(1000 * bound, 1), 0)} mm` : `${formatFixed(bound, 2)} m`}`;
}

export class Measuring implements MapTool {
  readonly hidden = [] as const;
  readonly isInside = false;
  readonly help =
    'Click or tap two points of the surface; with the keyboard, arrow keys turn the map and Enter takes the point under the cross; Backspace removes the last; Esc ends.';
  #host: ToolHost;
  #points: SurfacePoint[] = [];
  #missed = false;

  constructor(host: ToolHost) {
    this.#host = host;
    host.requestUpdate();
  }

  key(key: string): boolean {
    const { width, height } = this.#host.size;
    if (key === 'Enter') return this.tap(width / 2, height / 2);
    if (key !== 'Backspace') return false;
    this.#set(this.#points.slice(0, -1));
    return true;
  }

  tap(x: number, y: number): boolean {
    const { orbit, size, survey } = this.#host;
    const { section: height, plane = null, isInside = false } = this.#host.look();
    const mesh = this.#mesh;
    const reach = survey.sampled.reduce((far, point) => Math.max(far, Math.hypot(...point)), 0) + orbit.distance;
    const line = ray(orbit, size, x, y, reach);
    const [r, u, b] = survey.R_view_map;
    const inMap = (v: Vec3): Vec3 => added(added(scaled(r, v[0]), u, v[1]), b, v[2]);
    const shown = { up: u, height, plane, hasBacks: seesBacks(orbit, isInside) };
    const found = mesh && pick(mesh, inMap(line.origin), inMap(line.direction), shown);
    this.#missed = !found;
    if (found) this.#set([...(this.#points.length === 2 ? [] : this.#points), found]);
    else this.#host.requestUpdate();
    return true;
  }

  renderBar(): TemplateResult {
    return html`<output class="number" role="status">${this.#words()}</output>`;
  }

  renderOver(): TemplateResult | null {
    const [first, second] = this.#points;
    const middle = first && second && scaled(added(first.place, second.place), 0.5);
    const place = middle && this.#onScreen(middle);
    return html`<i class="cross" aria-hidden="true"></i>${
        place
          ? html`<span class="measured number" aria-hidden="true" style="left: ${place.x}px; top: ${place.y}px"
              >${this.#words()}</span
            >`
          : null
      }`;
  }

  end(): void {
    this.#host.setMeasured([]);
  }

  /** What is drawn of it; null: nothing. */
  get #mesh(): SurfaceMesh | null {
    return this.#host.look().surface && this.#host.runSurface.mesh;
  }

  #words(): string {
    const [first, second] = this.#points;
    const mesh = this.#mesh;
    if (!mesh) return 'Distances are measured on the surface: make it first (M).';
    if (this.#missed) return 'There is no surface at this point.';
    if (first && second) {
      const { distance, deviation } = measured(first, second, mesh.voxel_size);
      return measuredWords(distance, deviation);
    }
    return first ? 'Choose the second point.' : 'Choose the first point.';
  }

  #onScreen(point: Vec3): { x: number; y: number } | null {
    const { orbit, size, survey } = this.#host;
    return toScreen(orbit, size, transformed(survey.R_view_map, point));
  }

  #set(points: SurfacePoint[]): void {
    this.#points = points;
    this.#missed = false;
    const arm = ARM * (this.#mesh?.voxel_size ?? 0);
    const arms = ({ place }: SurfacePoint): [Vec3, Vec3][] =>
      (
        [
          [arm, 0, 0],
          [0, arm, 0],
          [0, 0, arm],
        ] as const
      ).map((by) => [added(place, by, -1), added(place, by)]);
    const [first, second] = points;
    const line: [Vec3, Vec3][] = first && second ? [[first.place, second.place]] : [];
    this.#host.setMeasured([...points.flatMap(arms), ...line]);
    this.#host.requestUpdate();
    this.#host.requestPaint();
  }
}
