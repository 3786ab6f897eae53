/** Poses of ROS as a trajectory: chains of /tf and /tf_static, and poses of one frame told for another. */
import type { PoseMessage, Quaternion, Stamp, Transform, Vector } from './messages.js';

export type Sample = { stamp: Stamp; pose: Transform };
/** A frame within its parent: T_parent_child, constant or sample by sample. */
type Edge = { child: string; parent: string; isStatic: boolean; samples: Sample[] };

export const IDENTITY: Transform = Object.freeze({ translation: [0, 0, 0], rotation: [0, 0, 0, 1] });
/** A transform is held for so long before its first and after its last sample (s). */
const HOLD = 0.2;

/** T_a_c of T_a_b and T_b_c. */
export function compose(a: Transform, b: Transform): Transform {
  const [x, y, z] = rotate(a.rotation, b.translation);
  const [u, v, w] = a.translation;
  return { translation: [u + x, v + y, w + z], rotation: multiply(a.rotation, b.rotation) };
}

function inverse({ translation, rotation: [x, y, z, w] }: Transform): Transform {
  const rotation: Quaternion = [-x, -y, -z, w];
  return { translation: rotate(rotation, translation.map((value) => -value) as Vector), rotation };
}

function multiply([ax, ay, az, aw]: Quaternion, [bx, by, bz, bw]: Quaternion): Quaternion {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function rotate([x, y, z, w]: Quaternion, v: Vector): Vector {
  // v + 2 w (q x v) + 2 q x (q x v), for a unit quaternion.
  const cross = ([a, b, c]: Vector) => [y * c - z * b, z * a - x * c, x * b - y * a] as Vector;
  const once = cross(v);
  const twice = cross(once);
  return v.map((value, i) => value + 2 * (w * (once[i] ?? 0) + (twice[i] ?? 0))) as Vector;
}

/** Between two poses: positions along a line, rotations along the shorter arc. */
function interpolate(a: Transform, b: Transform, share: number): Transform {
  const mix = (from: number[], to: number[], p: number, q: number) =>
    from.map((value, i) => p * value + q * (to[i] ?? 0));
  const dot = a.rotation.reduce((sum, value, i) => sum + value * (b.rotation[i] ?? 0), 0);
  const angle = Math.acos(Math.min(1, Math.abs(dot)));
  const [p, q] =
    angle < 1e-6
      ? [1 - share, share]
      : [Math.sin((1 - share) * angle), Math.sin(share * angle)].map((s) => s / Math.sin(angle));
  const rotation = mix(a.rotation, b.rotation, p ?? 1, dot < 0 ? -(q ?? 0) : (q ?? 0));
  return {
    translation: mix(a.translation, b.translation, 1 - share, share) as Vector,
    rotation: unit(rotation as Quaternion),
  };
}

function unit(q: Quaternion): Quaternion {
  const length = Math.hypot(...q);
  return q.map((value) => value / length) as Quaternion;
}

/** The same pose with a rotation of length 1; null where it is none. */
export function usable({ translation, rotation }: Transform): Transform | null {
  const length = Math.hypot(...rotation);
  const isPose = [...translation, length].every(Number.isFinite) && length > 0.5 && length < 2;
  return isPose ? { translation, rotation: unit(rotation) } : null;
}

function secondsOf({ sec, nsec }: Stamp) {
  return sec + nsec * 1e-9;
}

/** Which frame is carried by which, as the messages told. */
export class TransformTree {
  /** What cannot be right, with how often it was told. */
  faults: Map<string, number> = new Map();
  #edges: Map<string, Edge> = new Map();

  add({ stamp, frame, child, pose }: PoseMessage, isStatic: boolean) {
    const good = usable(pose);
    const [parent, name] = [bare(frame), bare(child)];
    if (!good) this.#fault(`the transform from ${parent} to ${name} is not finite, or has no unit quaternion`);
    if (!good || name === parent) return;
    const edge = this.#edges.get(name);
    if (!edge) this.#edges.set(name, { child: name, parent, isStatic, samples: [{ stamp, pose: good }] });
    else if (edge.parent === parent && isStatic === edge.isStatic) {
      if (isStatic) edge.samples = [{ stamp, pose: good }];
      else edge.samples.push({ stamp, pose: good });
    } else if (edge.parent !== parent) {
      this.#fault(`${name} is said to lie in ${edge.parent} and in ${parent}: the first is used`);
    }
  }

  #fault(fault: string) {
    this.faults.set(fault, (this.faults.get(fault) ?? 0) + 1);
  }

  /** To be called when all are added. */
  sort() {
    for (const { samples } of this.#edges.values()) samples.sort((a, b) => secondsOf(a.stamp) - secondsOf(b.stamp));
  }

  /** T_ancestor_frame where nothing moves between the two; null otherwise. */
  fixed(ancestor: string, frame: string): Transform | null {
    let pose = IDENTITY;
    const goal = bare(ancestor);
    for (const edge of this.#up(frame)) {
      if (edge.child === goal) return pose;
      if (!edge.isStatic && !isConstant(edge)) return null;
      pose = compose((edge.samples[0] as Sample).pose, pose);
      if (edge.parent === goal) return pose;
    }
    return bare(frame) === goal ? pose : null;
  }

  /** T_a_b where nothing moves between two frames that hang on one; null otherwise. */
  between(a: string, b: string): Transform | null {
    const ancestors = [a, ...this.#up(a).map(({ parent }) => parent)];
    for (const ancestor of ancestors) {
      const [T_ancestor_a, T_ancestor_b] = [this.fixed(ancestor, a), this.fixed(ancestor, b)];
      if (!T_ancestor_a) return null;
      if (T_ancestor_b) return compose(inverse(T_ancestor_a), T_ancestor_b);
    }
    return null;
  }

  /**
   * The height of a frame's own z axis, from -1 to 1, in the outermost frame that it is fixed to: 1 where it is
   * upright, -1 where it
   * hangs upside down; null where nothing is known of it.
   */
  uprightness(frame: string) {
    let pose: Transform | null = null;
    for (const edge of this.#up(frame)) {
      if (!edge.isStatic && !isConstant(edge)) break;
      pose = compose((edge.samples[0] as Sample).pose, pose ?? IDENTITY);
    }
    return pose && rotate(pose.rotation, [0, 0, 1])[2];
  }

  /**
   * The path of a frame in the world that carries it, at the times of the fastest moving part of the chain.
   * @returns null: it does not move, or is unknown
   */
  path(frame: string): { world: string; samples: Sample[] } | null {
    const chain = this.#up(frame);
    const moving = chain.filter(({ isStatic }) => !isStatic).sort((a, b) => b.samples.length - a.samples.length);
    const [fastest] = moving;
    const top = chain.at(-1);
    if (!fastest || !top) return null;
    const samples = fastest.samples.flatMap(({ stamp }) => {
      let pose: Transform | null = IDENTITY;
      for (const edge of chain) {
        const step = at(edge, secondsOf(stamp));
        pose = pose && step && compose(step, pose);
      }
      return pose ? [{ stamp, pose }] : [];
    });
    return { world: top.parent, samples };
  }

  /** Edges from a frame to the top. */
  #up(frame: string) {
    const chain: Edge[] = [];
    for (let edge = this.#edges.get(bare(frame)); edge && !chain.includes(edge); edge = this.#edges.get(edge.parent)) {
      chain.push(edge);
    }
    return chain;
  }
}

/** Whether all that was told of a frame is the same, to rounding. */
function isConstant({ samples: [first, ...others] }: Edge) {
  const values = (sample: Sample | undefined) => [
    ...(sample?.pose.translation ?? []),
    ...(sample?.pose.rotation ?? []),
  ];
  const expected = values(first);
  return others.every((sample) => values(sample).every((value, i) => Math.abs(value - (expected[i] ?? 0)) < 1e-6));
}

/** Frames were once written with a slash before them. */
function bare(frame: string) {
  return frame.replace(/^\//, '');
}

function at({ isStatic, samples }: Edge, time: number): Transform | null {
  const [first] = samples;
  const last = samples.at(-1);
  if (!first || !last) return null;
  if (isStatic) return first.pose;
  if (time <= secondsOf(first.stamp)) return secondsOf(first.stamp) - time <= HOLD ? first.pose : null;
  if (time >= secondsOf(last.stamp)) return time - secondsOf(last.stamp) <= HOLD ? last.pose : null;
  let [low, high] = [0, samples.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (secondsOf((samples[middle] as Sample).stamp) <= time) low = middle;
    else high = middle;
  }
  const [a, b] = [samples[low] as Sample, samples[high] as Sample];
  const [start, end] = [secondsOf(a.stamp), secondsOf(b.stamp)];
  return end > start ? interpolate(a.pose, b.pose, (time - start) / (end - start)) : a.pose;
}

/** Lines of `time x y z qx qy qz qw`, in order, each time once. */
export function tumText(samples: Sample[]) {
  const key = ({ stamp }: Sample) => `${stamp.sec}.${String(stamp.nsec).padStart(9, '0')}`;
  const ordered = samples.toSorted((a, b) => a.stamp.sec - b.stamp.sec || a.stamp.nsec - b.stamp.nsec);
  const lines = ordered
    .filter((sample, index) => index === 0 || key(sample) !== key(ordered[index - 1] as Sample))
    .map((sample) => [key(sample), ...sample.pose.translation, ...sample.pose.rotation].join(' '));
  return `${lines.join('\n')}\n`;
}
