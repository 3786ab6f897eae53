/** The path that a topic tells, as that of the sensor: as text, to compare with or to begin from. */
import { append } from '../base/append.js';
import { lost, type Note } from '../base/errors.js';
import { decodePoses, type PoseMessage } from './messages.js';
import type { Bag, Topic } from './open.js';
import { nanoseconds, plural, stampOf, withoutJumps } from './stamps.js';
import type { TopicFacts } from './topics.js';
import { compose, IDENTITY, type Sample, TransformTree, tumText, usable } from './transforms.js';

const TF = 'tf2_msgs/msg/TFMessage';
const PATH = 'nav_msgs/msg/Path';
/** Where nothing is called static, as in ROS 1, the first so many messages tell what does not move. */
const MAX_TF_MESSAGES = 200;
/** A pose with its velocity and covariances takes less; a path and the transforms of a robot may take more (bytes). */
const POSE_BYTES = 2048;
/** So many messages are read at a time: those of a packed bag bring a chunk into memory each. */
const READ_AT_ONCE = 8;

/**
 * @param sensor the frame of the sensor
 * @param options isCompared: nothing is computed from it. Then its messages are read without the chunks around them,
 *   where that is possible; these are checked with the frames. onProgress: messages read
 * @returns lines of `time x y z qx qy qz qw`; null where it has no path of this sensor
 */
export async function pathText(
  bag: Bag,
  topics: readonly TopicFacts[],
  topic: Topic,
  sensor: string,
  options: { isCompared?: boolean; onProgress?: (done: number) => void } = {},
): Promise<{ text: string | null; notes: Note[] }> {
  const notes: Note[] = [];
  const tree = await treeOf(bag, topics, topic.type !== TF, notes);
  const poses = await posesOf(bag, topic, notes, Infinity, options);
  const samples =
    topic.type === TF ? fromTree(tree, poses, topic, sensor, notes) : fromPoses(tree, poses, topic, sensor, notes);
  if (samples.length === 0) {
    if (notes.every(({ file }) => file !== topic.name))
      notes.push({ file: topic.name, reason: 'not used: it holds no pose' });
    return { text: null, notes };
  }
  return { text: tumText(samples), notes };
}

/**
 * How frames are fixed to one another; `withFirst`: with the first messages of the transforms that are not called static.
 */
export async function treeOf(bag: Bag, topics: readonly TopicFacts[], withFirst: boolean, notes: Note[]) {
  const tree = new TransformTree();
  const transforms = topics.filter(({ topic: { type } }) => type === TF).map(({ topic }) => topic);
  for (const other of transforms) {
    const isStatic = /tf_static$/.test(other.name);
    if (!isStatic && !withFirst) continue;
    const poses = await (isStatic ? posesOf(bag, other, notes) : posesOf(bag, other, [], MAX_TF_MESSAGES));
    for (const pose of poses) tree.add(pose, isStatic);
    tellFaults(tree, other, notes);
  }
  return tree;
}

/** What is wrong with the transforms of a topic. */
function tellFaults(tree: TransformTree, { name }: Topic, notes: Note[]) {
  for (const [fault, count] of tree.faults) notes.push({ file: name, reason: `${fault} (${plural(count, 'time')})` });
  tree.faults.clear();
}

function readWithChunk(bag: Bag, topic: Topic, index: number) {
  return bag.read(topic, index);
}

/** Without the chunk around it, where the bag is not packed. */
export async function readAlone(bag: Bag, topic: Topic, index: number) {
  const head = await bag.readHead(topic, index, POSE_BYTES);
  return head.length < POSE_BYTES ? head : bag.read(topic, index);
}

/** @param limit messages that are read */
async function posesOf(
  bag: Bag,
  topic: Topic,
  notes: Note[],
  limit: number = Infinity,
  { isCompared = false, onProgress = () => {} }: { isCompared?: boolean; onProgress?: (done: number) => void } = {},
) {
  const poses: PoseMessage[] = [];
  const recorded: bigint[] = [];
  let faults = 0;
  let fault = '';
  const read = isCompared ? readAlone : readWithChunk;
  // A path is sent again and again, each time longer: the last one is it.
  const end = Math.min(topic.count, limit);
  for (let first = topic.type === PATH ? topic.count - 1 : 0; first < end; first += READ_AT_ONCE) {
    const indexes = Array.from({ length: Math.min(READ_AT_ONCE, end - first) }, (_, i) => first + i);
    const decoded = await Promise.allSettled(
      indexes.map(async (index) => decodePoses(topic.type, await read(bag, topic, index))),
    );
    for (const [at, one] of decoded.entries()) {
      if (one.status === 'fulfilled') {
        append(poses, one.value);
        recorded.push(bag.time(topic, first + at));
      } else {
        fault ||= one.reason.problem ?? one.reason.message;
        faults += 1;
      }
    }
    onProgress(first + indexes.length);
  }
  if (faults > 0) notes.push(lost(topic.name, `${plural(faults, 'message')} of ${topic.count} left out: ${fault}`));
  return topic.type === TF || topic.type === PATH ? poses : continuous(topic, poses, recorded, notes);
}

/** Poses whose times do not begin anew, a message each. */
function continuous({ name }: Topic, poses: PoseMessage[], recorded: bigint[], notes: Note[]): PoseMessage[] {
  const timed = poses.map(({ stamp }, index) => ({ index, time: nanoseconds(stamp), recorded: recorded[index] ?? 0n }));
  const found = withoutJumps(name, timed);
  append(notes, found.notes);
  return found.messages.map(({ index, time }) => ({ ...(poses[index] as PoseMessage), stamp: stampOf(time) }));
}

function fromTree(tree: TransformTree, poses: PoseMessage[], topic: Topic, sensor: string, notes: Note[]): Sample[] {
  for (const pose of poses) tree.add(pose, false);
  tellFaults(tree, topic, notes);
  tree.sort();
  const path = tree.path(sensor);
  if (path) {
    notes.push({ file: topic.name, reason: `the reference is the path of ${sensor} in ${path.world}` });
    return path.samples;
  }
  notes.push({
    file: topic.name,
    reason: `not used: it gives no trajectory of the sensor's frame, ${sensor || 'which has no name'}`,
  });
  return [];
}

function fromPoses(tree: TransformTree, poses: PoseMessage[], topic: Topic, sensor: string, notes: Note[]): Sample[] {
  const child = poses[0]?.child ?? '';
  const mount = child === '' ? IDENTITY : tree.fixed(child, sensor);
  if (!mount && poses.length > 0) {
    const reason = `there is no static transform from ${child} to the sensor's frame, ${sensor}: the trajectory of ${child} is used instead`;
    notes.push({ file: topic.name, reason });
  }
  const samples = poses.flatMap(({ stamp, pose }) => {
    const good = usable(pose);
    return good ? [{ stamp, pose: compose(good, mount ?? IDENTITY) }] : [];
  });
  if (samples.length < poses.length) {
    notes.push(
      lost(
        topic.name,
        `${plural(poses.length - samples.length, 'pose')} left out: not finite, or without a unit quaternion`,
      ),
    );
  }
  return samples;
}
