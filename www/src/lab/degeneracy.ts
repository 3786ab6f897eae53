/** What the pairs of a step determine: each direction of motion, by how many of them it is measured. */
import { html, nothing, type TemplateResult } from 'lit';
import { slider } from '../components/fields.js';
import { formatFixed, formatLength, formatPercent, plural } from '../views/format.js';
import { formatAngle } from '../views/pose-format.js';
import type { Arrow, Ellipse } from './plane-painter.js';
import { movedBy } from './poses.js';
import type { LabIteration, Pose } from './protocol.js';

/** One direction of motion about the middle of the pairs. */
export interface Direction {
  /** Share of the pairs that measure it, 0..=1. */
  share: number;
  /** Turn in metres at the pairs' rms distance from their middle; unit length together with `shift`. */
  turn: readonly [number, number, number];
  shift: readonly [number, number, number];
  isUndetermined: boolean;
}

/** From the weakest to the strongest. */
export function directionsOf({ degeneracy }: LabIteration): Direction[] {
  if (!degeneracy) return [];
  const { shares, directions, undetermined_below } = degeneracy;
  const n = shares.length;
  return shares.map((share, i) => {
    const d = directions.slice(n * i, n * (i + 1));
    const at = (k: number): number => d[k] ?? 0;
    const isUndetermined = share < undetermined_below;
    return n === 3
      ? { share, turn: [0, 0, at(0)], shift: [at(1), at(2), 0], isUndetermined }
      : { share, turn: [at(0), at(1), at(2)], shift: [at(3), at(4), at(5)], isUndetermined };
  });
}

export const isTurning = ({ turn }: Direction): boolean => Math.hypot(...turn) > Math.SQRT1_2;

/** "translation along x", "translation along (0.71, −0.71)" or "rotation about the middle". */
function directionName({ turn, shift }: Direction, is_planar: boolean): string {
  const along = axisName(shift.slice(0, is_planar ? 2 : 3));
  if (Math.hypot(...turn) < 0.2) return `translation along ${along}`;
  const rotation = `rotation about ${is_planar ? 'the middle' : axisName(turn)}`;
  return Math.hypot(...shift) < 0.2 ? rotation : `${rotation} with translation along ${along}`;
}

/** "x" where a vector leads along that axis to a tenth of a radian, its unit vector elsewhere. */
function axisName(vector: readonly number[]): string {
  const length = Math.hypot(...vector) || 1;
  const axis = vector.findIndex((part) => Math.abs(part) > Math.cos(0.1) * length);
  return ['x', 'y', 'z'][axis] ?? `(${vector.map((part) => formatFixed(part / length, 2)).join(', ')})`;
}

/** By `metres` along a direction: a turn moves a point at the pairs' rms distance so far. */
export function slid(T: Pose, iteration: LabIteration, { turn, shift }: Direction, metres: number): number[] {
  const { degeneracy } = iteration;
  if (!degeneracy) return Array.from(T);
  const angle = turn.map((part) => (part * metres) / degeneracy.radius) as [number, number, number];
  return movedBy(
    T,
    angle,
    degeneracy.center,
    shift.map((part) => part * metres),
  );
}

const COLORS: Record<'light' | 'dark', readonly [weak: string, strong: string]> = {
  light: ['#b3261e', '#00845f'],
  dark: ['#ff8a80', '#2fc08f'],
};

export const directionColor = (direction: Direction, dark: boolean): string =>
  COLORS[dark ? 'dark' : 'light'][direction.isUndetermined || direction.share < 0.05 ? 0 : 1];

/** In the plane. */
export function arrowsOf(iteration: LabIteration, dark: boolean): Arrow[] {
  const { degeneracy } = iteration;
  if (!degeneracy) return [];
  const [x, y] = degeneracy.center;
  return directionsOf(iteration).map((direction) => ({
    x,
    y,
    turns: isTurning(direction),
    dx: direction.shift[0],
    dy: direction.shift[1],
    color: directionColor(direction, dark),
    label: formatPercent(direction.share),
  }));
}

/** Smallest share that the ellipse is drawn with: nothing is longer than ten times the best direction. */
const LEAST_SHARE_RATIO = 0.01;

/** Of the position of the pairs' middle: the part of the inverse of the normalised H for x and y. Its shape counts, not its size. */
export function ellipseOf(iteration: LabIteration, dark: boolean): Ellipse | null {
  const { degeneracy } = iteration;
  if (!degeneracy) return null;
  const all = directionsOf(iteration);
  const strongest = all.at(-1)?.share ?? 1;
  let [xx, xy, yy] = [0, 0, 0];
  for (const { share, shift } of all) {
    const variance = strongest / Math.max(share, strongest * LEAST_SHARE_RATIO);
    xx += variance * shift[0] * shift[0];
    xy += variance * shift[0] * shift[1];
    yy += variance * shift[1] * shift[1];
  }
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  const [mean, spread] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  const [major, minor] = [Math.sqrt(mean + spread), Math.sqrt(Math.max(mean - spread, 0))];
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [x, y] = degeneracy.center;
  return {
    x,
    y,
    major: [c * major, s * major],
    minor: [-s * minor, c * minor],
    color: dark ? '#f2b862' : '#8a4f08',
  };
}

export interface DegeneracyFacts {
  iteration: LabIteration;
  is_planar: boolean;
  dark: boolean;
  /** How far the source is slid along the weakest direction, m. */
  slide: number;
  slideTo(metres: number): void;
}

/** Farthest that the source is slid, m. */
const REACH = 2;

/** `styles`: sideStyles. */
export function degeneracyPanel({ iteration, is_planar, dark, slide, slideTo }: DegeneracyFacts): TemplateResult {
  const directions = directionsOf(iteration);
  const [weakest] = directions;
  const numFree = directions.filter(({ isUndetermined }) => isUndetermined).length;
  if (!weakest) return html`<p class="muted">These pairs have no weight: they determine nothing.</p>`;
  return html`
    <header><h2>What the pairs determine</h2></header>
    <p>
      ${
        numFree > 0
          ? html`<strong>${plural(numFree, 'direction is', 'directions are')} undetermined</strong>. The weakest is
              ${directionName(weakest, is_planar)}: ${formatPercent(weakest.share)} of the pairs measure it.`
          : html`Every direction is determined. The weakest is ${directionName(weakest, is_planar)}:
            ${formatPercent(weakest.share)} of the pairs measure it.`
      }
    </p>
    <ul class="directions number">
      ${directions.map(
        (direction) =>
          html`<li>
            <span>${directionName(direction, is_planar)}</span>
            <span class="bar" aria-hidden="true"
              ><i
                style="width: ${(100 * direction.share).toFixed(1)}%; background: ${directionColor(direction, dark)}"
              ></i
            ></span>
            <span>${formatPercent(direction.share)}</span>
          </li>`,
      )}
    </ul>
    <h3>Slide along the weakest direction</h3>
    <label class="row number"
      ><span class="visually-hidden">Slide along the weakest direction</span>
      ${slider(slide, { min: -REACH, max: REACH, step: 0.02, words: formatLength(slide) }, slideTo)}
      ${formatLength(slide)}</label
    >
    <p class="explanation">
      The arrows are the eigenvectors of <var>H</var> about the middle of the pairs, with turns measured at their rms
      distance of
      ${formatLength(iteration.degeneracy?.radius ?? 0)}${
        iteration.degeneracy ? ` (1 m is ${formatAngle(1 / iteration.degeneracy.radius, 1)})` : nothing
      };
      the eigenvalue of each is the share of the pairs that measure it. The ellipse is long where the position is
      uncertain. Pairs are coloured by how much each contributes to the weakest direction.
    </p>
  `;
}
