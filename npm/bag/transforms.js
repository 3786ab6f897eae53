// @ts-check
/** Poses of ROS as a trajectory: chains of /tf and /tf_static, and poses of one frame told for another. */

/** @typedef {import('./messages.js').Transform} Transform */
/** @typedef {import('./messages.js').Stamp} Stamp */
/** @typedef {import('./messages.js').PoseMessage} PoseMessage */
/** @typedef {import('./messages.js').Vector} Vector */
/** @typedef {import('./messages.js').Quaternion} Quaternion */
/** @typedef {{ stamp: Stamp, pose: Transform }} Sample */
/** A frame within its parent: T_parent_child, constant or sample by sample. */
/** @typedef {{ child: string, parent: string, isStatic: boolean, samples: Sample[] }} Edge */

/** @type {Transform} */
export const IDENTITY = Object.freeze({ translation: [0, 0, 0], rotation: [0, 0, 0, 1] });
/** A transform is held for so long before its first and after its last sample (s). */
const HOLD = 0.2;

/** T_a_c of T_a_b and T_b_c. @param {Transform} a @param {Transform} b @returns {Transform} */
export function compose(a, b) {
  const [x, y, z] = rotate(a.rotation, b.translation);
  const [u, v, w] = a.translation;
  return { translation: [u + x, v + y, w + z], rotation: multiply(a.rotation, b.rotation) };
}

/** @param {Quaternion} a @param {Quaternion} b @returns {Quaternion} */
function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/** @param {Quaternion} q @param {Vector} v @returns {Vector} */
function rotate([x, y, z, w], v) {
  // v + 2 w (q x v) + 2 q x (q x v), for a unit quaternion.
  const cross = (/** @type {Vector} */ [a, b, c]) =>
    /** @type {Vector} */ ([y * c - z * b, z * a - x * c, x * b - y * a]);
  const once = cross(v);
  const twice = cross(once);
  return /** @type {Vector} */ (v.map((value, i) => value + 2 * (w * (once[i] ?? 0) + (twice[i] ?? 0))));
}

/** Between two poses: positions along a line, rotations along the shorter arc. @param {Transform} a @param {Transform} b @param {number} share @returns {Transform} */
function interpolate(a, b, share) {
  const mix = (
    /** @type {number[]} */ from,
    /** @type {number[]} */ to,
    /** @type {number} */ p,
    /** @type {number} */ q,
  ) => from.map((value, i) => p * value + q * (to[i] ?? 0));
  const dot = a.rotation.reduce((sum, value, i) => sum + value * (b.rotation[i] ?? 0), 0);
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  const [p, q] =
    angle < 1e-6
      ? [1 - share, share]
      : [Math.sin((1 - share) * angle), Math.sin(share * angle)].map((s) => s / Math.sin(angle));
  const rotation = mix(a.rotation, b.rotation, p ?? 1, dot < 0 ? -(q ?? 0) : (q ?? 0));
  return {
    translation: /** @type {Vector} */ (mix(a.translation, b.translation, 1 - share, share)),
    rotation: unit(/** @type {Quaternion} */ (rotation)),
  };
}

/** @param {Quaternion} q @returns {Quaternion} */
function unit(q) {
  const length = Math.hypot(...q);
  return /** @type {Quaternion} */ (q.map((value) => value / length));
}

/** The same pose with a rotation of length 1; null where it is none. @param {Transform} pose @returns {Transform | null} */
export function usable({ translation, rotation }) {
  const length = Math.hypot(...rotation);
  const isPose = [...translation, length].every(Number.isFinite) && length > 0.5 && length < 2;
  return isPose ? { translation, rotation: unit(rotation) } : null;
}

/** @param {Stamp} stamp */
function secondsOf({ sec, nsec }) {
  return sec + nsec * 1e-9;
}

/** Which frame is carried by which, as the messages told. */
export class TransformTree {
  /** @type {Map<string, Edge>} */
  #edges = new Map();

  /** @param {PoseMessage} message @param {boolean} isStatic */
  add({ stamp, frame, child, pose }, isStatic) {
    const good = usable(pose);
    const [parent, name] = [bare(frame), bare(child)];
    if (!good || name === parent) return;
    const edge = this.#edges.get(name);
    if (!edge) this.#edges.set(name, { child: name, parent, isStatic, samples: [{ stamp, pose: good }] });
    else if (edge.parent === parent && isStatic === edge.isStatic) {
      if (isStatic) edge.samples = [{ stamp, pose: good }];
      else edge.samples.push({ stamp, pose: good });
    }
  }

  /** To be called when all are added. */
  sort() {
    for (const { samples } of this.#edges.values()) samples.sort((a, b) => secondsOf(a.stamp) - secondsOf(b.stamp));
  }

  /**
   * T_ancestor_frame where nothing moves between the two; null otherwise.
   * @param {string} ancestor @param {string} frame
   * @returns {Transform | null}
   */
  fixed(ancestor, frame) {
    let pose = IDENTITY;
    const goal = bare(ancestor);
    for (const edge of this.#up(frame)) {
      if (edge.child === goal) return pose;
      if (!edge.isStatic && !isConstant(edge)) return null;
      pose = compose(/** @type {Sample} */ (edge.samples[0]).pose, pose);
      if (edge.parent === goal) return pose;
    }
    return bare(frame) === goal ? pose : null;
  }

  /**
   * The height of a frame's own z axis, from -1 to 1, in the outermost frame that it is fixed to: 1 where it is upright, -1 where it
   * hangs upside down; null where nothing is known of it.
   * @param {string} frame
   */
  uprightness(frame) {
    /** @type {Transform | null} */
    let pose = null;
    for (const edge of this.#up(frame)) {
      if (!edge.isStatic && !isConstant(edge)) break;
      pose = compose(/** @type {Sample} */ (edge.samples[0]).pose, pose ?? IDENTITY);
    }
    return pose && rotate(pose.rotation, [0, 0, 1])[2];
  }

  /**
   * The path of a frame in the world that carries it, at the times of the fastest moving part of the chain.
   * @param {string} frame
   * @returns {{ world: string, samples: Sample[] } | null} null: it does not move, or is unknown
   */
  path(frame) {
    const chain = this.#up(frame);
    const moving = chain.filter(({ isStatic }) => !isStatic).sort((a, b) => b.samples.length - a.samples.length);
    const [fastest] = moving;
    const top = chain.at(-1);
    if (!fastest || !top) return null;
    const samples = fastest.samples.flatMap(({ stamp }) => {
      /** @type {Transform | null} */
      let pose = IDENTITY;
      for (const edge of chain) {
        const step = at(edge, secondsOf(stamp));
        pose = pose && step && compose(step, pose);
      }
      return pose ? [{ stamp, pose }] : [];
    });
    return { world: top.parent, samples };
  }

  /** Edges from a frame to the top. @param {string} frame */
  #up(frame) {
    /** @type {Edge[]} */
    const chain = [];
    for (let edge = this.#edges.get(bare(frame)); edge && !chain.includes(edge); edge = this.#edges.get(edge.parent)) {
      chain.push(edge);
    }
    return chain;
  }
}

/** Whether all that was told of a frame is the same, to rounding. @param {Edge} edge */
function isConstant({ samples: [first, ...others] }) {
  const values = (/** @type {Sample | undefined} */ sample) => [
    ...(sample?.pose.translation ?? []),
    ...(sample?.pose.rotation ?? []),
  ];
  const expected = values(first);
  return others.every((sample) => values(sample).every((value, i) => Math.abs(value - (expected[i] ?? 0)) < 1e-6));
}

/** Frames were once written with a slash before them. @param {string} frame */
function bare(frame) {
  return frame.replace(/^\//, '');
}

/** @param {Edge} edge @param {number} time @returns {Transform | null} */
function at({ isStatic, samples }, time) {
  const [first] = samples;
  const last = samples.at(-1);
  if (!first || !last) return null;
  if (isStatic) return first.pose;
  if (time <= secondsOf(first.stamp)) return secondsOf(first.stamp) - time <= HOLD ? first.pose : null;
  if (time >= secondsOf(last.stamp)) return time - secondsOf(last.stamp) <= HOLD ? last.pose : null;
  let [low, high] = [0, samples.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (secondsOf(/** @type {Sample} */ (samples[middle]).stamp) <= time) low = middle;
    else high = middle;
  }
  const [a, b] = [/** @type {Sample} */ (samples[low]), /** @type {Sample} */ (samples[high])];
  const [start, end] = [secondsOf(a.stamp), secondsOf(b.stamp)];
  return end > start ? interpolate(a.pose, b.pose, (time - start) / (end - start)) : a.pose;
}

/**
 * Lines of `time x y z qx qy qz qw`, in order, each time once.
 * @param {Sample[]} samples
 */
export function tumText(samples) {
  const key = (/** @type {Sample} */ { stamp }) => `${stamp.sec}.${String(stamp.nsec).padStart(9, '0')}`;
  const ordered = samples.toSorted((a, b) => a.stamp.sec - b.stamp.sec || a.stamp.nsec - b.stamp.nsec);
  const lines = ordered
    .filter((sample, index) => index === 0 || key(sample) !== key(/** @type {Sample} */ (ordered[index - 1])))
    .map((sample) => [key(sample), ...sample.pose.translation, ...sample.pose.rotation].join(' '));
  return `${lines.join('\n')}\n`;
}
