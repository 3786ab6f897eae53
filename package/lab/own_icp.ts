/**
 * Somebody's own ICP beside the engine's: from each of their poses the engine does one step, and what they have next is compared
 * with it. Where the two part, known faults are tried one by one: the one that gives exactly their next pose is named.
 */
import type { IcpIteration, IcpLab, PointCloud, RegistrationOptions } from '../../pkg/scanstitch.js';
import {
  bestRotation,
  difference,
  IDENTITY,
  inverted,
  moved,
  multiplied,
  poseOf,
  rotationOf,
  sumsOf,
} from '../base/matrices.js';

/** A step of an own ICP beside the engine's step from the same pose. */
export interface OwnIcpStep {
  /** The own ICP's pose before the step: 4 x 4, row by row. */
  T_before: number[];
  /** The own ICP's pose after the step. */
  T_own: number[];
  /** The pose after the engine's step from `T_before`. */
  T_ours: number[];
  /** Rotation between the two poses after the step (rad). */
  rotation: number;
  /** Translation between the two poses after the step (m). */
  translation: number;
}

/** Why a step of an own ICP differs from the engine's. */
export interface OwnIcpFault {
  kind: 'input' | 'pairs' | 'weights' | 'solution' | 'unknown';
  name: string;
  text: string;
}

export interface OwnIcpComparison {
  steps: OwnIcpStep[];
  /** Index of the first step that differs, from 0; null where all agree. */
  parts_at: number | null;
  /** The known fault that reproduces the own steps from there; null where all agree. */
  fault: OwnIcpFault | null;
  /** Number of iterations of the engine's loop from the same start. */
  num_ours: number;
}

/** Steps that differ by more part (rad, m): points read in single precision are good to 1e-7 of their distance. */
const SAME_STEP = 1e-5;
/** Poses that differ by less are the same (rad, m). */
const SAME_POSE = 1e-9;
/** Two points are equally near when their distances differ by less (m): the engine compares them in single precision. */
const SAME_DISTANCE = 1e-6;
/** With more ties than these, or more numbers times numbers of both clouds, partners are not tried one by one. */
const MAX_TIES = 12;
const MAX_TIED_PRODUCT = 1e8;
/** A fault is looked for with this many choices of partners. */
const MAX_JUDGED = 128;
/** Any pair is near enough (m). */
const NO_LIMIT = 1e6;

/** @param poses theirs, T_target_source after each iteration; the start may stand before them */
export function compareOwnIcp(
  engine: { IcpLab: typeof IcpLab },
  source: PointCloud,
  target: PointCloud,
  options: Partial<RegistrationOptions>,
  poses: ArrayLike<number>[],
): OwnIcpComparison {
  const lab = new engine.IcpLab(source, target, options);
  try {
    const start = options.init_T_target_source ?? [...IDENTITY];
    const given = poses.map((pose) => Array.from(pose));
    const first = given[0];
    const hasStart = first !== undefined && isNear(difference(start, first), SAME_POSE);
    const theirs = hasStart ? given : [start, ...given];
    const unit = wrongUnit(lab, theirs);
    const [begin, ...others] = theirs.slice(0, -1).map((pose) => lab.iteration(Float64Array.from(pose)));
    const judge = (iterations: IcpIteration[]) => {
      const steps = iterations.map((iteration, index) => {
        const own = theirs[index + 1] ?? start;
        return {
          T_before: theirs[index] ?? start,
          T_own: own,
          T_ours: iteration.T_next,
          ...difference(iteration.T_next, own),
        };
      });
      const parts = steps.findIndex((step) => !isNear(step, SAME_STEP));
      const fault =
        parts < 0 ? null : (unit ?? faultAt({ engine, source, target, options, lab, theirs, iterations, parts }));
      return { steps, parts_at: parts < 0 ? null : parts, fault };
    };
    const firsts = begin ? firstSteps(lab, theirs[0] ?? start, begin, theirs[1] ?? start) : [];
    let best = judge(begin ? [firsts[0] ?? begin, ...others] : []);
    for (const variant of best.parts_at === 0 ? firsts.slice(1, MAX_JUDGED) : []) {
      if (best.fault?.kind !== 'unknown') break;
      const other = judge([variant, ...others]);
      if (other.fault?.kind !== 'unknown') best = other;
    }
    return { ...best, num_ours: lab.trace(Float64Array.from(start)).records.length };
  } finally {
    lab.free();
  }
}

function isNear({ rotation, translation }: { rotation: number; translation: number }, limit: number) {
  return rotation <= limit && translation <= limit;
}

/**
 * The first step, with other partners, too, where it is the same to which of two points a point is paired: theirs may
 * be any of
 * them. The one that ends nearest to theirs comes first.
 */
function firstSteps(lab: IcpLab, T: number[], begin: IcpIteration, T_own: number[]) {
  if (isNear(difference(begin.T_next, T_own), SAME_POSE)) return [begin];
  const apart = ({ T_next }: IcpIteration) => Math.max(...Object.values(difference(T_next, T_own)));
  const steps = [begin, ...tiedSteps(lab, T, begin)].map((step) => ({ step, apart: apart(step) }));
  return steps.sort((a, b) => a.apart - b.apart).map(({ step }) => step);
}

/**
 * The same step with other partners where two target points are equally near to a source point, as in clouds that lie
 * symmetrically; none where it is no closed form, or in large clouds.
 */
function tiedSteps(lab: IcpLab, T: number[], iteration: IcpIteration): IcpIteration[] {
  const [source, target] = [lab.source_points(), lab.target_points()];
  if (source.length * target.length > MAX_TIED_PRODUCT) return [];
  const point = (xyz: Float64Array, i: number) => [...xyz.subarray(3 * i, 3 * i + 3)];
  const p = Array.from(iteration.source, (i) => moved(T, point(source, i)));
  const all = Array.from({ length: target.length / 3 }, (_, i) => point(target, i));
  const distance = (a: number[], b: number[]) => Math.hypot(...a.map((value, axis) => value - (b[axis] ?? 0)));
  const ties = p.flatMap((from, pair) => {
    const partner = iteration.target[pair] ?? 0;
    const least = distance(from, all[partner] ?? from);
    const others = all.flatMap((to, i) => (i !== partner && distance(from, to) - least < SAME_DISTANCE ? [i] : []));
    return others.length > 0 ? [{ pair, others: [partner, ...others] }] : [];
  });
  const solved = (partners: Uint32Array) => {
    const q = Array.from(partners, (i) => all[i] ?? []);
    const { p0, q0, covariance } = sumsOf(p, q, iteration.weight);
    const R = bestRotation(covariance(p0, q0));
    const turned = moved(poseOf(R, [0, 0, 0]), p0);
    const t = q0.map((value, axis) => value - (turned[axis] ?? 0));
    return multiplied(poseOf(R, t), T);
  };
  const isClosedForm = isNear(difference(solved(iteration.target), iteration.T_next), SAME_STEP);
  let choices: Uint32Array<ArrayBuffer>[] = [Uint32Array.from(iteration.target)];
  for (const { pair, others } of isClosedForm && ties.length <= MAX_TIES ? ties : []) {
    choices = choices.flatMap((partners) => others.map((other) => partners.with(pair, other)));
  }
  const made = choices.slice(1).map((partners) => ({ ...iteration, target: partners, T_next: solved(partners) }));
  return made as IcpIteration[];
}

/** Translations far beyond both clouds that fit when divided: another unit. */
function wrongUnit(lab: IcpLab, theirs: number[][]): OwnIcpFault | null {
  const reach = (xyz: Float64Array) => xyz.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  const size = reach(lab.source_points()) + reach(lab.target_points());
  const far = theirs.reduce((most, T) => Math.max(most, Math.hypot(T[3] ?? 0, T[7] ?? 0, T[11] ?? 0)), 0);
  if (far <= 2 * size) return null;
  const unit = far / 1000 <= 2 * size ? 'millimetres' : 'another unit';
  return {
    kind: 'input',
    name: 'unit',
    text: `A translation of ${far.toPrecision(3)} lies far outside both clouds (${size.toPrecision(3)} m): are these ${unit}? Poses are in metres.`,
  };
}

/** The fault whose step is theirs. */
function faultAt({
  engine,
  source,
  target,
  options,
  lab,
  theirs,
  iterations,
  parts,
}: {
  engine: { IcpLab: typeof IcpLab };
  source: PointCloud;
  target: PointCloud;
  options: Partial<RegistrationOptions>;
  lab: IcpLab;
  theirs: number[][];
  iterations: IcpIteration[];
  parts: number;
}): OwnIcpFault {
  // A fault may give the right step by chance (pairs that did not change): those after it are looked at as well.
  const places = iterations
    .map((_, index) => index)
    .filter((index) => index >= parts)
    .slice(0, 3);
  const explains = (next: (index: number) => number[] | null) =>
    places.every((index) => {
      const [predicted, own] = [next(index), theirs[index + 1]];
      return predicted !== null && own !== undefined && isNear(difference(predicted, own), SAME_STEP);
    });
  const free = { max_correspondence_distance: NO_LIMIT, max_normal_angle: Math.PI, trim_fraction: 0 };
  const equal = { robust_kernel: 'none' as const };
  const settings: [OwnIcpFault, Partial<RegistrationOptions>][] = [
    [
      {
        kind: 'pairs',
        name: 'rejection',
        text: 'Your step uses pairs that ours rejects: every point has a partner, however far.',
      },
      free,
    ],
    [
      {
        kind: 'weights',
        name: 'weights',
        text: 'Same pairs, but in your step all count the same; ours weighs them by the robust kernel.',
      },
      equal,
    ],
    [
      { kind: 'weights', name: 'rejection_and_weights', text: 'Your step uses all pairs, with equal weights.' },
      { ...free, ...equal },
    ],
  ];
  for (const [fault, others] of settings) {
    const other = new engine.IcpLab(source, target, { ...options, ...others });
    const found = explains((index) => [...other.iteration(Float64Array.from(theirs[index] ?? [])).T_next]);
    other.free();
    if (found) return fault;
  }
  const known = solutions(lab, theirs, iterations).find(({ next }) => explains(next));
  if (known) return known.fault;
  return {
    kind: 'unknown',
    name: 'unknown',
    text: 'None of the known faults gives your step. Compare the pairs first, then the weights, then the step of a single iteration.',
  };
}

type Sums = ReturnType<typeof sumsOf>;

/** Faults of the pairs' age and of the solution, each with the pose it gives after iteration `index`. */
function solutions(
  lab: IcpLab,
  theirs: number[][],
  iterations: IcpIteration[],
): { fault: OwnIcpFault; next: (index: number) => number[] | null }[] {
  const [source, target] = [lab.source_points(), lab.target_points()];
  const pose = (index: number) => theirs[index] ?? [...IDENTITY];
  /** The pairs of one iteration, the source's points moved by the pose of another. */
  const pairs = (from: number, at: number) => {
    const { source: sources, target: targets, weight } = iterations[from] ?? {};
    const p = Array.from(sources ?? [], (i) => moved(pose(at), [...source.subarray(3 * i, 3 * i + 3)]));
    const q = Array.from(targets ?? [], (i) => [...target.subarray(3 * i, 3 * i + 3)]);
    return sumsOf(p, q, weight ?? []);
  };
  const applied = (R: ArrayLike<number>, t: number[], at: number) => multiplied(poseOf(R, t), pose(at));
  const minus = (a: number[], b: number[]) => a.map((x, i) => x - (b[i] ?? 0));
  const turned = (R: ArrayLike<number>, p: number[]) => moved(poseOf(R, [0, 0, 0]), p);
  const transposed = (R: ArrayLike<number>) => [0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => R[i] ?? 0);
  const step = (index: number) => multiplied(iterations[index]?.T_next ?? IDENTITY, inverted(pose(index)));
  /** With the rotation that `rotationBy` makes of the sums. */
  const solved = (
    from: number,
    index: number,
    rotationBy = ({ p0, q0, covariance }: Sums) => bestRotation(covariance(p0, q0)),
  ) => {
    const sums = pairs(from, index);
    const R = rotationBy(sums);
    return applied(R, minus(sums.q0, turned(R, sums.p0)), index);
  };
  const fault = (kind: OwnIcpFault['kind'], name: string, text: string, next: (index: number) => number[] | null) => ({
    fault: { kind, name, text },
    next,
  });
  const origin = [0, 0, 0];
  return [
    fault(
      'pairs',
      'pairs_of_the_start',
      'The pairs are those of the first iteration: they are not searched again.',
      (index) => (index > 0 ? solved(0, index) : null),
    ),
    fault(
      'pairs',
      'pairs_of_the_last',
      'The pairs are those of the iteration before: they are searched before the source is moved.',
      (index) => (index > 0 ? solved(index - 1, index) : null),
    ),
    fault(
      'solution',
      'transposed_rotation',
      'The rotation of the step is transposed: it turns the other way (in NumPy: Vt.T @ U.T, not U @ Vt, where the covariance is P.T @ Q).',
      (index) => solved(index, index, ({ p0, q0, covariance }) => transposed(bestRotation(covariance(p0, q0)))),
    ),
    fault(
      'solution',
      'transposed_after_translation',
      'The rotation of the step is transposed after its translation was computed.',
      (index) => {
        const S = step(index);
        return applied(transposed(rotationOf(S)), [S[3] ?? 0, S[7] ?? 0, S[11] ?? 0], index);
      },
    ),
    fault(
      'solution',
      'centroids_not_subtracted',
      'The centroids are not subtracted before the covariance: the rotation is wrong, as if both clouds turned about the origin.',
      (index) => solved(index, index, ({ covariance }) => bestRotation(covariance(origin, origin))),
    ),
    fault(
      'solution',
      'centroids_forgotten',
      'The centroids are forgotten altogether: no centering before the covariance and no translation after.',
      (index) => applied(bestRotation(pairs(index, index).covariance(origin, origin)), origin, index),
    ),
    fault(
      'solution',
      'centroid_not_rotated',
      'The translation is the difference of the centroids: the source’s has to be rotated first, t = q0 - R p0.',
      (index) => {
        const { p0, q0, covariance } = pairs(index, index);
        return applied(bestRotation(covariance(p0, q0)), minus(q0, p0), index);
      },
    ),
    fault(
      'solution',
      'wrong_side',
      'The step is applied on the wrong side: T = step T, where the step moves points that T has moved.',
      (index) => multiplied(pose(index), step(index)),
    ),
    fault(
      'solution',
      'inverted',
      'The step is inverted: it moves the target to the source, or the sign of x in H x = -b is wrong.',
      (index) => multiplied(inverted(step(index)), pose(index)),
    ),
  ];
}
