// @ts-check
/**
 * Small worlds for the ICP lab, each with one thing to see: two clouds, a start, methods, a question and its answer. Everything is
 * computed from a fixed seed: the same clouds everywhere. `tests/cli/lab_scenes.test.mjs` measures every answer.
 */

/** @typedef {[x: number, y: number, theta: number]} Pose2 m, m, rad */
/** @typedef {{ segments: [number, number, number, number][], circles: [number, number, number][] }} World m */
/**
 * @typedef {object} Scene
 * @property {string} name
 * @property {string} title
 * @property {string} question
 * @property {string} answer
 * @property {Float32Array<ArrayBuffer>} source x y z ... (m)
 * @property {Float32Array<ArrayBuffer>} target x y z ... (m)
 * @property {number[]} start 4 x 4, row by row
 * @property {number[]} reference where the source belongs: 4 x 4, row by row
 * @property {Record<string, string | number | undefined>[]} methods options of the engine, the first to be looked at
 * @property {'step' | 'landscape' | 'basin' | 'degeneracy' | 'method'} tab what shows it best
 */

/** Standard deviation of a range (m): a good indoor scanner's. */
const NOISE = 0.01;
const BEAMS = 270;

/** Uniform in [0, 1) (Marsaglia, "Xorshift RNGs", 2003). @param {number} seed @returns {() => number} */
function generator(seed) {
  let state = seed * 2654435761 + 1;
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) / 2 ** 32;
  };
}

/** Normally distributed (Box and Muller, 1958). @param {() => number} uniform */
const normal = (uniform) => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());

/** Distance along a ray; Infinity where nothing is hit. @param {World} world @param {number} x @param {number} y @param {number} angle */
function cast({ segments, circles }, x, y, angle) {
  const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
  let range = Infinity;
  for (const [ax, ay, bx, by] of segments) {
    const [ex, ey] = [bx - ax, by - ay];
    const cross = dx * ey - dy * ex;
    if (Math.abs(cross) < 1e-12) continue;
    const t = ((ax - x) * ey - (ay - y) * ex) / cross;
    const u = ((ax - x) * dy - (ay - y) * dx) / cross;
    if (t > 1e-6 && u >= 0 && u <= 1) range = Math.min(range, t);
  }
  for (const [cx, cy, r] of circles) {
    const along = (cx - x) * dx + (cy - y) * dy;
    const sq = r * r - ((cx - x) ** 2 + (cy - y) ** 2 - along * along);
    if (sq < 0) continue;
    for (const t of [along - Math.sqrt(sq), along + Math.sqrt(sq)]) if (t > 1e-6) range = Math.min(range, t);
  }
  return range;
}

/**
 * A scan from a pose, in its own frame.
 * @param {World} world @param {Pose2} pose @param {number} seed
 * @param {{ max_range?: number, noise?: number, from?: number, to?: number }} [options] from, to: directions seen (rad)
 */
function scan(world, [x, y, theta], seed, { max_range = 12, noise = NOISE, from = -Math.PI, to = Math.PI } = {}) {
  const uniform = generator(seed);
  /** @type {number[]} */
  const xyz = [];
  for (let i = 0; i < BEAMS; i++) {
    const angle = from + ((to - from) * (i + 0.5)) / BEAMS;
    const range = cast(world, x, y, theta + angle) + noise * normal(uniform);
    if (range < max_range) xyz.push(range * Math.cos(angle), range * Math.sin(angle), 0);
  }
  return Float32Array.from(xyz);
}

/** @param {Pose2} pose */
function matrix([x, y, theta]) {
  const [c, s] = [Math.cos(theta), Math.sin(theta)];
  return [c, -s, 0, x, s, c, 0, y, 0, 0, 1, 0, 0, 0, 0, 1];
}

/** A room that looks like no other: two corners are cut, and a pillar stands in it. @returns {World} */
const room = () => ({
  segments: [
    [-3, -2.5, 4, -2.5],
    [4, -2.5, 4, 1.5],
    [4, 1.5, 2.5, 3],
    [2.5, 3, -1, 3],
    [-1, 3, -1, 2],
    [-1, 2, -3, 2],
    [-3, 2, -3, -2.5],
  ],
  circles: [[1.8, -1, 0.3]],
});

/** Two walls, with a niche every `pitch` m where there is one. @param {number} [pitch] @returns {World} */
function corridor(pitch) {
  if (!pitch)
    return {
      segments: [
        [-60, -1, 60, -1],
        [-60, 1, 60, 1],
      ],
      circles: [],
    };
  /** @type {World['segments']} */
  const segments = [[-60, 1, 60, 1]];
  const [half, depth] = [0.45, 0.3];
  for (let x = -60; x < 60; x += pitch) {
    segments.push([x + half - pitch, -1, x - half, -1]);
    segments.push(
      [x - half, -1, x - half, -1 - depth],
      [x - half, -1 - depth, x + half, -1 - depth],
      [x + half, -1 - depth, x + half, -1],
    );
  }
  return { segments, circles: [] };
}

const PLAIN = { robust_kernel: 'none', max_normal_angle: Math.PI };
const TEXTBOOK = { metric: 'point_to_point', ...PLAIN };

/**
 * Two scans of a world, the target from its origin.
 * @param {World} world @param {Pose2} moved @param {Pose2} start @param {Parameters<typeof scan>[3]} [options] @param {World} [later]
 */
const pair = (world, moved, start, options, later = world) => ({
  target: scan(world, [0, 0, 0], 1, options),
  source: scan(later, moved, 2, options),
  reference: matrix(moved),
  start: matrix(start),
});

/** @type {Record<string, () => Omit<Scene, 'name'>>} */
const SCENES = {
  corridor: () => ({
    title: 'A bare corridor',
    question:
      'The source starts half a metre too far along the corridor. Why does ICP leave it there, and how would one notice?',
    answer:
      'The walls are the same everywhere along the corridor: a move along it changes no residual. The smallest eigenvalue of H is near ' +
      'zero, its eigenvector points along the walls, and the loop comes to rest at the wrong place with next to no cost.',
    ...pair(corridor(), [0.3, 0.05, 0.03], [0.8, 0, 0], { max_range: 8 }),
    methods: [{ metric: 'point_to_line' }],
    tab: 'degeneracy',
  }),
  circle: () => ({
    title: 'A round room',
    question: 'The room is a circle. Which motion can no scan of it tell?',
    answer:
      'A turn about its centre: every wall point slides along the wall. The turn at the start hardly changes until the end.',
    ...pair({ segments: [], circles: [[0, 0, 3]] }, [0.2, -0.1, 0.3], [0, 0, 0]),
    methods: [{ metric: 'point_to_line' }],
    tab: 'degeneracy',
  }),
  repeated_doors: () => ({
    title: 'Doors that repeat',
    question: 'The doors of this corridor stand two metres apart. From which starts does ICP end at the wrong door?',
    answer:
      'From those nearer to the wrong door than to the right one: every door has a basin of its own. The cost at the wrong door is far ' +
      'below that between the doors: whoever sees it alone is content.',
    ...pair(corridor(2), [0.2, 0, 0.02], [1.7, 0, 0], { max_range: 8 }),
    methods: [{ metric: 'point_to_line' }],
    tab: 'basin',
  }),
  large_motion: () => ({
    title: 'Too large a motion',
    question: 'The scanner has turned by 70°. ICP starts without a guess. What does it need?',
    answer:
      'A start within its basin. Pairs of the nearest points are wrong ones while the turn is so large; a correlative search over ' +
      'heading and position finds the basin, and ICP then only refines.',
    ...pair(room(), [0.6, 0.3, (70 * Math.PI) / 180], [0, 0, 0]),
    methods: [{ metric: 'point_to_line' }],
    tab: 'basin',
  }),
  partial_overlap: () => ({
    title: 'Partial overlap',
    question: 'Only a part of the room is in both scans. Which points pull the source away, and what helps?',
    answer:
      'Points of the part that the target has not seen have no true partner, and are paired with the edge of what it has. Trimming ' +
      'the worst half of the pairs, or a short reach, leaves them out.',
    target: scan(room(), [0, 0, 0], 1, { from: -1.9, to: 0.7 }),
    source: scan(room(), [0.2, 0.1, 0.1], 2, { from: -0.9, to: 1.7 }),
    reference: matrix([0.2, 0.1, 0.1]),
    start: matrix([0, 0, 0]),
    methods: [
      { ...TEXTBOOK, max_correspondence_distance: 3 },
      { ...TEXTBOOK, max_correspondence_distance: 3, trim_fraction: 0.5 },
    ],
    tab: 'method',
  }),
  outliers: () => ({
    title: 'People walk by',
    question:
      'Three people have moved between the scans. What do they do to least squares, and what does a robust kernel do?',
    answer:
      'Least squares weighs a pair by its squared residual: a few large ones pull the whole scan along. A kernel takes their weight ' +
      'away as the residual grows; colour the pairs by weight to see it.',
    ...pair(
      {
        ...room(),
        circles: [
          [1.2, 0.6, 0.35],
          [-1.4, 0.7, 0.35],
          [0.4, -1.3, 0.35],
        ],
      },
      [0.1, 0.05, 0.05],
      [0, 0, 0],
      {},
      {
        ...room(),
        circles: [
          [1.6, 0.9, 0.35],
          [-1, 1, 0.35],
          [0.8, -1, 0.35],
        ],
      },
    ),
    methods: [
      { metric: 'point_to_line', ...PLAIN, max_correspondence_distance: 1 },
      {
        metric: 'point_to_line',
        max_normal_angle: Math.PI,
        max_correspondence_distance: 1,
        robust_kernel: 'cauchy',
        robust_kernel_width: 0.05,
      },
    ],
    tab: 'method',
  }),
  trimming: () => ({
    title: 'Noise against trimming',
    question: 'There are no outliers here, only noise of 5 cm. Does trimming 70 % of the pairs help?',
    answer:
      'No: it throws away good measurements, and the estimate rests on fewer. Trimming pays for outliers; without them it costs accuracy.',
    ...pair(room(), [0.1, 0.05, 0.05], [0, 0, 0], { noise: 0.05 }),
    methods: [TEXTBOOK, { ...TEXTBOOK, trim_fraction: 0.7 }],
    tab: 'method',
  }),
  point_to_point_crawl: () => ({
    title: 'Point to point crawls along a wall',
    question: 'Why does one of the methods need so many more iterations, and stop short of the end nevertheless?',
    answer:
      'Along a wall every point finds a partner right beside it, which holds it back: point to point can slide only by a share of the ' +
      'spacing of the points, and at last its steps are so small that the loop takes them for convergence. Point to line lets it slide, since a move along the wall changes no distance to it.',
    ...pair(
      {
        segments: [
          [-12, -1.5, 12, -1.5],
          [12, -1.5, 12, 1.5],
          [12, 1.5, -12, 1.5],
          [-12, 1.5, -12, -1.5],
        ],
        circles: [[3, 0.9, 0.2]],
      },
      [0.4, 0, 0],
      [0, 0, 0],
      { max_range: 30 },
    ),
    methods: [
      { ...TEXTBOOK, max_iterations: 200, max_correspondence_distance: 1 },
      { metric: 'point_to_line', ...PLAIN, max_iterations: 200, max_correspondence_distance: 1 },
    ],
    tab: 'method',
  }),
  free_plane: () => ({
    title: 'A plane and its free directions',
    question: 'The cloud is a flat floor in space. How many of the six directions of motion does it determine?',
    answer:
      'Three: the height, and two tilts. The two moves in the floor and the turn about its normal are free: three eigenvalues of H are ' +
      'near zero.',
    target: floor(1),
    source: floor(2),
    reference: matrix([0, 0, 0]),
    start: lifted(0.15, 0.08),
    methods: [{ metric: 'point_to_plane' }],
    tab: 'degeneracy',
  }),
  sparse_rings: () => ({
    title: 'GICP on sparse rings',
    question:
      'A scanner with eight rings sees a room. Why does point to point pull the rings onto each other, and what does GICP see instead?',
    answer:
      'Between the rings there are no points: the nearest point is one of the same ring, wherever the wall is, so point to point makes ' +
      'the rings agree, and not the walls. GICP measures the distance between the planes that the points lie on.',
    ...rings(),
    methods: [
      { metric: 'point_to_point', robust_kernel: 'none', max_normal_angle: Math.PI, max_correspondence_distance: 1 },
      { metric: 'gicp', robust_kernel: 'none', max_normal_angle: Math.PI, max_correspondence_distance: 1 },
    ],
    tab: 'method',
  }),
};

/** A square floor of 6 m, with noise. @param {number} seed */
function floor(seed) {
  const uniform = generator(seed);
  const count = 2500;
  return Float32Array.from({ length: 3 * count }, (_, i) => (i % 3 < 2 ? 6 * uniform() - 3 : NOISE * normal(uniform)));
}

/** Lifted (m) and tilted about x (rad). @param {number} height @param {number} tilt */
function lifted(height, tilt) {
  const [c, s] = [Math.cos(tilt), Math.sin(tilt)];
  return [1, 0, 0, 0, 0, c, -s, 0, 0, s, c, height, 0, 0, 0, 1];
}

/** Eight rings of a scanner in a room of 10 m by 7 m by 3 m; the source stands higher and further on. */
function rings() {
  /** @param {[number, number, number]} at @param {number} seed */
  const see = ([x, y, z], seed) => {
    const uniform = generator(seed);
    const [low, high] = [
      [-5, -3, 0],
      [5, 4, 3],
    ];
    /** @type {number[]} */
    const xyz = [];
    for (let ring = 0; ring < 8; ring++) {
      const elevation = ((ring - 3.5) * 6 * Math.PI) / 180;
      for (let i = 0; i < 360; i++) {
        const angle = (i * Math.PI) / 180;
        const direction = [
          Math.cos(elevation) * Math.cos(angle),
          Math.cos(elevation) * Math.sin(angle),
          Math.sin(elevation),
        ];
        const toWall = direction.map((d, k) =>
          Math.abs(d) < 1e-9 ? Infinity : ((d > 0 ? (high[k] ?? 0) : (low[k] ?? 0)) - ([x, y, z][k] ?? 0)) / d,
        );
        const range = Math.min(...toWall);
        const noisy = range + NOISE * normal(uniform);
        xyz.push(...direction.map((d) => d * noisy));
      }
    }
    return Float32Array.from(xyz);
  };
  /** @type {[number, number, number]} */
  const moved = [0.4, 0.25, 0];
  return {
    target: see([0, 0, 1.2], 1),
    source: see([moved[0], moved[1], 1.2], 2),
    reference: matrix([moved[0], moved[1], 0]),
    start: matrix([0, 0, 0]),
  };
}

/** In the order in which a course would show them. */
export const LAB_SCENES = Object.keys(SCENES);

/**
 * The scene of a name; null where there is none.
 * @param {string} name
 * @returns {Scene | null}
 */
export function labScene(name) {
  const make = Object.hasOwn(SCENES, name) ? SCENES[name] : undefined;
  return make ? { name, ...make() } : null;
}
