/** The gallery of the ICP lab: small scenes with one thing to see each, made by code. The tests measure their answers. */
import type { RegistrationOptions } from '../../pkg/scanstitch.js';
import { lookUp } from '../base/look_up.js';
import { circle, normalNumbers, numbers, poseIn, scan, type Sensor, type Wall, walls } from './scene_worlds.js';

/** A small scene that demonstrates one effect. */
export interface LabScene {
  name: string;
  title: string;
  /** A hint at what to observe. */
  look_at: string;
  question: string;
  answer: string;
  /** x y z of each point (m); z is 0 in planar scenes. */
  source: Float32Array;
  target: Float32Array;
  /** True motion: 4 x 4, row by row. */
  T_reference: number[];
  /** Options to compare, the initially selected ones first. */
  methods: Partial<RegistrationOptions>[];
}

const ORIGIN: Sensor = { x: 0, y: 0, theta: 0 };
/** A room with a bay and a pillar: every direction is measured. */
const ROOM: Wall[] = [
  ...walls([
    [-4, -3],
    [4, -3],
    [4, 1],
    [2.5, 1],
    [2.5, 3],
    [-4, 3],
    [-4, -3],
  ]),
  ...walls([
    [-2, 0.8],
    [-1.6, 0.8],
    [-1.6, 1.2],
    [-2, 1.2],
    [-2, 0.8],
  ]),
];

/**
 * Two scans of a planar world, the target's sensor at the origin.
 * @param sensor of the source
 */
function pair(world: Wall[], sensor: Sensor, laser: Parameters<typeof scan>[2] = {}) {
  return {
    source: scan(world, sensor, { sigma: 0.005, ...laser, seed: 2 }),
    target: scan(world, ORIGIN, { sigma: 0.005, ...laser, seed: 1 }),
    T_reference: poseIn(sensor),
  };
}

const SCENES: Record<string, () => Omit<LabScene, 'name'>> = {
  corridor: () => ({
    title: 'A bare corridor',
    look_at: 'The degeneracy of the last iteration, and the basin over x and y for both methods.',
    question:
      'The robot drove 0.5 m along a corridor whose ends it cannot see. Which of its three unknowns can ICP not find?',
    answer:
      'The position along the corridor. Both walls face across it: the share of the pairs that measure this direction is below 1 %, and point to line ends with the error along the corridor that it started with, or worse. Point to point does end somewhere definite, at no motion at all: it lays the pattern of beams of one scan on that of the other, which is no measurement of the corridor.',
    ...pair(
      walls([
        [-40, -1],
        [40, -1],
      ]).concat(
        walls([
          [-40, 1],
          [40, 1],
        ]),
      ),
      { x: 0.5, y: 0.05, theta: 0.03 },
      { max_range: 6 },
    ),
    methods: [{ metric: 'point_to_line' }, { metric: 'point_to_point' }],
  }),
  circle: () => ({
    title: 'A round room',
    look_at: 'The weakest direction: a rotation about the centre of the room, which is not the position of the sensor.',
    question: 'Inside a cylinder, what is left undetermined: a translation or a rotation?',
    answer:
      'A rotation about the centre of the room: it maps the wall onto itself. The rotation of the robot (0.2 rad) is not found; its distance from the centre is.',
    ...pair(circle(3, 720), { x: 0.3, y: 0.2, theta: 0.2 }),
    methods: [{ metric: 'point_to_line' }],
  }),
  repeated_doors: () => ({
    title: 'Doors that repeat',
    look_at: 'The basin of attraction over x and y: stripes, one per door.',
    question: 'A corridor has a niche every two metres. How large may the error of the initial guess be?',
    answer:
      'Less than half of the distance between two niches, 1 m. Beyond it ICP converges one niche further, to a minimum with the same cost: the basin over x repeats every 2 m.',
    ...pair(doors(2), { x: 0.3, y: 0.05, theta: 0.02 }, { max_range: 9 }),
    methods: [{ metric: 'point_to_line' }],
  }),
  large_motion: () => ({
    title: 'Too large a motion',
    look_at: 'The landscape over x and theta: the start is in the basin of another minimum.',
    question: 'The robot turned by 70 degrees. Where does ICP converge from the identity, and what helps?',
    answer:
      'In another minimum, more than 30 degrees off. The basin reaches to about 40 degrees around the truth; a correlative search over all headings starts ICP inside it.',
    ...pair(ROOM, { x: 0.6, y: -0.4, theta: (70 * Math.PI) / 180 }),
    methods: [
      { metric: 'point_to_line' },
      { metric: 'point_to_line', search_translation: 1.5, search_rotation: Math.PI },
    ],
  }),
  partial_overlap: () => ({
    title: 'Partial overlap',
    look_at:
      'The pairs: with a wide limit, points on surfaces that the target does not see are paired with points at its edge.',
    question:
      'The target does not see half of the surfaces that the source sees. What is the effect of the largest distance of a pair?',
    answer:
      'The influence of points without a true partner. With 5 m every point has a pair, and those on surfaces that the target does not see pull towards its edge: the error is several times that with 0.5 m. Neither is right: least squares cannot express that a point has no partner.',
    source: scan(ROOM, { x: 0.4, y: 0.1, theta: 0.1 }, { field: Math.PI, sigma: 0.005, seed: 2 }),
    target: scan(ROOM, { x: 0, y: 0, theta: 0 }, { field: (2 * Math.PI) / 3, sigma: 0.005, seed: 1 }),
    T_reference: poseIn({ x: 0.4, y: 0.1, theta: 0.1 }),
    methods: [
      { metric: 'point_to_point', robust_kernel: 'none', max_correspondence_distance: 0.5 },
      { metric: 'point_to_point', robust_kernel: 'none', max_correspondence_distance: 5 },
    ],
  }),
  outliers: () => ({
    title: 'Outliers',
    look_at: 'The weights of the pairs: with a robust kernel the outliers fade.',
    question: 'A fifth of the returns come from people walking by. Do they affect a least-squares fit?',
    answer:
      'Yes. The squares of a few large residuals outweigh all small ones: the error is more than ten times that with a robust kernel, which gives large residuals small weights.',
    ...outliers(0.2, 3),
    methods: [
      { metric: 'point_to_line', robust_kernel: 'none' },
      { metric: 'point_to_line', robust_kernel: 'cauchy', robust_kernel_width: 0.05 },
    ],
  }),
  trimming: () => ({
    title: 'Noise and trimming',
    look_at: 'Which pairs are trimmed, and the error in the table, for three shares.',
    question: 'Is it always better to drop more of the worst pairs?',
    answer:
      'No. About 30 % of the returns are wrong: without trimming they bias the result, with 35 % dropped they have no effect. With 90 % dropped, points that happen to fit at the start keep ICP near the start.',
    ...outliers(0.3, 5),
    methods: [0, 0.35, 0.9].map((trim_fraction) => ({ metric: 'point_to_line', robust_kernel: 'none', trim_fraction })),
  }),
  point_to_point_crawl: () => ({
    title: 'Point to point crawls along a wall',
    look_at:
      'Both methods side by side: the number of iterations, and how little each step of point to point moves along the wall.',
    question: 'Both methods converge to the same pose. Why does one need so many more iterations?',
    answer:
      'Each pair holds its point where it is: along the wall the nearest point moves along with the source, so that each step covers only a small share of the way. Point to line lets the points slide along the wall.',
    ...crawl(),
    methods: ['point_to_line', 'point_to_point'].map((metric) => ({
      metric: metric as 'point_to_line' | 'point_to_point',
      robust_kernel: 'none',
      max_correspondence_distance: 1,
      max_iterations: 300,
      translation_eps: 1e-5,
      rotation_eps: 1e-5,
    })),
  }),
  free_plane: () => ({
    title: 'A plane in space',
    look_at: 'Three undetermined directions: the plane can slide along itself and rotate about its normal.',
    question: 'A camera sees nothing but the floor. How many of its six unknowns are determined?',
    answer:
      'Three: the height and both tilts. A translation in x or z or a rotation about the normal of the floor changes no residual.',
    ...plane(),
    methods: [{ metric: 'point_to_plane' }],
  }),
  sparse_rings: () => ({
    title: 'Sparse rings',
    look_at: 'The pairs: point to point pairs rings with rings, GICP surfaces with surfaces.',
    question: 'A laser with eight rings moves by 0.3 m. Which method finds the motion?',
    answer:
      'GICP, to a few millimetres, since the normals of neighbouring points represent the surface. Point to point pairs rings with rings and hardly moves: its error is nearly the whole motion.',
    ...rings(),
    methods: [
      { metric: 'gicp', max_correspondence_distance: 1 },
      { metric: 'point_to_point', max_correspondence_distance: 1 },
    ],
  }),
};

/** Names of the scenes of the gallery, in its order. */
export function lab_scenes(): string[] {
  return Object.keys(SCENES);
}

/** Makes a scene of the gallery. Throws a RangeError if there is none of this name. */
export function lab_scene(name: string): LabScene {
  const make = lookUp(SCENES, name);
  if (!make) throw new RangeError(`There is no scene "${name}". There are: ${lab_scenes().join(', ')}`);
  return { name, ...make() };
}

/** A corridor with a niche every `period` metres. */
function doors(period: number): Wall[] {
  const corners: [number, number][] = [];
  for (let x = -20; x <= 20; x += period)
    corners.push([x, 1], [x + 0.8, 1], [x + 0.8, 1.3], [x + period, 1.3], [x + period, 1]);
  return walls(corners).concat(
    walls([
      [-20, -1],
      [20, -1],
    ]),
  );
}

/** Walls along x with a bay, the target seen so densely that no pattern of beams holds the source. */
function crawl() {
  const world = walls([
    [-8, -2.2],
    [2, -2.2],
    [2, -1.5],
    [8, -1.5],
  ]).concat(
    walls([
      [-8, 1.5],
      [8, 1.5],
    ]),
  );
  const sensor = { x: 0.3, y: 0.05, theta: 0.02 };
  const target = scan(world, ORIGIN, { beams: 3600, max_range: 7 });
  return { source: scan(world, sensor, { max_range: 5 }), target, T_reference: poseIn(sensor) };
}

/** A scan of the room of which a share of the returns ends before the wall. */
function outliers(share: number, seed: number) {
  const sensor = { x: 0.15, y: -0.1, theta: 0.05 };
  const both = pair(ROOM, sensor, { sigma: 0.01 });
  const random = numbers(seed);
  const source = both.source.slice();
  const count = source.length / 3;
  for (let i = 0; i < count; i++) {
    const factor = random();
    // Half of the circle is full of people, the rest is not: what is wrong all around would cancel out.
    if (i < count * share * 2 && random() < 0.5) {
      for (const axis of [0, 1]) source[3 * i + axis] = (source[3 * i + axis] ?? 0) * (0.8 + 0.15 * factor);
    }
  }
  return { ...both, source };
}

/** A floor seen from two places, as a camera sees it: y down. */
function plane() {
  const normal = normalNumbers(7);
  const grid = (x0: number, tilt: number) => {
    const points = [];
    for (let i = 0; i < 40; i++) {
      for (let j = 0; j < 40; j++) {
        const [x, z] = [(i - 19.5) * 0.05 + x0, (j - 19.5) * 0.05 + 2];
        points.push(x, 1.2 + tilt * (z - 2) + 0.001 * normal(), z);
      }
    }
    return Float32Array.from(points);
  };
  const [c, s] = [Math.cos(Math.atan(0.05)), Math.sin(Math.atan(0.05))];
  // The source's floor is tilted about x through (0, 1.2, 2): turned back it lies in the target's.
  const T_reference = [1, 0, 0, 0, 0, c, -s, 1.2 - c * 1.2 + s * 2, 0, s, c, 2 - s * 1.2 - c * 2, 0, 0, 0, 1];
  return { source: grid(0.1, 0.05), target: grid(0, 0), T_reference };
}

/** A box of a room seen by eight rings from two places: z up, the sensor at half height. */
function rings() {
  const noise = normalNumbers(9);
  const box = [5, 4, 1.5];
  const seen = (sensor: number[]) => {
    const points = [];
    for (let ring = 0; ring < 8; ring++) {
      const up = ((ring - 3.5) * 6 * Math.PI) / 180;
      for (let beam = 0; beam < 180; beam++) {
        const angle = (2 * Math.PI * beam) / 180;
        const way = [Math.cos(angle) * Math.cos(up), Math.sin(angle) * Math.cos(up), Math.sin(up)];
        const to = way.map((d, axis) => ((d > 0 ? (box[axis] ?? 0) : -(box[axis] ?? 0)) - (sensor[axis] ?? 0)) / d);
        const range = Math.min(...to.filter((x) => x > 0)) + 0.003 * noise();
        points.push(...way.map((d) => d * range));
      }
    }
    return Float32Array.from(points);
  };
  return {
    source: seen([0.3, 0.1, 0]),
    target: seen([0, 0, 0]),
    T_reference: [1, 0, 0, 0.3, 0, 1, 0, 0.1, 0, 0, 1, 0, 0, 0, 0, 1],
  };
}
