// @ts-check
/** The path that a topic tells, as that of the sensor: as text, to compare with or to begin from. */
import { lost } from '../errors.js';
import { decodePoses } from './messages.js';
import { plural } from './stamps.js';
import { compose, IDENTITY, TransformTree, tumText, usable } from './transforms.js';

/** @typedef {import('./open.js').Bag} Bag */
/** @typedef {import('./open.js').Topic} Topic */
/** @typedef {import('./topics.js').TopicFacts} TopicFacts */
/** @typedef {import('./messages.js').PoseMessage} PoseMessage */
/** @typedef {import('./transforms.js').Sample} Sample */
/** @typedef {import('../recording.js').Note} Note */

const TF = 'tf2_msgs/msg/TFMessage';
/** Where nothing is called static, as in ROS 1, the first so many messages tell what does not move. */
const MAX_TF_MESSAGES = 200;

/**
 * @param {Bag} bag
 * @param {readonly TopicFacts[]} topics
 * @param {Topic} topic
 * @param {string} sensor the frame of the sensor
 * @returns {Promise<{ text: string | null, notes: Note[] }>} lines of `time x y z qx qy qz qw`; null where it has no path
 *    of this sensor
 */
export async function pathText(bag, topics, topic, sensor) {
  /** @type {Note[]} */
  const notes = [];
  const tree = new TransformTree();
  const transforms = topics.filter(({ topic: { type } }) => type === TF).map(({ topic }) => topic);
  for (const other of transforms.filter(({ name }) => /tf_static$/.test(name))) {
    for (const pose of await posesOf(bag, other, notes)) tree.add(pose, true);
  }
  if (topic.type !== TF) {
    for (const other of transforms.filter(({ name }) => !/tf_static$/.test(name))) {
      for (const pose of await posesOf(bag, other, [], MAX_TF_MESSAGES)) tree.add(pose, false);
    }
  }
  const poses = await posesOf(bag, topic, notes);
  const samples =
    topic.type === TF ? fromTree(tree, poses, topic, sensor, notes) : fromPoses(tree, poses, topic, sensor, notes);
  if (samples.length === 0) {
    if (notes.every(({ file }) => file !== topic.name))
      notes.push({ file: topic.name, reason: 'not used: it holds no pose' });
    return { text: null, notes };
  }
  return { text: tumText(samples), notes };
}

/** @param {Bag} bag @param {Topic} topic @param {Note[]} notes @param {number} [limit] messages that are read */
async function posesOf(bag, topic, notes, limit = Infinity) {
  /** @type {PoseMessage[]} */
  let poses = [];
  let faults = 0;
  let fault = '';
  // A path is sent again and again, each time longer: the last one is it.
  const first = topic.type === 'nav_msgs/msg/Path' ? topic.count - 1 : 0;
  for (let index = first; index < Math.min(topic.count, limit); index += 1) {
    try {
      for (const pose of decodePoses(topic.type, await bag.read(topic, index))) poses.push(pose);
    } catch (error) {
      const { problem, message } = /** @type {Error & { problem?: string }} */ (error);
      fault ||= problem ?? message;
      faults += 1;
    }
  }
  if (faults > 0) notes.push(lost(topic.name, `${plural(faults, 'message')} of ${topic.count} left out: ${fault}`));
  return poses;
}

/** @param {TransformTree} tree @param {PoseMessage[]} poses @param {Topic} topic @param {string} sensor @param {Note[]} notes @returns {Sample[]} */
function fromTree(tree, poses, topic, sensor, notes) {
  for (const pose of poses) tree.add(pose, false);
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

/** @param {TransformTree} tree @param {PoseMessage[]} poses @param {Topic} topic @param {string} sensor @param {Note[]} notes @returns {Sample[]} */
function fromPoses(tree, poses, topic, sensor, notes) {
  const child = poses[0]?.child ?? '';
  const mount = child === '' ? IDENTITY : tree.fixed(child, sensor);
  if (!mount && poses.length > 0) {
    const reason = `no fixed transform leads from ${child} to the sensor's frame, ${sensor}: the path of ${child} is compared with`;
    notes.push({ file: topic.name, reason });
  }
  const samples = poses.flatMap(({ stamp, pose }) => {
    const good = usable(pose);
    return good ? [{ stamp, pose: compose(good, mount ?? IDENTITY) }] : [];
  });
  if (samples.length < poses.length) {
    notes.push(lost(topic.name, `${plural(poses.length - samples.length, 'pose')} left out: no numbers of a pose`));
  }
  return samples;
}
