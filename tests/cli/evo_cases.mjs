// @ts-check
/**
 * Pairs of trajectories in mixed conventions, for evo, the command line and the page: `node tests/cli/evo_cases.mjs FOLDER` writes
 * them as evo reads them (tests/data/evaluation/evo_cases.py).
 */
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

/** @typedef {{ t: number, position: number[], quaternion: number[] }} Pose `t`: after the first; `quaternion`: x y z w */
/** @typedef {{ name: string, content: string, isTimed: boolean, poses: Pose[] }} Written `poses`: as evo is to read them */
/** @typedef {{ align: string, metric: string, relation: string, delta?: number, unit?: string }} Options */
/** @typedef {{ reference: Written, estimates: Written[], options: Options[] }} Group */

const NUM_POSES = 120;
/** S between two poses; what is added to their times: seconds since 1970, as EuRoC has them. */
const [INTERVAL, EPOCH] = [0.1, 1_403_636_579];

/** Numbers that are spread as a normal distribution, the same in every run. @param {number} seed */
function normal(seed) {
  let state = seed;
  const uniform = () => {
    state = (Math.imul(state, 1_664_525) + 1_013_904_223) >>> 0;
    return (state + 0.5) / 2 ** 32;
  };
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}

/** @param {number[]} a @param {number[]} b */
function product([ax = 0, ay = 0, az = 0, aw = 1], [bx = 0, by = 0, bz = 0, bw = 1]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/** @param {number[]} vector a rotation, rad */
function turn(vector) {
  const angle = Math.hypot(...vector);
  const share = angle === 0 ? 0.5 : Math.sin(angle / 2) / angle;
  return [...vector.map((value) => share * value), Math.cos(angle / 2)];
}

/** The rows of the rotation matrix. @param {number[]} quaternion */
function matrixOf([x = 0, y = 0, z = 0, w = 1]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** A walk that turns about all of its axes. @param {number} seed @returns {Pose[]} */
function walk(seed) {
  const next = normal(seed);
  const phases = [0, 1, 2, 3, 4, 5].map(() => 3 * next());
  const wave = (/** @type {number} */ i, /** @type {number} */ k, /** @type {number} */ rate) =>
    Math.sin(rate * i + (phases[k] ?? 0));
  return Array.from({ length: NUM_POSES }, (_, i) => ({
    t: INTERVAL * i,
    position: [3 * wave(i, 0, 0.05), 2 * wave(i, 1, 0.07), 0.7 * wave(i, 2, 0.11)],
    quaternion: product(turn([0, 0, 0.04 * i]), turn([0.4 * wave(i, 3, 0.09), 0.3 * wave(i, 4, 0.06), 0])),
  }));
}

/** An estimate: off by centimetres, a degree and milliseconds. @param {Pose[]} poses @param {number} seed @param {number} scale @returns {Pose[]} */
function estimated(poses, seed, scale) {
  const next = normal(seed);
  const around = (/** @type {number} */ size) => [size * next(), size * next(), size * next()];
  return poses.map(({ t, position, quaternion }) => {
    const off = around(0.01);
    return {
      t: t + 0.001 * Math.sin(9 * t),
      position: position.map((value, k) => scale * (value + (off[k] ?? 0))),
      quaternion: product(quaternion, turn(around(0.01))),
    };
  });
}

/** @param {(pose: Pose, index: number) => (string | number)[]} cells */
const lines =
  (cells, separator = ' ') =>
  (/** @type {Pose[]} */ poses) =>
    poses.map((pose, index) => `${cells(pose, index).join(separator)}\n`).join('');
const tum = lines(({ t, position, quaternion }) => [EPOCH + t, ...position, ...quaternion]);
const nanoseconds = (/** @type {number} */ t) => String(BigInt(EPOCH) * 1_000_000_000n + BigInt(Math.round(t * 1e9)));
const wFirst = (/** @type {number[]} */ [x = 0, y = 0, z = 0, w = 1]) => [w, x, y, z];
/** The first three rows of each pose's matrix. @param {Pose} pose */
const rows = ({ position, quaternion }) => matrixOf(quaternion).map((row, k) => [...row, position[k] ?? 0]);
/** The sensor turned: from x ahead, y left, z up to another three. @param {number[]} axes */
const turned = (axes) => (/** @type {Pose[]} */ poses) =>
  tum(poses.map((pose) => ({ ...pose, quaternion: product(pose.quaternion, axes) })));
/** Y to the other side, for the sensor as for the world. @param {Pose} pose @returns {Pose} */
const mirrored = ({ t, position: [x = 0, y = 0, z = 0], quaternion: [qx = 0, qy = 0, qz = 0, qw = 1] }) => ({
  t,
  position: [x, -y, z],
  quaternion: [-qx, qy, -qz, qw],
});
const EUROC = '#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n';

/** @type {readonly { name: string, isTimed: boolean, write: (poses: Pose[]) => string }[]} */
const CONVENTIONS = [
  { name: 'plain.tum', isTimed: true, write: tum },
  {
    name: 'w_first.tum',
    isTimed: true,
    write: lines(({ t, position, quaternion }) => [EPOCH + t, ...position, ...wFirst(quaternion)]),
  },
  { name: 'left_handed.tum', isTimed: true, write: (poses) => tum(poses.map(mirrored)) },
  // Half a turn about x: y up and looking backwards, or y down and looking ahead.
  { name: 'half_turn.tum', isTimed: true, write: turned([1, 0, 0, 0]) },
  // Z ahead, x right, y down.
  { name: 'camera_axes.tum', isTimed: true, write: turned([-0.5, 0.5, -0.5, 0.5]) },
  {
    name: 'nanoseconds.txt',
    isTimed: true,
    write: lines(({ t, position, quaternion }) => [nanoseconds(t), ...position, ...quaternion]),
  },
  {
    name: 'euroc.csv',
    isTimed: true,
    write: (poses) =>
      EUROC + lines(({ t, position, quaternion }) => [nanoseconds(t), ...position, ...wFirst(quaternion)], ',')(poses),
  },
  { name: 'kitti.txt', isTimed: false, write: lines((pose) => rows(pose).flat()) },
  { name: 'matrices.txt', isTimed: false, write: lines((pose) => [...rows(pose), [0, 0, 0, 1]].flat()) },
  {
    name: 'stacked.txt',
    isTimed: false,
    write: (poses) =>
      poses.map((pose) => `${[...rows(pose), [0, 0, 0, 1]].map((row) => row.join(' ')).join('\n')}\n`).join(''),
  },
];

/** Two for each group. @type {readonly Options[]} */
const OPTIONS = [
  { align: 'none', metric: 'ape', relation: 'translation_part' },
  { align: 'se3', metric: 'ape', relation: 'translation_part' },
  { align: 'sim3', metric: 'ape', relation: 'translation_part' },
  { align: 'scale', metric: 'ape', relation: 'translation_part' },
  { align: 'origin', metric: 'ape', relation: 'translation_part' },
  { align: 'none', metric: 'ape', relation: 'rotation_angle_deg' },
  { align: 'se3', metric: 'ape', relation: 'rotation_angle_rad' },
  { align: 'origin', metric: 'ape', relation: 'rotation_part' },
  { align: 'sim3', metric: 'ape', relation: 'full_transformation' },
  { align: 'none', metric: 'ape', relation: 'full_transformation' },
  { align: 'none', metric: 'rpe', relation: 'translation_part', delta: 1, unit: 'frames' },
  { align: 'se3', metric: 'rpe', relation: 'rotation_angle_deg', delta: 1, unit: 'frames' },
  { align: 'sim3', metric: 'rpe', relation: 'translation_part', delta: 5, unit: 'frames' },
  { align: 'scale', metric: 'rpe', relation: 'point_distance', delta: 1, unit: 'frames' },
  { align: 'none', metric: 'rpe', relation: 'full_transformation', delta: 10, unit: 'frames' },
  { align: 'sim3', metric: 'rpe', relation: 'translation_part', delta: 0.5, unit: 'meters' },
  { align: 'origin', metric: 'rpe', relation: 'rotation_part', delta: 2, unit: 'frames' },
  { align: 'none', metric: 'rpe', relation: 'rotation_angle_rad', delta: 20, unit: 'degrees' },
  { align: 'se3', metric: 'ape', relation: 'point_distance' },
  { align: 'scale', metric: 'rpe', relation: 'point_distance_error_ratio', delta: 1, unit: 'meters' },
];

/**
 * A group for each convention of a reference: an estimate in every convention, of another scale in every second group, compared
 * in two ways. Where both have times, the estimate lacks every seventh pose.
 * @type {readonly Group[]}
 */
export const GROUPS = CONVENTIONS.map((reference, index) => {
  const poses = walk(100 + index);
  return {
    reference: { ...reference, name: `reference_${reference.name}`, content: reference.write(poses), poses },
    estimates: CONVENTIONS.map(({ name, isTimed, write }, at) => {
      const all = estimated(poses, 1000 + 10 * index + at, index % 2 === 0 ? 1 : 0.4);
      const lacks = isTimed && reference.isTimed;
      const kept = lacks ? all.filter((_, i) => i % 7 !== 3) : all;
      return { name, isTimed, content: write(kept), poses: kept };
    }),
    options: OPTIONS.filter((_, at) => at % CONVENTIONS.length === index),
  };
});

/** @typedef {Record<'rmse' | 'mean' | 'median' | 'std' | 'min' | 'max' | 'sse', number>} Statistics */

/** What evo 1.38.1 computes: for each group, of its options, of its estimates. `num`: of the errors. @type {(Statistics & { num: number })[][][]} */
export const EVO_FIGURES = JSON.parse(
  readFileSync(join(import.meta.dirname, '..', 'data', 'evaluation', 'evo_cases.json'), 'utf8'),
);

/** Largest deviation from evo's figures: of those above 1 as a share. @param {Record<string, number>} found @param {Statistics | undefined} evo */
export function farthestFromEvo(found, evo) {
  const deviations = Object.entries(evo ?? {}).map(
    ([name, expected]) => Math.abs((found[name] ?? NaN) - expected) / Math.max(1, Math.abs(expected)),
  );
  return deviations.length === 8 ? Math.max(...deviations) : NaN;
}

const [, script, folder] = process.argv;
if (folder && script?.endsWith('evo_cases.mjs')) {
  GROUPS.forEach(({ reference, estimates, options }, index) => {
    const of = join(folder, String(index));
    mkdirSync(of, { recursive: true });
    estimates.forEach((estimate, at) => {
      // Real parts first in both files: nothing tells that they are, and both are what they claim to be.
      const isUnknown = [reference, estimate].every(({ name }) => name.endsWith('w_first.tum'));
      const content = (/** @type {Written} */ one) => (isUnknown ? one.content : tum(one.poses));
      writeFileSync(join(of, `${at}_reference.tum`), content(reference));
      writeFileSync(join(of, `${at}.tum`), content(estimate));
    });
    const isTimed = estimates.map((estimate) => estimate.isTimed && reference.isTimed);
    writeFileSync(join(of, 'group.json'), JSON.stringify({ isTimed, options }));
  });
}
